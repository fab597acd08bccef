"""Evaluate the spherical harmonics by which ambient light depends on the direction that a surface faces.

Those up to the second order hold all of it but a hundredth (Ramamoorthi and Hanrahan 2001, "An Efficient Representation
for Irradiance Environment Maps").
"""

import numpy as np

from depthwalk.types import Array

LAMBERT = np.array([1, 2 / 3, 1 / 4, 2 / 3, 2 / 3, *[1 / 4] * 4])
"""Factors of the `polynomials` from radiance to the light on white surfaces, by the cosine of Lambert's law."""


def polynomials(normal: Array) -> Array:
    """Evaluate spherical harmonics up to the second order, not normalised, in given directions.

    Parameters
    ----------
    normal
        (n, 3) unit vectors.

    Returns
    -------
    Array
        (n, 9) values; the first three polynomials depend on y only.
    """
    x, y, z = normal.T
    return np.column_stack([np.ones_like(x), y, 3 * y * y - 1, x, z, x * x - z * z, x * y, y * z, z * x])
