"""Small pictures of everything that is drawn, against the ones kept in tests/images."""

from collections.abc import Callable, Sequence
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

import goldens
from depthwalk.bake.planar import bake_planar
from depthwalk.ingest.image import PlanarImage
from depthwalk.scene.arrays import Camera, Representation
from depthwalk.scene.render_settings import RenderSettings
from depthwalk.scene.scene import Scene
from depthwalk.types import Array
from shapes import ShapeLibrary, box, joined, scene_of, sphere
from studio import Studio

SKY: dict[str, Any] = {"sky": {}, "ground": {"height": 0.0, "colour": (0.5, 0.6, 0.4)}}


def still_life() -> ShapeLibrary:
    """A ball, a step pyramid with overhangs, and a relief."""
    steps = joined(*[box(1.2 - 0.3 * k, 0.3, 1.2 - 0.3 * k, (0.1 * k, 0.15 + 0.4 * k, 0)) for k in range(3)])
    y, x = np.mgrid[0:64, 0:64] / 63 * 2 - 1.0
    depth = (0.2 * (1 + np.sin(7 * x) * np.sin(5 * y))).astype(np.float32)
    colour = (np.stack([x, y, 0 * x], -1) * 60 + 150).astype(np.uint8)
    normal = np.zeros((64, 64, 3), np.float32)
    normal[..., 2] = 1
    relief = bake_planar(PlanarImage(depth=depth, colour=colour, normal=normal, size=(1.2, 1.2)), "relief")
    balls = ShapeLibrary([sphere(0.7, 64, 32, colour=(210, 90, 60)), steps], resolution=128)
    return ShapeLibrary([balls.mesh(0), balls.mesh(1), None], [balls.baked(0), balls.baked(1), relief])


PLACES = ((0, (-1.4, 0, 0), 0.0, 1.0), (1, (0.2, 0, 0.3), 0.5, 1.0), (2, (1.7, 0, -0.4), -0.4, 1.0))


def undithered(*placed: tuple[int, Sequence[float], float, float], **values: Any) -> Scene:
    """A scene as `scene_of` makes it, whose pictures show no noise: some passes change less than that does."""
    scene = scene_of(*placed, **values)
    scene.render.output.dither = False
    return scene


@pytest.fixture(scope="module")
def library() -> ShapeLibrary:
    return still_life()


@pytest.mark.parametrize(
    ("name", "representation", "position"),
    [
        ("dpci-front", Representation.DPCI, (0.3, 1.2, 4.2)),
        ("dpci-above", Representation.DPCI, (0.5, 4.0, 1.5)),
        ("dpci-far", Representation.DPCI, (3.0, 6.0, 30.0)),
        ("dpci-near", Representation.DPCI, (0.2, 0.9, 1.3)),
        ("dmesh-front", Representation.DMESH, (0.3, 1.2, 4.2)),
        ("mesh-front", Representation.MESH, (0.3, 1.2, 4.2)),
    ],
)
def test_golden(
    studio: Studio,
    library: ShapeLibrary,
    request: pytest.FixtureRequest,
    name: str,
    representation: Representation,
    position: tuple[float, float, float],
) -> None:
    placed = [place for place in PLACES if representation is not Representation.MESH or place[0] < 2]
    scene = undithered(*placed, representation=representation, **SKY)
    pixels = studio.picture(scene, library, Camera(position, (0.2, 0.6, 0), 0.8), size=(192, 128))
    goldens.compare(name, pixels, request.config.getoption("--update-goldens"), studio.device.renderer)


def test_golden_multisampled(studio: Studio, library: ShapeLibrary, request: pytest.FixtureRequest) -> None:
    """Depth images, a mesh, their shadows, the ground and the sky, of four samples per pixel."""
    scene = undithered(*PLACES, **SKY, sun={"direction": (-0.4, -0.8, -0.6)})
    scene.objects.representation[1] = Representation.MESH
    scene.render.aa, scene.render.shadows.enabled = "msaa", True
    pixels = studio.picture(scene, library, Camera((0.3, 1.2, 4.2), (0.2, 0.6, 0), 0.8), size=(192, 128))
    goldens.compare("msaa", pixels, request.config.getoption("--update-goldens"), studio.device.renderer)


def test_golden_of_ambient_occlusion(studio: Studio, library: ShapeLibrary, request: pytest.FixtureRequest) -> None:
    """Depth images, a mesh and the ground, in ambient light alone."""
    scene = undithered(*PLACES, **SKY, sun={"intensity": 0.0})
    scene.objects.representation[1] = Representation.MESH
    scene.render.ambient_occlusion.enabled = True
    pixels = studio.picture(scene, library, Camera((0.3, 1.2, 4.2), (0.2, 0.6, 0), 0.8), size=(192, 128))
    goldens.compare("ambient-occlusion", pixels, request.config.getoption("--update-goldens"), studio.device.renderer)


