"""A depth camera's picture of a head before a wall, made here, from file to screen."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from tools.make_models.heads import FLOOR, venus_field
from tools.make_models.meshing import polygonise
from tools.make_models.model import write_ply

from depthwalk.assets.library import SceneLibrary
from depthwalk.bake.planar import connect_texels, range_mesh
from depthwalk.bake.raycast import RayCaster
from depthwalk.errors import InputError
from depthwalk.ingest.loader import load_mesh
from depthwalk.ingest.mesh import Mesh
from depthwalk.ingest.range_image import Intrinsics, RangeImage, load_range_image
from depthwalk.scene.arrays import Camera
from depthwalk.scene.loader import load_scene
from depthwalk.scene.scene import Scene
from depthwalk.types import Array, Mask, Rows
from studio import Studio

SIZE, FOCAL = (240, 180), 220.0
EYE, WALL = np.array([0.0, 0.24, 0.75]), 1.15  # metres; the wall's depth


def camera_depth(mesh: Mesh, noise: float = 0.0015) -> tuple[Rows, Mask]:
    """What a depth camera of SIZE at EYE writes: counts of a millimetre (H, W), noise that grows with the square of
    depth, 1 in 100 pixels missing, and mixed ones on edges; and where it saw the mesh."""
    rng = np.random.default_rng(7)
    width, height = SIZE
    i, j = np.meshgrid(np.arange(width), np.arange(height))
    rays = np.stack([(i - width / 2) / FOCAL, -(j - height / 2) / FOCAL, -np.ones(i.shape)], -1).reshape(-1, 3)
    length = np.linalg.norm(rays, axis=1)
    hit = RayCaster(mesh).first(np.tile(EYE, (len(rays), 1)), rays / length[:, None]).distance / length
    clean = np.where(np.isfinite(hit), hit, WALL).reshape(height, width)
    depth = clean + noise * clean**2 * rng.normal(size=clean.shape)
    mixed = (np.abs(np.diff(clean, axis=1, prepend=WALL)) > 0.1) & (rng.random(clean.shape) < 0.5)
    depth[mixed] = (depth[mixed] + np.roll(depth, 1, axis=1)[mixed]) / 2
    counts = np.round(depth * 1000)
    counts[rng.random(clean.shape) < 0.01] = 0
    return counts.astype(np.uint16), np.isfinite(hit).reshape(height, width)


@pytest.fixture(scope="module")
def taken(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Mask]:
    """The folder with the picture `d.png` and a scene of it, and where it shows the head (H, W)."""
    folder = tmp_path_factory.mktemp("range")
    write_ply(
        folder / "head.ply", polygonise(venus_field, (-14, FLOOR - 1, -17), (14, 26, 13), 0.8).scaled(0.01).grounded()
    )
    counts, head = camera_depth(load_mesh(folder / "head.ply"))
    Image.fromarray(counts).save(folder / "d.png")
    colour = np.where(head[..., None], np.array([230, 60, 60], np.uint8), np.array([60, 60, 230], np.uint8))
    Image.fromarray(colour).save(folder / "c.png")
    lens = f"{{fx: {FOCAL}, fy: {FOCAL}, cx: {SIZE[0] / 2}, cy: {SIZE[1] / 2}}}"
    (folder / "scene.yaml").write_text(
        "version: 1\nassets:\n"
        f"  head: {{depth_image: {{depth: d.png, colour: c.png, unit: 0.001, intrinsics: {lens}}}}}\n"
        "objects: [{asset: head}]\n"
    )
    return folder, head


def load(folder: Path) -> RangeImage:
    lens = Intrinsics(fx=FOCAL, fy=FOCAL, cx=SIZE[0] / 2, cy=SIZE[1] / 2)
    return load_range_image(folder / "d.png", lens=lens, unit=0.001)


def test_the_mesh_is_torn_between_head_and_wall(taken: tuple[Path, Mask]) -> None:
    folder, head = taken
    mesh = range_mesh(load(folder))
    depth = -mesh.positions[:, 2][mesh.faces]
    assert np.ptp(depth, axis=1).max() < 0.1
    assert len(mesh.faces) > 0.85 * 2 * head.size  # and hardly anywhere else
    right, up = (mesh.positions[mesh.faces[:, k]] - mesh.positions[mesh.faces[:, 0]] for k in (1, 2))
    facing = np.cross(right, up)
    assert (np.einsum("ni,ni->n", facing, mesh.positions[mesh.faces[:, 0]]) < 0).all()  # toward the camera


@pytest.fixture(scope="module")
def scene(taken: tuple[Path, Mask]) -> tuple[Scene, SceneLibrary]:
    scene = load_scene(taken[0] / "scene.yaml")
    library = SceneLibrary(scene.assets)
    return scene, library


def test_from_the_cameras_place_it_shows_what_the_camera_saw(
    studio: Studio, taken: tuple[Path, Mask], scene: tuple[Scene, SceneLibrary]
) -> None:
    """Drawn again from where it was taken: everything but the missing pixels is there, at its depth."""
    folder, head = taken
    image = load(folder)
    seen = range_mesh(image).bounds
    # The asset's frame: centred in x, on its lowest point, nearest point at z = 0.
    eye = -np.array([(seen[0][0] + seen[1][0]) / 2, seen[0][1], seen[1][2]])
    fov = 2 * np.arctan(SIZE[1] / 2 / FOCAL)
    camera = Camera(tuple(eye), tuple(eye - [0, 0, 1]), fov)
    pixels, metres, _ = studio.measured(*scene, camera, size=SIZE, transparent=True)
    measured = image.depth[::-1]
    both = np.isfinite(measured) & (pixels[..., 3] > 0)
    assert both.sum() > 0.93 * np.isfinite(measured).sum()
    off = np.abs(metres[both] - measured[both])
    assert np.median(off) < 0.003 and np.quantile(off, 0.95) < 0.02
    red = pixels[..., 0] > pixels[..., 2]
    assert (red == head)[both].mean() > 0.98


@pytest.mark.parametrize("side", [-1, 1])
def test_from_aside_nothing_bridges_head_and_wall(studio: Studio, scene: tuple[Scene, SceneLibrary], side: int) -> None:
    """Between the head's back and the wall there is a gap of 20 cm that one looks through."""
    camera = Camera((side * 1.2, 0.5, 0.2), (0.0, 0.42, -0.22), 0.6)
    pixels, metres, _ = studio.measured(*scene, camera, size=(240, 180), transparent=True)
    solid = metres < np.inf
    z = camera_points(camera, metres)[..., 2]
    wall = float(np.median(z[solid & (z < -0.35)]))
    assert (solid & (z > -0.2)).sum() > 200  # the head
    between = solid & (z < -0.26) & (z > wall + 0.06)
    assert between.sum() < 0.01 * solid.sum()
    assert np.isfinite(pixels).all()


