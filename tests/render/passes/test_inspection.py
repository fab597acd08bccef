"""Normals, distances, colours and how objects are drawn in the place of light: a ball, whose truth is known."""

import numpy as np
import pytest

from depthwalk.reference.inspection import distance_grey, normal_colour, shaded
from depthwalk.render.draw.object_colours import GROUND_COLOUR, legend
from depthwalk.render.headless import HeadlessRenderer
from depthwalk.render.passes.mesh import MeshPass
from depthwalk.render.resources.placed_records import NUMBERED_MESH
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera, Representation
from depthwalk.scene.effect_settings import HowDrawn, InspectionParams
from depthwalk.scene.environment import GroundParams
from depthwalk.types import Array
from shapes import ShapeLibrary, scene_of, sphere

SIZE = (96, 72)
CAMERA = Camera((1.0, 2.0, 4.0), (0.0, 1.0, 0.0), 0.7)
COLOUR = (200, 120, 80)


@pytest.fixture(scope="module")
def library() -> ShapeLibrary:
    return ShapeLibrary([sphere(1.0, 64, 32, colour=COLOUR)], resolution=64)


def pictures(library: ShapeLibrary, how: Representation, show: str, background: bool = True) -> tuple[Array, Array]:
    """(H, W, 4) sRGB and alpha, 0 to 1, and (H, W) metres along the view axis."""
    scene = scene_of((0, (0, 0, 0), 0.0, 1.0), representation=how)
    scene.render.aa = "none"
    scene.render.inspection = InspectionParams.model_validate({"show": show, "half_distance": 3.0})
    with HeadlessRenderer(scene, library, SIZE) as headless:
        headless.draw(View(CAMERA, SIZE), transparent=not background)
        pixels = headless.pixels() / 255.0
        headless.draw(View(CAMERA, SIZE), linear=True)
        return pixels, headless.linear_image().distance


def eye_rays() -> Array:
    """(H, W, 3) from the viewer to a metre along the view axis, world."""
    x, y = np.meshgrid((np.arange(SIZE[0]) + 0.5) / SIZE[0] * 2 - 1, 1 - (np.arange(SIZE[1]) + 0.5) / SIZE[1] * 2)
    return np.asarray(np.stack([x, y, np.ones_like(x)], -1) @ View(CAMERA, SIZE).ray_from_screen.T)


def ball() -> tuple[Array, Array]:
    """(H, W, 3) normals of the ball as pixels show it, and (H, W) distances; NaN and infinite where it is not."""
    rays = eye_rays()
    start = np.array(CAMERA.position) - (0, 1, 0)
    a, b, c = (rays**2).sum(-1), (rays * start).sum(-1), (start**2).sum() - 1
    with np.errstate(invalid="ignore"):
        away = (-b - np.sqrt(b * b - a * c)) / a
    return start + away[..., None] * rays, np.where(np.isnan(away), np.inf, away)


@pytest.mark.gl
@pytest.mark.slow
@pytest.mark.parametrize("how", [Representation.MESH, Representation.DPCI])
def test_a_ball_shows_its_normals_distances_and_colour(library: ShapeLibrary, how: Representation) -> None:
    normals, distance = ball()
    inside = np.isfinite(distance)
    inside[1:-1, 1:-1] &= inside[:-2, 1:-1] & inside[2:, 1:-1] & inside[1:-1, :-2] & inside[1:-1, 2:]
    assert inside.sum() > 800
    shown, _ = pictures(library, how, "normals")
    assert np.abs(shown[..., :3] - normal_colour(normals))[inside].max() < 0.05
    shown, found = pictures(library, how, "distance")
    assert np.abs(shown[..., 0] - distance_grey(distance, 3.0))[inside].max() < 0.02
    assert np.abs(shown[..., 1] - distance_grey(found, 3.0)).max() < 0.005  # the twin, where nothing is too
    shown, _ = pictures(library, how, "albedo")
    assert np.abs(shown[..., :3] - np.array(COLOUR) / 255)[inside].max() < 0.01


@pytest.mark.gl
def test_what_is_no_surface_is_black_or_empty(library: ShapeLibrary) -> None:
    for background, alpha in ((True, 1.0), (False, 0.0)):
        shown, distance = pictures(library, Representation.MESH, "normals", background)
        nothing = np.isinf(distance)
        assert nothing.any() and (shown[nothing] == (0, 0, 0, alpha)).all() and (shown[~nothing, 3] == 1).all()


