"""The options that commands share, declared once, and what their text means."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from depthwalk.errors import InputError
from depthwalk.limits import (
    MAX_COORDINATE,
    MAX_DPCI_LAYERS,
    MAX_DPCI_PARTS,
    MAX_FOV,
    MAX_FRAMES,
    MAX_IMAGE_PIXELS,
    MAX_IMAGE_SIDE,
    MIN_FOV,
)

if TYPE_CHECKING:  # the scene package takes half a second to import, --help does not need it
    from depthwalk.bake.axis import Axis as BakeAxis
    from depthwalk.scene.arrays import Camera, Representation
    from depthwalk.scene.scene import Scene

Point = tuple[float, float, float]


class Method(StrEnum):
    """How depth images are made."""

    RAYCAST = "raycast"
    SIX_VIEW = "six-view"


class UpAxis(StrEnum):
    """A mesh file's upward axis."""

    Y = "y"
    Z = "z"


class RepresentationName(StrEnum):
    """How to draw what the assets allow it for; `scene` leaves it to the scene file."""

    SCENE = "scene"
    DPCI = "dpci"
    MESH = "mesh"
    MESH_LOD = "mesh-lod"
    DMESH = "dmesh"


SceneArgument = Annotated[Path, typer.Argument(metavar="SCENE", help="Scene file, or a mesh.", show_default=False)]
Resolution = Annotated[str, typer.Option("--resolution", metavar="W,H|WxH", help="Size of the picture in pixels.")]
CameraPosition = Annotated[
    str | None, typer.Option("--camera-position", metavar="X,Y,Z", help="Where the camera stands, metres.")
]
CameraTarget = Annotated[str | None, typer.Option("--camera-target", metavar="X,Y,Z", help="What it looks at, metres.")]
CameraAngle = Annotated[
    float | None, typer.Option("--camera-view-angle", metavar="DEG", help="Vertical angle of view, degrees.")
]
RepresentationOption = Annotated[
    RepresentationName, typer.Option("--representation", help="How to draw what the assets allow it for.")
]
PathOption = Annotated[Path | None, typer.Option("--path", metavar="P", help="Camera path file.", show_default=False)]
Frames = Annotated[int | None, typer.Option("--frames", metavar="N", min=1, max=MAX_FRAMES, help="Number of frames.")]
NoBackground = Annotated[bool, typer.Option("--no-background", help="Alpha 0 where nothing is.")]
AssetRoots = Annotated[
    list[Path] | None,
    typer.Option("--asset-root", metavar="DIR", help="Folder besides the scene's in which its files may lie."),
]
Settings = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="Replaces a value of the scene file: render.lod.bias=1."),
]
Layers = Annotated[
    str | None,
    typer.Option(
        "--layers",
        metavar="N|auto",
        help="Surfaces along each ray; auto: as many as hold what can be seen.",
        show_default="3, or as the scene says; 1 with six-view",
    ),
]
Parts = Annotated[
    str | None,
    typer.Option(
        "--parts",
        metavar="N|auto",
        help="Objects that share a mesh, at most; auto: as many as it takes.",
        show_default="1, or as the scene says",
    ),
]
Axis = Annotated[
    str | None,
    typer.Option(
        "--axis",
        metavar="x|y|z|X,Y,Z|auto",
        help="Axis of the cylinder; auto: the one whose images sample it best.",
        show_default="y, or as the scene says",
    ),
]
Height = Annotated[float | None, typer.Option("--height", metavar="M", help="Height to scale each mesh to, metres.")]
Texture = Annotated[Path | None, typer.Option("--texture", metavar="F", help="Texture in place of the files' own.")]
Fullscreen = Annotated[bool, typer.Option("--fullscreen", help="Use the whole screen.")]
Verbose = Annotated[bool, typer.Option("--verbose", help="Say what is done, show tracebacks.")]
Quiet = Annotated[bool, typer.Option("--quiet", help="Say nothing but errors.")]

DEFAULT_RESOLUTION = "1024,768"


@dataclass(frozen=True)
class CameraOptions:
    """What the --camera options ask for; None leaves a value as it is. angle: vertical, radians."""

    position: Point | None = None
    target: Point | None = None
    angle: float | None = None

    def apply(self, camera: "Camera") -> "Camera":
        """`camera` with the values asked for. Raises InputError where it would stand on its target."""
        position, target = self.position or camera.position, self.target or camera.target
        if self.given and position == target:
            raise InputError("--camera-target: must be elsewhere than the camera's position")
        return replace(camera, position=position, target=target, fov=self.angle or camera.fov)

    @property
    def given(self) -> bool:
        return self != CameraOptions()


