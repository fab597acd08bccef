"""Partial coverage at outlines, against areas that are known."""

from collections.abc import Sequence

import numpy as np
import pytest
from scipy.ndimage import binary_dilation

from depthwalk.colour import linear_from_srgb
from depthwalk.geometry.adjacency import build_adjacency
from depthwalk.reference.gpaa import part_beyond
from depthwalk.render.antialiasing.silhouette_lines import silhouette_lines
from depthwalk.render.resources.placed_records import placed_records
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera, Representation
from depthwalk.types import Array
from modes import AaName
from shapes import ShapeLibrary, box, joined, mesh_of, scene_of, sphere
from stage import OnScreen, view_of
from studio import Studio

SIZE = (160, 120)
CAMERA = Camera((0, 1, 5), (0, 1, 0), 0.7)


def area_left_of(start: Array, stop: Array, middle: Array, samples: int = 400) -> float:
    """The part of the unit square about `middle` on the left of a line, by counting."""
    grid = (np.arange(samples) + 0.5) / samples - 0.5
    x, y = np.meshgrid(middle[0] + grid, middle[1] + grid)
    along = stop - start
    return float((along[0] * (y - start[1]) > along[1] * (x - start[0])).mean())


def test_the_part_beyond_an_edge_is_an_area() -> None:
    rng = np.random.default_rng(3)
    angle, offset = rng.uniform(0, 2 * np.pi, 200), rng.uniform(-0.7, 0.7, 200)
    way = np.stack([np.cos(angle), np.sin(angle)], -1)
    middle = rng.uniform(0, 9, (200, 2))
    through = middle + offset[:, None] * way[:, ::-1] * [-1, 1]
    ends = np.hstack([through - 5 * way, through + 5 * way])
    exact = np.array([area_left_of(line[:2], line[2:], at) for line, at in zip(ends, middle, strict=True)])
    assert part_beyond(ends, middle) == pytest.approx(np.minimum(exact, 1 - exact), abs=4e-3)


def picture(
    studio: Studio,
    library: ShapeLibrary,
    aa: AaName,
    representation: Representation,
    camera: Camera = CAMERA,
    *placed: tuple[int, Sequence[float], float, float],
) -> Array:
    scene = scene_of(*(placed or [(0, (0, 0, 0), 0.0, 1.0)]), representation=representation)
    scene.render.aa = aa
    return studio.picture(scene, library, camera, SIZE, transparent=True)


def disc(camera: Camera, centre: tuple[float, float, float], radius: float, samples: int = 8) -> Array:
    """What part (H, W) of each pixel a sphere covers, by rays."""
    width, height = SIZE[0] * samples, SIZE[1] * samples
    view = View(camera, (width, height))
    x, y = (np.arange(width) + 0.5) / width * 2 - 1, 1 - (np.arange(height) + 0.5) / height * 2
    local = np.stack(np.broadcast_arrays(x[None] * view.half_extent[0], y[:, None] * view.half_extent[1], 1.0), -1)
    ray = local @ view.axes
    to_centre = np.asarray(centre) - view.position
    along = ray @ to_centre / np.linalg.norm(ray, axis=-1)
    inside = to_centre @ to_centre - along**2 < radius**2
    return inside.reshape(SIZE[1], samples, SIZE[0], samples).mean((1, 3))


@pytest.mark.parametrize(
    ("representation", "most"), [(Representation.DPCI, 0.16), (Representation.MESH, 0.05), (Representation.DMESH, 0.16)]
)
def test_a_ball_covers_pixels_in_part(studio: Studio, representation: Representation, most: float) -> None:
    """Root mean square of the error in alpha, of pixels on the outline. Without it is that of a coin, 0.29."""
    library = ShapeLibrary([sphere(1.0, 128, 64)], resolution=64)
    truth = disc(CAMERA, (0, 1, 0), 1.0)
    outline = (truth > 0) & (truth < 1)
    error = {
        aa: np.sqrt(np.mean((picture(studio, library, aa, representation)[..., 3] - truth)[outline] ** 2))
        for aa in ("none", "coverage", "gpaa", "gpaa-edge")
    }
    assert error["gpaa"] < most and error["gpaa-edge"] < most
    assert max(error["gpaa"], error["gpaa-edge"]) < 0.6 * error["none"]
    if representation is Representation.DPCI:
        assert error["coverage"] < 0.6 * error["none"]
    else:
        assert error["coverage"] == error["none"]  # polygons and grids do not tell what they cover


