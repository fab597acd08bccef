"""Measure how closely the shadows of depth images match those of their meshes.

The measurements are for `depthwalk quality` and docs/shadows.md. Shadows are measured in two ways: cast by depth images
alone, and as scenes draw them, where the mesh replaces images that a shadow map would magnify.

Each object hangs alone over level ground, high enough that a viewer straight above sees its whole shadow. The sun is
the only light, so that the ground is dark exactly where the sun does not reach it.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthwalk.assets.library import SceneLibrary
from depthwalk.assets.mesh_library import Report
from depthwalk.pictures import png_bytes
from depthwalk.quality.metrics import silhouette_iou
from depthwalk.quality.pair_renderer import one_asset_scene
from depthwalk.quality.rows import Row
from depthwalk.quality.views import FOV, Sphere, bounding_sphere
from depthwalk.render.headless import HeadlessRenderer
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera, Representation
from depthwalk.scene.environment import Environment
from depthwalk.scene.render_settings import RenderSettings
from depthwalk.scene.scene import MeshAsset, Scene
from depthwalk.types import Picture

Direction = tuple[float, float, float]

SUNS: dict[str, Direction] = {  # direction of the light, by the elevation of the sun
    "20°": (-0.92, -0.34, 0.20),
    "35°": (0.80, -0.57, 0.19),
    "50°": (0.1, -0.77, -0.63),
}
LEAST_IOU = 0.99  # of images alone
ALONE = "images alone"
WAYS = {ALONE: Representation.DPCI, "as drawn": None}  # the latter with meshes where they are finer
HEIGHT, RISE = 8.0, 2.0  # of the viewer and of the object, above the ground, radii of the object
REACH = 1.5 * HEIGHT  # of the shadow map, radii: farther away, where shadows fade, nothing is visible
FAR = 10 * REACH  # distance of the object that is never seen, radii
LEVEL = 0.01  # part of the viewer's height by which ground may appear to be off
_BOTH, _MISSING, _EXTRA, _LIT, _OBJECT = (70, 70, 70), (214, 20, 20), (40, 90, 220), (225, 225, 225), (160, 190, 150)


@dataclass(frozen=True)
class Ground:
    """Hold what a picture shows of the ground.

    Attributes
    ----------
    shown
        (H, W) bool: pixels in which nothing hides the ground.
    shadow
        (H, W) bool: pixels in which the ground is in shadow.
    """

    shown: NDArray[np.bool_]
    shadow: NDArray[np.bool_]


def examine(scenes: Sequence[Scene], size: tuple[int, int], report: Report) -> Iterator[Row]:
    """Compare the shadows of depth images with those of their meshes; an `Examine`.

    Every mesh asset with depth images has two rows: for its shadow cast by images alone, and as scenes draw it. Each
    row holds the intersection over union of this shadow and the mesh's, the smallest over the elevations in `SUNS`.
    """
    meshes = [asset for scene in scenes for asset in scene.assets if isinstance(asset, MeshAsset)]
    assets = {(asset.mesh, str(asset.dpci)): asset for asset in meshes if asset.dpci is not None}
    for asset in assets.values():
        report(asset.name, "shadows")
        library = SceneLibrary((asset,), report)
        mesh = library.mesh(0)
        assert mesh is not None  # it is a mesh asset
        sphere = bounding_sphere(mesh)
        with HeadlessRenderer(_stage(sphere), library, size, Representation.DPCI) as headless:
            grounds = {name: _grounds(headless, sphere, sun) for name, sun in SUNS.items()}
        for way in WAYS:
            yield _row(asset.name, way, {name: (mesh, ways[way]) for name, (mesh, ways) in grounds.items()})


def _row(asset: str, way: str, pairs: Mapping[str, tuple[Ground, Ground]]) -> Row:
    """Return the row of one way, from the ground below the mesh and below the images for each elevation of the sun."""
    ious = {name: _iou(*pair) for name, pair in pairs.items()}
    worst = min(ious, key=ious.__getitem__)
    caption = f"{way}, sun {worst} high; only the mesh's red, only the depth images' blue"
    panels = {caption: png_bytes(_panel(*pairs[worst]))}
    details = {f"sun {name}": iou for name, iou in ious.items()}
    goal = LEAST_IOU if way == ALONE else None
    return Row(
        subject=asset,
        name=f"IoU with the mesh's, {way}",
        measured=ious[worst],
        goal=goal,
        digits=4,
        details=details,
        pictures=panels,
    )


def _stage(sphere: Sphere) -> Scene:
    """Return a scene with the object at the origin over white ground, and another one that is never seen.

    Without the latter, shadow maps would be fitted to the object, whose bounds differ between representations.
    """
    shadows = {"enabled": True, "cascades": 1, "distance": REACH * sphere.radius, "resolution": 2048}
    settings = RenderSettings.model_validate({"shadows": shadows})
    below = sphere.centre[1] - (1 + RISE) * sphere.radius
    ground = {"colour": (1.0, 1.0, 1.0), "height": below, "half_size": 100 * sphere.radius}
    sun = {"colour": (1.0, 1.0, 1.0)}
    return one_asset_scene(
        settings,
        Environment.model_validate({"ground": ground, "sun": sun, "ambient": {"intensity": 0.0}}),
        (FAR * sphere.radius, 0, 0),
    )


def _grounds(headless: HeadlessRenderer, sphere: Sphere, sun: Direction) -> tuple[Ground, dict[str, Ground]]:
    """Return the ground below the mesh, and below its depth images for each of `WAYS`."""
    environment = headless.renderer.scene.environment
    environment.sun.direction = sun
    assert environment.ground is not None  # the stage has one
    centre, radius, ground = np.asarray(sphere.centre), sphere.radius, environment.ground.height
    below = centre + np.asarray(sun) * (ground - centre[1]) / sun[1]
    above = below + np.array([0, HEIGHT, 0.01]) * radius  # slightly to the side, so that "up" is defined
    camera = Camera(tuple(above.tolist()), tuple(below.tolist()), float(np.radians(FOV)))
    view = View(camera, headless.size, (HEIGHT - RISE - 2) * radius, (HEIGHT + 1) * radius)
    mesh = _ground(headless, view, ground, Representation.MESH)
    return mesh, {way: _ground(headless, view, ground, representation) for way, representation in WAYS.items()}


def _ground(headless: HeadlessRenderer, view: View, ground: float, representation: Representation | None) -> Ground:
    headless.renderer.world.representation = representation
    headless.draw(view, linear=True)
    image = headless.linear_image()
    height, width = image.distance.shape
    x, y = (np.arange(width) + 0.5) / width * 2 - 1, 1 - (np.arange(height) + 0.5) / height * 2
    up = (np.stack(np.broadcast_arrays(x[None], y[:, None], 1.0), -1) @ view.ray_from_screen.T)[..., 1]
    above = view.position[1] - ground
    with np.errstate(invalid="ignore"):  # the sky has no position
        shown = np.abs(above + image.distance * up) < LEVEL * above
    light = image.colour[..., :3].max(-1)
    return Ground(shown, shown & (light < np.median(light[shown]) / 2))


def _iou(mesh: Ground, images: Ground) -> float:
    """Return the intersection over union of two shadows where both pictures show the ground."""
    both = mesh.shown & images.shown
    return silhouette_iou(mesh.shadow & both, images.shadow & both)


def _panel(mesh: Ground, images: Ground) -> Picture:
    """Paint both shadows into one picture (H, W, 3)."""
    picture = np.empty((*mesh.shown.shape, 3), np.uint8)
    picture[...] = _OBJECT
    both = mesh.shown & images.shown
    for mask, colour in (
        (~mesh.shadow & ~images.shadow, _LIT),
        (mesh.shadow & images.shadow, _BOTH),
        (mesh.shadow & ~images.shadow, _MISSING),
        (~mesh.shadow & images.shadow, _EXTRA),
    ):
        picture[both & mask] = colour
    return picture
