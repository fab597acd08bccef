"""Changes of files keep what they promise: readers get past checksums and lengths to what was changed."""

import io
import json
import random
import tempfile
import zipfile
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from fuzz import gltf_seeds, seeds
from fuzz.bytes_changes import bounded, change_bytes, change_text
from fuzz.container_changes import change_exr, change_glb, change_npy, change_npz, change_png
from fuzz.tree_changes import change_json, change_yaml

TIMES = range(40)


def test_bytes_and_lines_change() -> None:
    data = seeds.OBJ.encode()
    for change in (change_bytes, change_text):
        results = {change(data, random.Random(seed), (b"usemtl ",)) for seed in TIMES}
        assert len(results) > 30
        assert results == {change(data, random.Random(seed), (b"usemtl ",)) for seed in TIMES}
    assert len(bounded(bytes(1 << 20))) == 1 << 16
    assert [change_bytes(b"", random.Random(seed)) is not None for seed in TIMES]


def test_documents_stay_documents() -> None:
    for seed in TIMES:
        json.loads(change_json(b'{"a": [1, {"b": "x"}], "c": 2.5}', random.Random(seed), ("d",)))
        json.loads(change_yaml(seeds.PATH.encode(), random.Random(seed)))


def test_documents_that_aliases_make_large_are_not_written_out() -> None:
    layers = [f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 9) if i else 'x'}]" for i in range(9)]
    with pytest.raises(ValueError, match="aliases"):
        change_yaml("\n".join(layers).encode(), random.Random(0))


def test_pictures_keep_right_checksums() -> None:
    data, opened = seeds.picture("PNG"), 0
    for seed in TIMES:
        changed = change_png(data, random.Random(seed))
        try:
            Image.open(io.BytesIO(changed)).load()
            opened += changed != data
        except Exception as error:  # whatever it says of the change
            assert "checksum" not in str(error).lower()
    assert opened > 3


def test_archives_keep_right_checksums() -> None:
    file = io.BytesIO()
    np.savez(file, a=np.arange(6.0), b=np.arange(4))
    for seed in TIMES:
        with zipfile.ZipFile(io.BytesIO(change_npz(file.getvalue(), random.Random(seed)))) as archive:
            assert archive.testzip() is None


def test_arrays_have_headers() -> None:
    data = seeds.npy(np.arange(6.0).reshape(2, 3))
    assert all(change_npy(data, random.Random(seed)).startswith(b"\x93NUMPY") for seed in TIMES)


def test_lengths_in_glb_files_fit() -> None:
    data = gltf_seeds.gltfs()[1]["mesh.glb"]
    for seed in TIMES:
        changed = change_glb(data, random.Random(seed))
        length = int.from_bytes(changed[12:16], "little")
        json.loads(changed[20 : 20 + length])
        assert int.from_bytes(changed[8:12], "little") == len(changed)


@pytest.mark.slow
def test_depth_images_keep_right_checksums() -> None:
    from depthwalk.bake.file import read_baked
    from depthwalk.errors import InputError

    (data,) = seeds.baked()[0].values()
    told = set()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "x.dpci.exr"
        for seed in range(20):
            try:
                path.write_bytes(change_exr(data, random.Random(seed)))
            except RuntimeError:  # OpenEXR does not write two parts of one name
                continue
            try:
                read_baked(path)
                told.add("")
            except InputError as error:
                told.add(str(error).rpartition(": ")[2])
    assert "" in told and len(told) > 4
    assert sum("checksum" in line for line in told) <= 1  # some keep the old one on purpose
