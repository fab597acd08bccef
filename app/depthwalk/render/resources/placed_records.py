"""TODO docstring."""

import numpy as np
from numpy.typing import NDArray

from depthwalk.scene.arrays import Objects
from depthwalk.types import Array

# What is read per object that is drawn straight into a picture or a shadow map: where it stands relative to the viewer,
# or to the map's centre, and how it is turned.
PLACED_RECORD = np.dtype([("origin", "3f4"), ("rotation", "4f4"), ("scale", "f4")])


def placed_records(origin: Array, objects: Objects) -> NDArray[np.void]:
    """Of n objects that are drawn straight into a picture. origin: (3,), world, where they are seen from."""
    records = np.zeros(len(objects), PLACED_RECORD)
    records["origin"] = objects.position - origin
    records["rotation"], records["scale"] = objects.rotation, objects.scale
    return records