def camera_points(camera: Camera, metres: Array) -> Array:
    from depthwalk.render.view.view import View

    height, width = metres.shape
    view = View(camera, (width, height))
    tan_x, tan_y = view.half_extent
    x = ((np.arange(width) + 0.5) / width * 2 - 1) * tan_x
    y = (1 - (np.arange(height) + 0.5) / height * 2) * tan_y
    rays = np.stack(np.broadcast_arrays(x[None], y[:, None], 1.0), -1) @ view.axes
    with np.errstate(invalid="ignore"):
        return view.position + metres[..., None] * rays


@pytest.mark.slow
def test_the_second_start_reads_the_cache(scene: tuple[Scene, SceneLibrary], monkeypatch: pytest.MonkeyPatch) -> None:
    before = scene[1].baked(0)
    monkeypatch.setattr("depthwalk.bake.planar.bake_range", lambda *_: pytest.fail("baked again"))
    again = SceneLibrary(scene[0].assets).baked(0)
    assert before is not None and again is not None
    assert np.array_equal(again.parts[0].images[0].depth, before.parts[0].images[0].depth)


def test_a_range_image_without_surface_is_refused(taken: tuple[Path, Mask], tmp_path: Path) -> None:
    folder, _ = taken
    lonely = np.zeros(SIZE[::-1], np.uint16)
    lonely[::3, ::3] = 900
    Image.fromarray(lonely).save(tmp_path / "d.png")
    (tmp_path / "c.png").write_bytes((folder / "c.png").read_bytes())
    (tmp_path / "scene.yaml").write_text((folder / "scene.yaml").read_text())
    with pytest.raises(InputError) as caught:
        SceneLibrary(load_scene(tmp_path / "scene.yaml").assets).baked(0)
    defect = "the range image holds no surface: no pixel continues its neighbours"
    place = f"{tmp_path / 'scene.yaml'}:3:9: assets.head"
    assert str(caught.value) == f"{place}: {(tmp_path / 'd.png').resolve()}: {defect}"


def test_no_grid_of_a_relief_spans_a_tear() -> None:
    """A step in the middle of the image, at no node of a coarse grid: triangles on both sides, none across."""
    depth = np.zeros((65, 65), np.float32)
    depth[:, 30:] = 0.5
    for level, cells in enumerate(connect_texels(depth, 1 / 65, 4)):
        step = 1 << level
        kept = (cells == (1 | 1 << 7)).reshape(64 // step, 64 // step)
        torn = np.zeros(kept.shape[1], bool)
        torn[29 // step] = True
        assert (kept == ~torn).all()
