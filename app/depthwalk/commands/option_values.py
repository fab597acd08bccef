"""Parse the texts of the options that commands share.

The functions `parse_…` and `check_…` raise InputError, whose message begins with the option.
"""

import logging
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from depthwalk.commands.options import RepresentationName
from depthwalk.errors import InputError
from depthwalk.limits import (
    MAX_COORDINATE,
    MAX_DPCI_LAYERS,
    MAX_DPCI_PARTS,
    MAX_FOV,
    MAX_IMAGE_PIXELS,
    MAX_IMAGE_SIDE,
    MIN_FOV,
)

if TYPE_CHECKING:  # the scene package takes long to import, and few commands need all of it
    from depthwalk.bake.params import Axis as BakeAxis
    from depthwalk.scene.arrays import Camera, Representation
    from depthwalk.scene.camera import FrameAll
    from depthwalk.scene.scene import Scene

log = logging.getLogger(__name__)

Point = tuple[float, float, float]

_LIGHT_FILE = 1 << 20  # bytes: in any format, a mesh file of this size has some 35,000 triangles at most


@dataclass(frozen=True)
class CameraOptions:
    """Hold the changes to a camera in the --camera options; None leaves a value unchanged.

    Attributes
    ----------
    position, target
        Position of the camera, and a point that it looks at, metres, world.
    angle
        Vertical field of view, radians.
    direction
        Direction, world, in which the camera looks from where it sees all objects; given without the first two.
    """

    position: Point | None = None
    target: Point | None = None
    angle: float | None = None
    direction: Point | None = None

    def apply(self, camera: "Camera", frame_all: "FrameAll | None" = None) -> "Camera":
        """Return `camera` with these changes. Raises InputError if its target would be its position.

        `frame_all` returns a camera that sees all objects, for commands that have the option --camera-direction.
        """
        if self.direction is not None and frame_all is not None:
            return frame_all(self.angle or camera.fov, self.direction)
        position, target = self.position or camera.position, self.target or camera.target
        if self.given and position == target:
            raise InputError("--camera-target: must differ from the camera's position")
        return replace(camera, position=position, target=target, fov=self.angle or camera.fov)

    @property
    def given(self) -> bool:
        """Return whether any of the options is given."""
        return self != CameraOptions()


def parse_camera(
    position: str | None, target: str | None, angle: float | None, direction: str | None = None
) -> CameraOptions:
    """Parse the --camera options.

    Parameters
    ----------
    position
        The text "x,y,z", metres, world; None if the option is not given.
    target
        The text "x,y,z", metres, world; None if the option is not given.
    angle
        Vertical field of view, degrees; None if the option is not given.
    direction
        The text "x,y,z", a vector of any length, world; None if the option is not given.

    Returns
    -------
    CameraOptions
        The values, the angle in radians.

    Raises
    ------
    InputError
        If a text cannot be parsed or a value is out of range.
    """
    if angle is not None and not MIN_FOV <= angle <= MAX_FOV:
        raise InputError(f"--camera-view-angle {angle:g}: must be {MIN_FOV:g} to {MAX_FOV:g} degrees")
    along = _point("--camera-direction", direction)
    if along == (0, 0, 0):
        raise InputError(f"--camera-direction {direction}: must not be zero")
    if along is not None and (position or target):
        raise InputError("--camera-direction: places the camera; leave out --camera-position and --camera-target")
    return CameraOptions(
        direction=along,
        position=_point("--camera-position", position),
        target=_point("--camera-target", target),
        angle=None if angle is None else math.radians(angle),
    )


def check_camera_source(path: Path | None, camera: CameraOptions) -> None:
    """Raise InputError if both a camera `path` and one of the options in `camera` place the camera."""
    if path is not None and camera.given:
        raise InputError("--path: already places the camera; leave out the --camera options")


def parse_resolution(text: str) -> tuple[int, int]:
    """Return width and height, pixels, from a `text` such as "640,480" or "640x480".

    Raises InputError if the text is neither, or asks for too many pixels.
    """
    parts = text.replace("x", ",").split(",")
    if len(parts) != 2 or not all(part.strip().isascii() and part.strip().isdigit() for part in parts):
        raise InputError(f"--resolution {text}: must be W,H or WxH, whole numbers of pixels")
    if any(len(part) > 9 or not 1 <= int(part) <= MAX_IMAGE_SIDE for part in parts):
        raise InputError(f"--resolution {text}: each side must be 1 to {MAX_IMAGE_SIDE} pixels")
    width, height = int(parts[0]), int(parts[1])
    if width * height > MAX_IMAGE_PIXELS:
        raise InputError(f"--resolution {text}: {width * height} pixels, the limit is {MAX_IMAGE_PIXELS}")
    return width, height


def parse_layers(text: str | None) -> int | Literal["auto"] | None:
    """Return how many surfaces to sample along each ray, from the `text` of --layers; None if it is not given.

    "auto" means as many as can be seen. Raises InputError for values out of range.
    """
    return _auto_or_up_to(MAX_DPCI_LAYERS, "--layers", text)


def parse_parts(text: str | None) -> int | Literal["auto"] | None:
    """Return the most parts into which to divide a mesh, from the `text` of --parts; None if it is not given.

    "auto" leaves the number to the shape of the mesh. Raises InputError for values out of range.
    """
    return _auto_or_up_to(MAX_DPCI_PARTS, "--parts", text)


