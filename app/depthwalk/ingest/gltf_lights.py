"""Read the cameras and lights of a glTF scene.

glTF 2.0, section 3.10, and its extension KHR_lights_punctual. What is malformed raises ValueError, TypeError or
LookupError.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthwalk.ingest.gltf import object_under, objects_under

LIGHTS = "KHR_lights_punctual"
"""The extension by which nodes are lights."""

Header = dict[str, Any]
_Matrices = NDArray[np.float64]  # (4, 4), scene from node


@dataclass(frozen=True, kw_only=True)
class PlacedCamera:
    """Hold a perspective camera: position and unit direction in the scene, vertical field of view in degrees."""

    position: tuple[float, ...]
    direction: tuple[float, ...]
    fov: float


@dataclass(frozen=True, kw_only=True)
class PlacedLight:
    """Hold a light of `KHR_lights_punctual`.

    Attributes
    ----------
    kind
        "directional", "point" or "spot".
    position, direction
        In the scene; the unit direction in which the light travels.
    colour
        Linear red, green and blue.
    intensity
        Lux of a directional light, candela of others.
    range
        Where the light ends, in the scene's unit; None if nowhere.
    angle
        Full opening angle of a spot light's cone, degrees.
    """

    kind: str
    position: tuple[float, ...]
    direction: tuple[float, ...]
    colour: tuple[float, ...]
    intensity: float
    range: float | None
    angle: float


def cameras(header: Header, world: dict[int, _Matrices]) -> Iterator[PlacedCamera]:
    """Yield the perspective cameras of the scene."""
    listed = header.get("cameras", [])
    for number, matrix in world.items():
        if "camera" in header["nodes"][number]:
            lens = listed[header["nodes"][number]["camera"]].get("perspective")
            if lens is not None:
                position, direction = _stand(matrix)
                yield PlacedCamera(position=position, direction=direction, fov=math.degrees(float(lens["yfov"])))


def lights(header: Header, world: dict[int, _Matrices]) -> Iterator[PlacedLight]:
    """Yield the lights of the scene."""
    listed = objects_under(object_under(object_under(header, "extensions"), LIGHTS), "lights")
    for number, matrix in world.items():
        extension = object_under(object_under(header["nodes"][number], "extensions"), LIGHTS)
        if "light" not in extension:
            continue
        light = listed[extension["light"]]
        position, direction = _stand(matrix)
        end = light.get("range")
        yield PlacedLight(
            kind=str(light["type"]),
            position=position,
            direction=direction,
            colour=tuple(float(term) for term in light.get("color", (1.0, 1.0, 1.0))),
            intensity=float(light.get("intensity", 1.0)),
            range=None if end is None else float(end),
            angle=math.degrees(2 * float(object_under(light, "spot").get("outerConeAngle", math.pi / 4))),
        )


def _stand(matrix: _Matrices) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return where a camera or a light is, and the unit vector along which it looks: −z in its own frame."""
    along = -matrix[:3, 2]
    length = float(np.linalg.norm(along))
    direction = along / length if length > 0 else np.array([0.0, 0.0, -1.0])
    return tuple(matrix[:3, 3].tolist()), tuple(direction.tolist())
