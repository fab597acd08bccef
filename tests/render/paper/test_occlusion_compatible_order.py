"""Occlusion-compatible order against the depth buffer, and the order itself against rays."""

from collections.abc import Sequence
from functools import partial

import numpy as np
import pytest

from depthwalk.bake.images import BakedObject, Face
from depthwalk.bake.planar import bake_planar
from depthwalk.cook.cases import ALL_PIECES
from depthwalk.cook.grid_lods import build_grid_lods
from depthwalk.ingest.image import PlanarImage
from depthwalk.ingest.mesh import Mesh
from depthwalk.render.paper.occlusion_compatible_order import GridCells, draw_order, epipole, image_cells
from depthwalk.scene.arrays import Camera
from depthwalk.types import Array, Rows
from shapes import ShapeLibrary, bake, box, joined, scene_of, sphere
from studio import Studio


def stack() -> Mesh:
    """Parts that hide one another from nearly everywhere, none of them around the axis alone."""
    return joined(
        box(0.5, 0.4, 0.5, (0, 0.2, 0)),
        *[box(0.36, 1.2, 0.36, (0.7 * x, 0.6, 0.7 * z)) for x, z in ((1, 0), (-1, 1), (0, -1))],
    )


@pytest.fixture(scope="module")
def library() -> ShapeLibrary:
    y, x = np.mgrid[0:96, 0:96] / 95 * 2 - 1.0
    depth = (0.5 * np.sin(6 * x) ** 2 * np.cos(5 * y) ** 2).astype(np.float32)
    colour = np.zeros((96, 96, 3), np.uint8)
    colour[..., 0], colour[..., 1] = (x > 0) * 200, (y > 0) * 200
    normal = np.zeros((96, 96, 3), np.float32)
    normal[..., 2] = 1
    relief = bake_planar(PlanarImage(depth=depth, colour=colour, normal=normal, size=(2.0, 2.0)), "relief")
    made = [bake(stack(), 128, 1), bake(sphere(0.6, 64, 32), 100, 1), bake(stack(), 128, 3), relief]
    return ShapeLibrary([None] * 4, made, cooked_as="whole grids")


VIEWPOINTS = [
    (d * np.cos(np.radians(e)) * np.sin(a), 0.6 + d * np.sin(np.radians(e)), d * np.cos(np.radians(e)) * np.cos(a))
    for a, e, d in ((0.1, 0, 3), (0.9, 20, 2.2), (2.2, -15, 4), (3.1, 50, 3), (4.4, 5, 2), (5.5, 85, 3), (4.0, -60, 3))
]


@pytest.fixture(autouse=True)
def whole_grids(monkeypatch: pytest.MonkeyPatch) -> None:
    """The depth buffer draws the same triangles as the order."""
    monkeypatch.setattr("depthwalk.cook.grid_lods.build_grid_lods", partial(build_grid_lods, tolerance=-np.inf))


@pytest.mark.parametrize("asset", [0, 1, 2])
@pytest.mark.parametrize("position", VIEWPOINTS)
def test_pictures_are_those_of_the_depth_buffer(
    studio: Studio, library: ShapeLibrary, asset: int, position: tuple[float, float, float]
) -> None:
    pictures = pictures_by_order(studio, library, asset, Camera(position, (0, 0.6, 0), 0.7))
    assert (pictures[0][..., 3] > 0).sum() > 500
    assert differing(pictures) <= 0.001


@pytest.mark.parametrize("position", [(0, 1, 3), (1.5, 1.8, 1.2), (-2, 0.2, 1), (0.3, 3, 1.5)])
def test_a_relief_is_drawn_in_order(
    studio: Studio, library: ShapeLibrary, position: tuple[float, float, float]
) -> None:
    pictures = pictures_by_order(studio, library, 3, Camera(position, (0, 1, 0), 0.8))
    assert differing(pictures) <= 0.001


def test_the_wrong_order_is_seen(studio: Studio, library: ShapeLibrary, monkeypatch: pytest.MonkeyPatch) -> None:
    """The shapes above do depend on their order."""
    monkeypatch.setattr(
        "depthwalk.render.paper.ordered_indices.draw_order", lambda cells, at: draw_order(cells, at)[::-1]
    )
    for asset, positions in ((0, VIEWPOINTS), (3, [(1.5, 1.8, 1.2)])):
        assert any(  # of the first positions already
            differing(pictures_by_order(studio, library, asset, Camera(position, (0, 0.9, 0), 0.8))) > 0.01
            for position in positions
        )


