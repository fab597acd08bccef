"""Choose levels of detail by how far their geometry is off, and by how many triangles a pixel may cost.

The paper's own rule, by distance alone, is in `render.lod.paper_lod`.
"""

import numpy as np

from depthwalk.render.view.view import View
from depthwalk.scene.render_settings import LodParams
from depthwalk.types import Array, Ints, Rows


def error_at_a_metre(view: View, lod: LodParams) -> float:
    """Return how far geometry one metre from the viewer may be off.

    Multiplied by an object's distance this is the geometric error that `lod.error` pixels allow for it.

    Parameters
    ----------
    view : the view of the picture.
    lod : the settings of detail.

    Returns
    -------
    Metres.
    """
    return lod.error * 2**lod.bias / view.focal_pixels


def error_level(error: Array, allowed: Array) -> Ints:
    """Return the coarsest level that is accurate enough; the finest, 0, where none is.

    Parameters
    ----------
    error : (n, levels) geometric error, metres, rising with the level; +inf where there is no such level.
    allowed : (n,) the error that each object may have, metres.

    Returns
    -------
    (n,) levels.
    """
    return np.asarray((error[:, 1:] <= allowed[:, None]).sum(1))


def affordable_level(triangles: Rows, pixels: Array, per_pixel: float) -> Ints:
    """Return the finest level with at most `per_pixel` triangles for each pixel that its object covers.

    An error bound knows nothing of how much lies within a texel: the borders of foliage make many triangles in a texel.

    Parameters
    ----------
    triangles : (n, levels) number of triangles, falling with the level.
    pixels : (n,) how many pixels each object covers.
    per_pixel : how many triangles a pixel may cost.

    Returns
    -------
    (n,) levels.
    """
    return np.asarray((triangles > per_pixel * pixels[:, None]).sum(1))
