"""Tell what of a glTF file is not read, for those who wonder why another program shows it otherwise."""

from typing import Any

from depthwalk.ingest.gltf import INSTANCING, is_unlit, object_under, objects_under
from depthwalk.ingest.gltf_normal_maps import normal_map_counts
from depthwalk.ingest.gltf_points import undrawn_beside
from depthwalk.ingest.gltf_reflection import roughness_map_counts
from depthwalk.ingest.gltf_textures import textures_without_picture

_APART = "with other texture coordinates than the colours"
_REPEAT = 10497  # the way of wrapping a texture that all textures are drawn with


def unread(header: dict[str, Any], *, is_translated: bool = False) -> list[str]:
    """Return what a glTF file holds and its pictures do not show, such as "2 animations".

    Parameters
    ----------
    header
        The JSON header of a file whose mesh can be read; other parts of it may be malformed, and count as none.
    is_translated
        Whether it was made of a USD file, and says itself what of that it lacks.

    Returns
    -------
    list
        A text for each kind, the number first.
    """
    materials = objects_under(header, "materials")
    samplers = objects_under(header, "samplers")
    lights = object_under(header, "extensions").get("KHR_lights_punctual")
    counts = {
        ("animation", "animations"): len(objects_under(header, "animations")),
        ("camera", "cameras"): len(objects_under(header, "cameras")),
        ("lamp", "lamps"): len(objects_under(lights, "lights")),
        ("node of instances", "nodes of instances"): sum(
            INSTANCING in object_under(node, "extensions") for node in objects_under(header, "nodes")
        ),
        (f"normal map {_APART}", f"normal maps {_APART}"): normal_map_counts(header)[1],
        ("texture without a picture that is read", "textures without pictures that are read"): sum(
            textures_without_picture(header).values()
        ),
        ("occlusion map", "occlusion maps"): sum("occlusionTexture" in material for material in materials),
        (f"roughness map {_APART}, but for its mean", f"roughness maps {_APART}, but for their means"): (
            roughness_map_counts(header)[1]
        ),
        ("unlit material among others", "unlit materials among others"): 0
        if is_unlit(header)
        else sum("KHR_materials_unlit" in object_under(material, "extensions") for material in materials),
        ("sampler that does not repeat", "samplers that do not repeat"): sum(
            any(sampler.get(axis, _REPEAT) != _REPEAT for axis in ("wrapS", "wrapT")) for sampler in samplers
        ),
    }
    said = object_under(header, "extras").get("unread") if is_translated else None  # by `ingest.usd`
    listed = [text for text in said if isinstance(text, str)] if isinstance(said, list) else []
    return listed + undrawn_beside(header) + [f"{count} {names[count > 1]}" for names, count in counts.items() if count]