def test_golden_of_lamps(studio: Studio, library: ShapeLibrary, request: pytest.FixtureRequest) -> None:
    """Two spot lights by night, each with its shadows, on depth images and from them."""
    lamps = [
        {"position": (2.5, 3.5, 2.0), "direction": (-2.2, -3.0, -2.0), "intensity": 14.0},
        {"position": (-3.0, 2.0, 1.5), "direction": (3.0, -1.6, -1.5), "intensity": 8.0, "colour": (0.6, 0.8, 1.0)},
    ]
    lights = [lamp | {"angle": 70.0, "range": 14.0, "shadow": True} for lamp in lamps]
    night: dict[str, Any] = {
        "sky": {"zenith": (0, 0, 0.1), "horizon": (0, 0, 0.2)},
        "sun": {"intensity": 0.05},
        "lights": lights,
    }
    scene = undithered(*PLACES, **SKY | night)
    pixels = studio.picture(scene, library, Camera((0.3, 2.2, 4.6), (0.1, 0.4, 0), 0.8), size=(192, 128))
    goldens.compare("lamp-shadows", pixels, request.config.getoption("--update-goldens"), studio.device.renderer)


LAMPS = [
    {"position": (-0.6, 1.2, 1.2), "colour": "#ffb060", "intensity": 1.5, "range": 5},
    {"position": (1.4, 2.2, 1.6), "direction": (-0.4, -1, -0.8), "colour": "#80b0ff", "intensity": 9, "angle": 50},
]
DARK = {"sun": {"intensity": 0.1}, "ambient": {"intensity": 0.1}}
LENS = {"focal_length": 400, "f_number": 1.4, "focus_distance": 4.4, "max_blur": 20}
CLEAR = {"model": "preetham", "turbidity": 4, "sun_size": 6, "light": True}
LOW_SUN = {"direction": (0.2, -0.25, 1), "colour": (1, 1, 1)}


@pytest.fixture(scope="module")
def picture(studio: Studio, library: ShapeLibrary) -> Callable[..., Any]:
    """Draws depth images and a mesh, every pass off that a picture can do without, but for what is asked for."""

    def draw(settings: dict[str, Any], environment: dict[str, Any]) -> Array:
        scene = undithered(*PLACES, representation=Representation.DPCI, **(SKY | environment))
        scene.objects.representation[0] = Representation.MESH
        cast(SimpleNamespace, scene).render = RenderSettings.model_validate({"lod": {"magnification": 0}} | settings)
        scene.render.output.dither = False
        return studio.picture(scene, library, Camera((0.3, 1.2, 4.2), (0.2, 0.6, 0), 0.8), size=(160, 120))

    return draw


@pytest.fixture(scope="module")
def plain(studio: Studio, picture: Callable[..., Any]) -> Array:
    with studio.device.context:
        return picture({}, {})


@pytest.mark.parametrize(
    ("name", "settings", "environment"),
    [
        ("gpaa", {"aa": "gpaa", "gpaa": {"samples": 1}}, {}),
        ("gpaa-edge", {"aa": "gpaa-edge"}, {}),
        ("fxaa", {"aa": "fxaa"}, {}),
        ("smaa", {"aa": "smaa"}, {}),
        ("ssaa", {"aa": "ssaa"}, {}),
        ("shadows", {"shadows": {"enabled": True, "distance": 12}}, {}),
        ("dof-paper", {"dof": {"mode": "paper", **LENS}}, {}),
        ("dof-gather", {"dof": {"mode": "gather", **LENS}}, {}),
        ("fog", {}, {"fog": {"density": 0.2, "height": 0.3, "falloff": 0.6}}),
        ("sky", {}, {"sky": CLEAR, "sun": LOW_SUN}),
        ("tone", {"output": {"tone_mapping": "agx", "exposure": 1.5}}, {}),
        ("lamps", {}, DARK | {"lights": LAMPS}),
        ("forward", {"light": {"mode": "forward"}}, DARK | {"lights": LAMPS}),
    ],
)
def test_golden_of_a_pass(
    studio: Studio,
    picture: Callable[..., Any],
    plain: Array,
    request: pytest.FixtureRequest,
    name: str,
    settings: dict[str, Any],
    environment: dict[str, Any],
) -> None:
    pixels = picture(settings, environment)
    goldens.compare(name, pixels, request.config.getoption("--update-goldens"), studio.device.renderer, plain)
