"""Declare `depthwalk info`, which prints versions and limits of this installation, or describes a file.

Readers are imported by the rows that need them, so that a mesh is described without the graphics libraries.
"""

import platform
from collections.abc import Iterable, Iterator, Sequence
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np
import typer

import depthwalk
from depthwalk import limits
from depthwalk.commands.exit_codes import BAD_INPUT
from depthwalk.commands.failures import tell_mistakes
from depthwalk.commands.mesh_info import TO_SEE_EVERY, largest, mesh_rows
from depthwalk.commands.options import Quiet, Verbose, named_files
from depthwalk.commands.program import guarded
from depthwalk.errors import InputError, counted, printable
from depthwalk.ingest.formats import content

if TYPE_CHECKING:
    from depthwalk.bake.images import BakedObject
    from depthwalk.scene.scene import Asset

_LIBRARIES = (
    "numpy", "scipy", "moderngl", "moderngl-window", "imgui-bundle", "trimesh", "embreex", "OpenEXR", "Pillow",
    "pydantic", "PyYAML", "imageio-ffmpeg", "rich", "typer",
)  # fmt: skip
Row = tuple[str, str]


@guarded
def main(
    files: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="FILE", help="Scenes, camera paths, baked files or meshes to describe.", callback=named_files
        ),
    ] = None,
    verbose: Verbose = False,
    quiet: Quiet = False,
) -> None:
    """Show versions, the OpenGL renderer and limits, or what files hold."""
    if not files:
        _print(installation())
    is_bad = has_printed = False
    for file in files or []:
        try:
            rows = list(describe_file(file, every=verbose))  # all first, so that an error prints no half table
        except InputError as error:
            is_bad = True
            tell_mistakes(error)
            continue
        if has_printed:
            print()
        _print(rows)
        has_printed = True
    if is_bad:
        raise typer.Exit(BAD_INPUT)


def _print(rows: Iterable[Row]) -> None:
    print("\n".join(printable(f"{name:<24} {value}") for name, value in rows))


def installation() -> Iterator[Row]:
    """Describe this installation: versions, the GL renderer with its limits, and the limits of inputs.

    Yields
    ------
    Row
        A name and a text.
    """
    yield "depthwalk", depthwalk.__version__
    yield "Python", f"{platform.python_version()} on {platform.platform()}"
    for name in _LIBRARIES:
        yield name, _version(name)
    yield from _opengl()
    yield "largest picture", f"{limits.MAX_IMAGE_SIDE} pixels a side, {limits.MAX_IMAGE_PIXELS} in all"
    yield "largest depth image", f"{limits.MAX_DPCI_RESOLUTION} texels a side, {limits.MAX_DPCI_LAYERS} layers"
    yield "most objects", str(limits.MAX_INSTANCES)
    yield "most triangles", f"{limits.MAX_MESH_TRIANGLES} a mesh"


def describe_file(path: Path, *, every: bool = False) -> Iterator[Row]:
    """Describe the contents of a scene, camera path, baked file or mesh.

    Parameters
    ----------
    path
        The file, whose suffix determines its kind.
    every
        Whether to describe every material of a mesh and every asset of a scene; otherwise at most the 20 with the most
        triangles, and how many others there are.

    Yields
    ------
    Row
        A name and a text.

    Raises
    ------
    InputError
        If the file cannot be read.
    """
    yield "file", str(path)
    match path.suffix.lower():
        case ".yaml" | ".yml":
            from depthwalk.scene.path import is_path_file

            yield from _path_rows(path) if is_path_file(path) else _scene_rows(path, every)
        case ".exr":
            yield from _baked_rows(path)
        case ".npz":
            yield from _cooked_rows(path)
        case _ if path.is_file() and (known := content(path)):
            raise InputError(f"{path}: {known[0]}; {known[1]}")
        case _:
            yield from mesh_rows(path, every)


def _version(name: str) -> str:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return "not installed"


