"""The compiled loops build mesh clusters as NumPy does: the same leaves and distances, and surfaces as near."""

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from cluster_cuts import (
    border_width,
    bordered,
    bumpy,
    cut,
    grid,
    is_watertight,
    normals_off,
    numpy_clusters,
    seamless,
    triangles_of,
    wavy,
)
from depthwalk.cook import kernels
from depthwalk.cook.cluster_builder import build_clusters
from depthwalk.cook.cluster_division import divided
from depthwalk.cook.cluster_error import _OFF_COLOUR, Colours, group_errors, nearest_shares, squared_distances
from depthwalk.cook.group_collapse import collapse_groups
from depthwalk.cook.mesh_clusters import SIZE, MeshClusters
from depthwalk.cook.seamed_mesh import Vertices
from depthwalk.geometry.triangles import face_normals, row_ids
from depthwalk.ingest.mesh import Mesh
from depthwalk.kernels import compiled_code
from depthwalk.types import Ints
from shapes import joined, leaves, mesh_of, sphere

pytest.importorskip("numba")
pytestmark = pytest.mark.slow


@pytest.fixture(autouse=True)
def _loaded() -> Iterator[None]:
    assert kernels.load()
    yield
    kernels.unload()


@pytest.fixture(scope="module")
def ball() -> Mesh:
    return bumpy(128, 64)


@pytest.fixture(scope="module")
def compiled(ball: Mesh) -> MeshClusters:
    """The clusters that the loops build."""
    assert kernels.load()
    return build_clusters(ball)


def both(ball: Mesh) -> tuple[MeshClusters, MeshClusters]:
    """The clusters that NumPy builds, and those that the loops do."""
    return numpy_clusters(ball), build_clusters(ball)


def test_leaves_are_those_of_numpy() -> None:
    random = np.random.default_rng(0)
    point = random.random((6000, 3)).astype(np.float32)
    corners = np.arange(6000, dtype=np.int32).reshape(-1, 3)
    part, group = np.zeros(2000, np.int32), np.repeat([0, 1], [700, 1300])
    order, count = divided(point, corners, part, group)
    kernels.unload()
    reference, same_count = divided(point, corners, part, group)
    np.testing.assert_array_equal(count, same_count)
    assert count.sum() == 2000 and count.max() <= SIZE
    ends = np.cumsum(count)[:-1]
    assert [set(leaf) for leaf in np.split(order, ends)] == [set(leaf) for leaf in np.split(reference, ends)]


def test_distances_are_those_of_numpy() -> None:
    random = np.random.default_rng(0)
    corners, group = random.random((90, 3, 3)), np.repeat([0, 1, 2], 30)
    corners[:3, 1] = corners[:3, 0]  # without area
    point, of = random.random((60, 3)), np.repeat([0, 2], 30)
    error, triangle = group_errors(point, of, corners, group, 3)
    distance = squared_distances(point[:, None], corners[None])
    distance[of[:, None] != group] = np.inf
    np.testing.assert_array_equal(triangle, distance.argmin(1))
    np.testing.assert_allclose(error, np.sqrt([distance.min(1)[:30].max(), 0, distance.min(1)[30:].max()]))
    kernels.unload()
    np.testing.assert_allclose(group_errors(point, of, corners, group, 3)[0], error, rtol=1e-9)


def test_colours_are_compared_as_numpy_does() -> None:
    random = np.random.default_rng(1)
    corners, group = random.random((150, 3, 3)), np.repeat([0, 1, 2], 50)
    point, of = random.random((60, 3)), np.repeat([0, 2], 30)
    colours = Colours(random.random((60, 3)), random.random((150, 3, 3)))
    error, triangle = group_errors(point, of, corners, group, 3, colours)
    shown = np.einsum("ntk,tkd->ntd", nearest_shares(point[:, None], corners[None]), colours.corner)
    off = np.square(shown - colours.point[:, None]).sum(-1)
    distance = squared_distances(point[:, None], corners[None]) + _OFF_COLOUR**2 * 2 * face_normals(corners)[1] * off
    distance[of[:, None] != group] = np.inf
    np.testing.assert_array_equal(triangle, distance.argmin(1))
    np.testing.assert_allclose(error, np.sqrt([distance.min(1)[:30].max(), 0, distance.min(1)[30:].max()]))
    kernels.unload()
    reference = group_errors(point, of, corners, group, 3, colours)[0]
    assert (reference >= error - 1e-12).all() and (reference <= 1.3 * error).all()  # upper bounds, see there


def test_colours_are_kept_as_well_as_by_numpy() -> None:
    ball = bordered(seamless(sphere(1.0, 64, 32)))
    for clusters in both(ball):
        chosen = cut(clusters, (0, 1, 11), 0.01)
        assert len(triangles_of(clusters, chosen)) < 0.3 * len(ball.faces)
        assert border_width(ball, clusters, chosen) < 0.05


