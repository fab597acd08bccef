"""Tell foliage, of which a viewer among the leaves sees the backs, from the surfaces of solids."""

import numpy as np

from depthwalk.geometry.adjacency import Shape
from depthwalk.geometry.triangles import doubled_areas
from depthwalk.geometry.vectors import lengths

# Times the area of the box around an object. A convex surface has at most that of its box; of the shipped models,
# hedge and trees have 2.2 to 3.3, solids at most 1.3, and a column with ivy has 1.7.
_FOLDED = 2.0


def is_foliage(shape: Shape) -> bool:
    """Return whether a surface is too large for its box to be that of a solid, and hence consists of many leaves.

    Depth images show leaves only from the side that faces their rays. From within a crown one looks at their backs.

    Parameters
    ----------
    shape
        Positions (v, 3), metres, and triangles (t, 3), rows of these: an object in all its detail.

    Returns
    -------
    bool
        True for foliage.
    """
    points, triangles = shape
    if not len(triangles):
        return False
    x, y, z = np.ptp(points[triangles], axis=(0, 1)).tolist()
    area = lengths(doubled_areas(points, triangles)).sum() / 2
    return bool(area > _FOLDED * 2 * (x * y + y * z + z * x))
