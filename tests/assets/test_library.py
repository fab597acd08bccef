"""Assets of a scene: what is read, and what is kept."""

import gc
import weakref
from collections.abc import Iterator
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import depthwalk.assets.asset_files
import depthwalk.assets.batch_bake
import shapes
from depthwalk.assets.asset_files import mesh_key
from depthwalk.assets.bake_job import Job
from depthwalk.assets.batch_bake import bake_all
from depthwalk.assets.library import SceneLibrary
from depthwalk.bake.cache import find_cached
from depthwalk.bake.file import read_baked
from depthwalk.bake.params import ModelParams
from depthwalk.cook.cook import CookOptions
from depthwalk.cook.cooked_file import find_cooked
from depthwalk.errors import InputError
from depthwalk.ingest.loader import load_mesh
from depthwalk.ingest.mesh import Mesh
from depthwalk.ingest.range_image import RangeImage
from depthwalk.scene.loader import load_scene
from depthwalk.scene.scene import DepthImageAsset, MeshAsset
from files import write_ply

COARSE = {"assets.ball.dpci.resolution": "16"}  # where what the depth images show does not matter


def test_a_mesh_read_to_be_baked_is_not_kept(tiny_scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "empty"))
    read: list[Any] = []

    def watched(*arguments: Path, **options: Any) -> Mesh:
        mesh = load_mesh(*arguments, **options)
        read.append(weakref.ref(mesh))
        return mesh

    monkeypatch.setattr(depthwalk.assets.asset_files, "load_mesh", watched)
    library = SceneLibrary(load_scene(tiny_scene, overrides=COARSE).assets)
    assert library.baked(0) is not None
    gc.collect()
    assert [mesh() for mesh in read] == [None]
    drawn = library.mesh(0)
    assert library.mesh(0) is drawn and len(read) == 2


def test_a_mesh_that_is_there_already_is_baked(
    tiny_scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "empty"))
    library = SceneLibrary(load_scene(tiny_scene, overrides=COARSE).assets)
    assert library.mesh(0) is not None
    monkeypatch.setattr(depthwalk.assets.asset_files, "load_mesh", None)  # reading once more would fail
    assert library.baked(0) is not None


