"""Right-triangulated networks on random surfaces with holes and labels: whole, without cracks, within the tolerance."""

from functools import cache

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter, minimum_filter

from depthwalk.bake.grid import cell_triangles, grid_cells, grid_nodes
from depthwalk.bake.images import DepthImage, Face
from depthwalk.cook.rtin import Surface, rtin_triangles
from depthwalk.types import Array, Rows

LAYER = 1
WHOLE = 0b0010011  # a triangle with all corners on that layer
UP = np.array([0.6, 0.48, 0.64], np.float32)  # one normal for all: heights along it add up exactly
CASES = [
    (Face.TOP, (97, 80), 0),
    (Face.BOTTOM, (70, 131), 0),
    (Face.SIDE, (65, 64), 0),
    (Face.SIDE, (50, 100), 0),  # blocks do not fit round
    (Face.SIDE, (128, 192), 1),
    (Face.TOP, (128, 128), 2),  # the last cells are narrower
]


@cache  # which nobody changes
def random_image(
    face: Face, shape: tuple[int, int], level: int, seed: int, flat: bool = False
) -> tuple[DepthImage, Surface]:
    """A DepthImage and its Surface: bumpy here, smooth there; some cells cut, empty or partly on another layer."""
    rng = np.random.default_rng(seed)
    mode = ("nearest", "wrap")
    smooth = gaussian_filter(rng.normal(size=shape), 12, mode=mode) * 20
    rough = gaussian_filter(rng.normal(size=shape), 1, mode=mode) * (gaussian_filter(rng.normal(size=shape), 9) > 0)
    point = rng.normal(size=(*shape, 1)) * np.cross(UP, (1, 0, 0)) + ((1 - flat) * (smooth + rough))[..., None] * UP
    label = gaussian_filter(rng.normal(size=shape), 15, mode=mode) > 0.02
    cells = len(grid_cells(shape, face, 1 << level)[0])
    codes = np.full(cells, WHOLE | WHOLE << 7, np.uint16)
    if not flat:
        holes = rng.random(cells) < 0.01
        codes[holes] = rng.choice([0, WHOLE, WHOLE << 7, WHOLE | (WHOLE ^ 0b110) << 7], holes.sum())
    point = point.reshape(-1, 3).astype(np.float32)
    surface = Surface(point, np.broadcast_to(UP, point.shape), (label & (not flat)).ravel().astype(np.uint8))
    empty = np.zeros(0, np.float32)
    depth = np.ones(shape, np.float32)
    return DepthImage(
        face=face,
        layer=LAYER,
        depth=depth,
        normal=empty,
        albedo=empty,
        cells=(np.zeros(0, np.uint16),) * level + (codes,),
        owner=np.zeros(0, np.uint8),
    ), surface


