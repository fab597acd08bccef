"""Encode the texels of depth images in few bits: normals, depths modulo a period, colours as square roots."""

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.face_grid import FaceGrid
from depthwalk.bake.images import Cylinder, DepthImage
from depthwalk.types import Array

DEPTH_PERIOD = 128.0  # texels, after which depths repeat
_LENGTHS = 8  # of normals that are tried


def image_texels(cylinder: Cylinder, image: DepthImage) -> NDArray[np.uint16]:
    """Return the texels of a depth image as a virtual texture stores them.

    An empty texel gets the values of the nearest one that is not, so that filtering meets no black, and the depth that
    is farthest from that one's.

    Parameters
    ----------
    cylinder
        The volume whose face the image lies on.
    image
        One layer, (H, W) texels.

    Returns
    -------
    NDArray[np.uint16]
        (H, W, 8): encoded normal (3, of 255), `depth_code` (of 255), √linear RGB and specular strength (4, of 65535).
    """
    # Colours as square roots: 8 bits suffice, and one component may stand for them.
    colour = np.sqrt(np.maximum(image.albedo[..., :3], 0))
    colours = np.round(np.clip(np.concatenate([colour, image.albedo[..., 3:]], -1), 0, 1) * 65535).astype(np.uint16)
    solid = np.isfinite(image.depth)
    depth = np.where(solid, image.depth, 0) / FaceGrid.of(cylinder, image).longest_texel
    normal = np.zeros_like(image.normal, np.uint8)
    normal[solid] = encode_normals(image.normal[solid])
    texels = np.concatenate([normal, depth_code(depth)[..., None], colours], -1)
    if not solid.all() and solid.any():
        from scipy.ndimage import distance_transform_edt

        rows, columns = distance_transform_edt(~solid, return_distances=False, return_indices=True)
        texels = texels[rows, columns]
        texels[~solid, 3] ^= 128  # half the period farther
    return texels


def depth_code(depth: Array) -> NDArray[np.uint8]:
    """Return the remainders (…) of depths (…), in texels, by `DEPTH_PERIOD`, as numbers of 8 bits.

    In 8 bits whole depths would not tell surfaces a texel apart; what a shader compares is never half a period off.
    """
    return np.round(depth * (256 / DEPTH_PERIOD)).astype(np.int64).astype(np.uint8)


def encode_normals(normal: Array) -> NDArray[np.uint8]:
    """Return unit vectors (n, 3) in 8 bits per component, (normal + 1) / 2 but for their length.

    Of vectors up to 11 % shorter, that is chosen whose direction rounding changes least, which halves the error
    (Kaplanyan 2010, "CryENGINE 3: Reaching the Speed of Light").
    """
    largest = np.abs(normal).max(1, keepdims=True).clip(1e-6)
    best, least_error = np.zeros(normal.shape, np.uint8), np.full(len(normal), np.inf)
    for shortened in range(_LENGTHS):
        # The largest component is exact.
        scale = (np.floor(127.5 * largest - 0.5) + 0.5 - shortened).clip(0.5) / largest
        code = np.floor(normal * scale + 128).clip(0, 255)
        decoded = code - 127.5
        error = np.square(decoded / np.linalg.norm(decoded, axis=1, keepdims=True) - normal).sum(1)
        better = error < least_error
        best[better], least_error[better] = code[better], error[better]
    return best
