"""The files in assets/ against their own list, their budget and the claims of the catalogue."""

import re
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray
from scipy.ndimage import binary_fill_holes
from tools.make_models.catalogue import MODELS, TEXTURES
from tools.make_models.model import Model
from tools.make_models.ship import shipped_name
from trimesh.visual import ColorVisuals

import depthwalk as dw
from depthwalk.bake.face_grid import square_texel
from depthwalk.cook.cooked_file import read_cooked

ASSETS = Path(__file__).resolve().parents[2] / "assets"
BUDGET = 25 * 1000 * 1000  # bytes, of models and textures together: they travel in the wheel, which may have 30 MB
LIGHT_MESH = 100_000  # triangles
HEAVY = [name for name, entry in MODELS.items() if entry.images is not None]
POLYGONS = [name for name in MODELS if name not in HEAVY]


@cache
def loaded(name: str) -> trimesh.Trimesh:
    return trimesh.load_mesh(ASSETS / f"{name}.ply", process=False)


def listed() -> dict[str, tuple[int, list[float]]]:
    """Triangles and size by file name, as SOURCES.md says."""
    rows = re.findall(
        r"^\| ([\w.]+\.(?:ply|npz)) \| (\d+) \| [^|]+ \| ([\d.× ]+) \|",
        (ASSETS / "SOURCES.md").read_text("utf-8"),
        re.M,
    )
    return {name: (int(count), [float(v) for v in size.split("×")]) for name, count, size in rows}


def test_sources_list_every_file_and_no_other_is_there() -> None:
    models, textures = {shipped_name(name) for name in MODELS}, {f"{name}.png" for name in TEXTURES}
    text = (ASSETS / "SOURCES.md").read_text("utf-8")
    assert listed().keys() == models
    assert {file.name for file in ASSETS.iterdir()} == models | textures | {"SOURCES.md"}
    assert all(f"| {name} |" in text for name in models | textures)


def test_budget() -> None:
    assert sum(file.stat().st_size for file in ASSETS.iterdir()) <= BUDGET


def test_no_heavy_mesh_ships() -> None:
    assert all(listed()[file.name][0] < LIGHT_MESH for file in ASSETS.glob("*.ply"))


@pytest.mark.parametrize("name", HEAVY)
def test_heavy_models_have_a_million_triangles(name: str) -> None:
    assert listed()[shipped_name(name)][0] >= 1_000_000


@pytest.mark.parametrize("name", HEAVY)
def test_depth_images_show_an_object_of_the_size_of_its_mesh(name: str) -> None:
    (cooked,) = read_cooked(ASSETS / shipped_name(name))
    geometry, texture = cooked.load()
    points, texel = geometry.positions[np.unique(geometry.drawn(0))], square_texel(cooked.outline)
    np.testing.assert_allclose(np.ptp(points, axis=0), listed()[shipped_name(name)][1], atol=2.5 * texel)
    assert abs(points[:, 1].min()) < 0.5 * texel
    assert texture.colours[..., 0].std() > 10


BUSTS = """version: 1
assets: {man: {baked: head_man.dpci.npz}, venus: {baked: head_venus.dpci.npz}}
objects:
  - {asset: man, position: [-0.16, -0.23, 0], yaw: -100}
  - {asset: venus, position: [0.16, -0.23, 0], yaw: -100}
"""
PEDESTAL = """version: 1
assets: {pedestal: {baked: pedestal.dpci.npz}}
objects: [{asset: pedestal, position: [0, -0.55, 0]}]
"""


@pytest.mark.gl
@pytest.mark.parametrize(("scene", "place"), [(BUSTS, (0.0, 0.25, 0.7)), (PEDESTAL, (-0.5, -0.25, -1.1))])
def test_nobody_sees_the_sky_through_what_stands_on_a_foot(
    tmp_path: Path, scene: str, place: tuple[float, float, float]
) -> None:
    """Its ledges lie behind all that overhangs them: with one layer less than there are they were holes."""
    (tmp_path / "scene.yaml").write_text(scene)
    with dw.Renderer(dw.load_scene(tmp_path / "scene.yaml", asset_roots=[ASSETS]), size=(240, 180)) as renderer:
        image = renderer.render(dw.Camera(position=place, target=(0.0, 0.0, 0.0), fov=0.9))
    covered = np.isfinite(image.depth)
    assert covered.sum() > 4000
    assert (binary_fill_holes(covered) & ~covered).sum() <= 5  # pixels


@pytest.mark.parametrize(("name", "count"), [("venus_of_the_paper", 67_170), ("man_of_the_paper", 78_157)])
def test_heads_have_the_papers_counts(name: str, count: int) -> None:
    assert len(loaded(name).faces) == count


def test_the_mans_head_lacks_one_face_only() -> None:
    edges = np.sort(loaded("man_of_the_paper").edges, axis=1)
    _, uses = np.unique(edges, axis=0, return_counts=True)
    assert (uses == 1).sum() == 3
    assert (uses > 2).sum() == 0


