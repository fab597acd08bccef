"""Meshes in the place of depth images because they are quicker: `representation: auto`."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from depthwalk.assets.library import SceneLibrary
from depthwalk.bake.model import BakedModel
from depthwalk.gpu.device import Device
from depthwalk.render.headless import HeadlessRenderer
from depthwalk.render.lod import mesh_choice
from depthwalk.render.lod.fallback_rule import MeshFallbackRule
from depthwalk.render.lod.mesh_choice import (
    AS_IMAGES,
    AS_MESH,
    BINS,
    FREE_TRIANGLES,
    TRIANGLES_PER_PIXEL,
    UNKNOWN,
    MeshChooser,
    advice_bins,
    advised_at,
    advised_table,
    mesh_is_quicker,
)
from depthwalk.render.view.view import View
from depthwalk.scene.advice import Advice
from depthwalk.scene.arrays import Camera, Representation
from depthwalk.scene.loader import load_scene
from shapes import ShapeLibrary, bake, scene_of, sphere
from stage import NEAR, SlowLibrary, Walk, draws_until

SIZE = 96, 72
AUTO, DPCI, MESH_LOD = Representation.AUTO, Representation.DPCI, Representation.MESH_LOD


def test_the_model_weighs_triangles_against_pixels() -> None:
    pixels = np.array([5000.0])
    even = TRIANGLES_PER_PIXEL * pixels + FREE_TRIANGLES
    for factor in (0.5, 0.95, 1.0, 1.05, 2.0):
        assert mesh_is_quicker(factor * even, pixels) == (factor <= 1)
    assert mesh_is_quicker(np.array([FREE_TRIANGLES]), np.array([1.0]))


def test_advice_holds_for_the_sizes_nearest_to_those_measured() -> None:
    bins = advice_bins(Advice(pixels=(20.0, 80.0, 320.0), mesh=(False, True, False)))
    assert bins.shape == (BINS,) and set(bins.tolist()) == {AS_IMAGES, AS_MESH}
    changes = 2.0 ** ((np.flatnonzero(np.diff(bins)) + 1) / mesh_choice.BINS_PER_OCTAVE)
    assert changes == pytest.approx([40.0, 160.0], rel=0.2)  # in the middle, by ratio
    for size in (5.0, 20.0, 38.0, 42.0, 80.0, 320.0):
        assert advised_at(bins[None], np.array([size])) == (AS_MESH if 40 <= size < 160 else AS_IMAGES)
    table = advised_table(3, {1: "oak", 2: "fir"}, {"oak": Advice(pixels=(50.0,), mesh=(True,))})
    assert (table[1] == AS_MESH).all() and (table[[0, 2]] == UNKNOWN).all()


def draw(
    scene_file: Path, kind: Representation | None, overrides: Mapping[str, str] | None = None
) -> tuple[np.ndarray, dict[str, float]]:
    """Return the picture from 8 m, where no texel is magnified, and what was counted."""
    scene = load_scene(scene_file, overrides={"render.lod.magnification": "1000", **(overrides or {})})
    with HeadlessRenderer(scene, SceneLibrary(scene.assets), SIZE, kind) as headless:
        headless.draw(View(Camera((0, 1, 8), (0, 1, 0), 0.8), SIZE))
        assert headless.renderer.plan is not None
        return headless.pixels(), headless.renderer.plan.counts


@pytest.mark.gl
@pytest.mark.parametrize("limit", (100_000.0, 0.0))
def test_auto_draws_one_of_both_by_the_model(tiny_scene: Path, limit: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """The picture is that of the mesh's level, or of the depth images; forced or written in the scene is the same."""
    monkeypatch.setattr(mesh_choice, "FREE_TRIANGLES", limit)
    monkeypatch.setattr(mesh_choice, "TRIANGLES_PER_PIXEL", 1e-9)
    picture, counts = draw(tiny_scene, AUTO)
    assert (counts["mesh_fallbacks"], counts["dpci"]) == ((1, 0) if limit else (0, 1))
    assert np.array_equal(picture, draw(tiny_scene, MESH_LOD if limit else DPCI)[0])
    written, _ = draw(tiny_scene, None, {"objects.0.representation": "auto"})
    assert np.array_equal(written, picture)


@pytest.mark.gl
@pytest.mark.parametrize("mesh", (True, False))
def test_auto_follows_advice_against_the_model(tiny_scene: Path, mesh: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mesh_choice, "FREE_TRIANGLES", 0.0 if mesh else 1e9)
    monkeypatch.setattr(mesh_choice, "TRIANGLES_PER_PIXEL", 1e-9)
    (tiny_scene.parent / "a.json").write_text(
        '{"version": 1, "renderer": "x", "want_flip": 0.1, "assets": {"ball": '
        f'[{{"pixels": 30.0, "mesh": {str(mesh).lower()}, "quickest": "mesh"}}]}}}}'
    )
    _, counts = draw(tiny_scene, AUTO, {"advice": "a.json"})
    assert counts["mesh_fallbacks"] == int(mesh)


