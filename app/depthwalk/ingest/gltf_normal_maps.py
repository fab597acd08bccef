"""Determine which normal maps of a glTF file are read, and how strong they are.

A mesh has one set of texture coordinates. So a normal map is read if it uses those of the material's other textures,
which is what exporters write, or if there are no others.
"""

import math
from pathlib import Path
from typing import Any

from depthwalk.errors import InputError
from depthwalk.ingest.gltf import objects_under
from depthwalk.ingest.gltf_geometry import shares_coordinates
from depthwalk.limits import MAX_NORMAL_SCALE

_MARK = "\x1f"  # unit separator: between the name of a material and the scale of its normal map
_KEY = "normalTexture"


def normal_map_counts(header: dict[str, Any]) -> tuple[int, int]:
    """Return how many materials have a normal map that is read, and how many have one that is not.

    header: the JSON header; parts of it may be malformed, and such maps are not read.
    """
    materials = [material for material in objects_under(header, "materials") if _KEY in material]
    read = sum(is_read(material) for material in materials)
    return read, len(materials) - read


def is_read(material: dict[str, Any]) -> bool:
    """Return whether the normal map of a material in a JSON header is read; False if it has none."""
    try:
        return "index" in material[_KEY] and shares_coordinates(material, material[_KEY])
    except (AttributeError, LookupError, TypeError, ValueError):
        return False


def fold_normal_maps(header: dict[str, Any], path: Path) -> bool:
    """Prepare the normal maps in a JSON header for `trimesh`, which drops their scale.

    The scale is appended to the name of the material, see `name_and_scale`; maps that are not read are removed.

    Parameters
    ----------
    header
        The JSON header; its materials are changed in place.
    path
        The file, for messages.

    Returns
    -------
    bool
        Whether anything was changed.

    Raises
    ------
    InputError
        `path: materials[k]: defect` if a scale is not a finite number.
    """
    changed = False
    for number, material in enumerate(header.get("materials", [])):
        if _KEY not in material:
            continue
        if not is_read(material):
            del material[_KEY]
            changed = True
        elif (scale := _scale(material[_KEY], f"{path}: materials[{number}]")) != 1:
            material["name"] = f"{material.get('name') or ''}{_MARK}{scale!r}"
            changed = True
    return changed


def name_and_scale(name: str | None) -> tuple[str | None, float]:
    """Return the name that a material has in its file, and the scale of its normal map."""
    own, mark, scale = (name or "").rpartition(_MARK)
    try:
        return (own or None, float(scale)) if mark else (name, 1.0)
    except ValueError:  # the file's own name has such a character
        return name, 1.0


def _scale(texture: dict[str, Any], where: str) -> float:
    """Return the scale of a normal map, within its limits. Raises InputError if it is not a finite number."""
    value = texture.get("scale", 1.0)
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) < math.inf:
        raise InputError(f"{where}: the scale of its normal map must be a number, not {str(value)[:40]}")
    return float(min(max(value, -MAX_NORMAL_SCALE), MAX_NORMAL_SCALE))  # a whole number may be too large to convert
