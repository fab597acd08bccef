"""What is told where the extra `gltf` is not installed."""

from pathlib import Path

import pytest

from depthwalk.errors import InputError
from depthwalk.ingest import gltf_meshopt
from depthwalk.ingest.draco import decoder
from depthwalk.ingest.reader import read_soup
from draco_files import compressed
from glb_files import Glb


def test_what_reads_draco_is_named_where_it_is_missing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(decoder, "find_spec", lambda name: None)
    glb = Glb()
    compressed(glb, {}, data=b"DRACO")
    wanted = r'^\S+a\.glb: is compressed by Draco; `pip install -e "\S+\[gltf\]"` installs what reads it, and `gltf-tr'
    with pytest.raises(InputError, match=wanted):
        read_soup(glb.write(tmp_path / "a.glb"))


def test_what_reads_meshopt_is_named_where_it_is_missing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(gltf_meshopt, "find_spec", lambda name: None)
    glb = Glb()
    glb.mesh({})
    glb.header["bufferViews"][0]["extensions"] = {"EXT_meshopt_compression": {"count": 4, "byteStride": 12}}
    glb.header["extensionsRequired"] = ["EXT_meshopt_compression"]
    wanted = r'^\S+a\.glb: is compressed by meshopt; `pip install -e "\S+\[gltf\]"` installs what reads it, and `gl'
    with pytest.raises(InputError, match=wanted):
        read_soup(glb.write(tmp_path / "a.glb"))
