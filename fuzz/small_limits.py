"""Lower the limits of the package, so that files a few bytes long reach them, and memory shows who does not look.

Imported before anything else of the package: modules take the limits when they are imported.
"""

from depthwalk import limits

LOWERED = {
    "MAX_SCENE_BYTES": 1 << 18,
    "MAX_PLACES_BYTES": 1 << 20,
    "MAX_MESH_BYTES": 1 << 22,
    "MAX_MESH_TRIANGLES": 100_000,
    "MAX_TEXTURE_SIDE": 1024,
    "MAX_TEXTURE_PIXELS": 1024 * 1024,
    "MAX_INSTANCES": 20_000,
    "MAX_FRAMES": 20_000,
    "MAX_KEYFRAMES": 1_000,
    "MAX_DPCI_RESOLUTION": 256,
    "MAX_BOUNDARY_STRIP_ENTRIES": 1 << 18,
}


def lower_limits() -> None:
    """Set each limit of LOWERED."""
    for name, value in LOWERED.items():
        assert value < getattr(limits, name), name
        setattr(limits, name, value)
