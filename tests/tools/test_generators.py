"""The tools the generators are made of."""

import os
import runpy
import subprocess
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from scipy.spatial import cKDTree
from tools.make_models import crowd, leaves, props, relief, stone, surfaces
from tools.make_models.decimate import unpinched, with_exact_count, without_flaps
from tools.make_models.generate import generate
from tools.make_models.meshing import ambient_occlusion, interpolated_occlusion, largest_part, polygonise
from tools.make_models.model import Model, write_ply
from tools.make_models.noise import fractal
from tools.make_models.sdf import Blob, Points, Rod, ellipsoid, rod, sculpt, union
from tools.make_models.specimens import figure
from tools.make_models.textures import grass, paving, tiling_noise, write_png
from trimesh.visual import ColorVisuals

from depthwalk.errors import InputError
from depthwalk.ingest.loader import load_mesh
from depthwalk.ingest.solid import is_solid
from depthwalk.scene.loader import load_scene
from depthwalk.scene.path import load_path
from depthwalk.scene.scene import MeshAsset
from depthwalk.types import Array

ROOT = Path(__file__).parents[2]


def test_a_missing_library_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "skimage.measure", None)
    with pytest.raises(SystemExit, match=r"scikit-image is not installed; pip install -e '\.\[models\]' brings it"):
        runpy.run_path(str(ROOT / "tools" / "make_models" / "meshing.py"))


def signed_volume(model: Model) -> float:
    """Cubic metres; positive where the faces of a closed model look outward."""
    a, b, c = (model.positions[model.faces[:, k]].astype(np.float64) for k in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)


def boundary_edges(model: Model) -> Array:
    """(n, 2) directed edges without a partner of the opposite direction; none means watertight."""
    edges = model.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2).astype(np.int64)
    keys = edges[:, 0] * len(model.positions) + edges[:, 1]
    partners = edges[:, 1] * len(model.positions) + edges[:, 0]
    return edges[~np.isin(keys, partners)].astype(np.int32)


def ball(p: Points) -> Array:
    return ellipsoid(p, (0, 0.5, 0), (0.5, 0.5, 0.5))


def dome(p: Points) -> Array:
    """The upper half of the ball."""
    upper: Array = np.maximum(ball(p), np.float32(0.5) - p[:, 1])
    return upper


@pytest.fixture(scope="module")
def sphere() -> Model:
    return polygonise(ball, (-0.6, -0.1, -0.6), (0.6, 1.1, 0.6), 0.03)


def test_distance_of_a_sphere_and_a_capsule_is_exact() -> None:
    p = np.array([[2, 0, 0], [0, 0.25, 0], [0, 3, 0]], np.float32)
    np.testing.assert_allclose(ellipsoid(p, (0, 0, 0), (1, 1, 1)), [1, -0.75, 2], atol=1e-6)
    np.testing.assert_allclose(rod(p, (0, 0, 0), (0, 2, 0), 0.5, 0.5), [1.5, -0.5, 0.5], atol=1e-6)


def test_union_is_the_minimum_but_for_the_seam() -> None:
    a, b = np.array([0, 1, 5], np.float32), np.array([0, 1.5, 1], np.float32)
    np.testing.assert_allclose(union(a, b, 0.4), [-0.1, 1, 1], atol=1e-6)


def test_a_cut_stroke_takes_away() -> None:
    p = np.zeros((1, 3), np.float32)
    solid = sculpt(p, np.full(1, 9, np.float32), [Rod((0, -1, 0), (0, 1, 0), 0.5, 0.5, 0.1)])
    assert solid[0] < 0 < sculpt(p, solid, [Blob((0, 0, 0), (0.3, 0.3, 0.3), 0.1, cut=True)])[0]


def test_polygonise_gives_a_closed_sphere_of_the_right_size(sphere: Model) -> None:
    assert len(boundary_edges(sphere)) == 0
    assert signed_volume(sphere) == pytest.approx(np.pi / 6, rel=0.01)


def test_polygonise_drops_crumbs() -> None:
    def two(p: Points) -> Array:
        return np.minimum(ball(p), ellipsoid(p, (0.9, 0.5, 0), (0.1, 0.1, 0.1)))

    model = polygonise(two, (-0.6, -0.1, -0.6), (1.1, 1.1, 0.6), 0.04)
    assert model.positions[:, 0].max() < 0.6


def test_polygonise_finds_what_it_would_find_if_it_looked_everywhere() -> None:
    """Also where the field bends within a coarse cell."""

    def rough(p: Points) -> np.ndarray:
        return ball(p) + np.float32(0.02) * np.sin(40 * p[:, 0]) * np.sin(40 * p[:, 2])

    box = (-0.6, -0.1, -0.6), (0.6, 1.1, 0.6)
    cell = 0.02
    model = polygonise(rough, *box, cell)
    assert len(boundary_edges(model)) == 0
    assert np.abs(rough(model.positions)).max() < 0.2 * cell