@pytest.mark.gl
def test_other_objects_of_the_scene_do_not_choose(tiny_scene: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Meshes are quicker, but only the second object asks for them."""
    monkeypatch.setattr(mesh_choice, "FREE_TRIANGLES", 1e6)
    scene = tiny_scene.with_name("two.yaml")
    scene.write_text(
        tiny_scene.read_text().replace(
            "  - {asset: ball}\n",
            "  - {asset: ball, position: [-1.5, 0, 0], representation: dpci}\n"
            "  - {asset: ball, position: [1.5, 0, 0], representation: auto}\n",
        )
    )
    picture, counts = draw(scene, None)
    assert (counts["mesh_fallbacks"], counts["dpci"]) == (1, 1)
    half = SIZE[0] // 2
    assert np.array_equal(picture[:, :half], draw(scene, DPCI)[0][:, :half])
    assert np.array_equal(picture[:, half:], draw(scene, MESH_LOD)[0][:, half:])


def chosen(gl_device: Device, told: int | None, budget: int = 2 << 30) -> tuple[bool, bool]:
    """Whether a ball of 224 triangles, of which its images tell `told`, is drawn as its mesh, and read at all."""
    mesh = sphere(0.5, columns=16, rows=8)
    images = replace(bake(mesh, resolution=32, layers=1), mesh_triangles=told)
    library = SlowLibrary([mesh], [BakedModel(parts=(images,))])
    scene = scene_of((0, (0, 0, 0), 0.0, 1.0), representation=AUTO)
    scene.render.lod.magnification, scene.render.gpu_memory = 1000.0, budget
    with Walk(gl_device, scene, library, seconds=0.01) as walk:
        walk.look(NEAR)
        assert walk.counts["mesh_fallbacks"] == 0  # which waits for nothing
        library.may.set()
        if told == len(mesh.faces) and budget > 1:
            draws_until(walk, lambda: walk.counts["mesh_fallbacks"] == 1)
        for _ in range(3):
            walk.look(NEAR)
        return bool(walk.counts["mesh_fallbacks"]), walk.renderer.assets.is_waiting or bool(library.read)


@pytest.mark.gl
def test_a_mesh_is_read_only_where_it_would_be_drawn(gl_device: Device) -> None:
    """Not where it has too many triangles, nobody knows how many, or there is no room for it."""
    assert chosen(gl_device, 224) == (True, True)
    assert chosen(gl_device, 10_000_000) == (False, False)
    assert chosen(gl_device, None) == (False, False)
    assert chosen(gl_device, 224, budget=1) == (False, False)


@pytest.mark.gl
@pytest.mark.parametrize("triangles", (40, 1000, 30_000))
def test_no_object_is_left_out_by_the_distance_that_is_tested_first(
    gl_device: Device, triangles: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """From near by to far away, the choice is the one of the model alone. No mesh counts as light."""
    monkeypatch.setattr(mesh_choice, "MOST_LIGHT", 0)
    mesh = sphere(0.5, columns=16, rows=8)
    images = replace(bake(mesh, resolution=32, layers=1), mesh_triangles=triangles)
    distances = np.geomspace(0.8, 60.0, 24)
    objects = [(0, (0.0, 0.0, -float(d)), 0.0, 1.0) for d in distances]
    scene = scene_of(*objects, representation=AUTO)
    scene.render.lod.magnification = 1e-6
    drawn = []
    for reach in (None, np.inf):
        if reach is not None:
            monkeypatch.setattr(
                mesh_choice, "farthest_as_mesh", lambda view, table, *_: np.full(len(table.mesh), np.inf)
            )
        with Walk(gl_device, scene, ShapeLibrary([mesh], [BakedModel(parts=(images,))]), seconds=None) as walk:
            arrays = walk.renderer.world.arrays()
            rule = MeshFallbackRule(
                magnification=1000.0,
                is_resident=lambda m: np.ones(len(m), bool),
                error=1.0,
                triangles_per_pixel=TRIANGLES_PER_PIXEL,
            )
            view = View(Camera((0, 0.5, 0), (0, 0.5, -1), 0.9), (640, 480))
            found = MeshChooser().as_meshes(
                view,
                arrays.objects,
                np.arange(len(objects)),
                choice=arrays.choice,
                fallbacks=arrays.table.mesh_fallbacks,
                levels=arrays.table.meshes,
                rule=rule,
            )
            drawn.append(found.tolist())
    assert drawn[0] == drawn[1] == list(range(len(drawn[0])))
    assert (len(drawn[0]) == len(objects)) == (triangles < FREE_TRIANGLES)
    assert len(drawn[0]) > 0


@pytest.mark.gl
def test_light_meshes_are_weighed_by_the_level_that_would_be_drawn(
    gl_device: Device, monkeypatch: pytest.MonkeyPatch
) -> None:
    """From 12 m a ball of 1,472 triangles has too many for its pixels, and a level of it has not."""
    mesh = sphere(0.5, columns=32, rows=24)
    images = replace(bake(mesh, resolution=32, layers=1), mesh_triangles=len(mesh.faces))
    for light, expected in ((len(mesh.faces), 1), (len(mesh.faces) - 1, 0)):
        monkeypatch.setattr(mesh_choice, "MOST_LIGHT", light)
        library = ShapeLibrary([mesh], [BakedModel(parts=(images,))])
        scene = scene_of((0, (0, 0, 0), 0.0, 1.0), representation=AUTO)
        scene.render.lod.magnification = 1000.0
        with Walk(gl_device, scene, library, seconds=None) as walk:
            walk.look(Camera((0, 0.5, 12), (0, 0.5, 0), 0.9))
            assert walk.counts["mesh_fallbacks"] == expected
            assert 0 < walk.counts["mesh_triangles"] < len(mesh.faces) / 3 or not expected
