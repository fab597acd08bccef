"""Bake a mesh to depth images, and measure how well they show it."""

import logging
from collections.abc import Callable, Mapping
from contextlib import closing
from dataclasses import dataclass
from numbers import Real
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np
from pydantic import ValidationError

from depthwalk.api.renderer import checked_size
from depthwalk.api.scene import PathLike
from depthwalk.assets.asset_files import read_body
from depthwalk.assets.bake_job import Baked, Job, Kept
from depthwalk.assets.batch_bake import bake_all
from depthwalk.bake.cache import sidecar
from depthwalk.bake.file import SUFFIX, read_baked
from depthwalk.bake.params import Axis, ModelParams
from depthwalk.errors import InputError
from depthwalk.ingest.formats import COOKED_SUFFIX
from depthwalk.limits import DEFAULT_DPCI_LAYERS, DEFAULT_DPCI_RESOLUTION, MAX_COORDINATE
from depthwalk.params import plain_message, shown
from depthwalk.quality.goals import MEASURES, summarise
from depthwalk.quality.measure import measure
from depthwalk.quality.views import SPHERE, VERIFY
from depthwalk.scene.render_settings import RenderSettings
from depthwalk.scene.scene import MeshAsset
from depthwalk.scene.schema import DpciParams

log = logging.getLogger(__name__)

Up = Literal["y", "z"]


def bake_mesh(
    mesh: PathLike,
    out: PathLike | None = None,
    *,
    resolution: int = DEFAULT_DPCI_RESOLUTION,
    layers: int | Literal["auto"] = DEFAULT_DPCI_LAYERS,
    parts: int | Literal["auto"] = 1,
    axis: Axis = "y",
    method: Literal["raycast", "six-view", "paper"] = "raycast",
    coordinates: Literal["auto", "never"] = "auto",
    texture: PathLike | None = None,
    up: Up = "y",
    height: float | None = None,
    force: bool = False,
    progress: Callable[[str], None] | None = None,
) -> Path:
    """Bake a mesh file to a file of depth images, unless it is up to date.

    A scene finds the result on its own if it lies beside the mesh and was baked with the values of the scene's `dpci`.

    Parameters
    ----------
    mesh
        Path of an OBJ, PLY, glTF or any other mesh file that docs/scene-file.md names.
    out
        The file to write: .exr, or .dpci.npz for cooked depth images, which scenes load by the key `baked`. None writes
        beside the mesh, for example `bust.dpci.exr` beside `bust.obj`.
    resolution
        Side of every image, texels.
    layers
        Surfaces kept along each ray; "auto": as many as can be seen.
    parts
        Most parts the mesh may be divided into, each with depth images of its own; "auto": as many as sample it well.
    axis
        Axis of the cylinder: "x", "y", "z" or a direction (x, y, z) of any length in the asset's frame; "auto": the
        one that samples the surface best.
    method
        How surfaces are sampled: by ray casting, or from the paper's six views; "paper" also uses six views, and leaves
        out everything that the paper does not have.
    coordinates
        Whether texels hold texture coordinates, so that textures stay sharp; "auto": where the texture is finer than
        the depth images.
    texture
        Path of a picture that replaces the textures of the mesh file; None keeps them.
    up
        The axis that points upward in the file.
    height
        Height in metres to which the mesh is scaled; None keeps the file's size.
    force
        Whether to bake even if the file is up to date.
    progress
        Called with the name of each stage as it begins; None logs it.

    Returns
    -------
    Path
        The file with the depth images.

    Raises
    ------
    InputError
        For files and values that cannot be used.
    OSError
        If the depth images cannot be written.

    Examples
    --------
    >>> file = dw.bake_mesh("ball.ply", resolution=64, layers=1)
    >>> file.name
    'ball.dpci.exr'
    """
    spec = _spec(mesh, texture, up, height)
    file = sidecar(spec.mesh) if out is None else Path(out)
    if not file.name.endswith((".exr", COOKED_SUFFIX)):
        raise InputError(f"{file}: must end in {SUFFIX} or {COOKED_SUFFIX}")
    params = _params(
        resolution=resolution, layers=layers, parts=parts, axis=axis, method=method, coordinates=coordinates
    )

    def stage(number: int, name: str) -> None:
        if progress is not None:
            progress(name)
        else:
            log.info("%s: %s", spec.mesh.name, name)

    with closing(
        bake_all([Job(spec=spec, params=params, out=file, force=force)], processes=1, stage=stage)
    ) as outcomes:
        for _, outcome in outcomes:
            if not isinstance(outcome, Baked | Kept):
                raise outcome
    return file


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """Hold how closely pictures of depth images match pictures of their mesh, seen from all around.

    The measures are psnr (dB), iou (of the silhouettes), flip (0 to 1), depth_median and depth_p99 (errors, in heights
    of the object) and holes (per cent of the mesh's pixels); docs/quality-method.md defines them.

    Attributes
    ----------
    mean
        Mean of each measure over the views, by its name.
    worst
        Value of each measure in its worst view, by its name.
    views
        Number of views in which the object was visible.
    gpu_bytes
        Most GPU memory that the depth images took in any of the pictures, bytes.

    Examples
    --------
    >>> found = dw.compare("ball.ply", dw.bake_mesh("ball.ply", resolution=64, layers=1), size=(96, 72), views=6)
    >>> found.worst["psnr"] <= found.mean["psnr"]
    True
    """

    mean: Mapping[str, float]
    worst: Mapping[str, float]
    views: int
    gpu_bytes: int