def test_a_far_ball_keeps_its_area(studio: Studio) -> None:
    """Of fifteen pixels' width, whatever part of a pixel it stands at."""
    library = ShapeLibrary([sphere(1.0, 64, 32)], resolution=64)
    for aside in (0.0, 0.11, 0.23):
        camera = Camera((aside, 1, 23), (aside, 1, 0), 0.7)
        truth = disc(camera, (0, 1, 0), 1.0)
        off = {
            aa: np.abs(picture(studio, library, aa, Representation.DPCI, camera)[..., 3] - truth).sum()
            for aa in ("none", "coverage", "gpaa")
        }
        assert max(off["coverage"], off["gpaa"]) < 0.6 * off["none"]


def test_polygons_cover_exactly_what_their_edges_say(studio: Studio) -> None:
    """Along the sides of a square, away from its corners."""
    angle = 0.3 + np.arange(4) * np.pi / 2
    positions = np.stack([np.cos(angle), 1 + np.sin(angle), np.zeros(4)], -1)
    mesh = mesh_of(positions, [[0, 1, 2], [0, 2, 3]], np.tile([0.0, 0, 1], (4, 1)))
    library = ShapeLibrary([mesh], [None])
    alpha = picture(studio, library, "gpaa-edge", Representation.MESH)[::-1, :, 3]  # row 0 at the bottom
    view = View(CAMERA, SIZE, near=1, far=10)
    scene = scene_of((0, (0, 0, 0), 0.0, 1.0))
    lines = silhouette_lines(
        build_adjacency(mesh.positions, mesh.faces), view, placed_records(view.position, scene.objects), np.pi, False
    )
    for start, stop in lines["ends"].astype(float).reshape(-1, 2, 2):
        for share in (0.25, 0.4, 0.55, 0.7):
            pixel = np.floor(start + share * (stop - start)).astype(int)
            exact = area_left_of(start, stop, pixel + 0.5)
            assert alpha[pixel[1], pixel[0]] == pytest.approx(exact, abs=0.02)


def test_nothing_but_outlines_is_touched(studio: Studio) -> None:
    """A ball before a step pyramid: away from where distances jump, and where faces fold, every pixel stays."""
    steps = joined(*[box(1.2 - 0.3 * k, 0.3, 1.2 - 0.3 * k, (0.1 * k, 0.15 + 0.4 * k, 0)) for k in range(3)])
    library = ShapeLibrary([sphere(0.5, 64, 32), steps], resolution=64)
    placed = (0, (0.3, 0, 1.2), 0.0, 1.0), (1, (0, 0, 0), 0.4, 1.3)
    for representation in Representation.DPCI, Representation.MESH:
        scene = scene_of(*placed, representation=representation)
        # Texels of half a pixel in both pictures: what is left is the pass itself.
        scene.render.warp.tile_scale = 2.0
        scene.render.fused = False  # nor is light rounded in one of them alone
        scene.render.gpaa.samples = 1
        scene.render.gpaa.crease_angle = 180.0
        before, metres, _ = studio.measured(scene, library, CAMERA, SIZE)
        scene.render.aa = "gpaa-edge"
        after = studio.picture(scene, library, CAMERA, SIZE)
        metres = np.minimum(metres, 99.0)
        jumps = np.zeros(metres.shape, bool)
        for axis in (0, 1):
            low, high = (np.take(metres, range(first, metres.shape[axis] - 1 + first), axis) for first in (0, 1))
            edge = np.argwhere(np.abs(high - low) > 0.02 * np.minimum(low, high))
            jumps[tuple(edge.T)] = True
        changed = (np.abs(after - before) > 1 / 255).any(-1)
        assert changed.sum() > 100
        assert not (changed & ~binary_dilation(jumps, np.ones((3, 3)), iterations=2)).any()


