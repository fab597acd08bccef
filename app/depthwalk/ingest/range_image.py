"""Depth images and range images as assets: a file of depths, a picture, and normals, fitted where there are none."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from depthwalk.errors import InputError
from depthwalk.ingest.depth_file import read_depth
from depthwalk.ingest.depth_surface import fit_planes
from depthwalk.ingest.image import PlanarImage, load_texture

_PLAIN = 204  # sRGB of what has no picture


@dataclass(frozen=True)
class Intrinsics:
    """A pinhole without distortion: focal lengths and principal point in pixels of the depth image, the centre of its
    first pixel (top left in the file) at 0, 0."""

    fx: float
    fy: float
    cx: float
    cy: float


@dataclass(frozen=True)
class RangeImage:
    """What a depth camera sees, in its frame: x right, y up, z toward the camera, which is at the origin; row 0 at the
    bottom.

    depth:  (H, W) float32, metres along the camera's axis; +inf where nothing was measured.
    colour: (H, W, 3) uint8, sRGB.
    normal: (H, W, 3) float32, unit length.
    lens:   as of the file, but `cy` counted from row 0 here.
    """

    depth: NDArray[np.float32]
    colour: NDArray[np.uint8]
    normal: NDArray[np.float32]
    lens: Intrinsics

    @cached_property
    def points(self) -> NDArray[np.float32]:
        """The point (H, W, 3) that each pixel saw, metres; z = −depth, and (0, 0, −inf) where nothing was measured."""
        rays = _rays(self.lens, (self.depth.shape[0], self.depth.shape[1]))
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
    """A planar depth image, orthographic, from files whose row 0 is at the top, as everywhere on disk.

    depth:  metres below the front plane: floats (NPY, EXR channel Z, TIFF), `unit` metres each, 1 by default; or grey
            of 8 or 16 bits, `unit` metres per count with 0 for no surface, or, without `unit`, white at the plane and
            black `depth_range` metres below it. See `read_depth` for what counts as empty.
    size:   (width, height) in metres.
    colour: sRGB picture, light grey where None. normal: RGB normal map, x right, y up, z toward the viewer; where None
            the normals are fitted to the depth. Both are resampled to the depth's resolution.

    Raises InputError.
    """
    _check_positive(depth, size=min(size), range=depth_range, unit=unit)
    metres = read_depth(depth, depth_range=depth_range, unit=unit, camera=False)[::-1].copy()
    shape = (metres.shape[1], metres.shape[0])
    picture = _picture(colour, shape)
    if normal is not None:
        return PlanarImage(metres, picture, _decoded_normals(_resampled(normal, shape)), size)
    cell = size[0] / shape[0], size[1] / shape[1]
    _, right, up = fit_planes(metres, max(cell))
    return PlanarImage(metres, picture, _directions(right / cell[0], up / cell[1], np.ones(metres.shape)), size)


def load_range_image(
    depth: Path,
    *,
    lens: Intrinsics,
    unit: float | None = None,
    colour: Path | None = None,
    normal: Path | None = None,
) -> RangeImage:
    """A range image from files whose row 0 is at the top: parameters as of `load_depth_image`, but that depth is
    measured along the axis of a pinhole camera and 0 always means that nothing was. Raises InputError."""
    _check_positive(depth, fx=lens.fx, fy=lens.fy, unit=unit)
    metres = read_depth(depth, depth_range=None, unit=unit, camera=True)[::-1].copy()
    height, width = metres.shape
    lens = Intrinsics(lens.fx, lens.fy, lens.cx, height - 1 - lens.cy)
    picture = _picture(colour, (width, height))
    if normal is not None:
        return RangeImage(metres, picture, _decoded_normals(_resampled(normal, (width, height))), lens)
    return RangeImage(metres, picture, _camera_normals(metres, lens), lens)


def _rays(lens: Intrinsics, shape: tuple[int, int]) -> NDArray[np.float64]:
    """The point (H, W, 3) at depth 1 that each pixel sees."""
    height, width = shape
    x, y = (np.arange(width) - lens.cx) / lens.fx, (np.arange(height) - lens.cy) / lens.fy
    return np.stack(np.broadcast_arrays(x[None], y[:, None], -1.0), -1)


def _camera_normals(metres: NDArray[np.float32], lens: Intrinsics) -> NDArray[np.float32]:
    """A plane m · P = 1 has inverse depth m · ray, which is linear over the image: fitting that yields m."""
    inverse = 1 / metres.astype(np.float64)
    inverse[~np.isfinite(metres)] = np.nan
    centre, right, up = fit_planes(inverse, inverse / min(lens.fx, lens.fy))
    x, y = right * lens.fx, up * lens.fy
    rays = _rays(lens, (metres.shape[0], metres.shape[1]))
    z = x * rays[..., 0] + y * rays[..., 1] - centre
    return _directions(-x, -y, -z)  # m points away from the camera


def _directions(x: NDArray[np.float64], y: NDArray[np.float64], z: NDArray[np.float64]) -> NDArray[np.float32]:
    """Unit vectors (H, W, 3); toward the viewer where there are none."""
    vectors = np.stack([x, y, z], -1)
    vectors[~np.isfinite(vectors).all(-1)] = [0, 0, 1]
    return (vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)).astype(np.float32)


def _decoded_normals(picture: NDArray[np.uint8]) -> NDArray[np.float32]:
    directions = picture.astype(np.float32) * np.float32(2 / 255) - 1
    directions[..., 2] = np.maximum(directions[..., 2], 1e-3)  # a depth image has no surface that faces away
    return directions / np.linalg.norm(directions, axis=-1, keepdims=True)


def _picture(path: Path | None, shape: tuple[int, int]) -> NDArray[np.uint8]:
    return np.full((shape[1], shape[0], 3), _PLAIN, np.uint8) if path is None else _resampled(path, shape)


def _resampled(path: Path, shape: tuple[int, int]) -> NDArray[np.uint8]:
    """(H, W, 3) uint8 at `shape` = (W, H), row 0 at the bottom."""
    from PIL import Image

    picture = Image.fromarray(np.ascontiguousarray(load_texture(path)[..., :3]))
    if picture.size != shape:
        picture = picture.resize(shape, Image.Resampling.BICUBIC)
    return np.array(picture)[::-1].copy()


def _check_positive(path: Path, **values: float | None) -> None:
    for name, value in values.items():
        if value is not None and not (np.isfinite(value) and value > 0):
            raise InputError(f"{path}: {name} must be positive and finite, not {value:g}")
