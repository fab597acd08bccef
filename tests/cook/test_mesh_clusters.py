"""Hierarchies of mesh clusters: whole at every cut, ever coarser, as near to the mesh as they say."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cluster_cuts import (
    border_width,
    bordered,
    bumpy,
    cut,
    is_watertight,
    nearest_on,
    numpy_clusters,
    seamless,
    triangles_of,
)
from depthwalk.cook.cluster_builder import build_clusters
from depthwalk.cook.cluster_error import squared_distances
from depthwalk.cook.mesh_clusters import SIZE, MeshClusters
from depthwalk.geometry.triangles import face_normals, sample_triangles
from depthwalk.ingest.mesh import Mesh, Part
from depthwalk.render.lod.cluster_selection import select_clusters
from shapes import box, joined, leaves, mesh_of, sphere

Point = tuple[float, float, float]


@pytest.fixture(scope="module")
def ball() -> Mesh:
    return bumpy()


@pytest.fixture(scope="module")
def clusters(ball: Mesh) -> MeshClusters:
    return build_clusters(ball)


POINTS = st.tuples(*[st.floats(-6, 6)] * 3)
ALLOWED = st.floats(-5, 1).map(lambda power: 10.0**power)


@settings(deadline=None, max_examples=150)
@given(viewer=POINTS, allowed=ALLOWED)
def test_a_closed_surface_has_no_cracks_in_any_cut(clusters: MeshClusters, viewer: Point, allowed: float) -> None:
    assert is_watertight(clusters, triangles_of(clusters, cut(clusters, viewer, allowed)))


def test_near_by_it_is_the_mesh_and_far_away_a_few_triangles(ball: Mesh, clusters: MeshClusters) -> None:
    near = triangles_of(clusters, cut(clusters, (0, 1, 0), 1e-9))
    np.testing.assert_array_equal(
        np.unique(np.sort(clusters.positions[near].reshape(len(near), 9), 0), axis=0),
        np.unique(np.sort(ball.positions[ball.faces].reshape(-1, 9), 0), axis=0),
    )
    assert 4 <= len(triangles_of(clusters, cut(clusters, (0, 1, 1e6), 1.0))) <= 32


@pytest.mark.slow
def test_a_nearer_half_is_finer() -> None:
    large = numpy_clusters(bumpy(128, 64))
    chosen = triangles_of(large, cut(large, (0, 1.2, 1.3), 0.02))
    in_front = large.positions[chosen].mean(1)[:, 2] > 0
    assert in_front.sum() > 1.3 * (~in_front).sum() > 0
    assert is_watertight(large, chosen)


def test_errors_and_spheres_hold_those_below(clusters: MeshClusters) -> None:
    inner = np.flatnonzero((clusters.made_by >= 0) & (clusters.group >= 0))
    below, above = clusters.made_by[inner], clusters.group[inner]
    assert (clusters.error[above] >= clusters.error[below]).all() and (clusters.error > 0).all()
    apart = np.linalg.norm(clusters.group_centre[above] - clusters.group_centre[below], axis=1)
    assert (apart + clusters.group_radius[below] <= clusters.group_radius[above] * (1 + 1e-9)).all()
    level = np.searchsorted(clusters.level_first, clusters.group, "right")
    assert (level[inner] > np.searchsorted(clusters.level_first, clusters.made_by, "right")[inner]).all()


def test_clusters_have_few_triangles_within_their_bounds(clusters: MeshClusters) -> None:
    count = np.diff(clusters.first)
    assert count.min() >= 1 and count.max() <= SIZE
    of = np.repeat(np.arange(len(clusters)), count)
    corners = clusters.positions[clusters.faces].astype(float)
    apart = np.linalg.norm(corners - clusters.centre[of][:, None], axis=2).max(1)
    assert (apart <= clusters.radius[of] * (1 + 1e-5)).all()
    normal, area = face_normals(corners)
    cosine = np.einsum("ij,ij->i", normal, clusters.axis[of])
    bounded = (clusters.sine[of] < 1) & (area > 0)
    assert (cosine >= np.sqrt(1 - clusters.sine[of] ** 2) - 1e-4)[bounded].all() and bounded.mean() > 0.5


@settings(deadline=None, max_examples=8)
@given(viewer=POINTS, allowed=st.floats(-3, -1).map(lambda power: 10.0**power))
def test_the_mesh_is_as_near_as_the_errors_say(
    ball: Mesh, clusters: MeshClusters, viewer: Point, allowed: float
) -> None:
    chosen = cut(clusters, viewer, allowed)
    corners = clusters.positions[triangles_of(clusters, chosen)].astype(float)
    points = sample_triangles(ball.positions[ball.faces].astype(float), 400)[0]
    distance = np.sqrt(squared_distances(points, corners[nearest_on(points, corners)[0]]))
    errors = clusters.error[clusters.made_by[chosen]][clusters.made_by[chosen] >= 0]
    assert distance.max() <= 1.1 * errors.max(initial=1e-6)
    # Of each group: the error allowed at its distance.
    apart = np.linalg.norm(clusters.group_centre - np.array(viewer), axis=1) - clusters.group_radius
    made_by = np.unique(clusters.made_by[chosen])
    made_by = made_by[made_by >= 0]
    assert (clusters.error[made_by] <= allowed * np.maximum(apart[made_by], 0)).all()


def test_many_objects_are_cut_as_each_is_alone(clusters: MeshClusters) -> None:
    random = np.random.default_rng(0)
    viewer = random.normal(size=(40, 3)) * np.geomspace(1, 1000, 40)[:, None]
    nearest = np.maximum(np.linalg.norm(viewer, axis=1) - 2.5, 0)
    together = select_clusters(clusters, viewer, nearest, 0.003)
    for row in range(len(viewer)):
        alone = select_clusters(clusters, viewer[row : row + 1], nearest[row : row + 1], 0.003)
        assert set(together.clusters[together.objects == row]) == set(alone.clusters)
    assert not len(select_clusters(clusters, viewer[:0], nearest[:0], 0.003).objects)


def test_seams_and_materials_are_kept(ball: Mesh) -> None:
    half = len(ball.faces) // 2
    parts = (Part(0, half, 1), Part(half, len(ball.faces) - half, 0))
    mesh = replace(ball, parts=parts, materials=ball.materials * 2)
    clusters = build_clusters(mesh)
    assert set(clusters.part) == {0, 1}
    for allowed in (1e-9, 0.01, 1.0):
        chosen = cut(clusters, (0, 1, 3), allowed)
        assert is_watertight(clusters, triangles_of(clusters, chosen))
        assert set(clusters.part[chosen]) == {0, 1}


def test_looks_stay_those_of_the_surface() -> None:
    ball = bumpy(48, 24)
    red, blue = ball, replace(ball, positions=ball.positions + np.array([4, 0, 0], np.float32))
    both = joined(red, blue)
    both.colours[: len(red.positions)], both.colours[len(red.positions) :] = (255, 0, 0), (0, 0, 255)
    clusters = build_clusters(both)
    chosen = triangles_of(clusters, cut(clusters, (2, 1, 30), 0.002))
    right = clusters.positions[chosen][..., 0] > 2
    assert (clusters.colours[chosen][right] == (0, 0, 255)).all() and (
        clusters.colours[chosen][~right] == (255, 0, 0)
    ).all()
    outward = clusters.positions[chosen] - np.where(right[..., None], [4, 1.2, 0], [0, 1.2, 0])
    assert (np.einsum("tij,tij->ti", clusters.normals[chosen], outward) > 0.5).all()
    np.testing.assert_allclose(np.linalg.norm(clusters.normals, axis=1), 1, atol=1e-5)
    assert len(chosen) < len(both.faces) / 2


def test_a_sharp_border_between_colours_stays_within_the_error() -> None:
    """The ball is smooth, so that its shape alone would leave few of its triangles."""
    ball = bordered(seamless(sphere(1.0, 64, 32)))
    clusters = numpy_clusters(ball)
    thinned = 0
    for allowed in (0.005, 0.01, 0.02, 0.05, 0.1):
        chosen = cut(clusters, (0, 1, 11), allowed / 10)
        errors = clusters.error[clusters.made_by[chosen]][clusters.made_by[chosen] >= 0]
        thinned += len(errors) > 0
        assert border_width(ball, clusters, chosen) <= errors.max(initial=1e-9) <= 1.2 * allowed
        assert is_watertight(clusters, triangles_of(clusters, chosen))
    assert thinned >= 3


def test_one_colour_is_simplified_like_any_other() -> None:
    ball = bumpy(40, 20)
    one, other = (build_clusters(replace(ball, colours=np.full_like(ball.colours, value))) for value in (7, 255))
    assert (one.colours == 7).all() and (other.colours == 255).all()
    for name in ("positions", "normals", "faces", "error", "group"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


def test_colours_that_change_evenly_do_not_hold_up_simplification() -> None:
    """A flat square with colours from left to right: two triangles would show it."""
    x, y = (side.ravel() for side in np.meshgrid(np.arange(17), np.arange(17)))
    corner = np.flatnonzero((x < 16) & (y < 16))
    square = np.stack([corner, corner + 1, corner + 18, corner, corner + 18, corner + 17], 1)
    flat = mesh_of(np.stack([x, y, 0 * x], 1) / 16, square.reshape(-1, 3), np.tile([0.0, 0, 1], (289, 1)))
    flat = replace(flat, colours=np.stack([15 * x, 255 - 15 * x, 0 * x + 90], 1).astype(np.uint8))
    clusters = build_clusters(flat)
    chosen = triangles_of(clusters, cut(clusters, (0.5, 0.5, 10), 1e-3))
    assert len(chosen) < 0.2 * len(flat.faces)
    shown, wanted = clusters.colours[chosen][..., 0], 240 * clusters.positions[chosen][..., 0]
    assert np.abs(shown - wanted).max() < 4


@pytest.mark.slow
def test_groups_that_are_simplified_apart_fit_together(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("depthwalk.cook.cluster_builder._BATCH", 2048)
    clusters = build_clusters(bumpy(88, 44))
    for allowed in (1e-9, 1e-4, 1e-3, 1e-2, 0.1, 1.0):
        for viewer in ((0.0, 1.2, 1.3), (3.0, 0.0, 1.0), (0.2, 2.6, 0.1)):
            assert is_watertight(clusters, triangles_of(clusters, cut(clusters, viewer, allowed)))


def test_open_leaves_are_thinned_out() -> None:
    clusters = build_clusters(leaves(700, 0.08))
    counts = [len(triangles_of(clusters, cut(clusters, (0, 0.5, 20), allowed))) for allowed in (1e-9, 1e-3, 1e-2)]
    assert counts[0] == 1400 and counts[1] <= counts[0] and counts[2] < 0.7 * counts[0]


@pytest.mark.parametrize("size", [1e-9, 1.0, 1e9])
def test_hostile_sizes(size: float) -> None:
    mesh = replace(bumpy(48, 24), positions=(size * bumpy(48, 24).positions).astype(np.float32))
    clusters = build_clusters(mesh)
    assert np.isfinite(clusters.error).all() and np.isfinite(clusters.positions).all()
    for allowed in (1e-9, 0.01, 1.0):
        assert is_watertight(clusters, triangles_of(clusters, cut(clusters, (0, 0, 9 * size), allowed)))


def test_a_mesh_far_from_the_origin() -> None:
    mesh = bumpy(48, 24)
    clusters = build_clusters(replace(mesh, positions=mesh.positions + np.float32(1000)))
    assert is_watertight(clusters, triangles_of(clusters, cut(clusters, (1000, 1000, 1010), 0.01)))


@pytest.mark.parametrize(
    "mesh",
    [
        mesh_of(np.zeros((0, 3)), np.zeros((0, 3), int), np.zeros((0, 3))),
        mesh_of(np.zeros((3, 3)), [[0, 1, 2]], np.tile([0.0, 1, 0], (3, 1))),
        mesh_of([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2]], np.tile([0.0, 1, 0], (3, 1))),
        mesh_of([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]] * 300, np.tile([0.0, 0, 1], (3, 1))),
        mesh_of([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 1], [0, 1, 2]], np.tile([0.0, 0, 1], (3, 1))),
        box(1, 2, 3),
        joined(*(box(1, 1, 1, centre=(2 * k, 0, 0)) for k in range(60))),
    ],
    ids=["empty", "a point", "a line", "copies", "partly a line", "box", "boxes"],
)
def test_degenerate_meshes(mesh: Mesh) -> None:
    clusters = build_clusters(mesh)
    for allowed in (1e-9, 1.0):
        chosen = triangles_of(clusters, cut(clusters, (0, 0, 5), allowed))
        corners = mesh.positions[mesh.faces]
        proper = (np.ptp(corners, axis=1).max(1) > 0) & (mesh.faces[:, 1] != mesh.faces[:, 2])
        assert len(chosen) == proper.sum() if allowed < 1e-6 else len(chosen) <= proper.sum()
