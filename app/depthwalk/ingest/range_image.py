"""Read depth images and range images: a file of depths, a picture, and a normal map.

A relief is seen by parallel rays, a range image through a pinhole: by a depth camera, or all round, as a cylindrical
panorama. Normals are fitted to the depth if no normal map is given.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from depthwalk.errors import InputError
from depthwalk.ingest.depth_file import read_depth
from depthwalk.ingest.depth_surface import fit_planes
from depthwalk.ingest.image import PlanarImage, load_texture

_SEAM = 2  # columns beyond the seam of a panorama that are used to fit normals
_PLAIN = 204  # sRGB, light grey: the colour of surfaces without a picture


@dataclass(frozen=True, kw_only=True)
class Intrinsics:
    """Describe a pinhole camera without distortion, which maps points in space to pixels of a depth image.

    Attributes
    ----------
    fx, fy
        Horizontal and vertical focal length, pixels.
    cx, cy
        Principal point, pixels; 0, 0 is the centre of the first pixel, which is at the top left in files.
    """

    fx: float
    fy: float
    cx: float
    cy: float

    @property
    def focal(self) -> float:
        """Return the smaller focal length, pixels."""
        return min(self.fx, self.fy)

    def rays(self, shape: tuple[int, int]) -> NDArray[np.float64]:
        """Return the point (H, W, 3), camera frame, at depth 1 that each pixel of a picture of `shape` (H, W) sees."""
        height, width = shape
        x, y = (np.arange(width) - self.cx) / self.fx, (np.arange(height) - self.cy) / self.fy
        return np.stack(np.broadcast_arrays(x[None], y[:, None], -1.0), -1)


@dataclass(frozen=True, kw_only=True)
class PanoramaLens:
    """Describe the camera of a cylindrical panorama: a pinhole inside a cylinder (McMillan and Bishop 1995).

    Each column of the picture sees one direction of the compass: the middle one −z, those to its right further right.
    Depth is the horizontal distance from the cylinder's axis, +Y through the pinhole. Pixels are square.

    Attributes
    ----------
    width
        Columns of the picture, a full turn.
    horizon
        Row of the horizon; 0 is the centre of the first row, which is at the top in files.
    """

    width: int
    horizon: float

    @property
    def focal(self) -> float:
        """Return the cylinder's radius, pixels."""
        return self.width / (2 * np.pi)

    def rays(self, shape: tuple[int, int]) -> NDArray[np.float64]:
        """Return the point (H, W, 3), camera frame, at depth 1 that each pixel of a picture of `shape` (H, W) sees."""
        turn = 2 * np.pi * ((np.arange(shape[1]) + 0.5) / self.width - 0.5)
        y = (np.arange(shape[0]) - self.horizon) / self.focal
        return np.stack(np.broadcast_arrays(np.sin(turn)[None], y[:, None], -np.cos(turn)[None]), -1)


@dataclass(frozen=True, kw_only=True)
class RangeImage:
    """Hold the image of a depth camera, in its frame: x right, y up, z toward the camera, which is at the origin.

    Attributes
    ----------
    depth : (H, W) float32
        Metres along the camera's axis, or for a panorama from its cylinder's axis; row 0 at the bottom; +inf where
        nothing was measured.
    colour : (H, W, 3) uint8
        sRGB.
    normal : (H, W, 3) float32
        Unit length, in the camera's frame.
    lens : Intrinsics or PanoramaLens
        The camera; here `cy` or `horizon` is counted from row 0, which is at the bottom.
    """

    depth: NDArray[np.float32]
    colour: NDArray[np.uint8]
    normal: NDArray[np.float32]
    lens: Intrinsics | PanoramaLens

    @cached_property
    def points(self) -> NDArray[np.float32]:
        """Return the points (H, W, 3) float32 that the camera saw in each pixel, metres, camera frame.

        They are (0, 0, −inf) where nothing was measured.
        """
        rays = self.lens.rays((self.depth.shape[0], self.depth.shape[1]))
        known = np.isfinite(self.depth)[..., None]
        points = np.where(known, self.depth[..., None], 0) * rays
        return np.where(known, points, [0, 0, -np.inf]).astype(np.float32)