def parse_camera(position: str | None, target: str | None, angle: float | None) -> CameraOptions:
    """The values of the --camera options. Raises InputError."""
    if angle is not None and not MIN_FOV <= angle <= MAX_FOV:
        raise InputError(f"--camera-view-angle {angle:g}: must be {MIN_FOV:g} to {MAX_FOV:g} degrees")
    return CameraOptions(
        _point("--camera-position", position),
        _point("--camera-target", target),
        None if angle is None else math.radians(angle),
    )


def check_camera_source(path: Path | None, camera: CameraOptions) -> None:
    """Raises InputError where both a camera path and the --camera options say where the camera is."""
    if path is not None and camera.given:
        raise InputError("--path: already says where the camera is; leave out the --camera options")


def parse_resolution(text: str) -> tuple[int, int]:
    """Width and height in pixels. Raises InputError."""
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
    """How many surfaces are sampled along each ray. Raises InputError."""
    return _auto_or_up_to(MAX_DPCI_LAYERS, "--layers", text)


def parse_parts(text: str | None) -> int | Literal["auto"] | None:
    """How many objects are to share a mesh. Raises InputError."""
    return _auto_or_up_to(MAX_DPCI_PARTS, "--parts", text)


def parse_axis(text: str | None) -> "BakeAxis | None":
    """The axis of a cylinder. Raises InputError."""
    if text is None or text in ("auto", "x", "y", "z"):
        return text  # type: ignore[return-value]
    try:
        x, y, z = (float(part) for part in text.split(","))
    except ValueError:
        raise InputError(f"--axis {text}: must be auto, x, y, z or X,Y,Z, a direction") from None
    if not (any((x, y, z)) and all(abs(value) <= MAX_COORDINATE for value in (x, y, z))):
        raise InputError(f"--axis {text}: not all may be 0, nor any beyond ±{MAX_COORDINATE:g}")
    return x, y, z


def parse_settings(settings: Sequence[str] | None) -> dict[str, str]:
    """The --set options as `load_scene` takes them. Raises InputError."""
    overrides = {}
    for text in settings or ():
        key, equals, value = text.partition("=")
        if not equals or not key:
            raise InputError(f"--set {text}: must be KEY=VALUE")
        overrides[key] = value
    return overrides


def refuse_reuse(settings: Sequence[str] | None) -> None:
    """Raises InputError where images are to be kept from frame to frame, in a command whose pictures must not depend on
    those before."""
    if any("reuse_error" in text for text in settings or ()):
        raise InputError("--set render.warp.reuse_error: only `view` and `bench` keep images from frame to frame")


def representation(name: RepresentationName) -> "Representation | None":
    """As `Renderer.representation` takes it: None leaves it to the scene."""
    from depthwalk.scene.arrays import Representation

    return None if name is RepresentationName.SCENE else Representation[name.name]


def open_scene(path: Path, asset_roots: Sequence[Path] | None, settings: Sequence[str] | None) -> "Scene":
    """Loads the scene file with the options laid over it. Raises InputError."""
    from depthwalk.scene.loader import load_scene

    return load_scene(path, asset_roots or (), parse_settings(settings))


def _auto_or_up_to(most: int, option: str, text: str | None) -> int | Literal["auto"] | None:
    if text is None or text == "auto":
        return text  # type: ignore[return-value]
    if not (text.isascii() and text.isdigit() and len(text) <= 2 and 1 <= int(text) <= most):
        raise InputError(f"{option} {text}: must be auto or a whole number from 1 to {most}")
    return int(text)


def _point(option: str, text: str | None) -> Point | None:
    if text is None:
        return None
    try:
        x, y, z = (float(part) for part in text.split(","))
    except ValueError:
        raise InputError(f"{option} {text}: must be X,Y,Z, three numbers of metres") from None
    if not all(abs(value) <= MAX_COORDINATE for value in (x, y, z)):  # also false for NaN
        raise InputError(f"{option} {text}: each coordinate must be within ±{MAX_COORDINATE:g} m")
    return x, y, z
