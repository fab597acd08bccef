"""Turn normals as tangent-space normal maps say, as the twin of shaders/common/normal_map.glsl.

The tangent frame comes from derivatives along the rows and columns of the picture: Schüler 2013, "Followup: Normal
Mapping Without Precomputed Tangents".
"""

import numpy as np

from depthwalk.geometry.tangent_frames import tangents, turned_normals
from depthwalk.types import Array


def mapped_normals(
    normal: Array, place_steps: tuple[Array, Array], uv_steps: tuple[Array, Array], texel: Array, scale: float = 1.0
) -> Array:
    """Return the normals that surfaces with a normal map are lit by.

    Parameters
    ----------
    normal
        (n, 3) interpolated normals, of any length above 0.
    place_steps
        Two (n, 3), metres: how the seen point moves from a pixel to the next one to the right, and to the one above.
    uv_steps
        Two (n, 2): how its texture coordinates change, v upward.
    texel
        (n, 3) texels of the normal map, 0 to 1.
    scale
        Factor on x and y of the normals in the map.

    Returns
    -------
    Array
        (n, 3) unit normals, on the side to which `normal` points.
    """
    unit = normal / np.linalg.norm(normal, axis=1, keepdims=True)
    mapped = (2 * texel - 1) * [scale, scale, 1]
    return turned_normals(unit, tangents(*place_steps, *uv_steps), mapped)
