"""Twin of shaders/light/light.frag."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating]


def phong(
    albedo: Array,
    specular: Array,
    shininess: Array,
    normal: Array,
    view: Array,
    to_sun: Array,
    sun: Array,
    ambient: Array,
) -> Array:
    """Linear RGB (n, 3). albedo (n, 3); specular, shininess (n,); normal, view (n, 3) unit, world, `view` from the
    viewer to the surface; to_sun (3,) unit; sun, ambient (3,) linear."""
    lambert = np.maximum(normal @ to_sun, 0)
    mirrored = view - 2 * np.einsum("ni,ni->n", view, normal)[:, None] * normal
    highlight = np.where(lambert > 0, specular * np.maximum(mirrored @ to_sun, 0) ** np.maximum(shininess, 1), 0)
    everywhere = ambient * (0.75 + 0.25 * normal[:, 1:2])
    return albedo * (everywhere + sun * lambert[:, None]) + sun * highlight[:, None]
