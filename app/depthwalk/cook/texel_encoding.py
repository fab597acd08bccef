"""Encode the texels of depth images in few bits: normals, depths modulo a period, colours as square roots."""

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.face_grid import FaceGrid
from depthwalk.bake.images import Cylinder, DepthImage
from depthwalk.parallel import batches
from depthwalk.types import Array

DEPTH_PERIOD = 128.0  # texels, after which depths repeat
_LENGTHS = 8  # of normals that are tried
_BATCH = 1 << 13  # normals at a time: their arrays stay in the CPU's cache


def image_texels(cylinder: Cylinder, image: DepthImage) -> NDArray[np.uint16]:
    """Encode the texels of a depth image as a virtual texture stores them.

    An empty texel gets the values of the nearest texel with a surface, so that filtering does not mix in black. Its
    depth code is the one that differs most from that texel's.

    Parameters
    ----------
    cylinder
        The volume whose face the image lies on, metres.
    image
        The depth image, (H, W) texels.

    Returns
    -------
    numpy.ndarray
        (H, W, 8) uint16: three numbers of the normal, as `encode_normals` returns them, and the `depth_code`, up to
        255; √linear RGB and specular strength, 65535 for 1.0.
    """
    solid = np.isfinite(image.depth)
    texels: NDArray[np.uint16] = np.zeros((*solid.shape, 8), np.uint16)
    if not solid.any():
        return texels
    texels[solid, :3] = encode_normals(image.shading_normal[solid])
    texels[solid, 3] = depth_code(image.depth[solid] / FaceGrid.of(cylinder, image).longest_texel)
    # Colours as square roots: 8 bits suffice, and one component may represent them.
    colour = np.clip(image.albedo[solid], 0, 1)
    colour[:, :3] = np.sqrt(colour[:, :3])
    texels[solid, 4:] = np.round(colour * 65535)
    if solid.all():
        return texels
    from scipy.ndimage import distance_transform_edt

    row, column = distance_transform_edt(~solid, return_distances=False, return_indices=True)
    texels = texels.reshape(-1, 8).take(row * solid.shape[1] + column, 0)
    texels[~solid, 3] ^= 128  # half a period farther away
    return texels


def depth_code(depth: Array) -> NDArray[np.uint8]:
    """Return `depth` (…), in texels, modulo `DEPTH_PERIOD`, as (…) uint8 in steps of half a texel.

    Complete depths in 8 bits could not distinguish surfaces a texel apart. The remainder can, because the depths that a
    shader compares never differ by half a period.
    """
    return np.round(depth * (256 / DEPTH_PERIOD)).astype(np.int64).astype(np.uint8)


def encode_normals(normal: Array) -> NDArray[np.uint8]:
    """Return unit vectors `normal` (n, 3) as (n, 3) uint8: (vector + 1) / 2 · 255.

    Each vector is first shortened by up to 11 %, to the length at which rounding changes its direction least. This
    halves the error (Kaplanyan 2010, "CryENGINE 3: Reaching the Speed of Light").
    """
    parts = [_encoded(np.ascontiguousarray(normal[batch].T)) for batch in batches(len(normal), _BATCH)]
    return np.concatenate(parts)


def _encoded(normal: Array) -> NDArray[np.uint8]:
    """Return the same as `encode_normals` for vectors (3, n), whose components are contiguous for speed."""
    largest = np.abs(normal).max(0).clip(1e-6)
    best, least_error = np.zeros(normal.shape, np.uint8), np.full(normal.shape[1], np.inf, normal.dtype)
    for shortened in range(_LENGTHS):
        # The largest component is exact.
        scale = (np.floor(127.5 * largest - 0.5) + 0.5 - shortened).clip(0.5) / largest
        code = np.floor(normal * scale + 128).clip(0, 255)
        decoded = code - 127.5
        error = np.square(decoded / np.sqrt(np.square(decoded).sum(0)) - normal).sum(0)
        better = error < least_error
        np.copyto(best, code, where=better, casting="unsafe")
        np.copyto(least_error, error, where=better)
    return best.T
