"""Define named sets of render settings, so that one word in a scene file selects all that belong together.

`PRESETS` is plain data: under each name, the settings that differ from their defaults, as `render:` of a scene file
would hold them. A file's own values override those of its preset, key by key.
"""

from collections.abc import Mapping
from typing import Any

PRESETS: dict[str, dict[str, Any]] = {
    "default": {},
    # Liu, Liu and Wu 2007, as it was published: what this program adds is off. Together with `dpci: {method: paper}` in
    # the assets this is the whole method; docs/paper.md says what each key corresponds to.
    "paper": {
        "lod": {"mode": "paper", "cases": "paper", "triangles_per_pixel": 1e6, "magnification": 0.0},
        "culling": {"occlusion": False},
        "warp": {"order": "epipole", "tile_mapping": "plane", "cluster_pixels": 0.0, "reuse_error": 0.0},
        "composite": {"parallax_steps": 0},
        "light": {"mode": "warp"},
    },
}


def with_preset(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return render settings completed with the values of their preset.

    Parameters
    ----------
    values
        The settings as a scene file holds them, groups as mappings; the key `preset` names one of `PRESETS`.

    Returns
    -------
    dict
        All of `values`, and the preset's settings for keys that are missing. An unknown name adds nothing.
    """
    name = values.get("preset")
    merged = dict(values)
    for key, of_preset in PRESETS.get(name, {}).items() if isinstance(name, str) else ():
        own = merged.get(key)
        if key not in merged:
            merged[key] = dict(of_preset)
        elif isinstance(own, Mapping):
            merged[key] = of_preset | dict(own)
    return merged
