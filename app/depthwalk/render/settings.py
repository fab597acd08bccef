"""`render:` of the scene file, the panel's sections and `--set render.…`: gathered from the passes' declarations."""

import re
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import BeforeValidator, Field, WithJsonSchema, create_model

from depthwalk.params import param
from depthwalk.render.antialiasing import PictureParams
from depthwalk.render.assets import DEFAULT_BUDGET
from depthwalk.render.cells import CullingParams
from depthwalk.render.lod import LodParams
from depthwalk.render.passes import PASSES

_UNITS = {"B": 1} | {
    prefix + "B": 1000**power for power, prefix in enumerate("kMGT", 1)
} | {prefix + "iB": 1024**power for power, prefix in enumerate("KMGT", 1)}  # fmt: skip


def _bytes(value: Any) -> Any:
    """A number of bytes, or text such as `2 GiB`, as a number."""
    found = re.fullmatch(r"([0-9]+(?:\.[0-9]+)?) ?([A-Za-z]+)", value) if isinstance(value, str) else None
    if found and found[2] in _UNITS:
        return int(float(found[1]) * _UNITS[found[2]])
    if type(value) is not int:
        raise ValueError(f"must be a size such as 2 GiB or 500 MB, or a number of bytes, not {value!r:.40}")
    return value


Bytes = Annotated[
    int,
    BeforeValidator(_bytes),
    Field(ge=0, le=1 << 44),
    WithJsonSchema({"anyOf": [{"type": "string"}, {"type": "integer", "minimum": 0, "maximum": 1 << 44}]}),
]

_groups: dict[str, Any] = {
    "lod": (LodParams, Field(default_factory=LodParams)),
    "culling": (CullingParams, Field(default_factory=CullingParams)),
}
for _pass in PASSES:
    if _pass.Params.model_fields:
        _groups[_pass.name] = (_pass.Params, Field(default_factory=_pass.Params))

_memory: dict[str, Any] = {
    "gpu_memory": (
        Bytes,
        param(DEFAULT_BUDGET, "GPU memory for depth images, `2 GiB` or bytes; those not seen for longest make room"),
    )
}

if TYPE_CHECKING:

    class RenderSettings(PictureParams):
        """Everything that changes the picture but not the scene: what concerns it as a whole, `lod`, `culling`, a group
        per pass, `gpu_memory`."""

        def __getattr__(self, name: str) -> Any: ...

else:
    RenderSettings = create_model(
        "RenderSettings",
        __base__=PictureParams,
        __doc__="Everything that changes the picture but not the scene.",
        **_groups,
        **_memory,
    )
