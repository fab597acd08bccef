"""Which anti-aliasing a picture gets, and what that asks of the passes before it."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthwalk.errors import InputError
from depthwalk.gpu.device import Device
from depthwalk.render.view.view import View
from depthwalk.scene.render_settings import PictureParams, TileParams

SUPERSAMPLING = 2  # samples per pixel along either axis, for `ssaa`
MULTISAMPLING = 4  # samples per pixel of what objects are drawn into, for `msaa`
COVERAGE_TEXELS = 2.0  # texels of an intermediate image per pixel, along either axis, that tell what is covered of it


def geometric(settings: PictureParams) -> bool:
    """Whether edges are smoothed by where the geometry has them."""
    return settings.aa in ("gpaa", "gpaa-edge")


def covering(settings: PictureParams) -> bool:
    """Whether intermediate images tell what part of a pixel is covered."""
    return settings.aa == "coverage" or geometric(settings)


def samples(settings: Any) -> int:
    """How many samples each pixel has along either axis. settings: a RenderSettings."""
    if geometric(settings):
        return int(settings.gpaa.samples)
    return SUPERSAMPLING if settings.aa == "ssaa" else 1


@dataclass(frozen=True, kw_only=True)
class AntiAliasing:
    """What passes go by of the settings' anti-aliasing. mode: see `PictureParams.aa`; samples: those of a pixel along
    either axis; geometric, covering: see the functions of these names."""

    mode: str
    samples: int
    geometric: bool
    covering: bool


def anti_aliasing(settings: Any) -> AntiAliasing:
    """The anti-aliasing that a RenderSettings asks for."""
    return AntiAliasing(
        mode=settings.aa, samples=samples(settings), geometric=geometric(settings), covering=covering(settings)
    )


def hardware_samples(settings: PictureParams, device: Device) -> int:
    """How many samples each pixel has of what objects are drawn into. Raises InputError where `device` has too few."""
    if settings.aa != "msaa":
        return 1
    if device.max_samples < MULTISAMPLING:
        raise InputError(
            f"render.aa: msaa needs {MULTISAMPLING} samples per pixel, each shaded by itself; {device.renderer} offers "
            f"{device.max_samples}; choose ssaa or gpaa-edge"
        )
    return MULTISAMPLING


def sample_views(view: View, offsets: NDArray[np.floating]) -> list[View]:
    """`view` for each sample of its pixels: what is at `offsets` (samples, 2) from a pixel's middle, pixels to the
    right and up, is in the middle of that pixel there."""
    shears = np.asarray(view.shear) - offsets / view.focal_pixels
    return [replace(view, shear=tuple(shear)) for shear in shears.tolist()]


def tile_layout(settings: Any, layout: TileParams, remembers: bool) -> TileParams:
    """`layout`, with texels that tell what part of a pixel is covered where the anti-aliasing wants to know, and with
    nothing kept unless the renderer `remembers`, nor for another point of the lens: blur is made of those differences.

    settings: a RenderSettings.
    """
    changes = {"tile_scale": COVERAGE_TEXELS} if covering(settings) or settings.aa == "msaa" else {}
    if not remembers or settings.dof.mode == "accumulate":
        changes["reuse_error"] = 0.0
    return layout.model_copy(update=changes)
