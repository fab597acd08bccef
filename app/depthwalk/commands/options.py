"""Declare the options that commands share, once each, and parse their texts.

The functions `parse_…` and `check_…` raise InputError, whose message begins with the option.
"""

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

if TYPE_CHECKING:  # the scene package takes long to import, and few commands need all of it
    from depthwalk.bake.params import Axis as BakeAxis
    from depthwalk.scene.arrays import Camera, Representation
    from depthwalk.scene.scene import Scene

Point = tuple[float, float, float]


class Method(StrEnum):
    """Name the ways in which a mesh is sampled by depth images, which the option --method chooses from."""

    RAYCAST = "raycast"
    SIX_VIEW = "six-view"
    PAPER = "paper"


class CoordinatesName(StrEnum):
    """Name when texels get texture coordinates, which the option --coordinates chooses from."""

    AUTO = "auto"
    NEVER = "never"


class UpAxis(StrEnum):
    """Name the axes of a mesh file that may point upward."""

    Y = "y"
    Z = "z"


class RepresentationName(StrEnum):
    """Name the ways to draw every object whose asset allows it; `scene` leaves the choice to the scene file.

    `dpci` draws impostors, `dmesh` depth samples that are warped straight to the screen, `mesh` full meshes,
    `mesh-lod` meshes with levels of detail, and `mesh-clusters` meshes of which each patch has levels of its own.
    `octahedral` and `billboard` draw pictures of meshes. `auto` chooses between
    `mesh` and `dpci` for each object. The others draw reliefs as height fields.
    """

    SCENE = "scene"
    DPCI = "dpci"
    MESH = "mesh"
    MESH_LOD = "mesh-lod"
    MESH_CLUSTERS = "mesh-clusters"
    DMESH = "dmesh"
    RELIEF = "relief"
    DISTANCE = "distance"
    PARALLAX = "parallax"
    BUMP = "bump"
    DISPLACEMENT = "displacement"
    RELIEF_TEXTURE = "relief-texture"
    OCTAHEDRAL = "octahedral"
    BILLBOARD = "billboard"
    AUTO = "auto"