def test_interpolated_occlusion_is_near_the_one_of_all_vertices(sphere: Model) -> None:
    exact = ambient_occlusion(sphere, 0.5)
    assert np.abs(interpolated_occlusion(sphere, 0.5, samples=2000) - exact).mean() < 0.03


def test_relief_moves_a_surface_by_no_more_than_it_says(sphere: Model) -> None:
    small = sphere.scaled(0.1)
    worn = relief.weathered(small, 0.02, 1, depth=0.05, chisel=0.05)
    moved = np.linalg.norm(worn.positions - small.positions, axis=1)
    assert 0.0001 < moved.max() < 0.02 * 0.2
    assert len(boundary_edges(worn)) == 0


@pytest.mark.parametrize("count", [1000, 1001])
def test_exact_count(count: int) -> None:
    model = with_exact_count(polygonise(dome, (-0.6, 0.3, -0.6), (0.6, 1.1, 0.6), 0.03), count)
    assert len(model.faces) == count
    assert len(boundary_edges(model)) == 3 * (count % 2)
    assert signed_volume(model) == pytest.approx(np.pi / 12, rel=0.02)


def voxels(solid: list[tuple[int, int, int]]) -> Model:
    """The surface of unit cubes; neighbours share vertices, and their common sides are left out."""
    quads = []
    for cube in solid:
        for axis in range(3):
            for side in (0, 1):
                step = np.eye(3, dtype=int)[axis] * (2 * side - 1)
                if tuple(np.add(cube, step)) not in solid:
                    u, v = np.eye(3, dtype=int)[[(axis + 1) % 3, (axis + 2) % 3]]
                    at = np.add(cube, np.eye(3, dtype=int)[axis] * side)
                    ring = [at, at + u, at + u + v, at + v]
                    quads.append(ring if side else ring[::-1])
    corners, index = np.unique(np.reshape(quads, (-1, 3)), axis=0, return_inverse=True)
    faces = index.reshape(-1, 4)[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3)
    return Model(corners.astype(np.float32), faces.astype(np.int32), np.ones(corners.shape, np.float32))