def parse_axis(text: str | None) -> "BakeAxis | None":
    """Return the axis of an object's cylinder, asset frame, from the `text` of --axis; None if it is not given.

    It is a letter, a direction of any length, or "auto". Raises InputError for other texts.
    """
    if text is None or text in ("auto", "x", "y", "z"):
        return text  # type: ignore[return-value]  # mypy does not narrow a string to its literals
    try:
        x, y, z = (float(part) for part in text.split(","))
    except ValueError:
        raise InputError(f"--axis {text}: must be auto, x, y, z, or a direction X,Y,Z") from None
    if not (any((x, y, z)) and all(abs(value) <= MAX_COORDINATE for value in (x, y, z))):
        raise InputError(f"--axis {text}: must not be all 0, and each must be within ±{MAX_COORDINATE:g}")
    return x, y, z


def parse_settings(settings: Sequence[str] | None) -> dict[str, str]:
    """Return the --set options in the form for `load_scene`: YAML texts by dotted key; empty for None.

    Raises InputError if an option is not of the form KEY=VALUE.
    """
    overrides = {}
    for text in settings or ():
        key, equals, value = text.partition("=")
        if not equals or not key:
            raise InputError(f"--set {text}: must be KEY=VALUE")
        overrides[key] = value
    return overrides


def refuse_reuse(settings: Sequence[str] | None) -> None:
    """Raise InputError if the --set options `settings` set `reuse_error`; None stands for no options.

    Commands that call this draw every picture from scratch, so that none depends on the pictures before it.
    """
    if any("reuse_error" in text for text in settings or ()):
        raise InputError("--set render.warp.reuse_error: only `view` and `bench` reuse impostors of earlier frames")


def representation(name: RepresentationName) -> "Representation | None":
    """Return the representation `name`; None, for `scene`, leaves the choice to the scene file."""
    from depthwalk.scene.arrays import Representation

    return None if name is RepresentationName.SCENE else Representation[name.name]


def open_scene(
    path: Path, asset_roots: Sequence[Path] | None, settings: Sequence[str] | None, sky: Path | None = None
) -> "Scene":
    """Load a scene for a command.

    Parameters
    ----------
    path
        The scene file, or a mesh.
    asset_roots
        Folders, besides the scene's own, in which to look for its files; None for none.
    settings
        The --set options; None for none.
    sky
        The picture of the option --sky; None leaves the scene's sky.

    Returns
    -------
    Scene
        The scene, with the options applied.

    Raises
    ------
    InputError
        If the scene or an option cannot be used.
    """
    from depthwalk.scene.loader import load_scene

    return load_scene(path, asset_roots or (), parse_settings(settings), sky)


def warn_if_empty(scene: "Scene") -> None:
    """Warn of a scene without objects, which is rather a mistake than a picture of sky and ground."""
    if not len(scene.objects):
        log.warning("%s: has no objects; only its sky and ground are drawn", scene.path)


def still_representation(
    name: RepresentationName, files: Sequence[Path], settings: Sequence[str] | None
) -> "Representation | None":
    """Return the representation for a single picture: that of the scene, but polygons for meshes without a scene.

    Baking such a mesh takes as long as drawing its polygons a hundred times, and one picture does not repay that. Its
    depth images are baked and drawn if --representation asks for them, or --set changes them or the object.
    """
    from depthwalk.scene.arrays import Representation

    if name is RepresentationName.SCENE and all(_is_plain_mesh(file, settings) for file in files):
        return Representation.MESH
    return representation(name)


def open_files(
    files: Sequence[Path],
    asset_roots: Sequence[Path] | None,
    settings: Sequence[str] | None,
    *,
    sky: Path | None = None,
    side_by_side: bool = False,
    texture: Path | None = None,
) -> "Scene":
    """Load a scene, or several models, as `open_scene` does; the last two: see `scene.models.load_files`."""
    from depthwalk.scene.models import load_files

    overrides = parse_settings(settings)
    return load_files(files, asset_roots or (), overrides, sky, side_by_side=side_by_side, texture=texture)


def show_light_meshes(scene: "Scene", settings: Sequence[str] | None) -> "Scene":
    """Draw light meshes that a window shows without a scene file by their polygons; return the `scene`.

    Two cores draw the triangles of one in a few milliseconds and would bake its depth images for up to a minute. They
    are baked if the user asks for them, in the window or by --representation, or if --set changes them or the object.
    """
    from depthwalk.scene.arrays import Representation

    for number, file in enumerate(scene.files):
        if _is_plain_mesh(file, settings) and file.stat().st_size <= _LIGHT_FILE:
            scene.objects.representation[number] = Representation.MESH
    return scene


def _is_plain_mesh(file: Path, settings: Sequence[str] | None) -> bool:
    """Return whether a file is a mesh, and no --set option changes its depth images or the object that shows it."""
    from depthwalk.ingest.formats import MESH_SUFFIXES

    asked = any(re.match(r"objects|assets\.[^.=]+\.dpci", setting) for setting in settings or ())
    return file.suffix.lower() in MESH_SUFFIXES and not asked


def _auto_or_up_to(most: int, option: str, text: str | None) -> int | Literal["auto"] | None:
    if text is None or text == "auto":
        return text  # type: ignore[return-value]  # mypy does not narrow a string to its literals
    if not (text.isascii() and text.isdigit() and len(text) <= 2 and 1 <= int(text) <= most):
        raise InputError(f"{option} {text}: must be auto or a whole number from 1 to {most}")
    return int(text)


def _point(option: str, text: str | None) -> Point | None:
    if text is None:
        return None
    try:
        x, y, z = (float(part) for part in text.split(","))
    except ValueError:
        unit = "" if option == "--camera-direction" else " in metres"
        raise InputError(f"{option} {text}: must be X,Y,Z, three numbers{unit}") from None
    if not all(abs(value) <= MAX_COORDINATE for value in (x, y, z)):  # false for NaN, too
        raise InputError(f"{option} {text}: each coordinate must be within ±{MAX_COORDINATE:g} m")
    return x, y, z
