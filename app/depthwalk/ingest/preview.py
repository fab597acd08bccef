"""Make a coarse mesh of a large file quickly, to be shown until the whole mesh or its depth images are ready.

Normals, creases and simplified levels of five million triangles take minutes; their arrays are read in seconds.
"""

from dataclasses import replace

import numpy as np

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
    used = np.zeros(len(soup.positions), bool)
    used[soup.faces.ravel()] = True
    rows = np.flatnonzero(used)
    points = soup.positions[rows]
    low, extent = points.min(0), np.ptp(points, axis=0)
    size = float(extent.max()) / cells
    if not (np.isfinite(size) and size > 0):
        return soup
    along = [np.minimum((axis / size).astype(np.int64), cells - 1) for axis in (points - low).T]
    key = (along[0] * cells + along[1]) * cells + along[2]
    first = np.zeros(cells**3, np.int64)
    first[key[::-1]] = rows[::-1]  # of several vertices in a cell, the last one written stays
    merged = np.zeros(len(soup.positions), np.int64)
    merged[rows] = first[key]
    faces = merged[soup.faces]
    kept = (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])
    chosen = np.flatnonzero(kept)
    _, once = np.unique(np.sort(faces[chosen], axis=1), axis=0, return_index=True)
    chosen = chosen[np.sort(once)]
    if not len(chosen):
        return soup
    vertices, corners = np.unique(faces[chosen], return_inverse=True)
    return replace(
        soup,
        positions=soup.positions[vertices],
        normals=soup.normals[vertices],
        colours=soup.colours[vertices],
        uv=soup.uv[vertices],
        faces=corners.reshape(-1, 3).astype(np.int64),
        material=soup.material[chosen],
    )