def _opengl() -> Iterator[Row]:
    from depthwalk.gpu.failures import GpuError
    from depthwalk.gpu.headless_device import headless_device

    try:
        device = headless_device()
    except GpuError as error:
        yield "OpenGL", str(error)
        return
    try:
        yield "OpenGL renderer", device.renderer + (" (software)" if device.software else "")
        yield "OpenGL version", device.driver
        yield "largest texture", f"{device.limits.edge} texels a side, {device.limits.layers} layers"
        conservative = "GL_ARB_conservative_depth" in device.context.extensions
        yield "conservative depth", "yes" if conservative else "no"
        yield "reports a lost context", "yes" if device.notices_loss else "no"
    finally:
        device.context.release()


def _scene_rows(path: Path, every: bool) -> Iterator[Row]:
    from depthwalk.commands.reports import own_file
    from depthwalk.scene.arrays import Representation
    from depthwalk.scene.loader import load_scene
    from depthwalk.scene.scene import told_at

    scene = load_scene(path)
    yield "kind", "scene"
    yield "objects", str(len(scene.objects))
    drawn = np.bincount(scene.objects.representation, minlength=max(Representation) + 1)
    yield "drawn as", ", ".join(f"{kind.label} {drawn[kind]}" for kind in Representation if drawn[kind]) or "-"
    uses = np.bincount(scene.objects.asset, minlength=len(scene.assets))
    made_of = []
    for asset in scene.assets:
        with told_at(asset):
            made_of.append(_made_of(asset))
    totals = {kind: int(uses @ [number * (own == kind) for number, own in made_of]) for kind in ("triangle", "point")}
    if any(totals.values()):
        yield "made of", " and ".join(counted(total, kind) for kind, total in totals.items() if total)
    drawn_of = [count * own for count, (own, _) in zip(uses.tolist(), made_of, strict=True)]
    shown = largest(drawn_of, every)
    for number in shown:
        asset, count, (most, kind) = scene.assets[number], int(uses[number]), made_of[number]
        of_each = f" of {counted(most, kind)}" if most else ""
        yield f"asset {asset.name}", f"{own_file(asset).name}, {counted(count, 'object')}{of_each}"
    if others := len(drawn_of) - len(shown):
        yield "other assets", f"{others}, {counted(int(uses.sum() - uses[shown].sum()), 'object')}; {TO_SEE_EVERY}"
    if scene.camera is not None:
        yield "camera", f"{_point(scene.camera.position)} to {_point(scene.camera.target)}"


def _made_of(asset: "Asset") -> tuple[int, str]:
    """Return how many triangles or, in a scan, points the mesh of an asset has, and which.

    The number is 0 if it was not made from a mesh, or its file does not say.
    """
    from depthwalk.bake.header import inspect_header
    from depthwalk.cook.cooked_file import read_cooked
    from depthwalk.ingest.formats import is_cooked_file
    from depthwalk.ingest.loader import mesh_of
    from depthwalk.ingest.point_cloud import PointCloud, shown_points
    from depthwalk.ingest.reader import read_geometry
    from depthwalk.scene.scene import BakedAsset, DepthImageAsset, MeshAsset

    match asset:
        case DepthImageAsset():
            return 0, "triangle"
        case BakedAsset() if is_cooked_file(asset.baked):
            return read_cooked(asset.baked)[0].outline.mesh_triangles or 0, "triangle"
        case BakedAsset():
            return inspect_header(asset.baked)[1][0].mesh_triangles or 0, "triangle"
        case MeshAsset():
            geometry = read_geometry(asset.mesh)
            if isinstance(geometry, PointCloud):
                return len(shown_points(geometry, asset.mesh)), "point"
            return len(mesh_of(geometry, asset.mesh).faces), "triangle"