def most_faces_at_an_edge(model: Model) -> int:
    edges = np.sort(model.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    return int(np.unique(edges, axis=0, return_counts=True)[1].max())


BRIDGE = [(0, 0), (1, 0), (1, 1)]


@pytest.mark.parametrize(
    ("solid", "bodies"),
    [
        ([(0, 0, 0), (1, 1, 0)], 2),  # two cubes that touch along an edge
        ([(0, 0, 1), (1, 1, 1), *((x, y, z) for x, y in BRIDGE for z in (0, 2))], 1),  # also joined above and below
    ],
)
def test_what_touches_itself_along_an_edge_is_taken_apart(solid: list[tuple[int, int, int]], bodies: int) -> None:
    pinched = voxels(solid)
    apart = unpinched(pinched)
    assert most_faces_at_an_edge(pinched) == 4
    assert most_faces_at_an_edge(apart) == 2
    assert len(boundary_edges(apart)) == 0
    assert signed_volume(apart) == pytest.approx(len(solid))
    assert len(largest_part(apart).faces) == len(apart.faces) // bodies


def test_faces_back_to_back_are_dropped(sphere: Model) -> None:
    flap = np.array([[0, 1000, 2000], [2000, 1000, 0]], np.int32)
    model = Model(sphere.positions, np.concatenate([sphere.faces, flap]), sphere.colours)
    assert np.array_equal(without_flaps(model).faces, sphere.faces)


def test_ambient_occlusion_is_open_above_and_dark_below(sphere: Model) -> None:
    light = ambient_occlusion(sphere, 2.0)
    y = sphere.positions[:, 1]
    assert light[y > 0.95].min() > 0.95
    assert light[y < 0.03].max() < 0.3


def test_direct_surfaces_are_closed_and_look_outward() -> None:
    turned = surfaces.lathe([[0, 0], [1, 0], [1, 2], [0, 2]], 32)
    bent = surfaces.tube(surfaces.curve([[0, 0, 0], [0, 1, 0], [1, 2, 0]], 20), 0.1, 12)
    unit = np.eye(3)
    leaf = leaves.leaves(unit[:1], unit[1:2], unit[2:], np.ones(1), 0.5, unit[2:], leaves.OAK)
    twig, outward = leaves.brushes(np.zeros((1, 3)), unit[:1], np.full(1, 0.1), 5, 9)
    stone = surfaces.rounded_block([0, 0, 0], [1, 2, 3], 0.05, 0.1)
    assert len(leaves.leaf_pattern(leaves.OAK)) == len(leaf.positions) and len(outward) == len(twig.positions)
    assert signed_volume(stone) == pytest.approx(6, rel=0.02)
    for model in (turned, bent, leaf, twig, stone):
        assert len(boundary_edges(model)) == 0
        assert signed_volume(model) > 0
    assert signed_volume(turned) == pytest.approx(2 * np.pi, rel=0.01)
    assert signed_volume(surfaces.block([0, 0, 0], [1, 2, 3])) == pytest.approx(6)


def test_noise_is_bounded_smooth_and_seeded() -> None:
    p = np.random.default_rng(0).uniform(-9, 9, (5000, 3))
    values = fractal(p, 1.0, 7)
    assert np.abs(values).max() <= 1
    assert values.std() > 0.1
    assert np.abs(fractal(p + 1e-3, 1.0, 7) - values).max() < 0.05
    assert not np.array_equal(fractal(p, 1.0, 8), values)


def coarse_rock() -> Model:
    """The slab at a tenth of its fineness: heavy models take a minute each."""
    return stone.rock((0.8, 0.34, 0.5), 12, 8, 0.04)


@pytest.mark.parametrize("make", [coarse_rock, props.teapot])
def test_generators_repeat_themselves(make: Callable[[], Model], tmp_path: Path) -> None:
    write_ply(tmp_path / "a.ply", make())
    write_ply(tmp_path / "b.ply", make())
    assert (tmp_path / "a.ply").read_bytes() == (tmp_path / "b.ply").read_bytes()


def test_ply_reads_back(tmp_path: Path) -> None:
    model = surfaces.block([0, 0, 0], [1, 2, 3], (1.0, 0.5, 0.0))
    write_ply(tmp_path / "block.ply", model)
    read = trimesh.load_mesh(tmp_path / "block.ply", process=False)
    np.testing.assert_array_equal(read.vertices, model.positions)
    np.testing.assert_array_equal(read.faces, model.faces)
    np.testing.assert_array_equal(read.vertex_normals, model.normals)
    assert isinstance(read.visual, ColorVisuals)
    np.testing.assert_array_equal(read.visual.vertex_colors[0], [255, 128, 0, 255])


def test_tiling_noise_has_no_seam() -> None:
    field = tiling_noise(64, 4, 1)
    step = np.abs(np.diff(field, axis=0)).max()
    assert np.abs(field[0] - field[-1]).max() <= 1.2 * step


@pytest.mark.parametrize("make", [grass, paving])
def test_textures_tile_and_stay_small(make: Any, tmp_path: Path) -> None:
    picture = make()
    inner = np.abs(np.diff(picture, axis=0)).mean()
    assert picture.shape == (512, 512, 3)
    assert np.abs(picture[0] - picture[-1]).mean() < 1.5 * inner
    assert np.abs(picture[:, 0] - picture[:, -1]).mean() < 1.5 * inner
    write_png(tmp_path / "a.png", picture)
    assert (tmp_path / "a.png").stat().st_size < 250_000


def test_generate_writes_what_is_asked(tmp_path: Path) -> None:
    generate(tmp_path / "out", ["teapot"])
    assert [f.name for f in (tmp_path / "out").iterdir()] == ["teapot.ply"]
    with pytest.raises(InputError, match="no demo file is called 'pedestel'; did you mean 'pedestal'"):
        generate(tmp_path, ["pedestel"])


def test_the_command_makes_several_in_processes(tmp_path: Path) -> None:
    folders = [str(ROOT / "app"), str(ROOT)]
    done = subprocess.run(
        [sys.executable, "-m", "tools.make_models", tmp_path, "torus", "cup"],
        env=os.environ | {"PYTHONPATH": os.pathsep.join(folders)},
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.returncode == 0, done.stderr
    assert sorted(path.name for path in tmp_path.iterdir()) == ["cup.ply", "torus.ply"]


def test_the_market_is_a_scene_of_different_assets(tmp_path: Path) -> None:
    generate(tmp_path, ["market"], assets=5)
    scene = load_scene(tmp_path / "market.yaml")
    assert len(scene.assets) == len(scene.objects) == 5
    assert len({path.read_bytes() for path in tmp_path.glob("*.ply")}) == 5
    assert len(np.unique(scene.objects.position, axis=0)) == 5
    asset = scene.assets[3]
    assert isinstance(asset, MeshAsset)
    mesh = load_mesh(asset.mesh)
    assert 0.6 < mesh.bounds[1][1] < 1.4 and is_solid(mesh)


def test_the_crowd_is_a_walk_among_thin_figures(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(crowd, "figure", partial(figure, 0.03))
    generate(tmp_path, ["crowd"])
    scene, walk = load_scene(tmp_path / "crowd.yaml"), load_path(tmp_path / "crowd_walk.yaml")
    assert len(scene.objects) == 10_000
    apart = cKDTree(scene.objects.position).query(walk.sample(7.0).position)[0]
    assert apart < 3  # the walk leads through the crowd
    low, high = load_mesh(tmp_path / "figure.ply").bounds
    assert low[1] == 0 and high[1] == pytest.approx(1.75, abs=0.03)
    assert high[0] - low[0] > 1  # the arms are spread