def test_depth_images_that_are_there_are_told_of_too(
    tiny_scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    for kept in (False, True):
        told: list[Any] = []
        assets = load_scene(tiny_scene, overrides=COARSE).assets
        SceneLibrary(assets, lambda *what, told=told: told.append(what)).baked(0)
        assert told[0] == ("ball", "depth images") and (len(told) == 1) == kept


def replace_ball(scene: Path, radius: float) -> Path:
    """Puts another ball in the place of the scene's."""
    return write_ply(scene.with_name("ball.ply"), shapes.sphere(radius, columns=32, rows=16))


def size_of(library: SceneLibrary) -> float:
    """Half the height of the ball as its depth images show it, metres."""
    baked = library.baked(0)
    assert baked is not None
    cylinder = baked.parts[0].cylinder
    return (cylinder.top - cylinder.bottom) / 2


@pytest.mark.slow
def test_a_mesh_replaced_before_it_is_baked_is_kept_under_its_own_key(
    tiny_scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    assets = load_scene(tiny_scene).assets
    replace_ball(tiny_scene, 1.0)
    library = SceneLibrary(assets)
    before = library.key(0)
    replace_ball(tiny_scene, 2.0)
    assert size_of(library) == pytest.approx(2, abs=0.1)
    after = library.key(0)
    baked = library.baked(0)
    assert baked is not None and baked.key == after != before
    assert SceneLibrary(assets).key(0) == after
    replace_ball(tiny_scene, 1.0)
    again = SceneLibrary(assets)
    assert size_of(again) == pytest.approx(1, abs=0.1) and again.key(0) == before


@pytest.mark.slow
def test_a_mesh_replaced_after_it_was_read_poisons_no_key(
    tiny_scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    assets = load_scene(tiny_scene).assets
    replace_ball(tiny_scene, 1.0)
    library = SceneLibrary(assets)
    assert library.mesh(0) is not None
    replace_ball(tiny_scene, 2.0)
    assert size_of(library) == pytest.approx(1, abs=0.1)
    levels = library.mesh_levels(0)
    fresh = SceneLibrary(assets)
    assert size_of(fresh) == pytest.approx(2, abs=0.1)
    assert fresh.mesh_levels(0)[-1].mesh.bounds[1][1] > 1.5 * levels[-1].mesh.bounds[1][1]


def test_a_mesh_replaced_while_it_is_baked_to_a_file(
    tiny_scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (spec,) = load_scene(tiny_scene).assets
    assert isinstance(spec, MeshAsset)
    replace_ball(tiny_scene, 1.0)
    key = mesh_key(spec, ModelParams(resolution=32, layers=1))

    def replaced(*arguments: Path, **options: Any) -> Mesh:
        replace_ball(tiny_scene, 2.0)
        return load_mesh(*arguments, **options)

    monkeypatch.setattr(depthwalk.assets.asset_files, "load_mesh", replaced)
    job = Job(spec=spec, params=ModelParams(resolution=32, layers=1), out=tmp_path / "ball.dpci.exr")
    list(bake_all([job], 1, lambda *_: None))
    baked = read_baked(job.out)
    assert baked.key == key
    assert baked.parts[0].cylinder.top == pytest.approx(2, abs=0.1)  # of the ball of radius 1


@pytest.mark.parametrize("times", [1, 100])
def test_a_range_image_that_changes_while_it_is_read(
    tiny_scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, times: int
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    file, left = tiny_scene.with_name("d.npy"), times
    np.save(file, np.linspace(1, 1.2, 20 * 20, dtype=np.float32).reshape(20, 20))
    lens = "intrinsics: {fx: 50, fy: 50, cx: 10, cy: 10}"
    tiny_scene.write_text(f"version: 1\nassets: {{seen: {{depth_image: {{depth: d.npy, {lens}}}}}}}\n")
    (spec,) = load_scene(tiny_scene).assets
    read = depthwalk.assets.asset_files.read_range_image

    def changing(spec: DepthImageAsset) -> RangeImage:
        nonlocal left
        image = read(spec)
        if left > 0:
            left -= 1
            np.save(file, np.load(file) + np.float32(0.5))
        return image

    monkeypatch.setattr(depthwalk.assets.asset_files, "read_range_image", changing)
    library = SceneLibrary((spec,))
    first = library.key(0)
    if times > 1:
        with pytest.raises(InputError, match=r"d\.npy: .*keeps changing while it is read"):
            library.baked(0)
        return
    baked = library.baked(0)
    assert baked is not None and baked.key == library.key(0) == SceneLibrary((spec,)).key(0) != first


def test_a_panorama_is_baked_once(tiny_scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """And stands with its lowest point on the ground, its pinhole above its position."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    np.save(tiny_scene.with_name("d.npy"), np.full((16, 48), 2, np.float32))
    tiny_scene.write_text("version: 1\nassets: {seen: {depth_image: {depth: d.npy, panorama: {horizon: 5}}}}\n")
    (spec,) = load_scene(tiny_scene).assets
    baked = SceneLibrary((spec,)).baked(0)
    assert baked is not None
    (part,) = baked.parts
    assert part.position == pytest.approx((0, 2 * 10 / (48 / (2 * np.pi)), 0), rel=1e-5)
    assert part.cylinder.radius == pytest.approx(2, rel=1e-2)
    monkeypatch.setattr("depthwalk.bake.panorama.bake_panorama", lambda *_, **__: pytest.fail("baked again"))
    again = SceneLibrary((spec,)).baked(0)
    assert again is not None and again.key == baked.key


def test_a_process_that_is_ended_while_it_bakes_does_not_end_the_caller(
    tiny_scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    names = ", ".join(f"b{k}: {{mesh: ball.ply, height: {k}, dpci: {{resolution: 32, layers: 1}}}}" for k in (1, 2))
    tiny_scene.write_text(f"version: 1\nassets: {{{names}}}\n")

    def ended(*arguments: object) -> Iterator[object]:
        raise BrokenProcessPool("A process in the process pool was terminated abruptly")
        yield

    monkeypatch.setattr(depthwalk.assets.batch_bake, "bake_all", ended)
    library = SceneLibrary(load_scene(tiny_scene).assets, processes=2)
    library.bake_missing([0, 1])
    assert [record.message for record in caplog.records] == [
        "a baking process was killed, perhaps for lack of memory; baking the remaining depth images one at a time"
    ]
    assert library.baked(0) is not None


@pytest.mark.slow
def test_what_is_baked_to_be_cooked_is_kept_cooked_only(
    tiny_scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    tiny_scene.write_text("version: 1\nassets: {ball: {mesh: ball.ply, dpci: {resolution: 136, layers: 1}}}\n")
    library = SceneLibrary(load_scene(tiny_scene).assets)
    (cooked,) = library.cooked(0, CookOptions())
    assert cooked.outline.steps == 1
    assert find_cooked(library.key(0), CookOptions()) is not None and find_cached(library.key(0)) is None
    (stepped,) = library.cooked(0, CookOptions(stepped=True))
    kept = find_cached(library.key(0))
    assert kept is not None and kept.parts[0].steps == stepped.outline.steps > 1


@pytest.mark.parametrize(("terms", "read"), [("d 1.0\nKe 0 0 0\n", False), ("d 0.5\n", True), ("Ke 1 0 0\n", True)])
def test_only_meshes_that_may_be_translucent_are_read_for_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, terms: str, read: bool
) -> None:
    (tmp_path / "m.mtl").write_text(f"newmtl m\n{terms}")
    triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl m\nf 1 2 3\n"
    (tmp_path / "m.obj").write_text(f"mtllib m.mtl\n{triangle}")
    library = SceneLibrary(
        (MeshAsset(name="m", mesh=tmp_path / "m.obj", texture=None, up="y", height=None, dpci=None),)
    )
    if not read:
        monkeypatch.setattr(depthwalk.assets.asset_files, "load_mesh", None)  # reading would fail
    found = library.translucent_mesh(0)
    assert (found is not None) == read
    if read:
        known = library.mesh(0)
        assert library.translucent_mesh(0) is known