def _path_rows(path: Path) -> Iterator[Row]:
    from depthwalk.scene.path import load_path

    walk = load_path(path)
    yield "kind", "camera path"
    yield "keyframes", str(len(walk.times))
    yield "frames", f"{len(walk.frames())} at {walk.fps:g} a second, {walk.interpolation}"
    yield "duration", f"{walk.times[-1]:g} s"


def _baked_rows(path: Path) -> Iterator[Row]:
    from depthwalk.bake.file import read_baked

    model = read_baked(path)
    yield "kind", "depth images"
    yield "bytes", str(path.stat().st_size)
    yield "key", model.key or "-"
    yield from _left_out_row(model.left_out)
    yield from _made_of_row(model.parts[0].mesh_triangles)
    if len(model.parts) > 1:
        yield "parts", str(len(model.parts))
    for number, baked in enumerate(model.parts, 1):
        yield from _object_rows(baked, f"part{number}." if len(model.parts) > 1 else "")


def _cooked_rows(path: Path) -> Iterator[Row]:
    from depthwalk.cook.cases import PIECES
    from depthwalk.cook.cooked_file import cooked_key, cooked_left_out, read_cooked

    objects = read_cooked(path)
    yield "kind", "cooked depth images"
    yield "bytes", str(path.stat().st_size)
    yield "key", cooked_key(path) or "-"
    yield from _left_out_row(cooked_left_out(path))
    yield from _made_of_row(objects[0].outline.mesh_triangles)
    yield "on the GPU", f"{sum(cooked.bytes for cooked in objects) / 1e6:.1f} MB"
    for number, cooked in enumerate(objects, 1):
        prefix = f"part{number}." if len(objects) > 1 else ""
        cylinder, triangles = cooked.outline.cylinder, cooked.count[:, :PIECES].sum(-1) // 3
        yield (
            f"{prefix}cylinder",
            f"radius {cylinder.radius:.6g} m, y from {cylinder.bottom:.6g} to {cylinder.top:.6g} m",
        )
        yield f"{prefix}images", ", ".join(f"{image.name} {image.depth.shape[1]}²" for image in cooked.outline.images)
        yield f"{prefix}triangles", " ".join(map(str, triangles.tolist()))


def _left_out_row(left_out: float | None) -> Iterator[Row]:
    """Yield the part of the visible surface that no image holds, if the file records it."""
    if left_out is not None:
        yield "left out", f"{100 * left_out:.2f} % of the visible surface"


def _made_of_row(triangles: int | None) -> Iterator[Row]:
    """Yield the number of triangles of the mesh, if the file records it."""
    if triangles is not None:
        yield "made of", counted(triangles, "triangle")


def _object_rows(baked: "BakedObject", prefix: str) -> Iterator[Row]:
    """Yield rows about one object of a baked file; `prefix` begins the names of its images there."""
    from depthwalk.geometry.quaternions import rotate

    cylinder, axis = baked.cylinder, rotate(np.array(baked.rotation), np.array([0.0, 1.0, 0.0]))
    yield (
        f"{prefix}cylinder",
        (
            f"radius {cylinder.radius:g} m, y from {cylinder.bottom:g} to {cylinder.top:g} m; "
            f"about {_point(baked.position)} along {_point(axis.round(4).tolist())}"
        ),
    )
    yield f"{prefix}grids", f"steps 1 to {1 << (baked.steps - 1)}"
    if baked.texture is not None:
        rows, columns = baked.texture.shape[:2]
        yield f"{prefix}texture", f"{columns} × {rows}, with texture coordinates in each texel"
    for image in baked.images:
        height, width = image.depth.shape
        covered = np.isfinite(image.depth)
        depths = image.depth[covered]
        span = f", depths {depths.min():.4g} to {depths.max():.4g} m" if len(depths) else ""
        yield f"part {prefix}{image.name}", f"{width} × {height}, {100 * covered.mean():.1f} % covered{span}"


def _point(point: Sequence[float]) -> str:
    return "(" + ", ".join(f"{value:g}" for value in point) + ")"
