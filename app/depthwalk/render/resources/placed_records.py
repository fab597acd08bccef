"""Make the instance records of objects that are drawn straight into a picture or a shadow map, not as impostors."""

import numpy as np
from numpy.typing import NDArray

from depthwalk.scene.arrays import Objects
from depthwalk.types import Array, Rows

COVERAGE_BITS = 4
"""Lowest bits of the second number in the visibility buffer, which hold how much of a pixel is covered."""

FIRST_CAPTURED = 2 << COVERAGE_BITS
"""Second number in the visibility buffer where captured views show row 0; each further row adds 2 ** COVERAGE_BITS."""

NUMBERED_MESH, NUMBERED_CLUSTERS = 1, 2
"""Images of object 0 in the visibility buffer that stand for polygons, meshes drawn whole and by clusters; then the
second number is that of the record among those of the frame, times 2 ** COVERAGE_BITS. Only while false colours are
shown; otherwise image and second number of polygons are 0."""

PLACED_RECORD = np.dtype([("origin", "3f4"), ("rotation", "4f4"), ("scale", "f4")])
"""Where an object stands relative to the viewer, or to the shadow map's centre, metres; its quaternion; its scale."""

CAPTURED_RECORD = np.dtype([*((name, PLACED_RECORD[name]) for name in PLACED_RECORD.names or ()), ("row", "f4")])
"""The same for an object that captured views show, and the number of its row, which float32 holds exactly."""


def placed_records(origin: Array, objects: Objects) -> NDArray[np.void]:
    """Return the instance records of n objects.

    Positions are relative to `origin`, so that float32 is exact enough far from the world's origin, too.

    Parameters
    ----------
    origin
        (3,) the viewer or a shadow map's centre, metres, world.
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


def captured_records(origin: Array, objects: Objects, rows: Rows) -> NDArray[np.void]:
    """Return the instance records of the objects `rows` (n,), shown by captured views: (n,) CAPTURED_RECORD.

    origin: see `placed_records`.
    """
    placed, records = placed_records(origin, objects.take(rows)), np.zeros(len(rows), CAPTURED_RECORD)
    for name in placed.dtype.names or ():
        records[name] = placed[name]
    records["row"] = rows
    return records
