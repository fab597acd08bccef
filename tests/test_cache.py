"""Cached files that are damaged are named, passed over and made again, whenever that is seen."""

import logging
import os
import shutil
import time
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import shapes
from depthwalk.array_file import read_arrays, write_arrays
from depthwalk.assets.bake_job import Baked, Job, Kept
from depthwalk.assets.batch_bake import Outcome, bake_all
from depthwalk.assets.library import SceneLibrary
from depthwalk.bake.cache import BAKED
from depthwalk.bake.images import BakedObject
from depthwalk.bake.level_file import LEVELS
from depthwalk.bake.params import ModelParams
from depthwalk.cache import DamagedFileError
from depthwalk.cook.cook import CookedObject, CookOptions, cook_object
from depthwalk.cook.cooked_file import COOKED, find_cooked, keep_cooked, read_cooked
from depthwalk.errors import InputError
from depthwalk.gpu.device import Device
from depthwalk.ingest.mesh import Mesh, MeshLevel
from depthwalk.render.resources.asset_store import AssetStore
from depthwalk.scene.loader import load_scene
from depthwalk.scene.scene import MeshAsset
from shapes import bake, sphere


@pytest.fixture(autouse=True)
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return tmp_path / "cache"


def flip(path: Path, at: int) -> None:
    data = bytearray(path.read_bytes())
    data[at] ^= 1
    path.write_bytes(data)


