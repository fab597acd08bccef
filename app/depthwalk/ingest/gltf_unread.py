"""Tell what of a glTF file is not read, for those who wonder why another program shows it otherwise."""

from typing import Any

from depthwalk.ingest.gltf import is_unlit
from depthwalk.ingest.gltf_normal_maps import normal_map_counts

_APART = "with other texture coordinates than the colours"
_REPEAT = 10497  # the way of wrapping a texture that all textures are drawn with


def unread(header: dict[str, Any]) -> list[str]:
    """Return what a glTF file holds and its pictures do not show, such as "2 animations".

    Parameters
    ----------
    header
        The JSON header of a file whose mesh can be read; other parts of it may be malformed, and count as none.

    Returns
    -------
    list
        A text for each kind, the number first.
    """
    materials = _objects(header, "materials")
    samplers = _objects(header, "samplers")
    lights = _object(header, "extensions").get("KHR_lights_punctual")
    counts = {
        ("animation", "animations"): len(_objects(header, "animations")),
        ("camera", "cameras"): len(_objects(header, "cameras")),
        ("lamp", "lamps"): len(_objects(lights, "lights")),
        (f"normal map {_APART}", f"normal maps {_APART}"): normal_map_counts(header)[1],
        ("occlusion map", "occlusion maps"): sum("occlusionTexture" in material for material in materials),
        ("roughness map", "roughness maps"): sum(
            "metallicRoughnessTexture" in _object(material, "pbrMetallicRoughness") for material in materials
        ),
        ("unlit material among others", "unlit materials among others"): 0
        if is_unlit(header)
        else sum("KHR_materials_unlit" in _object(material, "extensions") for material in materials),
        ("sampler that does not repeat", "samplers that do not repeat"): sum(
            any(sampler.get(axis, _REPEAT) != _REPEAT for axis in ("wrapS", "wrapT")) for sampler in samplers
        ),
    }
    return [f"{count} {names[count > 1]}" for names, count in counts.items() if count]


def _object(parent: dict[str, Any], key: str) -> dict[str, Any]:
    """Return the object under a key of `parent`; an empty one if that is something else."""
    found = parent.get(key)
    return found if isinstance(found, dict) else {}


def _objects(parent: Any, key: str) -> list[dict[str, Any]]:
    """Return the objects in a list of the object `parent`; none if either is something else."""
    listed = parent.get(key) if isinstance(parent, dict) else None
    return [each for each in listed if isinstance(each, dict)] if isinstance(listed, list) else []
