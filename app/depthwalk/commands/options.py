"""Declare the options that commands share, once each; `option_values` parses their texts."""

import os
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from depthwalk.errors import InputError, suggest_file
from depthwalk.limits import (
    MAX_DPCI_RESOLUTION,
    MAX_FRAMES,
    MIN_DPCI_RESOLUTION,
)
from depthwalk.resources import given_or_shipped, shipped_places


class Method(StrEnum):
    """Name the ways to sample a mesh, for the option --method."""

    RAYCAST = "raycast"
    SIX_VIEW = "six-view"
    PAPER = "paper"


class CoordinatesName(StrEnum):
    """Name when texels get texture coordinates, for the option --coordinates."""

    AUTO = "auto"
    NEVER = "never"


class UpAxis(StrEnum):
    """Name the axes of a mesh file that may point upward."""

    Y = "y"
    Z = "z"


class RepresentationName(StrEnum):
    """Name the ways to draw every object whose asset allows it; `scene` leaves the choice to the scene file.

    `dpci` draws impostors, `dmesh` depth samples that are warped straight to the screen, `mesh` full meshes,
    `mesh-lod` meshes with levels of detail, and `mesh-clusters` meshes whose patches have levels of their own.
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
    BAR_TEXTURE = "bar-texture"
    OCTAHEDRAL = "octahedral"
    BILLBOARD = "billboard"
    AUTO = "auto"


def named_file(path: Path | None) -> Path | None:
    """Return the file that the user names, which may be a shipped one; None if none is named. Raises like `_found`."""
    return None if path is None else _found(path)


def named_files(paths: list[Path] | None) -> list[Path]:
    """Return the files that the user names, some of which may be shipped ones. Raises like `_found`."""
    return [_found(path) for path in paths or []]


def _found(path: Path) -> Path:
    """Return the file at `path`, or the shipped one of this name; `path` if neither exists.

    Raises InputError if neither exists and only a shipped one is spelt much like it. Other missing files are reported
    by their readers.
    """
    found = given_or_shipped(path)
    if not os.path.exists(found) and not suggest_file(found):
        for hint in filter(None, map(suggest_file, shipped_places(path))):
            raise InputError(f"{path}: no such file{hint}")
    return found


def own_file(path: Path, option: str) -> Path:
    """Return the file that the user names, beside which the command will write.

    Raises InputError if it is a folder without a name, "." or "..", or if only a shipped file has this name; `option`
    is the option that names another place.
    """
    if path.name in ("", ".."):  # nothing can be written beside it; what else is wrong is told with all other files
        raise InputError(f"{path}: is a folder")
    if (found := given_or_shipped(path)) != path:
        raise InputError(f"{path}: ships with the program; choose a place to write to with {option}")
    return found


SideBySide = Annotated[
    bool,
    typer.Option("--side-by-side", help="Put several meshes in a row, instead of at the coordinates of their files."),
]
SceneArgument = Annotated[Path, typer.Argument(metavar="SCENE", help="Scene file or mesh.", show_default=False)]
Resolution = Annotated[
    str, typer.Option("--resolution", metavar="W,H|WxH", help="Width and height of the picture, pixels.")
]
WindowResolution = Annotated[
    str | None,
    typer.Option(
        "--resolution",
        metavar="W,H|WxH",
        help="Width and height of the window, pixels.",
        show_default="1024,768, more on a dense screen, less on a small one",
    ),
]
CameraPosition = Annotated[
    str | None, typer.Option("--camera-position", metavar="X,Y,Z", help="Position of the camera, metres.")
]
CameraTarget = Annotated[
    str | None, typer.Option("--camera-target", metavar="X,Y,Z", help="Point that the camera looks at, metres.")
]
CameraDirection = Annotated[
    str | None,
    typer.Option("--camera-direction", metavar="X,Y,Z", help="Look in this direction, from where all objects show."),
]
CameraAngle = Annotated[
    float | None, typer.Option("--camera-view-angle", metavar="DEG", help="Vertical field of view, degrees.")
]
Moment = Annotated[
    float,
    typer.Option(
        "--time", metavar="SECONDS", help="Show the scene's animations at this moment; a turntable begins there."
    ),
]
RepresentationOption = Annotated[
    RepresentationName,
    typer.Option(
        "--representation",
        metavar="NAME",
        help="How to draw every object that can be drawn so: dpci (depth images), mesh, mesh-lod, mesh-clusters, "
        "dmesh, octahedral or billboard; reliefs also relief, distance, parallax, bump, displacement, "
        "relief-texture or bar-texture; auto: mesh or dpci, whichever is quicker; scene: as the scene file says.",
    ),
]
PathOption = Annotated[
    Path | None,
    typer.Option("--path", metavar="FILE", help="Camera path file.", show_default=False, callback=named_file),
]
Frames = Annotated[
    int | None,
    typer.Option("--frames", metavar="N", min=1, max=MAX_FRAMES, help="Number of frames; by default the whole path."),
]
NoBackground = Annotated[bool, typer.Option("--no-background", help="Leave the background transparent (alpha 0).")]
AssetRoots = Annotated[
    list[Path] | None,
    typer.Option(
        "--asset-root", metavar="DIR", help="Additional folder in which to look for the scene's files; repeatable."
    ),
]
Sky = Annotated[
    Path | None,
    typer.Option(
        "--sky",
        metavar="IMAGE",
        help="Show and light the scene by this picture of all directions: equirectangular .hdr, .exr, .jpg or .png.",
        show_default=False,
    ),
]
Settings = Annotated[
    list[str] | None,
    typer.Option(
        "--set", metavar="KEY=VALUE", help="Replace a value of the scene file, as in render.lod.bias=1; repeatable."
    ),
]
Meshes = Annotated[
    list[Path],
    typer.Argument(metavar="MESH", help="OBJ, PLY, STL, OFF, GLB, glTF, FBX, DAE, 3DS, 3MF, USD, LAS or LAZ files."),
]
Up = Annotated[UpAxis, typer.Option("--up", help="The axis that points upward in the files.")]
DpciResolution = Annotated[
    int,
    typer.Option(
        "--dpci-resolution",
        metavar="N",
        min=MIN_DPCI_RESOLUTION,
        max=MAX_DPCI_RESOLUTION,
        help="Width and height of a depth image, texels.",
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
        help="Maximum number of parts into which to divide a mesh; auto: depends on its shape.",
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
    Path | None, typer.Option(metavar="FILE", help="Write the report to this file, as an HTML page with pictures.")
]
CacheLimit = Annotated[
    str | None,
    typer.Option(
        "--cache-limit",
        metavar="SIZE",
        help="Maximum size of the cache of depth images, such as 500MB; DEPTHWALK_CACHE_LIMIT sets it permanently.",
        show_default="4GiB",
    ),
]
Fullscreen = Annotated[bool, typer.Option("--fullscreen", help="Use the whole screen.")]
ClusterOption = Annotated[
    str | None,
    typer.Option(
        "--cluster",
        metavar="local[:N]|tls://HOST:PORT",
        help="Use a Dask cluster: N processes on this machine, or the workers of a scheduler.",
        show_default="this process and its pool",
    ),
]
Verbose = Annotated[bool, typer.Option("--verbose", "-v", help="Report every step; show tracebacks.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Print errors only.")]

DEFAULT_RESOLUTION = "1024,768"
