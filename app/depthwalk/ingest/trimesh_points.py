"""Take the points of a scan in a PLY file, or the centres of Gaussian splats, from what trimesh has read."""

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from trimesh import PointCloud as TrimeshPoints
from trimesh import Trimesh
from trimesh.visual.color import to_rgba

from depthwalk.ingest.point_cloud import PointCloud, joined_clouds, opaque_splats
from depthwalk.ingest.soup import srgb8_from_file, unit_normals
from depthwalk.types import Array


def joined_points(placed: Iterable[tuple[TrimeshPoints, Array]]) -> PointCloud:
    """Join point clouds into one.

    Parameters
    ----------
    placed
        The clouds, at least one, and their scene_from_cloud matrices (4, 4).

    Returns
    -------
    PointCloud
        All points, in the frame of the scene; those of clouds without colours are white if others have some.
    """
    return joined_clouds([_cloud(points, matrix) for points, matrix in placed])


def _cloud(points: TrimeshPoints, matrix: Array) -> PointCloud:
    """Return one cloud, placed by the matrix (4, 4)."""
    positions, linear = np.asarray(points.vertices, np.float64), matrix[:3, :3]
    normals = _file_normals(points)
    if np.linalg.det(linear):
        normals = unit_normals(normals @ np.linalg.inv(linear))
    with np.errstate(invalid="ignore"):  # points may be infinite; `cloud_soup` drops them
        placed = positions @ linear.T + matrix[:3, 3]
    colours = np.asarray(points.colors)
    has_colours = colours.shape == (len(points.vertices), 4)
    cloud = PointCloud(placed, normals, srgb_colours(colours, linear=False) if has_colours else None)
    harmonics = ply_columns(points, "f_dc_0", "f_dc_1", "f_dc_2")
    return cloud if harmonics is None else opaque_splats(cloud, harmonics, ply_columns(points, "opacity"))


def srgb_colours(values: NDArray[Any], *, linear: bool) -> NDArray[np.uint8]:
    """Return the sRGB colours (n, 3) of a file's `values`, (n, 3 or 4), 0 to 1 or, in uint8, to 255.

    Those of glTF are `linear`, of all other formats sRGB already.
    """
    if not linear:
        return to_rgba(np.array(values))[:, :3].astype(np.uint8)
    unit = values[:, :3] / 255.0 if values.dtype == np.uint8 else values[:, :3]  # dividing a signalling NaN warns
    return srgb8_from_file(unit)


def _file_normals(points: TrimeshPoints) -> NDArray[np.float64]:
    """Return the unit normals (n, 3) of the points of a PLY file; NaN without."""
    normals = ply_columns(points, "nx", "ny", "nz")
    return np.full(np.shape(points.vertices), np.nan) if normals is None else unit_normals(normals.astype(np.float64))


def ply_columns(drawn: Trimesh | TrimeshPoints, *names: str) -> NDArray[Any] | None:
    """Return the properties with these `names` of the vertices of a PLY file, (n, k) of their type; None without."""
    vertex: Any = drawn.metadata.get("_ply_raw", {}).get("vertex", {}).get("data", {})
    held = vertex.keys() if isinstance(vertex, dict) else vertex.dtype.names
    if not set(names) <= set(held) or len(vertex[names[0]]) != len(drawn.vertices):
        return None
    return np.column_stack([vertex[name] for name in names])