def load_depth_image(
    depth: Path,
    *,
    size: tuple[float, float],
    depth_range: float | None = None,
    unit: float | None = None,
    colour: Path | None = None,
    normal: Path | None = None,
) -> PlanarImage:
    """Read a relief from picture files.

    Parameters
    ----------
    depth
        The file of depths below the front plane: floats (NPY, EXR channel Z, TIFF) or grey of 8 or 16 bits. See
        `read_depth` for what counts as empty.
    size
        Width and height of the image, metres.
    depth_range
        Metres between white, at the plane, and black, for grey without `unit`; None if it is unknown.
    unit
        Metres per unit of the file, in which 0 means no surface; None: floats are metres.
    colour
        A picture in sRGB, resampled to the depth's resolution; None: light grey.
    normal
        RGB normal map, x right, y up, z toward the viewer, resampled likewise; None: fitted to the depth.

    Returns
    -------
    PlanarImage
        The relief, row 0 at the bottom.

    Raises
    ------
    InputError
        `path: defect`, if a file cannot be used or a number is not positive.
    """
    _check_positive(depth, size=min(size), range=depth_range, unit=unit)
    metres = read_depth(depth, depth_range=depth_range, unit=unit, camera=False)[::-1].copy()
    shape = (metres.shape[1], metres.shape[0])
    picture = _picture(colour, shape)
    if normal is not None:
        directions = _decoded_normals(_resampled(normal, shape))
        return PlanarImage(depth=metres, colour=picture, normal=directions, size=size)
    cell = size[0] / shape[0], size[1] / shape[1]
    _, right, up = fit_planes(metres, max(cell))
    directions = _directions(right / cell[0], up / cell[1], np.ones(metres.shape))
    return PlanarImage(depth=metres, colour=picture, normal=directions, size=size)


def load_range_image(
    depth: Path,
    *,
    lens: Intrinsics,
    unit: float | None = None,
    colour: Path | None = None,
    normal: Path | None = None,
) -> RangeImage:
    """Read a range image, the picture of a depth camera, from files.

    Parameters
    ----------
    depth
        The file of depths along the camera's axis; 0 always means that nothing was measured.
    lens
        The camera, its `cy` counted from the top.
    unit
        Metres per unit of the file; None: floats are metres.
    colour
        A picture in sRGB, resampled to the depth's resolution; None: light grey.
    normal
        RGB normal map, x right, y up, z toward the camera, resampled likewise; None: fitted to the depth.

    Returns
    -------
    RangeImage
        The range image, row 0 at the bottom.

    Raises
    ------
    InputError
        `path: defect`, if a file cannot be used or a number is not positive.
    """
    _check_positive(depth, fx=lens.fx, fy=lens.fy, unit=unit)
    metres = read_depth(depth, depth_range=None, unit=unit, camera=True)[::-1].copy()
    height, width = metres.shape
    lens = replace(lens, cy=height - 1 - lens.cy)
    picture = _picture(colour, (width, height))
    if normal is not None:
        directions = _decoded_normals(_resampled(normal, (width, height)))
    else:
        directions = _camera_normals(metres, lens)
    return RangeImage(depth=metres, colour=picture, normal=directions, lens=lens)


def load_panorama(
    depth: Path, *, horizon: float | None = None, unit: float | None = None, colour: Path | None = None
) -> RangeImage:
    """Read a cylindrical panorama with depth from files.

    Parameters
    ----------
    depth
        The file of horizontal distances from the cylinder's axis, a full turn; 0 always means that nothing was
        measured.
    horizon
        Row of the horizon, counted from the top; None: the middle of the picture.
    unit
        Metres per unit of the file; None: floats are metres.
    colour
        A picture in sRGB, resampled to the depth's resolution; None: light grey.

    Returns
    -------
    RangeImage
        The panorama, row 0 at the bottom; its normals are fitted to the depth.

    Raises
    ------
    InputError
        `path: defect`, if a file cannot be used or a number is not positive.
    """
    _check_positive(depth, unit=unit)
    metres = read_depth(depth, depth_range=None, unit=unit, camera=True)[::-1].copy()
    height, width = metres.shape
    row = (height - 1) / 2 if horizon is None else height - 1 - horizon
    lens = PanoramaLens(width=width, horizon=row)
    picture = _picture(colour, (width, height))
    return RangeImage(depth=metres, colour=picture, normal=_panorama_normals(metres, lens), lens=lens)


