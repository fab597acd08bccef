"""What is told where the extra `draco` is not installed, and of compression that is not read."""

from pathlib import Path

import pytest

from depthwalk.errors import InputError
from depthwalk.ingest.draco import decoder
from depthwalk.ingest.reader import read_soup
from draco_files import compressed
from glb_files import Glb


def test_what_reads_draco_is_named_where_it_is_missing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(decoder, "find_spec", lambda name: None)
    glb = Glb()
    compressed(glb, {}, data=b"DRACO")
    wanted = r'^\S+a\.glb: is compressed by Draco; `pip install -e "\S+\[draco\]"` installs what reads it, and `gltf-tr'
    with pytest.raises(InputError, match=wanted):
        read_soup(glb.write(tmp_path / "a.glb"))


@pytest.mark.parametrize(
    ("extension", "remedy"),
    [("EXT_meshopt_compression", ", or use `gltf-transform copy`"), ("KHR_meshopt_compression", "")],
)
def test_meshopt_is_not_read(tmp_path: Path, extension: str, remedy: str) -> None:
    glb = Glb()
    glb.mesh({})
    glb.header["extensionsRequired"] = [extension]
    wanted = f"extension {extension} is not supported; export it without compression{remedy}$"
    with pytest.raises(InputError, match=wanted):
        read_soup(glb.write(tmp_path / "a.glb"))
