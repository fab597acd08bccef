"""Which anti-aliasing a picture gets, and what that asks of the passes before it."""

from typing import Any, Literal

from depthwalk.params import Params, param
from depthwalk.render.tiles import TileParams

SUPERSAMPLING = 2  # samples per pixel along either axis, for `ssaa`
COVERAGE_TEXELS = 2.0  # texels of an intermediate image per pixel, along either axis, that tell what is covered of it


class PictureParams(Params):
    """What concerns the picture as a whole."""

    aa: Literal["none", "fxaa", "smaa", "gpaa", "gpaa-edge", "ssaa"] = param(
        "none",
        "Anti-aliasing: by edges of brightness (FXAA, SMAA), by all edges of polygons or those alone that may be "
        "outlines (GPAA), by four samples per pixel (SSAA)",
    )


def geometric(settings: PictureParams) -> bool:
    """Whether edges are smoothed by where the geometry has them."""
    return settings.aa in ("gpaa", "gpaa-edge")


def samples(settings: Any) -> int:
    """How many samples each pixel has along either axis. settings: a RenderSettings."""
    if geometric(settings):
        return int(settings.gpaa.samples)
    return SUPERSAMPLING if settings.aa == "ssaa" else 1


def tile_layout(settings: PictureParams, layout: TileParams, remembers: bool) -> TileParams:
    """`layout`, with texels that tell what part of a pixel is covered where the anti-aliasing wants to know, and with
    nothing kept unless the renderer `remembers`."""
    changes = {"tile_scale": COVERAGE_TEXELS} if geometric(settings) else {}
    if not remembers:
        changes["reuse_error"] = 0.0
    return layout.model_copy(update=changes)
