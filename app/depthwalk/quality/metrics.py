"""Compute how much two pictures of one object differ.

These are pure functions over arrays, independent of how the pictures were made.
"""

import flip_evaluator
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_erosion

from depthwalk.types import Mask, Picture

FLIP_PIXELS_PER_DEGREE = 67.02064  # the paper's: 0.7 m from a screen 0.7 m and 3840 pixels wide
FLIP_REACH = 16  # pixels; no filter of FLIP's reaches farther at this density
HOLE_MARGIN = 2  # pixels by which the silhouette is eroded before searching for holes


def psnr(reference: Picture, test: Picture, where: Mask) -> float:
    """Return the peak signal-to-noise ratio of two pictures over some pixels: 10·log10(255² / MSE).

    MSE is the mean squared error over those pixels and all channels.

    Parameters
    ----------
    reference
        (H, W, 3) uint8, sRGB.
    test
        (H, W, 3) uint8, sRGB.
    where
        (H, W) bool: the pixels that count.

    Returns
    -------
    float
        dB; +inf if the pictures are equal.
    """
    difference = reference[where].astype(np.float64) - test[where]
    error = float(np.mean(difference**2)) if difference.size else 0.0
    return float("inf") if error == 0 else float(10 * np.log10(255**2 / error))


def silhouette_iou(reference: Mask, test: Mask) -> float:
    """Return the intersection over union, 0 to 1, of the silhouettes `reference` and `test`, (H, W) bool each.

    It is 1 if both are empty.
    """
    union = int((reference | test).sum())
    return float((reference & test).sum() / union) if union else 1.0


def flip_map(reference: Picture, test: Picture) -> NDArray[np.float32]:
    """Return how clearly a viewer who flips between two pictures would see them differ at each pixel.

    This is FLIP (Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström and Fairchild 2020, "FLIP: A Difference
    Evaluator for Alternating Images"), in its authors' implementation for low dynamic range.

    Parameters
    ----------
    reference
        (H, W, 3) uint8, sRGB.
    test
        (H, W, 3) uint8, sRGB.

    Returns
    -------
    numpy.ndarray
        (H, W) float32, 0 to 1.
    """
    return np.asarray(_flip(reference, test, colours=False)[..., 0], np.float32)


def flip_colours(reference: Picture, test: Picture) -> Picture:
    """Return the `flip_map` of two pictures as a picture, in the colours of FLIP's authors.

    Parameters
    ----------
    reference, test
        (H, W, 3) uint8, sRGB.

    Returns
    -------
    Picture
        (H, W, 3) uint8, sRGB; equal pixels are black.
    """
    return np.round(np.clip(_flip(reference, test, colours=True), 0, 1) * 255).astype(np.uint8)


def mean_flip(reference: Picture, test: Picture, where: Mask) -> float:
    """Return the mean of the `flip_map` of two pictures over some pixels.

    Parameters
    ----------
    reference, test
        (H, W, 3) uint8, sRGB.
    where
        (H, W) bool: the pixels that count.

    Returns
    -------
    float
        0 to 1; 0 if no pixel counts.
    """
    return float(flip_map(reference, test)[where].mean(dtype=np.float64)) if where.any() else 0.0


def hole_map(reference: Mask, test: Mask) -> Mask:
    """Find the holes of a picture: the pixels well inside the reference's silhouette that show nothing.

    Parameters
    ----------
    reference, test
        (H, W) bool: the pixels that show the object.

    Returns
    -------
    Mask
        (H, W) bool; pixels within `HOLE_MARGIN` of the edge of the reference's silhouette are not holes.
    """
    square = np.ones((2 * HOLE_MARGIN + 1,) * 2, bool)
    inside = binary_erosion(reference, square, border_value=1)  # the picture's edge is not part of the silhouette
    return np.asarray(inside & ~test)


def hole_percent(reference: Mask, test: Mask) -> float:
    """Return the number of pixels in the `hole_map` of two silhouettes, per cent of the pixels of the reference.

    Parameters
    ----------
    reference, test
        (H, W) bool: the pixels that show the object.

    Returns
    -------
    float
        0 to 100; 0 if the reference shows nothing.
    """
    covered = int(reference.sum())
    return 100 * float(hole_map(reference, test).sum()) / covered if covered else 0.0


def depth_errors(reference: NDArray[np.float32], test: NDArray[np.float32], unit: float = 1.0) -> tuple[float, float]:
    """Return median and 99th percentile of |test − reference| / unit where both distances are finite.

    Parameters
    ----------
    reference, test
        (H, W) float32, metres along the view axis, +inf where there is nothing.
    unit
        Unit by which errors are divided, metres.

    Returns
    -------
    tuple[float, float]
        Median and percentile; NaN, NaN if the pictures share no pixel.
    """
    common = np.isfinite(reference) & np.isfinite(test)
    if not common.any():
        return float("nan"), float("nan")
    error = np.abs(test[common].astype(np.float64) - reference[common]) / unit
    median, high = np.percentile(error, (50, 99))
    return float(median), float(high)


def bounding_window(where: Mask, margin: int) -> tuple[slice, slice]:
    """Return the smallest window of a picture that holds all selected pixels and a margin around them.

    Parameters
    ----------
    where
        (H, W) bool: the selected pixels, of which there must be at least one.
    margin
        Width of the margin, pixels; the picture's edge may cut it off.

    Returns
    -------
    tuple[slice, slice]
        The rows and the columns.
    """
    rows, columns = np.flatnonzero(where.any(1)), np.flatnonzero(where.any(0))
    return tuple(slice(max(0, int(run[0]) - margin), int(run[-1]) + 1 + margin) for run in (rows, columns))  # type: ignore[return-value]


def _flip(reference: Picture, test: Picture, colours: bool) -> NDArray[np.float32]:
    pictures = (np.ascontiguousarray(picture, np.float32) / 255 for picture in (reference, test))
    options = {"applyMagma": colours, "computeMeanError": False, "parameters": {"ppd": FLIP_PIXELS_PER_DEGREE}}
    return np.asarray(flip_evaluator.evaluate(*pictures, "LDR", **options)[0], np.float32)