@pytest.mark.gl
@pytest.mark.slow
@pytest.mark.parametrize(
    ("how", "show", "meaning"),
    [
        (Representation.DPCI, "representation", "impostor"),
        (Representation.DMESH, "representation", "dmesh"),
        (Representation.MESH, "representation", "mesh"),
        (Representation.MESH_CLUSTERS, "representation", "clusters"),
        (Representation.OCTAHEDRAL, "representation", "captured view"),
        (Representation.DPCI, "level", "1"),
        (Representation.DMESH, "level", "1"),
        (Representation.MESH, "level", "0"),
        (Representation.MESH, "case", "polygons"),
        (Representation.MESH, "error", "0"),
        (Representation.DPCI, "case", "side"),
        (Representation.DPCI, "error", "0"),
        (Representation.OCTAHEDRAL, "error", "not known"),
    ],
)
def test_a_ball_shows_how_it_is_drawn(library: ShapeLibrary, how: Representation, show: HowDrawn, meaning: str) -> None:
    normals, distance = ball()
    inside = np.isfinite(distance)
    inside[1:-1, 1:-1] &= inside[:-2, 1:-1] & inside[2:, 1:-1] & inside[1:-1, :-2] & inside[1:-1, 2:]
    scene = scene_of((0, (0, 0, 0), 0.0, 1.0), representation=how, ground=GroundParams(height=-0.5))
    scene.render.aa, scene.render.lod.bias = "none", 1.0
    scene.render.octahedral.resolution = 96
    scene.render.output.exposure, scene.render.output.tone_mapping = 1.5, "aces"  # of light: these colours are none
    scene.render.inspection = InspectionParams.model_validate({"show": show})
    with HeadlessRenderer(scene, library, SIZE) as headless:
        headless.draw(View(CAMERA, SIZE))
        shown = headless.pixels()[..., :3] / 255.0
    rays = distance[..., None] * eye_rays()
    rays[~inside] = 1
    expected = shaded(np.array(dict(legend(show))[meaning]), np.where(inside[..., None], normals, 0), rays)
    assert np.abs(shown - expected)[inside].max() < 0.15  # normals are some degrees off; other colours are 0.2 off
    corner = eye_rays()[-1, 0]  # where the ground is
    assert np.abs(shown[-1, 0] - shaded(GROUND_COLOUR, np.array((0.0, 1.0, 0.0)), corner)).max() < 0.01


@pytest.mark.gl
@pytest.mark.slow
@pytest.mark.parametrize("how", [Representation.MESH_LOD, Representation.MESH_CLUSTERS])
def test_each_of_several_meshes_shows_its_own_level_whatever_phase_draws_it(how: Representation) -> None:
    """The nearest is drawn in the first phase, those beside and behind it in the second."""
    library = ShapeLibrary([sphere(1.0, 192, 96, colour=COLOUR), sphere(1.0, 192, 96)], resolution=64)
    places = [(0, (0.0, 0.0, 0.0)), (1, (-2.5, 0.0, -3.0)), (0, (14.0, 0.0, -30.0)), (1, (19.0, 0.0, -60.0))]
    scene = scene_of(*((asset, place, 0.0, 1.0) for asset, place in places), representation=how)
    scene.render.aa = "none"
    scene.render.inspection.show = "level"
    camera = Camera((0.0, 1.0, 4.0), (0.0, 1.0, 0.0), 0.8)
    with HeadlessRenderer(scene, library, (240, 180)) as headless:
        for _ in range(2):  # in the second, what was seen before is drawn first
            headless.draw(View(camera, (240, 180)))
        picture = headless.pixels()[..., :3] / 255.0
        renderer = headless.renderer
        assert renderer.plan is not None
        drawn = renderer.plan.polygons
        levels = {
            tuple(drawn.records["origin"][row].round(3).tolist()): batch.level
            for batch in drawn.batches
            for row in range(batch.first, batch.first + batch.count)
        }
        view = View(camera, (240, 180))
    assert len(levels) == 4 and len(set(levels.values())) >= 3
    for origin, level in levels.items():
        x, y, z = view.axes @ (np.array(origin) + np.array((0, 1, 0)))
        column = int((1 + x / (z * view.half_extent[0])) / 2 * 240)
        row = int((1 - y / (z * view.half_extent[1])) / 2 * 180)
        shown = picture[row, column] / np.linalg.norm(picture[row, column])
        colours = np.array([colour for _, colour in legend("level")][:8])
        nearest = np.linalg.norm(colours / np.linalg.norm(colours, axis=1)[:, None] - shown, axis=1).argmin()
        assert nearest == min(level, 7)


@pytest.mark.gl
def test_without_false_colours_polygons_are_drawn_by_the_same_programs_as_ever(library: ShapeLibrary) -> None:
    scene = scene_of((0, (0, 0, 0), 0.0, 1.0), representation=Representation.MESH)
    with HeadlessRenderer(scene, library, SIZE) as headless:
        (mesh,) = (each for each in headless.renderer.passes if isinstance(each, MeshPass))
        headless.draw(View(CAMERA, SIZE))
        before = set(mesh._programs)
        assert not any("NUMBERED" in defines for defines in before)
        scene.render.inspection.show = "level"
        headless.draw(View(CAMERA, SIZE))
        assert {defines for defines in mesh._programs if "NUMBERED" in defines}
        targets = headless.renderer.targets
        assert targets is not None
        with headless.device.context:
            visible = np.frombuffer(targets.visibility_texture.read(), np.uint32)[::2]
        assert set(visible) == {0, NUMBERED_MESH}
        scene.render.inspection.show = "picture"
        headless.draw(View(CAMERA, SIZE))
        with headless.device.context:
            visible = np.frombuffer(targets.visibility_texture.read(), np.uint32)
        assert not visible.any()