class Network:
    """What `rtin_triangles` makes of an image, in nodes (row, column) of the level's grid."""

    def __init__(self, image: DepthImage, surface: Surface, level: int, tolerance: float) -> None:
        shape, self.wraps = image.depth.shape, image.face is Face.SIDE
        self.rows, self.columns = (
            grid_nodes(n, 1 << level, w) for n, w in zip(shape, (False, self.wraps), strict=True)
        )
        self.down, self.across = len(self.rows) - 1, len(self.columns) - (not self.wraps)
        texels, self.replaced = rtin_triangles(image, surface, level, tolerance)
        self.coarse = self.unrolled(*np.divmod(texels, shape[1]))
        cells = [axis[~self.replaced] for axis in grid_cells(shape, image.face, 1 << level)]
        columns, rows = cell_triangles(image.face, *cells)
        self.fine = self.unrolled(rows.reshape(-1, 3), columns.reshape(-1, 3))
        of_node = self.rows[:, None] * shape[1] + np.append(self.columns, 0)[: self.across + 1]
        self.height, self.label = (surface.point @ UP)[of_node], surface.label[of_node]
        self.codes = image.cells[level].reshape(self.down, self.across)

    def unrolled(self, rows: Rows, columns: Rows) -> Rows:
        """Triangles (t, 3, 2) of texels, those across the seam in one piece."""
        row, column = np.searchsorted(self.rows, rows), np.searchsorted(self.columns, columns)
        if self.wraps:
            column[(column == 0) & (column.max(1, keepdims=True) > self.across // 2)] = self.across
        return np.stack([row, column], -1)

    def areas(self, triangles: Rows) -> Array:
        return np.linalg.det(triangles[:, 1:] - triangles[:, :1]) / 2


@pytest.mark.parametrize(("face", "shape", "level"), CASES)
@pytest.mark.parametrize("seed", range(4))
def test_triangles_fill_the_grid_without_gaps_and_cracks(
    face: Face, shape: tuple[int, int], level: int, seed: int
) -> None:
    net = Network(*random_image(face, shape, level, seed), level, 0.1)
    assert 0.1 < net.replaced.mean() < 0.95 and len(net.coarse) < 1.4 * net.replaced.sum()
    triangles = np.concatenate([net.coarse, net.fine])
    areas = net.areas(triangles)
    assert len(np.unique(np.sign(areas))) == 1
    assert np.abs(areas).sum() == pytest.approx(net.down * net.across)

    number = triangles @ (net.across + 1, 1)
    if net.wraps:
        number = triangles[..., 0] * (net.across + 1) + triangles[..., 1] % net.across
    edges = np.stack([number, np.roll(number, -1, axis=1)], -1).reshape(-1, 2)
    assert len(np.unique(edges, axis=0)) == len(edges)
    single = edges[~np.isin(edges @ (1 << 20, 1), edges @ (1, 1 << 20))]
    row, column = np.divmod(single, net.across + 1)
    outer = [row == 0, row == net.down] + ([] if net.wraps else [column == 0, column == net.across])
    assert np.any([side.all(1) for side in outer], axis=0).all()


@pytest.mark.parametrize(("face", "shape", "level"), CASES)
@pytest.mark.parametrize("tolerance", [0.02, 0.3])
def test_samples_are_within_the_tolerance(face: Face, shape: tuple[int, int], level: int, tolerance: float) -> None:
    net = Network(*random_image(face, shape, level, 7), level, tolerance)
    worst = 0.0
    extent = np.ptp(net.coarse, axis=1) + 1
    for size in np.unique(extent, axis=0):  # all triangles n whose box has as many nodes k at once
        triangles = net.coarse[(extent == size).all(1)]
        nodes = triangles.min(1)[:, None] + np.moveaxis(np.indices(size), 0, -1).reshape(-1, 2)
        corners, points = (np.insert(each, 2, 1, axis=2).swapaxes(1, 2).astype(float) for each in (triangles, nodes))
        weights = np.linalg.solve(corners, points)  # (n, 3, k)
        inside = (weights > -1e-9).all(1)
        flat = np.einsum("nc,nck->nk", net.height[tuple(np.moveaxis(triangles, -1, 0))], weights)
        around = tuple(np.moveaxis(nodes, -1, 0))
        worst = max(worst, np.abs(net.height[around] - flat)[inside].max())
        label = net.label[tuple(triangles[:, 0].T)]
        assert (net.label[around] == label[:, None])[inside].all()
    assert 0.5 * tolerance < worst < tolerance + 1e-5


@pytest.mark.parametrize(("face", "shape", "level"), CASES)
def test_only_cells_that_are_whole_are_replaced(face: Face, shape: tuple[int, int], level: int) -> None:
    net = Network(*random_image(face, shape, level, 3), level, 10.0)
    label = net.label
    same = (label[1:, 1:] == label[:-1, :-1]) & (label[1:, :-1] == label[:-1, 1:]) & (label[1:, 1:] == label[1:, :-1])
    plain = same & (net.codes == (WHOLE | WHOLE << 7))
    replaced = net.replaced.reshape(plain.shape)
    assert (~plain).sum() > 20
    assert not (replaced & ~plain).any()
    # Where two rings of neighbours are plain as well, nothing demands a vertex at all corners of a cell.
    inside = plain & minimum_filter(plain, 5, mode=("constant", "wrap" if net.wraps else "constant"))
    assert inside.any() and replaced[inside].all()


@pytest.mark.parametrize(("face", "shape"), [(Face.TOP, (65, 97)), (Face.SIDE, (65, 96))])
def test_a_flat_image_is_two_triangles_a_block(face: Face, shape: tuple[int, int]) -> None:
    net = Network(*random_image(face, shape, 0, 0, flat=True), 0, 1e-3)
    assert net.replaced.all() and len(net.coarse) == 2 * (64 // 32) * (96 // 32)


def test_no_tolerance_leaves_the_grid_as_it_is() -> None:
    net = Network(*random_image(Face.SIDE, (64, 64), 0, 0, flat=True), 0, -np.inf)
    assert not len(net.coarse) and not net.replaced.any()


@pytest.mark.parametrize("face", Face)
def test_triangles_face_as_those_of_the_grid_do(face: Face) -> None:
    net = Network(*random_image(face, (64, 80), 0, 5), 0, 0.1)
    assert set(np.sign(net.areas(net.coarse))) == set(np.sign(net.areas(net.fine)))