SceneArgument = Annotated[Path, typer.Argument(metavar="SCENE", help="Scene file or mesh.", show_default=False)]
Resolution = Annotated[
    str, typer.Option("--resolution", metavar="W,H|WxH", help="Width and height of the picture, pixels.")
]
CameraPosition = Annotated[
    str | None, typer.Option("--camera-position", metavar="X,Y,Z", help="Position of the camera, metres.")
]
CameraTarget = Annotated[
    str | None, typer.Option("--camera-target", metavar="X,Y,Z", help="Point that the camera looks at, metres.")
]
CameraAngle = Annotated[
    float | None, typer.Option("--camera-view-angle", metavar="DEG", help="Vertical angle of view, degrees.")
]
RepresentationOption = Annotated[
    RepresentationName,
    typer.Option(
        "--representation",
        metavar="NAME",
        help="Draw all that can be drawn so as dpci (depth images), mesh, mesh-lod, mesh-clusters, dmesh, octahedral "
        "or billboard; reliefs also as relief, distance, parallax, bump, displacement or relief-texture; auto: mesh "
        "or dpci, whichever is quicker; scene: as the scene file says.",
    ),
]
PathOption = Annotated[
    Path | None, typer.Option("--path", metavar="FILE", help="Camera path file.", show_default=False)
]
Frames = Annotated[
    int | None,
    typer.Option("--frames", metavar="N", min=1, max=MAX_FRAMES, help="Number of frames; all of the path if left out."),
]
NoBackground = Annotated[bool, typer.Option("--no-background", help="Leave the background transparent (alpha 0).")]
AssetRoots = Annotated[
    list[Path] | None,
    typer.Option(
        "--asset-root", metavar="DIR", help="Folder, besides the scene's, in which its files may lie; repeatable."
    ),
]
Settings = Annotated[
    list[str] | None,
    typer.Option(
        "--set", metavar="KEY=VALUE", help="Replace a value of the scene file, as in render.lod.bias=1; repeatable."
    ),
]
Layers = Annotated[
    str | None,
    typer.Option(
        "--layers",
        metavar="N|auto",
        help="Surfaces sampled along each ray; auto: as many as a viewer can see.",
        show_default="3, or as the scene says; 1 with six-view and paper",
    ),
]
Parts = Annotated[
    str | None,
    typer.Option(
        "--parts",
        metavar="N|auto",
        help="Cylinders among which a mesh is divided, at most; auto: chosen by its shape.",
        show_default="1, or as the scene says",
    ),
]
Axis = Annotated[
    str | None,
    typer.Option(
        "--axis",
        metavar="x|y|z|X,Y,Z|auto",
        help="Axis of the cylinder; auto: the one whose images sample the mesh best.",
        show_default="y, or as the scene says",
    ),
]
Coordinates = Annotated[
    CoordinatesName | None,
    typer.Option(
        "--coordinates",
        help="Whether texels hold texture coordinates, so that textures stay sharp; auto: where a texture is finer "
        "than the depth images.",
        show_default="auto, or as the scene says",
    ),
]
Height = Annotated[float | None, typer.Option("--height", metavar="M", help="Scale each mesh to this height, metres.")]
Texture = Annotated[
    Path | None, typer.Option("--texture", metavar="FILE", help="Texture that replaces those of the files.")
]
JsonReport = Annotated[Path | None, typer.Option(metavar="FILE", help="Write the report to this file, as JSON.")]
HtmlReport = Annotated[
    Path | None, typer.Option(metavar="FILE", help="Write the report to this file, as a page with pictures.")
]
CacheLimit = Annotated[
    str | None,
    typer.Option(
        "--cache-limit",
        metavar="SIZE",
        help="Most that the cache of depth images may hold, such as 500MB; DEPTHWALK_CACHE_LIMIT says it for good.",
        show_default="4GiB",
    ),
]
Fullscreen = Annotated[bool, typer.Option("--fullscreen", help="Use the whole screen.")]
ClusterOption = Annotated[
    str | None,
    typer.Option(
        "--cluster",
        metavar="local[:N]|tls://HOST:PORT",
        help="Use a Dask cluster: N processes of this machine, or the workers of a scheduler.",
        show_default="this process and its pool",
    ),
]
Verbose = Annotated[bool, typer.Option("--verbose", help="Report every step; show tracebacks.")]
Quiet = Annotated[bool, typer.Option("--quiet", help="Print errors only.")]

DEFAULT_RESOLUTION = "1024,768"


@dataclass(frozen=True)
class CameraOptions:
    """Hold the changes to a camera that the --camera options ask for; None leaves a value as it is.

    Attributes
    ----------
    position, target
        Where the camera stands, and a point that it looks at, metres, world.
    angle
        Vertical angle of view, radians.
    """

    position: Point | None = None
    target: Point | None = None
    angle: float | None = None

    def apply(self, camera: "Camera") -> "Camera":
        """Return `camera` with these changes. Raises InputError where it would stand at its own target."""
        position, target = self.position or camera.position, self.target or camera.target
        if self.given and position == target:
            raise InputError("--camera-target: must be elsewhere than the camera's position")
        return replace(camera, position=position, target=target, fov=self.angle or camera.fov)

    @property
    def given(self) -> bool:
        """Return whether any of the options is given."""
        return self != CameraOptions()


def parse_camera(position: str | None, target: str | None, angle: float | None) -> CameraOptions:
    """Read the --camera options.

    Parameters
    ----------
    position
        The text "x,y,z", metres, world; None where the option is not given.
    target
        The text "x,y,z", metres, world; None where the option is not given.
    angle
        Vertical angle of view, degrees; None where the option is not given.

    Returns
    -------
    CameraOptions
        The values, the angle in radians.

    Raises
    ------
    InputError
        Where a text cannot be read or a value is out of range.
    """
    if angle is not None and not MIN_FOV <= angle <= MAX_FOV:
        raise InputError(f"--camera-view-angle {angle:g}: must be {MIN_FOV:g} to {MAX_FOV:g} degrees")
    return CameraOptions(
        position=_point("--camera-position", position),
        target=_point("--camera-target", target),
        angle=None if angle is None else math.radians(angle),
    )