def _camera_normals(metres: NDArray[np.float32], lens: Intrinsics) -> NDArray[np.float32]:
    """Return normals (H, W, 3) fitted to depth.

    A plane m · P = 1 has the inverse depth m · ray, which is linear over the image, so that fitting it yields m.
    """
    inverse = 1 / metres.astype(np.float64)
    inverse[~np.isfinite(metres)] = np.nan
    centre, right, up = fit_planes(inverse, inverse / min(lens.fx, lens.fy))
    x, y = right * lens.fx, up * lens.fy
    rays = lens.rays((metres.shape[0], metres.shape[1]))
    z = x * rays[..., 0] + y * rays[..., 1] - centre
    return _directions(-x, -y, -z)  # m points away from the camera


def _panorama_normals(metres: NDArray[np.float32], lens: PanoramaLens) -> NDArray[np.float32]:
    """Return normals (H, W, 3) fitted to depth.

    A plane m · P = 1 has the inverse depth m · ray. Its change along a column is the component of m along y, its change
    along a row the component to the right; the remaining component points away from the axis.
    """
    inverse = 1 / metres.astype(np.float64)
    inverse[~np.isfinite(metres)] = np.nan
    round_about = np.pad(inverse, ((0, 0), (_SEAM, _SEAM)), mode="wrap")
    centre, right, up = (part[:, _SEAM:-_SEAM] for part in fit_planes(round_about, round_about / lens.focal))
    rays = lens.rays((metres.shape[0], metres.shape[1]))
    x, height, z = np.moveaxis(rays, -1, 0)
    to_right, upward = right * lens.focal, up * lens.focal
    outward = centre - height * upward
    return _directions(-outward * x + to_right * z, -upward, -outward * z - to_right * x)  # m points away


def _directions(x: NDArray[np.float64], y: NDArray[np.float64], z: NDArray[np.float64]) -> NDArray[np.float32]:
    """Return unit vectors (H, W, 3) along x, y, z; toward the viewer where those are not finite."""
    vectors = np.stack([x, y, z], -1)
    vectors[~np.isfinite(vectors).all(-1)] = [0, 0, 1]
    return np.asarray(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True), np.float32)


def _decoded_normals(picture: NDArray[np.uint8]) -> NDArray[np.float32]:
    directions = picture.astype(np.float32) * np.float32(2 / 255) - 1
    directions[..., 2] = np.maximum(directions[..., 2], 1e-3)  # no surface of a depth image faces away
    return np.asarray(directions / np.linalg.norm(directions, axis=-1, keepdims=True))


def _picture(path: Path | None, shape: tuple[int, int]) -> NDArray[np.uint8]:
    return np.full((shape[1], shape[0], 3), _PLAIN, np.uint8) if path is None else _resampled(path, shape)


def _resampled(path: Path, shape: tuple[int, int]) -> NDArray[np.uint8]:
    """Return a picture (H, W, 3) uint8, resampled to `shape` = (W, H), row 0 at the bottom."""
    from PIL import Image

    picture = Image.fromarray(np.ascontiguousarray(load_texture(path)[..., :3]))
    if picture.size != shape:
        picture = picture.resize(shape, Image.Resampling.BICUBIC)
    return np.array(picture)[::-1].copy()


def _check_positive(path: Path, **values: float | None) -> None:
    for name, value in values.items():
        if value is not None and not (np.isfinite(value) and value > 0):
            raise InputError(f"{path}: {name} must be positive and finite, not {value:g}")
