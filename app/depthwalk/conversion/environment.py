"""Express the cameras and lights of a glTF scene by keys of a scene file."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from depthwalk.colour import srgb_from_linear
from depthwalk.errors import InputError
from depthwalk.ingest.formats import SKY_SUFFIXES
from depthwalk.ingest.gltf import object_under
from depthwalk.ingest.gltf_accessors import Accessors
from depthwalk.ingest.gltf_lights import PlacedCamera, PlacedLight
from depthwalk.ingest.sky_image import load_sky_image
from depthwalk.limits import MAX_FOV, MAX_LIGHTS, MAX_SKY_INTENSITY, MIN_FOV

_AHEAD = 5.0  # m from a camera to its target
_BRIGHTEST = 10.0  # strength of the brightest lamp at 1 m, if there is no sun, unless it is weaker
_DARK = 0.01  # strength at which a lamp without a range ends: 1 % of the sun's
_FARTHEST = 100.0  # m, where such lamps end in any case


def camera_values(camera: PlacedCamera) -> dict[str, Any]:
    """Return the value of the key `camera`; a camera that leans to its side is set upright."""
    target = [at + _AHEAD * along for at, along in zip(camera.position, camera.direction, strict=True)]
    fov = min(max(camera.fov, MIN_FOV), MAX_FOV)
    return {"position": _short(camera.position), "target": _short(target), "fov": round(fov, 3)}


def environment_values(
    lights: Sequence[PlacedLight], sky: dict[str, Any] | None = None
) -> tuple[dict[str, Any], list[str]]:
    """Return the value of the key `environment`, and notes about what it lacks.

    A white surface that a sun of π lux faces sends out one unit of light, as a sun of intensity 1 makes it. Blender
    exports a sun hundreds of times as strong, for which viewers lower their exposure; here all lights are dimmed
    together, until the sun has intensity 1 or, without a sun, the brightest lamp 10 at 1 m.

    Parameters
    ----------
    lights
        The lights of the scene.
    sky
        The value of the key `sky` for a picture, whose `intensity` is radiance, as that of the lights; None without.
    """
    suns = sorted((light for light in lights if light.kind == "directional"), key=lambda sun: -sun.intensity)
    lamps = sorted((light for light in lights if light.kind != "directional"), key=lambda lamp: -lamp.intensity)
    if not lights and sky is None:
        return {"sky": {}}, []
    brightest, most = (suns[0].intensity, 1.0) if suns else (lamps[0].intensity if lamps else 0.0, _BRIGHTEST)
    unit = max(math.pi, brightest / most)
    values: dict[str, Any] = {}
    notes = []
    if sky is not None:
        values["sky"] = sky | {"intensity": round(min(sky["intensity"] * math.pi / unit, MAX_SKY_INTENSITY), 5)}
    if suns:
        values.setdefault("sky", {})
        values["sun"] = {
            "direction": _short(suns[0].direction),
            "colour": _colour(suns[0]),
            "intensity": round(suns[0].intensity / unit, 4),
        }
        if len(suns) > 1:
            notes.append(f"{len(suns) - 1} of {len(suns)} directional lights are left out, the brightest one stays")
    else:
        values["sun"] = {"intensity": 0.0}
    if len(lamps) > MAX_LIGHTS:
        notes.append(f"{len(lamps) - MAX_LIGHTS} of {len(lamps)} lamps are left out, the brightest ones stay")
    if lamps:
        values["lights"] = [_lamp(lamp, unit) for lamp in lamps[:MAX_LIGHTS]]
    return values, notes


def sky_values(header: dict[str, Any], accessors: Accessors, folder: Path) -> tuple[dict[str, Any] | None, list[str]]:
    """Write the picture of a dome light into a folder, and return the value of the key `sky`, and notes.

    Parameters
    ----------
    header, accessors
        Of a file that `ingest.usd` has made, which describes the picture below `extras`.
    folder
        The folder of the scene file.

    Returns
    -------
    tuple
        The value, with its `intensity` as radiance; None without a picture that can be read. A note says so then.
    """
    dome = object_under(object_under(header, "extras"), "sky")
    if not dome:
        return None, []
    name = f"sky{dome['suffix']}"
    try:
        if dome["suffix"] not in SKY_SUFFIXES:
            raise InputError(f"{dome['suffix']!r} is not a picture of a sky")
        (folder / name).write_bytes(accessors.view(dome["picture"]))
        load_sky_image(folder / name)
    except InputError as error:
        (folder / name).unlink(missing_ok=True)
        return None, [f"the picture of the dome light is left out: {str(error).removeprefix(f'{folder / name}: ')}"]
    turned = {"turn": round(dome["turn"], 3)} if abs(dome["turn"]) > 1e-3 else {}
    return {"model": "image", "image": name, **turned, "intensity": dome["intensity"], "light": True}, []


def _lamp(light: PlacedLight, unit: float) -> dict[str, Any]:
    intensity = light.intensity / unit
    end = light.range or min(max(math.sqrt(intensity / _DARK), 1.0), _FARTHEST)
    values = {
        "position": _short(light.position),
        "colour": _colour(light),
        "intensity": round(intensity, 4),
        "range": round(end, 3),
    }
    if light.kind == "spot":
        values |= {"direction": _short(light.direction), "angle": round(min(max(light.angle, 1.0), 180.0), 3)}
    return values


def _colour(light: PlacedLight) -> list[float]:
    return [round(float(term), 4) for term in srgb_from_linear(light.colour)]


def _short(vector: Sequence[float]) -> list[float]:
    return [round(float(term), 5) + 0.0 for term in vector]