def check_camera_source(path: Path | None, camera: CameraOptions) -> None:
    """Raise InputError where both a camera `path` and one of the options in `camera` say where the camera is."""
    if path is not None and camera.given:
        raise InputError("--path: already says where the camera is; leave out the --camera options")


def parse_resolution(text: str) -> tuple[int, int]:
    """Return width and height, pixels, from a `text` such as "640,480" or "640x480".

    Raises InputError where the text is none of these, or asks for too many pixels.
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
    """Return how many surfaces are sampled along each ray, from the `text` of --layers; None where it is not given.

    "auto" stands for as many as a viewer can see. Raises InputError for values out of range.
    """
    return _auto_or_up_to(MAX_DPCI_LAYERS, "--layers", text)


def parse_parts(text: str | None) -> int | Literal["auto"] | None:
    """Return among how many cylinders a mesh is divided at most, from the `text` of --parts; None where none is given.

    "auto" leaves the number to the shape of the mesh. Raises InputError for values out of range.
    """
    return _auto_or_up_to(MAX_DPCI_PARTS, "--parts", text)


def parse_axis(text: str | None) -> "BakeAxis | None":
    """Return the axis of an object's cylinder, asset frame, from the `text` of --axis; None where it is not given.

    It is a letter, a direction of any length, or "auto". Raises InputError for other texts.
    """
    if text is None or text in ("auto", "x", "y", "z"):
        return text  # type: ignore[return-value]  # a text is not narrowed to its literals
    try:
        x, y, z = (float(part) for part in text.split(","))
    except ValueError:
        raise InputError(f"--axis {text}: must be auto, x, y, z or X,Y,Z, a direction") from None
    if not (any((x, y, z)) and all(abs(value) <= MAX_COORDINATE for value in (x, y, z))):
        raise InputError(f"--axis {text}: not all may be 0, nor any beyond ±{MAX_COORDINATE:g}")
    return x, y, z


def parse_settings(settings: Sequence[str] | None) -> dict[str, str]:
    """Return the --set options `settings` as `load_scene` takes them: YAML texts by dotted key; none for None.

    Raises InputError where an option is not of the form KEY=VALUE.
    """
    overrides = {}
    for text in settings or ():
        key, equals, value = text.partition("=")
        if not equals or not key:
            raise InputError(f"--set {text}: must be KEY=VALUE")
        overrides[key] = value
    return overrides


def refuse_reuse(settings: Sequence[str] | None) -> None:
    """Raise InputError where the options --set, `settings`, set `reuse_error`; None stands for no options.

    A command that refuses this draws every picture from scratch, so that none depends on the pictures before it.
    """
    if any("reuse_error" in text for text in settings or ()):
        raise InputError("--set render.warp.reuse_error: only `view` and `bench` reuse impostors of earlier frames")


def representation(name: RepresentationName) -> "Representation | None":
    """Return the representation called `name`; None, for `scene`, leaves the choice to the scene file."""
    from depthwalk.scene.arrays import Representation

    return None if name is RepresentationName.SCENE else Representation[name.name]


def open_scene(path: Path, asset_roots: Sequence[Path] | None, settings: Sequence[str] | None) -> "Scene":
    """Load a scene for a command.

    Parameters
    ----------
    path
        The scene file, or a mesh.
    asset_roots
        Folders besides the scene's own in which its files may lie; None for none.
    settings
        The --set options; None for none.

    Returns
    -------
    Scene
        The scene, with the options applied.

    Raises
    ------
    InputError
        Where the scene or an option cannot be used.
    """
    from depthwalk.scene.loader import load_scene

    return load_scene(path, asset_roots or (), parse_settings(settings))


def _auto_or_up_to(most: int, option: str, text: str | None) -> int | Literal["auto"] | None:
    if text is None or text == "auto":
        return text  # type: ignore[return-value]  # a text is not narrowed to its literals
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
    if not all(abs(value) <= MAX_COORDINATE for value in (x, y, z)):  # false for NaN, too
        raise InputError(f"{option} {text}: each coordinate must be within ±{MAX_COORDINATE:g} m")
    return x, y, z
