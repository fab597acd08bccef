"""Derive from the anti-aliasing mode of a picture what the passes have to do.

`ssaa` draws larger targets, `msaa` several samples per pixel in hardware, `gpaa` and `gpaa-edge` blend along the edges
of the geometry, `coverage` blends pixels that impostor tiles cover in part, `fxaa` and `smaa` filter the lit picture.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from depthwalk.errors import InputError
from depthwalk.gpu.device import Device
from depthwalk.render.view.view import View
from depthwalk.scene.object_settings import TileParams
from depthwalk.scene.render_settings import PictureParams, RenderSettings

SUPERSAMPLING = 2  # samples per pixel along either axis, for `ssaa`
MULTISAMPLING = 4  # samples per pixel of the targets that objects are drawn into, for `msaa`
COVERAGE_TEXELS = 2.0  # texels of an impostor tile per pixel, along either axis, if coverage is computed from them


def geometric(settings: PictureParams) -> bool:
    """Return whether the anti-aliasing of `settings` blends pixels along the edges of the geometry."""
    return settings.aa in ("gpaa", "gpaa-edge")


def covering(settings: PictureParams) -> bool:
    """Return whether the anti-aliasing of `settings` uses the part of a pixel that impostor tiles cover."""
    return settings.aa == "coverage" or geometric(settings)


def samples(settings: RenderSettings) -> int:
    """Return the samples per pixel along either axis, the factor by which `settings` enlarge the targets."""
    if geometric(settings):
        return settings.gpaa.samples
    return SUPERSAMPLING if settings.aa == "ssaa" else 1


@dataclass(frozen=True, kw_only=True)
class AntiAliasing:
    """Hold what the passes need to know of the anti-aliasing.

    Attributes
    ----------
    mode : the value of `PictureParams.aa`.
    samples : samples per pixel along either axis, the factor by which targets are wider and higher.
    geometric : whether pixels are blended along the edges of the geometry.
    covering : whether `composite` stores which part of a pixel impostor tiles cover.
    shown : whether edges are blended in the finished picture, after all other passes, where that is possible.
    """

    mode: str
    samples: int
    geometric: bool
    covering: bool
    shown: bool


def anti_aliasing(settings: RenderSettings) -> AntiAliasing:
    """Return what the passes need to know of the anti-aliasing that `settings` choose."""
    return AntiAliasing(
        mode=settings.aa,
        samples=samples(settings),
        geometric=geometric(settings),
        covering=covering(settings),
        shown=covering(settings) and samples(settings) == 1 and settings.dof.mode == "none",
    )


def supersampled(aa: AntiAliasing) -> AntiAliasing:
    """Return `aa` with `SUPERSAMPLING` samples per pixel along either axis."""
    return replace(aa, samples=SUPERSAMPLING, shown=False)


def hardware_samples(settings: PictureParams, device: Device) -> int:
    """Return the hardware samples per pixel of the targets that objects are drawn into.

    Parameters
    ----------
    settings : the settings of the picture; only `aa` is used.
    device : the device that draws.

    Returns
    -------
    How many samples, at least 1.

    Raises
    ------
    InputError
        Where `settings` ask for `msaa` and `device` offers too few samples.
    """
    if settings.aa != "msaa":
        return 1
    if device.max_samples < MULTISAMPLING:
        raise InputError(
            f"render.aa: msaa needs {MULTISAMPLING} samples per pixel, each shaded separately; {device.renderer} "
            f"offers {device.max_samples}; choose ssaa or gpaa-edge"
        )
    return MULTISAMPLING


def sample_views(view: View, offsets: NDArray[np.floating]) -> list[View]:
    """Return a view for each hardware sample, sheared so that the sample is at the centre of the pixel.

    Parameters
    ----------
    view : the view of the picture.
    offsets : (samples, 2) places of the samples from the middle of a pixel, pixels to the right and up.

    Returns
    -------
    The views, in the order of the offsets.
    """
    shears = np.asarray(view.shear) - offsets / view.focal_pixels
    return [replace(view, shear=tuple(shear)) for shear in shears.tolist()]


def tile_layout(settings: RenderSettings, layout: TileParams, remembers: bool) -> TileParams:
    """Adapt the layout of impostor tiles to the anti-aliasing and the lens.

    Parameters
    ----------
    settings : the render settings; only anti-aliasing and lens are used.
    layout : the layout in `settings`. If coverage is computed from texels, these are made finer than pixels.
    remembers : whether tiles may be reused from one frame to the next. For the points of a lens they never are, since
        the differences between the pictures of these points are the blur.

    Returns
    -------
    The layout to use.
    """
    changes = {"tile_scale": COVERAGE_TEXELS} if covering(settings) or settings.aa == "msaa" else {}
    if not remembers or settings.dof.mode == "accumulate":
        changes["reuse_error"] = 0.0
    return layout.model_copy(update=changes)