def test_folds_are_smoothed_from_the_angle_asked_for(studio: Studio) -> None:
    library = ShapeLibrary([box(1.4, 1.4, 1.4, (0, 1, 0))], [None])
    camera = Camera((2, 2.5, 4), (0, 1, 0), 0.7)
    changed = {}
    for crease in (30.0, 120.0):
        scene = scene_of((0, (0, 0, 0), 0.0, 1.0), representation=Representation.MESH)
        before = studio.picture(scene, library, camera, SIZE)
        scene.render.aa, scene.render.gpaa.crease_angle = "gpaa-edge", crease
        changed[crease] = (studio.picture(scene, library, camera, SIZE) != before).any(-1)
    assert (changed[30.0] & ~changed[120.0]).sum() > 40
    assert not (changed[120.0] & ~changed[30.0]).any()


def test_a_kept_image_ends_where_its_texels_end(studio: Studio) -> None:
    """Boxes side by side fill the rectangles of their images; whoever walks past sees none nearer than they are."""
    places = [(0, (1.2 * i + 0.1 * k, 0, -1.4 * k), 0.0, 1.0) for i in range(-6, 6) for k in range(8)]
    scene = scene_of(*places)
    scene.render.aa = "coverage"
    kept = 0.0
    with OnScreen(studio.device, scene, ShapeLibrary([box(0.3, 0.8, 0.3)], resolution=64)) as stage:
        stage.renderer.remembers = True
        for step in range(25):
            aside = 0.008 * step
            counts = stage.draw(view_of((aside, 1.2, 4.5), (aside, 0.6, -3)))
            kept += counts["dpci"] - counts["warped"]
            assert stage.renderer.targets is not None
            seen = np.frombuffer(stage.renderer.targets.drawn.visibility_texture.read(), np.uint32).reshape(-1, 2)
            inverse = (seen[:, 1] & ~np.uint32(15)).view(np.float32)
            assert np.isfinite(inverse).all() and inverse.max() < 1 / 4.1
    assert kept > 500


@pytest.mark.parametrize("samples", [1, 2])
def test_the_horizon_is_smooth(studio: Studio, samples: int) -> None:
    """The ground's far side covers a row of pixels by as much as it does, also where it is at the far plane."""
    library = ShapeLibrary([box(0.2, 0.2, 0.2)], [None])
    white, scene_size = {"height": 0.0, "half_size": 30.0, "colour": (1, 1, 1)}, (64, 48)
    scene = scene_of((0, (0, 0, 0), 0.0, 1.0), representation=Representation.MESH, ground=white)
    scene.render.aa, scene.render.gpaa.samples = "gpaa-edge", samples
    for up in np.linspace(1.0, 2.6, 9).tolist():
        camera = Camera((0, up, 5), (0, up, 0), 0.7)
        alpha = studio.picture(scene, library, camera, scene_size, transparent=True)[..., 3]
        below = up / 35 / np.tan(0.35) * scene_size[1] / 2  # of the middle of the picture, pixels
        row = int(scene_size[1] / 2 + below)
        assert alpha[row, 5] == pytest.approx(1 - below % 1, abs=0.03)
        assert (alpha[: row - 1, 5] == 0).all() and (alpha[row + 1 :, 5] == 1).all()


@pytest.mark.parametrize("aa", ["coverage", "gpaa-edge"])
def test_what_is_too_bright_is_white_before_it_is_blended(studio: Studio, aa: AaName) -> None:
    """A ball eight times as bright as white, on black, is as bright at its outline as it covers pixels."""
    shown_as = Representation.DPCI if aa == "coverage" else Representation.MESH
    library, truth = ShapeLibrary([sphere(1.0, 128, 64)], resolution=64), disc(CAMERA, (0, 1, 0), 1.0)
    scene = scene_of(
        (0, (0, 0, 0), 0.0, 1.0),
        representation=shown_as,
        background=(0, 0, 0),
        ambient={"intensity": 20.0},
        sun={"intensity": 0.0},
    )
    scene.render.aa, scene.render.gpaa.samples = aa, 1
    blended = linear_from_srgb(studio.picture(scene, library, CAMERA, SIZE)[..., :3])
    assert blended.max() == pytest.approx(1.0)
    outline = (truth > 0) & (truth < 1)
    assert np.abs(blended[outline].mean(-1) - truth[outline]).mean() < 0.12
    scene.render.dof.mode, scene.render.dof.f_number = "gather", 64.0  # a lens blurs light, whatever a screen can show
    unlimited = linear_from_srgb(studio.picture(scene, library, CAMERA, SIZE)[..., :3])
    assert np.abs(unlimited[outline].mean(-1) - truth[outline]).mean() > 0.2
