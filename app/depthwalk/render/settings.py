"""`render:` of the scene file, the panel's sections and `--set render.…`, gathered from the passes' own declarations."""

from typing import Literal

from pydantic import Field

from depthwalk.params import Params, param


class LodParams(Params):
    """Which resolution and which depth images an object is warped with."""

    bias: float = param(0.0, "Added to the level of detail: +1 halves the grid's resolution", unit="levels", ge=-4, le=8)
    max_step: int = param(64, "Coarsest Iter_step", unit="texels", ge=1, le=64)
    freeze: bool = param(False, "Keep the steps and cases of the moment it was switched on")
    cases: Literal["paper", "all"] = param("paper", "Depth images per view: the paper's three cases, or always all")


class RenderSettings(Params):
    """Everything that changes the picture but not the scene."""

    lod: LodParams = Field(default_factory=LodParams)
