"""The compiled loops compute what NumPy does: the same functions, called with and without them."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial import cKDTree

from depthwalk.geometry.adjacency import build_adjacency
from depthwalk.render import kernels
from depthwalk.render.antialiasing.silhouette_lines import silhouette_lines
from depthwalk.render.culling.occlusion_test import depth_test, screen_extents
from depthwalk.render.draw import material_depth
from depthwalk.render.draw.object_detail import DrawMethod, describe
from depthwalk.render.draw.plan_settings import PlanSettings
from depthwalk.render.draw.planner import Planner
from depthwalk.render.impostors import tile_cache
from depthwalk.render.impostors.atlas_allocator import Atlas
from depthwalk.render.impostors.tile_records import record_numbers
from depthwalk.render.lighting import light_clusters
from depthwalk.render.lod.mesh_fallback import MeshFallbacks
from depthwalk.render.relief_prewarp import plane_images, prewarp
from depthwalk.render.renderer import Renderer
from depthwalk.render.resources.meshlets import build_meshlets
from depthwalk.render.resources.placed_records import PLACED_RECORD, placed_records
from depthwalk.render.view.bounds import Bounds, Cylinders, object_bounds
from depthwalk.render.view.view import View
from depthwalk.render.world.asset_table import AssetTable
from depthwalk.render.world.render_world import SceneArrays
from depthwalk.render.world.spatial_cells import sort_into_cells
from depthwalk.scene.arrays import Camera, Objects, Representation
from depthwalk.scene.object_settings import LodParams, MeshLodParams, TileParams
from shapes import ShapeLibrary, box, scene_of, sphere
from studio import Studio

pytest.importorskip("numba")
SEEDS = range(4)
FILES = Path(kernels.__file__).parent


def both(compute: Callable[[], Any]) -> tuple[Any, Any]:
    """Return what NumPy computes, and what the loops do."""
    kernels.unload()
    reference = compute()
    assert kernels.load()
    return reference, compute()


def random_view(rng: np.random.Generator, spread: float = 12.0) -> View:
    position, target = rng.normal(0, spread / 3, (2, 3))
    position[1] = abs(position[1])
    return View(Camera(tuple(position), tuple(target), rng.uniform(0.4, 1.4)), (320, 240), 0.1, 200.0)


@pytest.fixture(scope="module")
def table(studio: Studio) -> AssetTable:
    library = ShapeLibrary([sphere(0.5, 64, 32), box(0.4, 0.9, 0.2)], resolution=64)
    with studio.device.context:
        renderer = Renderer(studio.device, scene_of((0, (0, 0, 0), 0, 1), (1, (2, 0, 0), 0, 1)), library)
        table = renderer.world.table()
        renderer.release()
    return table


def random_objects(rng: np.random.Generator, table: AssetTable, count: int, spread: float = 12.0) -> Objects:
    numbers = np.flatnonzero(table.volumes.radius > 0)
    rotation = rng.normal(size=(count, 4))
    return Objects(
        asset=rng.choice(numbers, count).astype(np.int32),
        position=rng.uniform(-spread, spread, (count, 3)).astype(np.float32),
        rotation=(rotation / np.linalg.norm(rotation, axis=1, keepdims=True)).astype(np.float32),
        scale=rng.uniform(0.3, 3, count).astype(np.float32),
        representation=np.full(count, Representation.DPCI, np.uint8),
    )


def bounds_of(objects: Objects, table: AssetTable) -> Bounds:
    return object_bounds(objects, table.centre, table.bounding_radius)


@pytest.mark.gl
@pytest.mark.parametrize("seed", SEEDS)
def test_how_objects_are_drawn(table: AssetTable, seed: int) -> None:
    """By tiles, directly and as polygons; from within them, too; of planar images their fronts alone."""
    rng = np.random.default_rng(seed)
    objects, view = random_objects(rng, table, 400), random_view(rng)
    objects.position[:40] = view.position + rng.normal(0, 0.3, (40, 3))
    objects.representation[:] = rng.choice([0, 1, 1, 1, 2, 3], 400)
    planar = replace(table.volumes, has_side=rng.random(len(table.volumes.radius)) < 0.5)
    rows = rng.permutation(400)[:300]
    for volumes in (table.volumes, planar):
        scene = SceneArrays(
            objects=objects, bounds=bounds_of(objects, table), table=replace(table, volumes=volumes), generation=0
        )
        reference, compiled = both(lambda: describe(view, scene, rows, LodParams()))  # noqa: B023
        for name in ("row", "level", "pieces", "triangles", "method"):
            np.testing.assert_array_equal(getattr(reference, name), getattr(compiled, name))
        for name in ("viewer", "step"):
            np.testing.assert_allclose(getattr(compiled, name), getattr(reference, name), rtol=1e-5, atol=1e-5)
        assert len(np.unique(reference.level)) > 2 and len(np.unique(reference.pieces)) > 2
        methods = {DrawMethod.POLYGONS, DrawMethod.TILE, DrawMethod.DIRECT}
        assert (
            methods
            <= set(reference.method.tolist())
            <= methods | ({DrawMethod.NOTHING} if volumes is planar else set())
        )


@pytest.mark.parametrize("seed", SEEDS)
def test_objects_near_enough_for_their_meshes(seed: int) -> None:
    """Of assets of one and of two parts, somewhere in the frame of their asset."""
    rng = np.random.default_rng(seed)
    fallbacks, count = MeshFallbacks.empty(6), 300
    parts = np.array([0, 0, 1, 0, 1, 0])  # numbers 1 and 2, 3 and 4 are parts of one asset each; 0 is a mesh
    fallbacks.mesh[1:] = 0
    fallbacks.part[:] = parts
    fallbacks.offset[:] = rng.normal(0, 0.5, (6, 3))
    fallbacks.turn[:] = (turn := rng.normal(size=(6, 4))) / np.linalg.norm(turn, axis=1, keepdims=True)
    fallbacks.span[:] = 3.0
    fallbacks.half_height[:], fallbacks.cylinder_radius[:] = rng.uniform(0.3, 1, (2, 6))
    for column in (fallbacks.half_height, fallbacks.cylinder_radius):  # of the asset, as its parts are
        column[[2, 4]] = column[[1, 3]]
    first = rng.choice([1, 3, 5, 0], count // 2)
    asset = np.stack([first, np.where(np.isin(first, [1, 3]), first + 1, first)], 1).reshape(-1)
    rotation = rng.normal(size=(count, 4)).astype(np.float32)
    objects = Objects(
        asset=asset.astype(np.int32),
        position=rng.uniform(-6, 6, (count, 3)).astype(np.float32),
        rotation=rotation / np.linalg.norm(rotation, axis=1, keepdims=True),
        scale=rng.uniform(0.3, 3, count).astype(np.float32),
        representation=np.ones(count, np.uint8),
    )
    for column in (objects.position, objects.scale):
        column[1::2] = column[::2]
    view, rows = random_view(rng), np.arange(count)
    reach = np.array([0, 4, 4, 1, 1, np.inf])
    (near, metres), (found, compiled) = both(lambda: fallbacks.nearer_than(view, objects, rows, reach))
    np.testing.assert_array_equal(near, found)
    np.testing.assert_allclose(compiled, metres, rtol=1e-4, atol=1e-4)
    assert 5 < len(near) < count / 2
    paired = np.isin(asset[near], [1, 2, 3, 4])
    assert (np.bincount(near[paired] // 2)[np.unique(near[paired] // 2)] == 2).all()  # all parts or none


@pytest.mark.gl
@pytest.mark.parametrize("min_pixels", [0.0, 8.0])
@pytest.mark.parametrize("seed", SEEDS)
def test_cells_and_objects_in_sight(table: AssetTable, seed: int, min_pixels: float) -> None:
    rng = np.random.default_rng(seed)
    objects, view = random_objects(rng, table, 3000, 40.0), random_view(rng)
    bounds = bounds_of(objects, table)
    cells = sort_into_cells(bounds)
    for reference, compiled in zip(*both(lambda: cells.batches(view, min_pixels, 500)), strict=True):
        np.testing.assert_array_equal(reference, compiled)
    every = np.arange(len(cells.low))
    (rows, forward), (compiled_rows, compiled_forward) = both(lambda: cells.visible(view, bounds, min_pixels, every))
    assert 0 < len(rows) < len(objects)
    np.testing.assert_array_equal(rows, compiled_rows)
    np.testing.assert_allclose(forward, compiled_forward, rtol=1e-5, atol=1e-5)


@pytest.mark.parametrize("seed", SEEDS)
def test_hidden_objects(seed: int) -> None:
    rng = np.random.default_rng(seed)
    view, count = random_view(rng), 2000
    axis = rng.normal(size=(count, 3))
    enclosing = Cylinders(
        rng.uniform(-30, 30, (count, 3)).astype(np.float32),
        (axis / np.linalg.norm(axis, axis=1, keepdims=True)).astype(np.float32),
        rng.uniform(0.1, 2, count).astype(np.float32),
        rng.uniform(0.1, 1, count).astype(np.float32),
    )
    farthest = np.where(rng.random((120, 160)) < 0.002, 1.0, 0.995).astype(np.float32)  # a wall with holes
    reference, compiled = both(lambda: depth_test(farthest, 2, view, 1.0)(enclosing))
    assert 0.01 < reference.mean() < 0.99
    # NumPy looks at squares of cells that together hold the rectangle and more, the loop at its cells alone.
    assert not (reference & ~compiled).any()
    extents = screen_extents(view, enclosing, 1.0)
    low, high = (np.clip(bound / 2, 0, [159, 119]).astype(int) for bound in (extents.low, extents.high))
    behind = [farthest[y : top + 1, x : right + 1].max() for (x, y), (right, top) in zip(low, high, strict=True)]
    assert ((extents.depth > np.array(behind) + 2.0**-21) != compiled).mean() < 0.002  # rounded in single precision


def test_slots_of_an_atlas() -> None:
    sizes = np.random.default_rng(5).integers(3, 60, (80, 2))

    def allocate() -> tuple[Any, ...]:
        atlas = Atlas((256, 256))
        slots = atlas.allocate_each(sizes)
        atlas.release(slots[::3])  # some of which have free neighbours to merge with
        return slots, atlas.free_texels, atlas.allocate_each(sizes[::-1])

    reference, compiled = both(allocate)
    assert 0 < len(reference[0]) < len(sizes) and len(reference[2])
    for one, other in zip(reference, compiled, strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.mark.gl
@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("crowd", [1 << 14, 20])
def test_records_of_surfaces(table: AssetTable, monkeypatch: pytest.MonkeyPatch, seed: int, crowd: int) -> None:
    """Of objects before, about and behind the viewer, in a sheared view too; of two assets, one of them a crowd."""
    monkeypatch.setattr(material_depth, "_CROWD", crowd)
    rng = np.random.default_rng(seed)
    objects, view = random_objects(rng, table, 200), replace(random_view(rng), shear=(0.1, -0.05))
    objects.asset[:190] = objects.asset.max()
    objects.asset[190:] = objects.asset.min() if objects.asset.min() != objects.asset.max() else 0
    scene = SceneArrays(objects=objects, bounds=bounds_of(objects, table), table=table)
    rows, tiled = rng.permutation(200)[:180], rng.random(180) < 0.5
    reference, compiled = both(lambda: material_depth.material_records(view, scene, rows, tiled))
    one, other = (record_numbers(part.records) for part in (reference, compiled))
    np.testing.assert_allclose(one, other, rtol=1e-5, atol=1e-5)
    for name in ("assets", "material_depth"):
        np.testing.assert_array_equal(getattr(reference, name), getattr(compiled, name))
    for name in ("low", "high"):
        np.testing.assert_allclose(getattr(reference, name), getattr(compiled, name), rtol=1e-5, atol=1e-5)
    assert len(reference.assets) == 2


@pytest.mark.gl
@pytest.mark.parametrize("seed", SEEDS)
def test_plans_of_a_walk(table: AssetTable, seed: int) -> None:
    """Viewers who come near, turn, go through objects and then hardly move: what is warped, where to, and drawn."""

    def walk() -> list[tuple[Any, ...]]:
        rng = np.random.default_rng(seed)
        objects, planner = random_objects(rng, table, 60, 6.0), Planner()
        bounds, settings = bounds_of(objects, table), _settings()
        frames = []
        for k in [*range(6), 5.04, 5.1, 5.2, 5.4, *range(6, 12)]:
            camera = Camera((0.3 * k - 2, 1, 5 - 0.5 * k), (np.sin(k / 4), 0.5, 0), 1.0)
            view = View(camera, (320, 240), 0.1, 100.0)
            seen, _ = bounds.visible(view)
            scene = SceneArrays(objects=objects, bounds=bounds, table=table)
            plan = planner.plan(view, scene, seen, settings)
            warp, composite = (record_numbers(part.records) for part in (plan.warp, plan.composite))
            frames.append((plan.warp.batches, plan.composite.aligned, plan.object_rows, plan.cleared, warp, composite))
        return frames

    reference_frames, compiled_frames = both(walk)
    assert any(0 < len(warped) < len(drawn) for *_, warped, drawn in reference_frames)
    for reference, compiled in zip(reference_frames, compiled_frames, strict=True):
        assert reference[:2] == compiled[:2]
        for one, other in zip(reference[2:4], compiled[2:4], strict=True):
            np.testing.assert_array_equal(one, other)
        for one, other in zip(reference[4:], compiled[4:], strict=True):
            np.testing.assert_allclose(one, other, rtol=2e-4, atol=2e-4)


def _settings() -> PlanSettings:
    layout = TileParams.model_validate({"reuse_error": 0.5})
    return PlanSettings(lod=LodParams(), layout=layout, polygons=MeshLodParams(), atlas_size=(1024, 1024))


@pytest.mark.parametrize("seed", SEEDS)
def test_lamps_by_cluster(seed: int) -> None:
    """Some boxes lie wholly or partly outside; every number is exact."""
    rng = np.random.default_rng(seed)
    count, shape = (0, 1, 30, 200)[seed], np.array([9, 7, 5])
    first = rng.uniform(-6, 12, (count, 3))
    last = first + rng.uniform(0, 8, (count, 3))
    (cells, lists), (compiled_cells, compiled_lists) = both(
        lambda: (kernels.loaded() or light_clusters).cluster_lists(first, last, shape, count // 3)
    )
    np.testing.assert_array_equal(compiled_cells, cells)
    np.testing.assert_array_equal(compiled_lists, lists)
    assert cells.dtype == compiled_cells.dtype and lists.dtype == compiled_lists.dtype
    assert cells[:, 1].sum() >= count and (count < 3 or cells[:, 2].any())


@pytest.mark.parametrize("seed", SEEDS)
def test_lamps_in_sight(seed: int) -> None:
    """Before, behind and beside the viewer, who stands in the reach of some; a third has shadow maps."""
    rng = np.random.default_rng(seed)
    view = replace(random_view(rng), shear=(0.1, -0.05))
    bounds = Bounds(view.position + rng.normal(0, 12, (80, 3)), rng.uniform(0.3, 9, 80))
    lamps = light_clusters.LampTable(bounds=bounds, records=np.zeros(80, light_clusters.LAMP_RECORD))
    tiles = {number: number % 7 for number in range(0, 80, 3)}
    reference, compiled = both(lambda: light_clusters.visible_lamps(view, lamps, tiles))
    for name in ("records", "cells", "lists"):
        np.testing.assert_array_equal(getattr(compiled, name), getattr(reference, name))
    tile = reference.records["shadow"][:, 3]
    assert 5 < len(tile) < 80 and 0 < (tile >= 0).sum() < len(tile)


@pytest.mark.parametrize("seed", SEEDS)
def test_slots_that_tiles_keep(seed: int) -> None:
    """Of all sizes, also powers of two; some objects have no slot, others one that is far too large."""
    rng = np.random.default_rng(seed)
    sizes = np.append(rng.integers(1, 600, (200, 2)), 2 ** rng.integers(0, 10, (40, 2)), 0)
    factor = rng.choice([0.8, 1.0, 1.1, 2.0], (240, 1))
    slot = np.hstack([rng.integers(0, 4000, (240, 2)), np.ceil(sizes * factor).astype(np.int64)])
    row = np.where(rng.random(240) < 0.2, -1, np.arange(240)).astype(np.int32)
    reference, compiled = both(lambda: (kernels.loaded() or tile_cache).kept_slots(row, slot, sizes))
    for expected, found in zip(reference, compiled, strict=True):
        np.testing.assert_array_equal(found, expected)
    assert 0 < reference[2].sum() < (row >= 0).sum()
    cache = tile_cache.TileCache(240, (4096, 4096))
    cache.tiles, cache._row = tile_cache.CachedTiles.empty().take(np.zeros(0, np.int64)), row
    cache.tiles = replace(cache.tiles, slot=slot)
    np.testing.assert_array_equal(*both(lambda: cache.areas(np.arange(240))))


@pytest.mark.parametrize("solid", [True, False])
@pytest.mark.parametrize("seed", SEEDS)
def test_meshlets_in_sight(seed: int, solid: bool) -> None:
    """From within the mesh to far off; some pictures are sheared."""
    rng = np.random.default_rng(seed)
    meshlets = build_meshlets(sphere(1.0, 160, 80))
    assert meshlets is not None
    meshlets = replace(meshlets, part=np.sort(rng.integers(0, 3, len(meshlets.part))))
    most = 0
    for _ in range(10):
        view, rotation = replace(random_view(rng, 6.0), shear=tuple(rng.normal(0, 0.1, 2))), rng.normal(size=(1, 4))
        placed = Objects(
            asset=np.zeros(1, np.int32),
            position=rng.normal(0, 2, (1, 3)).astype(np.float32),
            rotation=(rotation / np.linalg.norm(rotation)).astype(np.float32),
            scale=rng.uniform(0.5, 3, 1).astype(np.float32),
            representation=np.ones(1, np.uint8),
        )
        record = placed_records(view.position, placed)[0]
        reference, compiled = both(lambda: meshlets.seen(view, record, solid))  # noqa: B023
        np.testing.assert_array_equal(compiled, reference)
        most = max(most, len(reference))
    assert 10 < most < len(meshlets.part) or not solid


@pytest.mark.parametrize("seed", SEEDS)
def test_relief_prewarp(seed: int) -> None:
    """From in front, from beside the picture and nearly along it, with texels that are empty."""
    rng = np.random.default_rng(seed)
    depth = rng.random((37, 52)).astype(np.float32) ** 3
    depth[rng.random(depth.shape) < 0.1] = 1e20
    viewers = np.concatenate([rng.uniform(-1, 2, (5, 2)), -rng.uniform(0.01, 3, (5, 1))], 1)
    images = plane_images((37, 52), viewers)
    reference, found = both(lambda: prewarp(depth, viewers, images))
    assert reference.dtype == found.dtype == np.float32 and (reference > 0).mean() > 0.1
    np.testing.assert_allclose(found, reference, rtol=1e-6)


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("least_fold", [None, 0.4, np.pi])
@pytest.mark.parametrize("solid", [True, False])
def test_silhouettes(seed: int, least_fold: float | None, solid: bool) -> None:
    """As lines in any order; one that just touches a pixel's middle may be on either side of it."""
    rng = np.random.default_rng(seed)
    mesh = sphere(0.5, 24, 16) if seed % 2 else box(0.4, 0.9, 0.2)
    faces = mesh.faces[: None if solid else -5]  # with a hole
    edges = build_adjacency(mesh.positions, faces)
    placed = np.zeros(30, PLACED_RECORD)
    view = random_view(rng)
    placed["origin"] = view.axes[2] * rng.uniform(-1, 8, (30, 1)) + rng.normal(0, 1, (30, 3))
    rotation = rng.normal(size=(30, 4))
    placed["rotation"] = rotation / np.linalg.norm(rotation, axis=1, keepdims=True)
    placed["scale"] = rng.uniform(0.5, 2, 30)
    reference, found = both(lambda: silhouette_lines(edges, view, placed, least_fold, solid))
    assert len(reference) > 20 and reference.dtype == found.dtype
    ends = [lines.view(np.float32).reshape(-1, 7)[:, [0, 1, 2, 3, 6]] for lines in (reference, found)]
    for some, others in (ends, ends[::-1]):
        nearest, _ = cKDTree(others).query(some)
        assert (nearest > 0.01).mean() < 0.005
    where = cKDTree(ends[0]).query(ends[1])[1]
    depths = np.abs(reference["depths"][where] - found["depths"])
    assert np.quantile(depths, 0.99) < 1e-4