def test_normals_are_kept_as_well_as_by_numpy() -> None:
    """Those of a flat square with waves, which alone say where triangles are needed."""
    point, triangles = grid(48)
    flat = mesh_of(point, triangles, wavy(point))
    reference, compiled = both(flat)
    for allowed in (0.1, 0.2):
        (one, count), (other, same_count) = (normals_off(flat, clusters, allowed) for clusters in (reference, compiled))
        assert count < 0.7 * len(triangles) and other < 1.2 * one and same_count < 1.2 * count


def test_surfaces_are_as_near_with_as_few_triangles(ball: Mesh, compiled: MeshClusters) -> None:
    reference = numpy_clusters(ball)
    assert len(compiled.faces) < 1.02 * len(reference.faces)
    assert abs(len(compiled.level_first) - len(reference.level_first)) <= 1
    for level in range(4):  # of those above, a few groups are left
        groups = slice(*reference.level_first[level : level + 2]), slice(*compiled.level_first[level : level + 2])
        assert compiled.error[groups[1]].mean() < 1.2 * reference.error[groups[0]].mean()


@pytest.mark.parametrize("allowed", [1e-9, 1e-4, 1e-3, 1e-2, 0.1, 1.0])
def test_no_cracks(compiled: MeshClusters, allowed: float) -> None:
    for viewer in ((0.0, 1.2, 1.3), (3.0, 0.0, 1.0), (0.2, 2.6, 0.1)):
        assert is_watertight(compiled, triangles_of(compiled, cut(compiled, viewer, allowed)))


def test_seams_and_open_edges_hold_up_no_more() -> None:
    """A sphere with a seam, and leaves, which have open edges only."""
    reference, compiled = both(joined(sphere(1.0, 64, 32), leaves(700, 0.08)))
    assert len(compiled.faces) < 1.05 * len(reference.faces)
    assert compiled.error[: compiled.level_first[2]].mean() < 1.2 * reference.error[: reference.level_first[2]].mean()


def strip(columns: int) -> tuple[np.ndarray, Ints]:
    """Points and triangles of a flat strip, two squares wide."""
    x, y = np.meshgrid(np.arange(columns + 1), np.arange(3))
    corner = (np.arange(2)[:, None] * (columns + 1) + np.arange(columns)).ravel()
    square = np.stack([corner, corner + 1, corner + columns + 2, corner, corner + columns + 2, corner + columns + 1], 1)
    return np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], 1) / columns, square.reshape(-1, 3)


@pytest.mark.parametrize("compiled", [False, True])
def test_no_edge_is_made_between_places_that_stay(compiled: bool) -> None:
    """Both sides of the strip are locked, as where other groups begin: those may have such an edge, too."""
    if not compiled:
        kernels.unload()
    point, triangles = strip(12)
    locked = point[:, 1] != point[13, 1]
    vertices = Vertices(place=np.arange(len(point)), part=np.zeros(len(point), np.int64), look=point.copy())
    found = collapse_groups(point, vertices, triangles, np.zeros(len(triangles), np.int64), np.array([4]), locked)
    edges = np.concatenate([found.triangles[:, [0, 1]], found.triangles[:, [1, 2]], found.triangles[:, [2, 0]]])
    between = edges[locked[edges].all(1)]
    assert len(found.triangles) < len(triangles)
    assert (np.ptp(between % 13, axis=1) <= 1).all() and (between[:, 0] // 13 == between[:, 1] // 13).all()


def test_what_is_left_of_a_group_at_the_end_is_not_flattened() -> None:
    """A spike on a plane stays where the plane has not enough triangles to spare."""
    x, y = np.meshgrid(np.arange(21.0), np.arange(21.0))
    point = np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], 1) / 20
    locked = (x % 20 * (y % 20) == 0).ravel()
    point[220, 2] = 0.1
    corner = np.flatnonzero((x < 20).ravel() & (y < 20).ravel())
    square = np.stack([corner, corner + 1, corner + 22, corner, corner + 22, corner + 21], 1)
    triangles = square.reshape(-1, 3)
    vertices = Vertices(place=np.arange(441), part=np.zeros(441, np.int64), look=point.copy())
    found = collapse_groups(point, vertices, triangles, np.zeros(800, np.int64), np.array([10]), locked)
    assert len(found.triangles) < 300
    assert found.point[found.triangles, 2].max() > 0.09


def test_a_cache_that_cannot_be_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """NumPy then serves, and a warning names the folder."""
    (tmp_path / "file").touch()
    kernels.unload()
    with monkeypatch.context() as patched:
        patched.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
        assert not kernels.load() and kernels.loaded() is None
    assert len(row_ids(build_clusters(sphere(1.0, 16, 8)).positions)[1])


def test_a_numba_that_fails_leaves_the_work_to_numpy(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    (tmp_path / "numba").mkdir()
    (tmp_path / "numba" / "__init__.py").write_text('raise ImportError("Numba needs NumPy 2.0 or less")')
    monkeypatch.syspath_prepend(tmp_path)
    for name in [name for name in sys.modules if name.split(".")[0] == "numba"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setattr(kernels, "_loops", None)
    monkeypatch.setattr(compiled_code, "_failed", set())
    assert not kernels.load() and not kernels.load()
    (record,) = caplog.records
    assert "Numba needs NumPy 2.0 or less" in record.getMessage()
