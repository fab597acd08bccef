"""Look colours up by stored texture coordinates, as shaders/common/texture_coordinates.glsl does, with NumPy."""

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.images import COORDINATE_STEPS, HAS_COORDINATES, ONE_CHART, Cylinder, Face, plane_axes
from depthwalk.cook.virtual_texture import FLATTEST
from depthwalk.types import Array, Mask

_CORNERS = np.array([(0, 0), (1, 0), (0, 1), (1, 1)])  # columns and rows of four texels


def coordinates_at(
    codes: NDArray[np.uint16], place: Array, border: bool = False
) -> tuple[NDArray[np.float64], NDArray[np.float64], Mask]:
    """Return texture coordinates between texels.

    Between four texels of one chart they are interpolated. Elsewhere they are extrapolated from the nearest texel if it
    has any, at the rate at which they change in the cell on its far side, if that cell is in one chart.

    Parameters
    ----------
    codes
        (H, W, 2) uint16, see `DepthImage.coordinates`.
    place
        (n, 2) columns and rows, texels; 0.5 is the centre of the first texel. At least 1.5 texels from the edges.
    border
        Whether four texels may show several surfaces even if they are in one chart.

    Returns
    -------
    coordinates
        (n, 2) u and v, modulo 1.
    slope
        (n, 2, 2) change from texel to texel: rows u and v, columns to the right and upward.
    has
        (n,) bool, whether there are coordinates.
    """
    low = np.floor(place - 0.5).astype(int)
    f = place - 0.5 - low
    at = [_fetch(codes, low + corner) for corner in _CORNERS]
    right, above = _shortest(at[1] - at[0]), _shortest(at[2] - at[0])
    bend = _shortest(at[3] - at[0]) - right - above
    x, y = f[:, :1], f[:, 1:]
    inside = at[0] + x * right + y * above + x * y * bend
    inside_slope = np.stack([right + y * bend, above + x * bend], -1)
    whole = _marked(codes, low, 1, ONE_CHART) & (not border)

    g = 1 - f
    weight = np.stack([g[:, 0] * g[:, 1], f[:, 0] * g[:, 1], g[:, 0] * f[:, 1], f[:, 0] * f[:, 1]])
    known = np.stack([_marked(codes, low + corner, 0, HAS_COORDINATES) for corner in _CORNERS])
    most = weight.argmax(0)
    corner = np.stack([most & 1, most >> 1], -1)
    outward, middle = 2 * corner - 1, low + corner
    own = _fetch(codes, middle)
    goes_on = _marked(codes, middle + corner - 1, 1, ONE_CHART)
    steps = [
        _shortest(_fetch(codes, middle + outward * axis) - own) * (outward * axis).sum(1, keepdims=True)
        for axis in np.eye(2, dtype=int)
    ]
    slope = np.where(goes_on[:, None, None], np.stack(steps, -1), 0)
    beside = own + np.einsum("nij,nj->ni", slope, f - corner)
    coordinates = np.where(whole[:, None], inside, beside) % 1.0
    return (
        coordinates,
        np.where(whole[:, None, None], inside_slope, slope),
        whole | np.take_along_axis(known, most[None], 0)[0],
    )


def step_within(
    cylinder: Cylinder, face: Face, point: Array, normal: Array, sight: Array, change: Array
) -> NDArray[np.float64]:
    """Return how far a point of a face moves within its image for one pixel's step along the surface.

    Parameters
    ----------
    cylinder
        The volume that the face bounds, object frame, metres.
    face
        The face.
    point
        (n, 3) points of the surface, object frame, metres.
    normal
        (n, 3) unit normals, object frame.
    sight
        (n, 3) vectors from the viewer to the points, metres.
    change
        (n, 3) change of `sight` from one pixel to the next for a surface perpendicular to it, metres.

    Returns
    -------
    numpy.ndarray
        (n, 2) parts of the image's width and height.
    """
    facing = np.minimum(_dot(normal, sight), -FLATTEST * np.linalg.norm(sight, axis=1, keepdims=True))
    moved = change - sight * _dot(normal, change) / facing
    if face is Face.SIDE:
        x, z = point[:, 0], point[:, 2]
        turned = (x * moved[:, 2] - z * moved[:, 0]) / (2 * np.pi * np.maximum(x**2 + z**2, 1e-12))
        return np.stack([turned, moved[:, 1] / cylinder.height], -1)
    across, up = plane_axes(face)
    return np.asarray(moved[:, [across, up]] / cylinder.box[1][[across, up]])


def _fetch(codes: NDArray[np.uint16], at: NDArray[np.integer]) -> NDArray[np.float64]:
    """Return the coordinates (n, 2) of the texels `at` (n, 2), columns and rows."""
    return np.asarray((codes[at[:, 1], at[:, 0]] & ~np.uint16(1)) / COORDINATE_STEPS)


def _marked(codes: NDArray[np.uint16], at: NDArray[np.integer], part: int, mark: int) -> Mask:
    """Return which texels `at` (n, 2), columns and rows, have a `mark` in u (part 0) or v (1)."""
    return np.asarray(codes[at[:, 1], at[:, 0], part] & mark > 0)


def _shortest(difference: Array) -> NDArray[np.float64]:
    """Wrap differences of coordinates, which repeat after 1, to −1/2 … 1/2."""
    return np.asarray((difference + 0.5) % 1.0 - 0.5)


def _dot(a: Array, b: Array) -> NDArray[np.float64]:
    return np.asarray((a * b).sum(1, keepdims=True))
