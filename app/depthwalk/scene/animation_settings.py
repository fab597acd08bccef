"""Define what a scene file says about the movement of a node: its placement at several moments."""

from typing import Annotated, Literal

from pydantic import Field

from depthwalk.limits import MAX_KEYFRAMES
from depthwalk.params import param
from depthwalk.scene.fields import FileParams, Scale, Vector

_OWN = "if left out, the node's own"
MAX_ANGLE = 36000  # degrees, a hundred turns


class AnimationKeyParams(FileParams):
    """Describe the placement of a node at one moment; what is left out is as the node itself says."""

    time: float = param(..., "Time of the keyframe", unit="s", ge=0, le=1e6)
    position: Vector | None = param(None, f"Position in the parent; {_OWN}", unit="m")
    yaw: float | None = param(
        None, f"Rotation about +Y; {_OWN}. 360 after 0 is a whole turn", unit="degrees", ge=-MAX_ANGLE, le=MAX_ANGLE
    )
    pitch: float | None = param(None, f"Rotation about +X; {_OWN}", unit="degrees", ge=-MAX_ANGLE, le=MAX_ANGLE)
    roll: float | None = param(None, f"Rotation about +Z; {_OWN}", unit="degrees", ge=-MAX_ANGLE, le=MAX_ANGLE)
    scale: Scale | None = param(None, f"Size of an object or a group; {_OWN}")


class AnimationParams(FileParams):
    """Describe how a node moves over time, together with everything below it."""

    keyframes: Annotated[list[AnimationKeyParams], Field(min_length=2, max_length=MAX_KEYFRAMES)] = param(
        ..., "Placements at different times, in order; before the first, the node stays there"
    )
    interpolation: Literal["smooth", "linear", "step"] = param(
        "smooth",
        "Between keyframes: along a smooth curve, at constant speed, or not at all until the next. Angles are "
        "interpolated one by one",
    )
    repeat: Literal["loop", "ping-pong", "once"] = param(
        "loop", "After the last keyframe: from the beginning again, back and forth, or stay there"
    )
    start: float = param(
        0.0, "Moment at which it begins; negative: it has been going on for so long", unit="s", ge=-1e6, le=1e6
    )