def compare(
    mesh: PathLike,
    baked: PathLike,
    *,
    texture: PathLike | None = None,
    up: Up = "y",
    height: float | None = None,
    size: tuple[int, int] = (1024, 768),
    views: Literal[6, 42] = 42,
) -> Comparison:
    """Compare pictures of depth images with pictures of their mesh under the same light.

    Parameters
    ----------
    mesh
        Path of the mesh file that was baked.
    baked
        Path of the file that `bake_mesh` made from it.
    texture, up, height
        The values that `bake_mesh` was given.
    size
        Width and height of the pictures, pixels.
    views
        Number of viewing directions: 42 all around, or 6 for a quick check.

    Returns
    -------
    Comparison
        Mean and worst of each measure.

    Raises
    ------
    InputError
        For files that cannot be used.
    GpuError
        Where no OpenGL 3.3 context can be created.

    Examples
    --------
    >>> file = dw.bake_mesh("ball.ply", resolution=64, layers=1)
    >>> found = dw.compare("ball.ply", file, size=(96, 72), views=6)
    >>> found.mean["iou"] > 0.9
    True
    """
    around = {6: VERIFY, 42: SPHERE}
    if views not in around:
        raise InputError(f"views {views}: must be 6 or 42")
    size = checked_size(size)
    body = read_body(_spec(mesh, texture, up, height))
    quality = measure(body, read_baked(Path(baked)), RenderSettings(), size, around[views])
    if not quality.views:
        raise InputError(f"{mesh}: shows no pixel in any view")
    summaries = {measured.key: summarise(measured, quality.views) for measured in MEASURES}
    return Comparison(
        mean={key: summary.mean for key, summary in summaries.items()},
        worst={key: summary.worst for key, summary in summaries.items()},
        views=len(quality.views),
        gpu_bytes=quality.gpu_bytes,
    )


def _spec(mesh: PathLike, texture: PathLike | None, up: Up, height: float | None) -> MeshAsset:
    """Return the asset that a scene file with these values would define, so that both get the same cache key."""
    if height is not None and not (isinstance(height, Real) and 0 < height <= MAX_COORDINATE):
        raise InputError(f"height {shown(height)}: must be above 0 and at most {MAX_COORDINATE:.0f} metres")
    if up not in get_args(Up):
        raise InputError(f"up {up!r}: must be 'y' or 'z'")
    file = Path(mesh)
    image = None if texture is None else Path(texture)
    return MeshAsset(name=file.stem, mesh=file, texture=image, up=up, height=height, dpci=None)


def _params(**values: Any) -> ModelParams:
    """Return the bake parameters with these `values`, of which the same are allowed as in a scene file.

    Raises InputError for others.
    """
    for name, value in values.items():
        if isinstance(value, np.integer | list):
            values[name] = value.item() if isinstance(value, np.integer) else tuple(value)
    try:
        DpciParams.model_validate(values)
    except ValidationError as error:
        for detail in error.errors(include_url=False):
            if detail["loc"]:  # otherwise values do not go together, which `ModelParams` tells
                name = str(detail["loc"][0])
                wrong = plain_message(detail).rpartition(", not ")
                raise InputError(f"{name} {shown(values[name])}: {wrong[0] or wrong[2]}") from None
    return ModelParams(**values)
