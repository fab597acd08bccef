"""Make what shaders read of objects that are drawn straight into a picture or a shadow map, not as impostors."""

import numpy as np
from numpy.typing import NDArray

from depthwalk.scene.arrays import Objects
from depthwalk.types import Array

PLACED_RECORD = np.dtype([("origin", "3f4"), ("rotation", "4f4"), ("scale", "f4")])
"""Where an object stands relative to the viewer, or to the shadow map's centre, metres; its quaternion; its scale."""


def placed_records(origin: Array, objects: Objects) -> NDArray[np.void]:
    """Return what shaders read of n objects.

    Positions are relative to the viewer, so that float32 is exact enough far from the world's origin, too.

    Parameters
    ----------
    origin
        (3,) what positions are relative to: the viewer or a shadow map's centre, metres, world.
    objects
        The n objects.

    Returns
    -------
    NDArray[np.void]
        (n,) PLACED_RECORD.
    """
    records = np.zeros(len(objects), PLACED_RECORD)
    records["origin"] = objects.position - origin
    records["rotation"], records["scale"] = objects.rotation, objects.scale
    return records