@pytest.mark.gl
@pytest.mark.parametrize("asset", [0, 3])
def test_cells_that_a_ray_meets_come_far_to_near(library: ShapeLibrary, asset: int) -> None:
    """Points along random rays, and the ranks of the cells they fall into."""
    model = library.baked(asset)
    assert model is not None
    (baked,) = model.parts
    cells = image_cells(build_grid_lods(baked, tolerance=-np.inf), baked, level=1, pieces=ALL_PIECES)
    rng = np.random.default_rng(3)
    side = any(image.face is Face.SIDE for image in baked.images)
    middle = np.array([0, (baked.cylinder.bottom + baked.cylinder.top) / 2, 0])
    for _ in range(7):
        viewer = middle + 3 * unit(rng.normal(size=3)) if side else viewer_above(rng, baked)
        rank = np.empty(len(cells.ordered), int)
        rank[draw_order(cells, epipole(baked, viewer, cells))] = np.arange(len(rank))
        ranks = ranks_by_node(cells, rank)
        ends = middle + rng.uniform(-0.7, 0.7, (40, 3))
        along = np.linspace(0.4, 1.6, 300)[:, None, None]
        at = spans_at(cells, baked, viewer + along * (ends - viewer))  # (300, 40, 2) in nodes
        for ray in np.moveaxis(at, 1, 0):
            met = [ranks[node] for node in map(tuple, ray.tolist()) if node in ranks]
            nearer, farther = met[:-1], met[1:]
            assert all(a == b or a[0] > b[1] for a, b in zip(nearer, farther, strict=True))


def unit(v: Array) -> Array:
    return v / np.linalg.norm(v)


def viewer_above(rng: np.random.Generator, baked: BakedObject) -> Array:
    x, z = rng.uniform(-2, 2, 2)
    return np.array([x, baked.cylinder.top + 1.5, z])


def spans_at(cells: GridCells, baked: BakedObject, points: Array) -> Rows:
    """Columns and rows, in nodes, of points (…, 3)."""
    cylinder = baked.cylinder
    x, y, z = np.moveaxis(points, -1, 0)
    if cells.wraps:
        u, v = np.arctan2(z, x) / (2 * np.pi) % 1, (y - cylinder.bottom) / cylinder.height
    else:
        u, v = x / (2 * cylinder.half_width) + 0.5, z / (2 * cylinder.half_depth) + 0.5
    height, width = baked.images[0].depth.shape
    texel = np.stack([u * width - 0.5, v * height - 0.5], -1)
    return np.stack([np.searchsorted(nodes, texel[..., k], "right") - 1 for k, nodes in enumerate(cells.nodes)], -1)


def ranks_by_node(cells: GridCells, rank: Rows) -> dict[tuple[int, ...], tuple[int, int]]:
    """Lowest and highest rank among the triangles of each cell that has some, by the node (column, row) of the cell."""
    nodes, owner = np.unique(cells.cell, axis=0, return_inverse=True)
    low, high = np.full(len(nodes), len(rank)), np.full(len(nodes), -1)
    np.minimum.at(low, owner.ravel(), rank)
    np.maximum.at(high, owner.ravel(), rank)
    return dict(zip(map(tuple, nodes.tolist()), zip(low.tolist(), high.tolist(), strict=True), strict=True))


def pictures_by_order(studio: Studio, library: ShapeLibrary, asset: int, camera: Camera) -> list[Array]:
    pictures = []
    for order in ("depth", "epipole"):
        scene = scene_of((asset, (0, 0, 0), 0.0, 1.0))
        scene.render.warp.order = order
        scene.render.lod.cases = "paper"  # else most is drawn by faces that have no order
        pictures.append(studio.picture(scene, library, camera, size=(320, 240), transparent=True))
    return pictures


def differing(pictures: Sequence[Array]) -> float:
    """Share of the object's pixels whose colour differs by more than rounding."""
    first, second = pictures
    covered = (first[..., 3] > 0) | (second[..., 3] > 0)
    return (np.abs(first - second).max(-1) > 2 / 255)[covered].mean()
