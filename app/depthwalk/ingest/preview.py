"""Make a coarse mesh of a large file quickly, to be shown until the whole mesh or its depth images are ready.

Normals, creases and simplified levels of five million triangles take minutes; their arrays are read in seconds.
"""

import numpy as np

from depthwalk.geometry.distinct import distinct_numbers
from depthwalk.geometry.indexed_triangles import drop_unused
from depthwalk.ingest.soup import Soup

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
    points = soup.positions[rows]
    low, extent = points.min(0), np.ptp(points, axis=0)
    size = float(extent.max()) / cells
    if not (np.isfinite(size) and size > 0):
        return soup
    x, y, z = (np.minimum((axis / size).astype(np.int64), cells - 1) for axis in (points - low).T)
    _, first, number = distinct_numbers((x * cells + y) * cells + z)
    faces = number[faces]
    kept = (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])
    chosen = np.flatnonzero(kept)
    _, once = np.unique(np.sort(faces[chosen], axis=1), axis=0, return_index=True)
    chosen = chosen[np.sort(once)]
    if not len(chosen):
        return soup
    used, corners = drop_unused(faces[chosen], len(first))
    return soup.subset(rows[first[used]], corners, chosen)
