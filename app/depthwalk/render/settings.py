"""`render:` of the scene file, the panel's sections and `--set render.…`: gathered from the passes' declarations."""

from typing import TYPE_CHECKING, Any

from pydantic import Field, create_model

from depthwalk.params import Params
from depthwalk.render.cells import CullingParams
from depthwalk.render.lod import LodParams
from depthwalk.render.passes import PASSES

_groups: dict[str, Any] = {
    "lod": (LodParams, Field(default_factory=LodParams)),
    "culling": (CullingParams, Field(default_factory=CullingParams)),
}
for _pass in PASSES:
    if _pass.Params.model_fields:
        _groups[_pass.name] = (_pass.Params, Field(default_factory=_pass.Params))

if TYPE_CHECKING:

    class RenderSettings(Params):
        """Everything that changes the picture but not the scene: `lod`, `culling`, and a group per pass."""

        def __getattr__(self, name: str) -> Any: ...

else:
    RenderSettings = create_model(
        "RenderSettings", __base__=Params, __doc__="Everything that changes the picture but not the scene.", **_groups
    )