@pytest.mark.parametrize("name", POLYGONS)
def test_mesh_is_sound(name: str) -> None:
    mesh = loaded(name)
    count, size = listed()[f"{name}.ply"]
    assert len(mesh.faces) == count
    np.testing.assert_allclose(mesh.extents, size, atol=0.0051)
    assert np.isfinite(mesh.vertices).all()
    assert mesh.area_faces.min() > 0
    assert np.array_equal(np.unique(mesh.faces), np.arange(len(mesh.vertices)))
    assert mesh.bounds[0, 1] == pytest.approx(0, abs=1e-6)
    assert mesh.is_winding_consistent
    assert isinstance(mesh.visual, ColorVisuals)
    assert mesh.visual.vertex_colors[:, :3].std(axis=0).max() > 3


@cache
def made(name: str) -> Model:
    """The model, its hollows as bright as the rest: to darken them is most of the work, and no test here needs it."""

    def in_the_open(model: Model, *_: object) -> NDArray[np.float32]:
        return np.ones(len(model.positions), np.float32)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("tools.make_models.paint.interpolated_occlusion", in_the_open)
        return MODELS[name].make()


@pytest.mark.parametrize("name", ["hedge", "tree_fir", "pedestal"])  # among those soonest made
@pytest.mark.slow
def test_heavy_mesh_is_sound(name: str) -> None:
    model = made(name)
    corners = model.positions[model.faces].astype(np.float64)
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    count, size = listed()[shipped_name(name)]
    edges = model.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2).astype(np.int64)
    forward, backward = (edges[:, k] * len(model.positions) + edges[:, 1 - k] for k in (0, 1))
    assert len(model.faces) == count
    np.testing.assert_allclose(np.ptp(model.positions, axis=0), size, atol=0.0051)
    assert area.min() > 0
    assert model.positions[:, 1].min() == pytest.approx(0, abs=1e-6)
    assert model.colours.std(axis=0).max() > 0.01
    forward.sort()
    backward.sort()
    opposite = backward.take(np.searchsorted(backward, forward), mode="clip")  # `np.isin` takes ten times as long
    assert np.array_equal(opposite, forward) == MODELS[name].closed
    assert np.einsum("ij,ij->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) > 0


@pytest.mark.slow
def test_images_of_the_urn_hold_its_neck_behind_a_handle() -> None:
    model = made("urn")
    mesh = trimesh.Trimesh(model.positions, model.faces, process=False)
    height = np.linspace(0.69, 0.72, 5)  # metres, below where the handles meet the neck
    origin = np.column_stack([np.full(5, 1.0), height, np.zeros(5)])
    place, ray, face = mesh.ray.intersects_location(origin, np.broadcast_to([-1.0, 0, 0], (5, 3)))
    images = MODELS["urn"].images
    assert images is not None
    for number in range(5):
        x = np.sort(place[(ray == number) & (mesh.face_normals[face][:, 0] > 0), 0])[::-1]
        inside = np.flatnonzero((x < -0.1) & (x > -0.2))[0]  # the neck's far side, seen from within
        assert inside < images.layers, x


@pytest.mark.parametrize("name", [n for n in POLYGONS if MODELS[n].closed])
def test_closed_models_are_watertight_and_look_outward(name: str) -> None:
    assert loaded(name).is_watertight
    assert loaded(name).volume > 0


@pytest.mark.parametrize("name", [n for n in POLYGONS if n != "room"])
def test_first_hits_from_outside_face_the_ray(name: str) -> None:
    mesh = loaded(name)
    low, high = mesh.bounds
    rng = np.random.default_rng(1)
    origins = np.column_stack(
        [rng.uniform(low[0], high[0], 200), rng.uniform(low[1], high[1], 200), np.full(200, high[2] + 1)]
    )
    hit = mesh.ray.intersects_first(origins, np.broadcast_to([0.0, 0, -1], (200, 3)))
    normals = mesh.face_normals[hit[hit >= 0]]
    assert len(normals) > 20
    assert (normals[:, 2] > -1e-6).all()


def test_the_room_looks_inward() -> None:
    mesh = loaded("room")
    directions = np.concatenate([np.eye(3), -np.eye(3)])
    hit = mesh.ray.intersects_first(np.tile([0.5, 0.5, 0.3], (6, 1)), directions)
    assert (np.einsum("ij,ij->i", mesh.face_normals[hit], directions) < -0.99).all()


def test_the_rooms_floor_ends_at_its_walls_only() -> None:
    mesh = loaded("room")
    floor = mesh.faces[(mesh.vertices[mesh.faces][..., 1] == 0).all(1) & (mesh.face_normals[:, 1] > 0.99)]
    place, vertex = np.unique(mesh.vertices, axis=0, return_inverse=True)
    edges = np.sort(vertex.reshape(-1)[floor[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)], axis=1)
    edge, uses = np.unique(edges, axis=0, return_counts=True)
    ends = np.abs(place[edge[uses == 1]][..., [0, 2]]) == 3
    assert len(floor) == 1920 and ends.all(1).any(1).all()
