"""Choose the anti-aliasing of a picture, and tell what that asks of the passes.

`ssaa` draws larger targets, `msaa` several samples per pixel in hardware, `gpaa` and `gpaa-edge` blend along the edges
of the geometry, `coverage` blends what impostor tiles cover in part, `fxaa` and `smaa` look at the finished picture.
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
MULTISAMPLING = 4  # samples per pixel of what objects are drawn into, for `msaa`
COVERAGE_TEXELS = 2.0  # texels of an impostor tile per pixel, along either axis, where coverage is computed from them


def geometric(settings: PictureParams) -> bool:
    """Return whether the anti-aliasing of `settings` blends pixels along the edges of the geometry."""
    return settings.aa in ("gpaa", "gpaa-edge")


def covering(settings: PictureParams) -> bool:
    """Return whether the anti-aliasing of `settings` uses what part of a pixel impostor tiles cover."""
    return settings.aa == "coverage" or geometric(settings)


def samples(settings: RenderSettings) -> int:
    """Return how many samples `settings` give a pixel along either axis; targets are so many times as large."""
    if geometric(settings):
        return settings.gpaa.samples
    return SUPERSAMPLING if settings.aa == "ssaa" else 1


@dataclass(frozen=True, kw_only=True)
class AntiAliasing:
    """Hold what the anti-aliasing asks of the passes.

    Attributes
    ----------
    mode : the value of `PictureParams.aa`.
    samples : samples of a pixel along either axis, for which targets are so many times as wide and as high.
    geometric : whether pixels are blended along the edges of the geometry.
    covering : whether impostor tiles tell what part of a pixel they cover.
    shown : whether edges are blended in the finished picture, after all other passes, where that is possible.
    """

    mode: str
    samples: int
    geometric: bool
    covering: bool
    shown: bool


def anti_aliasing(settings: RenderSettings) -> AntiAliasing:
    """Return what the anti-aliasing that `settings` choose asks of the passes."""
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
    """Return how many hardware samples per pixel the targets have that objects are drawn into.

    Parameters
    ----------
    settings : the settings of the picture, of which only `aa` matters here.
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
            f"render.aa: msaa needs {MULTISAMPLING} samples per pixel, each shaded by itself; {device.renderer} offers "
            f"{device.max_samples}; choose ssaa or gpaa-edge"
        )
    return MULTISAMPLING


def sample_views(view: View, offsets: NDArray[np.floating]) -> list[View]:
    """Return one view per hardware sample, sheared so that the sample lies in the middle of the pixel.

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
    """Return how impostor tiles are laid out, given what the anti-aliasing and the lens ask of them.

    Parameters
    ----------
    settings : the render settings, of which anti-aliasing and lens matter here.
    layout : the layout that `settings` ask for. Where coverage is computed from texels, these are made finer than
        pixels.
    remembers : whether tiles may be reused from one frame to the next. For the points of a lens they never are, since
        the blur consists of the differences between the pictures of these points.

    Returns
    -------
    The layout to use.
    """
    changes = {"tile_scale": COVERAGE_TEXELS} if covering(settings) or settings.aa == "msaa" else {}
    if not remembers or settings.dof.mode == "accumulate":
        changes["reuse_error"] = 0.0
    return layout.model_copy(update=changes)
