"""Choose levels of detail by how far their geometry is off, and by how many triangles a pixel may cost.

The paper's own rule, by distance alone, is in `render.lod.paper_lod`.
"""

import numpy as np

from depthwalk.render.view.view import View
from depthwalk.scene.render_settings import LodParams
from depthwalk.types import Array, Ints, Rows


def error_at_a_metre(view: View, lod: LodParams) -> float:
    """Return how far geometry one metre from the viewer may be off, metres.

    Multiplied by an object's distance this is the geometric error that `lod.error` pixels allow for it.
    """
    return lod.error * 2**lod.bias / view.focal_pixels


def error_level(error: Array, allowed: Array) -> Ints:
    """Return the coarsest level (n,) that is accurate enough; the finest, 0, where none is.

    Parameters
    ----------
    error : (n, levels) geometric error, metres, rising with the level; +inf where there is no such level.
    allowed : (n,) metres.
    """
    return np.asarray((error[:, 1:] <= allowed[:, None]).sum(1))


def affordable_level(triangles: Rows, pixels: Array, per_pixel: float) -> Ints:
    """Return the finest level (n,) that has no more than `per_pixel` triangles for each pixel of its object.

    An error bound knows nothing of how much lies within a texel: the borders of foliage make many triangles there.

    Parameters
    ----------
    triangles : (n, levels), falling with the level.
    pixels : (n,) that each object covers.
    """
    return np.asarray((triangles > per_pixel * pixels[:, None]).sum(1))
