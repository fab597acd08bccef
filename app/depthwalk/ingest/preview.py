"""Make a coarse mesh of a large file quickly, to be shown until the whole mesh or its depth images are ready.

Normals, creases and simplified levels of five million triangles take minutes, and so does the surface through as many
points; their arrays are read in seconds.
"""

import numpy as np

from depthwalk.geometry.distinct import distinct_numbers
from depthwalk.geometry.indexed_triangles import drop_unused
from depthwalk.ingest.point_cloud import PointCloud
from depthwalk.ingest.soup import Soup
from depthwalk.types import Array, Ints

_CELLS = 160  # along the longest extent; a curved surface keeps some 100,000 triangles


def coarse_soup(soup: Soup, cells: int = _CELLS) -> Soup:
    """Merge vertices by vertex clustering (Rossignac and Borrel 1993), without sorting them.

    Parameters
    ----------
    soup
        The triangles of a file.
    cells
        Cubic cells along the longest extent of its vertices. All vertices in a cell become the first of them.

    Returns
    -------
    Soup
        Triangles with corners in three cells, each once for the same three, and the vertices that they use; `soup`
        itself if it has no such triangle.
    """
    rows, faces = drop_unused(soup.faces, len(soup.positions))
    if (occupied := _occupied_cells(soup.positions[rows], cells)) is None:
        return soup
    first, number = occupied
    faces = number[faces]
    kept = (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])
    chosen = np.flatnonzero(kept)
    _, once = np.unique(np.sort(faces[chosen], axis=1), axis=0, return_index=True)
    chosen = chosen[np.sort(once)]
    if not len(chosen):
        return soup
    used, corners = drop_unused(faces[chosen], len(first))
    return soup.subset(rows[first[used]], corners, chosen)


def thinned(cloud: PointCloud, cells: int = _CELLS) -> PointCloud:
    """Return the first point in each cell of a grid, so that the surface through them is found quickly.

    Parameters
    ----------
    cloud
        The points of a file.
    cells
        Cubic cells along the longest extent of the points.

    Returns
    -------
    PointCloud
        The points that are kept, all of them finite; `cloud` itself if they have no extent.
    """
    rows = np.flatnonzero(np.isfinite(cloud.positions).all(axis=1))
    if not len(rows) or (occupied := _occupied_cells(cloud.positions[rows], cells)) is None:
        return cloud
    kept = rows[occupied[0]]
    colours = None if cloud.colours is None else cloud.colours[kept]
    return cloud._replace(positions=cloud.positions[kept], normals=cloud.normals[kept], colours=colours)


def _occupied_cells(points: Array, cells: int) -> tuple[Ints, Ints] | None:
    """Divide the longest extent of points (n, 3) into cubic cells.

    Returns the first point (m,) of each cell that holds any, and the number (n,) among these of each point's cell; None
    for points without extent.
    """
    low, extent = points.min(0), np.ptp(points, axis=0)
    size = float(extent.max()) / cells
    if not (np.isfinite(size) and size > 0):
        return None
    x, y, z = (np.minimum((axis / size).astype(np.int64), cells - 1) for axis in (points - low).T)
    _, first, number = distinct_numbers((x * cells + y) * cells + z)
    return first, number
