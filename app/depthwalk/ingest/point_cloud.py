"""Turn the points of a scan into a mesh, so that all that is done with meshes can be done with scans."""

import logging
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from depthwalk.budget import check_memory
from depthwalk.errors import InputError
from depthwalk.geometry.triangles import row_ids
from depthwalk.ingest.formats import LAS_SUFFIXES
from depthwalk.ingest.materials import plain_material, without_light
from depthwalk.ingest.soup import Soup, check_mesh_memory, check_triangle_count
from depthwalk.types import Rows

log = logging.getLogger(__name__)

_POINT_BYTES = 2000  # peak memory of `point_surface` for each point, measured with 300,000 and a million
_TOLD = 0.02  # of all points: if more are on no surface, it is told; a few are stray
_SH_0 = 0.28209479177387814  # the spherical harmonic of degree 0, 1 / (2 √π)
_TRIANGLES = 2  # for each point of a closed surface (Euler)


class PointCloud(NamedTuple):
    """Hold points in the frame and unit of their file.

    Attributes
    ----------
    positions : (n, 3) float64
        The points; some may be NaN or infinite, as where a scanner saw nothing.
    normals : (n, 3) float64
        Unit normals; a whole row is NaN where there is none.
    colours : (n, 3) uint8 or None
        sRGB; None without colours.
    splats : str
        What is drawn of a file of Gaussian splats, as messages say it; "" for any other file.
    """

    positions: NDArray[np.float64]
    normals: NDArray[np.float64]
    colours: NDArray[np.uint8] | None
    splats: str = ""


def joined_clouds(clouds: Sequence[PointCloud]) -> PointCloud:
    """Join clouds, at least one, that are in one frame; those without colours are white if others have some."""
    colours = [
        np.full((len(cloud.positions), 3), 255, np.uint8) if cloud.colours is None else cloud.colours
        for cloud in clouds
    ]
    return PointCloud(
        positions=np.concatenate([cloud.positions for cloud in clouds]),
        normals=np.concatenate([cloud.normals for cloud in clouds]),
        colours=np.concatenate(colours) if any(cloud.colours is not None for cloud in clouds) else None,
        splats=max(cloud.splats for cloud in clouds),
    )


def opaque_splats(cloud: PointCloud, harmonics: NDArray[Any], opacity: NDArray[Any] | None) -> PointCloud:
    """Return the centres of the Gaussian splats (Kerbl et al. 2023) that are at least half opaque.

    Those are near surfaces; the others are haze, and would pull the surface through the points apart. Guédon and
    Lepetit (SuGaR, 2024) remove them for the same reason before they extract a mesh.

    Parameters
    ----------
    cloud
        The centres of all n splats; colours that it has are kept.
    harmonics
        (n, 3), the coefficients of degree 0 of their sRGB colour: its mean over all directions. Higher ones, for
        highlights, are not read.
    opacity
        (n, 1), as training stores it, before the logistic function; None: all are opaque.
    """
    colours = cloud.colours
    if colours is None:
        srgb = 0.5 + _SH_0 * np.nan_to_num(harmonics.astype(np.float64))
        colours = (srgb.clip(0, 1) * 255).round().astype(np.uint8)
    kept = np.full(len(colours), True) if opacity is None else opacity[:, 0] >= 0  # where the function is 1/2
    share = f"the {np.count_nonzero(kept)} of {len(kept)} that are at least half opaque"
    return PointCloud(
        positions=cloud.positions[kept],
        normals=cloud.normals[kept],
        colours=colours[kept],
        splats=f"Gaussian splats, drawn as the surface through the centres of {share}",
    )


def shown_points(cloud: PointCloud, path: Path) -> Rows:
    """Return the rows of the points that a surface is laid through: the finite ones, the first at each place.

    Parameters
    ----------
    cloud
        The points.
    path
        The file, for messages.

    Raises
    ------
    InputError
        `path: defect` for fewer than three.
    """
    rows = np.flatnonzero(np.isfinite(cloud.positions).all(axis=1))
    rows = rows[np.sort(row_ids(cloud.positions[rows])[1])] if len(rows) else rows
    if len(rows) < 3:
        if cloud.splats:
            raise InputError(f"{path}: {cloud.splats}; that is too few")
        if path.suffix.lower() in LAS_SUFFIXES:  # which holds nothing but points
            raise InputError(f"{path}: fewer than three points, through which no surface passes")
        raise InputError(f"{path}: no faces, and fewer than three points; lines alone are not drawn")
    return rows


def cloud_soup(cloud: PointCloud, path: Path, *, warns: bool = True) -> Soup:
    """Return the triangles of the surface through points.

    Parameters
    ----------
    cloud
        The points. Those that are not finite, and all but the first at one place, are left out.
    path
        The file, for messages.
    warns
        Whether to warn of points that are not shown.

    Returns
    -------
    Soup
        The triangles, with a vertex for each point.

    Raises
    ------
    InputError
        `path: defect` for points on no surface, and for too many.
    """
    total = len(cloud.positions)
    if warns and (left_out := total - np.count_nonzero(np.isfinite(cloud.positions).all(axis=1))):
        log.warning("%s: %d of %d points have NaN or infinite coordinates; left out", path, left_out, total)
    rows = shown_points(cloud, path)
    if warns and cloud.splats:
        log.warning("%s: %s", path, cloud.splats)
    count = len(rows)
    check_triangle_count(_TRIANGLES * count, path)
    check_memory(path, _POINT_BYTES * count, f"a surface through {count} points")
    from depthwalk.geometry.point_surface import point_surface  # here: it imports scipy, which meshes do not need

    # In a frame of size 1, in which squares neither overflow nor underflow.
    low, high = cloud.positions[rows].min(axis=0) / 2, cloud.positions[rows].max(axis=0) / 2
    faces, normals = point_surface((cloud.positions[rows] / 2 - low) / (high - low).max(), cloud.normals[rows])
    if not len(faces):
        raise InputError(f"{path}: no faces, and no surface passes through its {count} points")
    check_triangle_count(len(faces), path)
    check_mesh_memory(count, len(faces), path)
    log.info("%s: %d triangles through %d points", path, len(faces), count)
    if warns and (hidden := count - np.count_nonzero(np.bincount(faces.ravel()))) > _TOLD * count:
        log.warning("%s: %d of %d points are on no surface, and not shown", path, hidden, count)
    plain = plain_material(cloud.colours is not None)
    return Soup(
        positions=cloud.positions[rows],
        normals=normals,
        colours=np.full((count, 3), 255, np.uint8) if cloud.colours is None else cloud.colours[rows],
        uv=np.full((count, 2), np.nan),
        faces=faces,
        material=np.zeros(len(faces), np.int64),
        materials=(without_light(plain) if cloud.splats else plain,),  # splats hold light, as pictures do
    )