def flip_within(path: Path, needle: bytes) -> None:
    """Damages the file in the middle of these bytes, which it holds once."""
    data = path.read_bytes()
    assert data.count(needle) == 1
    flip(path, data.index(needle) + len(needle) // 2)


@pytest.fixture(scope="module")
def baked() -> BakedObject:
    return bake(sphere(columns=32, rows=16), resolution=16, layers=1)


def found_cooked(key: str, options: CookOptions) -> tuple[CookedObject, ...]:
    """What the cache keeps under `key`, where a test knows that it does."""
    found = find_cooked(key, options)
    assert found is not None
    return found


def test_damage_that_is_seen_late_is_named_and_removed(baked: BakedObject, caplog: pytest.LogCaptureFixture) -> None:
    form = CookOptions()
    keep_cooked("ab", form, (cook_object(baked, form),))
    (path,) = COOKED.file("").parent.glob("ab*")
    (found,) = found_cooked("ab", form)
    flip_within(path, found.load()[1].normals.tobytes())
    (found,) = found_cooked("ab", form)  # outlines are whole
    with caplog.at_level(logging.WARNING), pytest.raises(DamagedFileError):
        found.load()
    assert f"{path}: damaged cooked depth images" in caplog.text and not path.exists()
    assert find_cooked("ab", form) is None


@pytest.mark.parametrize("again", [False, True])
def test_a_walk_goes_on_over_damaged_files(
    gl_device: Device, tiny_scene: Path, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch, again: bool
) -> None:
    """Damaged between outline and pixels; or with each file that takes its place, too."""
    library = SceneLibrary(load_scene(tiny_scene).assets)
    store = AssetStore(gl_device, library)
    (number,) = store.parts.numbers(0)
    assert library.baked(0) is not None  # into the cache
    before = store.parts.cooked(number).load()
    (cooked,) = COOKED.file("").parent.glob(f"{library.key(0)}*.npz")
    flip_within(cooked, before[1].normals.tobytes())
    flip(BAKED.file(library.key(0)), -1000)
    if again:
        keep = write_arrays

        def keep_damaged(path: Path, arrays: Arrays) -> None:
            keep(path, arrays)
            flip_within(path, before[1].normals.tobytes())

        monkeypatch.setattr("depthwalk.cook.cooked_file.write_arrays", keep_damaged)
    try:
        with caplog.at_level(logging.WARNING):
            store.depth_object(number)
        assert store.depth_count == 1
        assert [str(cooked) in caplog.text, str(BAKED.file(library.key(0))) in caplog.text] == [True, True]
    finally:
        store.release()
    if not again:
        after = found_cooked(library.key(0), CookOptions())[0].load()
        np.testing.assert_array_equal(before[1].normals, after[1].normals)


@pytest.fixture(scope="module")
def simplified() -> tuple[Mesh, tuple[MeshLevel, ...]]:
    mesh = sphere(columns=24, rows=12)
    return mesh, shapes.simplified(mesh)


Arrays = dict[str, NDArray[Any]]


def crafted(number: int, name: str, change: Callable[[NDArray[Any]], object]) -> Callable[[Arrays], None]:
    def craft(arrays: Arrays) -> None:
        values = arrays[f"{name}.{number}"] if name != "error" else arrays[name]
        change(values)

    return craft


@pytest.mark.parametrize(
    "craft",
    [
        crafted(0, "positions", lambda p: p.__setitem__((0, 0), np.nan)),
        crafted(0, "normals", lambda n: n.__setitem__((0, 0), np.inf)),
        crafted(0, "faces", lambda f: f.__setitem__((0, 0), 1 << 20)),
        crafted(0, "faces", lambda f: f.__setitem__((0, 0), -1)),
        crafted(0, "parts", lambda p: p.__setitem__((0, 2), 7)),
        crafted(0, "parts", lambda p: p.__setitem__((0, 1), 1)),
        crafted(0, "error", lambda e: e.__setitem__(0, -1)),
        crafted(0, "error", lambda e: e.__setitem__(0, np.nan)),
        lambda arrays: arrays.pop("uv.0"),
        lambda arrays: arrays.update({"faces.0": arrays["faces.0"][:, :2]}),
        lambda arrays: arrays.update({"parts.0": arrays["parts.0"][:0]}),
    ],
)
def test_levels_that_cannot_be_drawn_are_passed_over(
    simplified: tuple[Mesh, tuple[MeshLevel, ...]],
    craft: Callable[[Arrays], object],
    caplog: pytest.LogCaptureFixture,
) -> None:
    mesh, levels = simplified
    path = LEVELS.keep_value(levels, "ab")
    assert LEVELS.find_value(mesh, "ab") is not None
    arrays = read_arrays(path)
    craft(arrays)
    write_arrays(path, arrays)
    with caplog.at_level(logging.WARNING):
        assert LEVELS.find_value(mesh, "ab") is None
    assert f"{path}: damaged simplified meshes" in caplog.text and not path.exists()


@pytest.mark.slow
def test_a_bake_takes_no_damaged_file(tiny_scene: Path, tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    (spec,) = load_scene(tiny_scene, overrides={"assets.ball.dpci.resolution": "16"}).assets
    library = SceneLibrary((spec,))
    baked = library.baked(0)
    assert isinstance(spec, MeshAsset) and baked is not None
    key, out, params = baked.parts[0].key, tmp_path / "a.dpci.exr", ModelParams(resolution=16, layers=1)

    def bake_once(force: bool = False) -> Outcome:
        return dict(bake_all([Job(spec=spec, params=params, out=out, force=force)], 1, lambda *_: None))[0]

    flip(BAKED.file(key), -1000)
    assert isinstance(bake_once(), Baked)  # not copied
    flip(out, -1000)
    assert isinstance(bake_once(), Baked) and str(out) in caplog.text
    assert isinstance(bake_once(), Kept)


@pytest.mark.slow
def test_force_heals_all_of_the_asset(tiny_scene: Path, tmp_path: Path) -> None:
    (spec,) = load_scene(tiny_scene).assets
    library = SceneLibrary((spec,))
    baked = library.baked(0)
    library.mesh_levels(0)
    assert baked is not None
    keep_cooked(baked.key, CookOptions(), tuple(cook_object(part, CookOptions()) for part in baked.parts))
    other = BAKED.file("0" * 64)
    shutil.copyfile(BAKED.file(baked.key), other)
    assert len(list(other.parent.iterdir())) == 4
    assert isinstance(spec, MeshAsset)
    job = Job(spec=spec, params=ModelParams(resolution=64, layers=1), out=tmp_path / "a.dpci.exr", force=True)
    assert isinstance(dict(bake_all([job], 1, lambda *_: None))[0], Baked)
    assert list(other.parent.iterdir()) == [other]


def test_what_killed_writers_left_is_swept(home: Path) -> None:
    old = time.time() - 2 * 86_400
    folder = LEVELS.file("").parent
    folder.mkdir(parents=True)
    dead, alive = 999_999_999 % (1 << 22) + (1 << 22), os.getpid()  # above what Linux numbers processes to
    names = {f".{dead}-a.npz": old, f".{alive}-b.npz": old, f".{dead}-c.npz": time.time(), ".other": old}
    for name, when in names.items():
        (folder / name).write_bytes(b"half")
        os.utime(folder / name, (when, when))
    LEVELS.keep("ab", lambda path: path.write_bytes(b"whole"))
    assert {path.name for path in folder.iterdir()} == {*names, "ab.levels.npz"} - {f".{dead}-a.npz"}


def test_arrays_that_memory_does_not_hold_are_not_unpacked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("depthwalk.budget.machine_memory", lambda: 40_000_000)
    monkeypatch.setattr("depthwalk.budget._SMALL", 1 << 20)
    packed = zipfile.ZipFile(tmp_path / "a.dpci.npz", "w", zipfile.ZIP_DEFLATED)
    with packed as archive, archive.open("made_of.npy", "w") as member:
        for _ in range(20):
            member.write(bytes(1 << 20))
    assert (tmp_path / "a.dpci.npz").stat().st_size < 30_000
    told = r"a\.dpci\.npz: its arrays would take 42 MB of memory; 30 MB are allowed here$"
    with pytest.raises(InputError, match=told):
        read_cooked(tmp_path / "a.dpci.npz")
