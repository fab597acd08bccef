"""Trim what is never drawn from images: samples and triangles of caps and box faces that another face owns.

The side keeps everything it sees, for the paper's cases, which draw it alone.
"""

from dataclasses import replace
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.grid import layer_triangles, triangle_places
from depthwalk.bake.images import BoundaryStrip, DepthImage, Face
from depthwalk.bake.texture_coordinates import kept_coordinates
from depthwalk.parallel import Map


def trim(
    images: list[DepthImage], borders: list[BoundaryStrip], parallel_map: Map = map
) -> tuple[list[DepthImage], list[BoundaryStrip]]:
    """Trim what is never drawn: samples and triangles of caps and box faces that another face owns.

    Parameters
    ----------
    images
        All depth images of an object, with their owners.
    borders
        All boundary strips of the object.
    parallel_map
        `map`, or what `thread_map` yields to work in several threads.

    Returns
    -------
    tuple
        The images and boundary strips that remain. Those of the side are unchanged.
    """

    def trim_face(face: Face) -> tuple[list[DepthImage], list[BoundaryStrip]]:
        layers = [image for image in images if image.face is face]
        edges = [border for border in borders if border.face is face]
        return _trim_face(layers, edges) if layers and face is not Face.SIDE else (layers, edges)

    trimmed, left = zip(*parallel_map(trim_face, Face), strict=True)
    return list(chain(*trimmed)), list(chain(*left))


def _trim_face(layers: list[DepthImage], borders: list[BoundaryStrip]) -> tuple[list[DepthImage], list[BoundaryStrip]]:
    """Trim the layers of one face, in order, and its strips; return what remains of both."""
    size = layers[0].depth.size
    owner = np.concatenate([image.owner.ravel() for image in layers])
    used = np.zeros(len(owner), bool)
    cells = []
    for image in layers:
        kept = [_kept_cells(image, level, owner, used) for level in range(len(image.cells))]
        cells.append(tuple(kept))
    borders = [_kept_border(border, owner, used) for border in borders]
    count = int((used.reshape(len(layers), size).any(1) * np.arange(1, len(layers) + 1)).max(initial=0))
    trimmed = [
        replace(_only(image, used.reshape(-1, *image.depth.shape)[image.layer]), cells=cells[image.layer])
        for image in layers[:count]
    ]
    shift = size * (len(layers) - count)  # boundary vertices are numbered after all samples
    return trimmed, [
        replace(border, triangles=border.triangles - np.int32(shift) * (border.triangles >= len(owner)))
        for border in borders
        if len(border.triangles)
    ]


def _kept_cells(image: DepthImage, level: int, owner: NDArray[np.uint8], used: NDArray[np.bool_]) -> NDArray[np.uint16]:
    """Return the cells of a level without triangles that are never drawn; mark the samples of the others in `used`."""
    layer, texel = layer_triangles(image, level)
    half, cell = triangle_places(image, level)
    corners = layer * image.depth.size + texel
    yielded = image.cells[level][cell] >> (14 + half) & 1 > 0
    drawn = _drawn(owner[corners], image.face) & ~yielded
    used[corners[drawn]] = True
    cleared = np.zeros_like(image.cells[level])
    np.bitwise_or.at(cleared, cell[~drawn], (0b1111111 << 7 * half[~drawn] | 1 << 14 + half[~drawn]).astype(np.uint16))
    return image.cells[level] & ~cleared


def _kept_border(border: BoundaryStrip, owner: NDArray[np.uint8], used: NDArray[np.bool_]) -> BoundaryStrip:
    """Return a strip without triangles that are never drawn; mark the samples of the others in `used`."""
    samples, triangles = len(owner), border.triangles
    owners = owner[np.where(triangles < samples, triangles, triangles[:, :1])]
    triangles = triangles[_drawn(owners, border.face)]
    ends = triangles >= samples
    used[triangles[~ends]] = True
    kept, number = np.unique(triangles[ends] - samples, return_inverse=True)
    used[border.start[kept]] = True
    triangles = triangles.copy()
    triangles[ends] = samples + number
    return replace(
        border, start=border.start[kept], offset=border.offset[kept], rise=border.rise[kept], triangles=triangles
    )


def _drawn(owners: NDArray[np.uint8], face: Face) -> NDArray[np.bool_]:
    """Return which triangles (n,) with corners of `owners` (n, 3) are drawn: not those owned by one other face."""
    return np.asarray((owners[:, 0] == face) | (owners != owners[:, :1]).any(1))


def _only(image: DepthImage, used: NDArray[np.bool_]) -> DepthImage:
    return replace(
        image,
        depth=np.where(used, image.depth, np.float32(np.inf)),
        normal=np.where(used[..., None], image.normal, np.float32(0)),
        albedo=np.where(used[..., None], image.albedo, np.float32(0)),
        mapped_normal=None
        if image.mapped_normal is None
        else np.where(used[..., None], image.mapped_normal, np.float32(0)),
        owner=np.where(used, image.owner, np.uint8(image.face)),
        coordinates=None if image.coordinates is None else kept_coordinates(image.coordinates, used, image.face),
    )
