"""What the shaders read per object: instance records, and how they follow from planes, tiles and places."""

import numpy as np
from numpy.typing import NDArray

from depthwalk.render.impostors.tile_mapping import Tiles
from depthwalk.render.impostors.warp_planes import Planes
from depthwalk.types import Array

# What warp.vert reads per object: plane axes with the epipole or the plane's offset in w; the viewer's distance to the
# plane, the tile's nearest w / λ, and what is added to numbers of images; rows that map plane coordinates to the atlas
# in clip space; its corners there.
WARP_RECORD = np.dtype(
    [
        ("right", "4f4"),
        ("up", "4f4"),
        ("normal", "4f4"),
        ("depths", "3f4"),
        ("to_x", "3f4"),
        ("to_y", "3f4"),
        ("to_w", "3f4"),
        ("bounds", "4f4"),
    ]
)
# What composite.vert reads per object. Of its tile: the plane's axes with the rectangle's low corner and the distance
# of the viewer it was warped for; the high corner, and λ of the object's nearest and farthest; that viewer, object
# frame, and the tile's nearest w / λ; rows that map plane coordinates to its texels; where it lies, in texels. Of the
# object: the present viewer in its frame, and its scale; its rotation. Where the tile lies in the picture, see
# `Tiles`; the number of its first object in the round, and how many it shows.
COMPOSITE_RECORD = np.dtype(
    [
        ("right", "4f4"),
        ("up", "4f4"),
        ("normal", "4f4"),
        ("reach", "4f4"),
        ("origin", "4f4"),
        ("to_x", "3f4"),
        ("to_y", "3f4"),
        ("to_w", "3f4"),
        ("tile", "4f4"),
        ("viewer", "4f4"),
        ("rotation", "4f4"),
        ("pixel", "2f4"),
        ("objects", "2f4"),
    ]
)


def warp_records(
    planes: Planes, tiles: Tiles, corners: NDArray[np.integer], atlas_size: tuple[int, int]
) -> NDArray[np.void]:
    """Warp records of n tiles at `corners` (n, 2), texels of the atlas, still without what is added to numbers of
    images."""
    records = np.zeros(len(corners), WARP_RECORD)
    records["right"] = np.column_stack([planes.right, planes.epipole[:, 0]])
    records["up"] = np.column_stack([planes.up, planes.epipole[:, 1]])
    records["normal"] = np.column_stack([planes.normal, planes.offset])
    records["depths"][:, :2] = np.column_stack([planes.distance, tiles.nearest])
    atlas = np.asarray(atlas_size, float)
    w = tiles.texel[:, 2]
    for axis, name in enumerate(("to_x", "to_y")):
        records[name] = 2 * (tiles.texel[:, axis] + corners[:, axis, None] * w) / atlas[axis] - w
    records["to_w"] = w
    records["bounds"] = np.column_stack([2 * corners / atlas - 1, 2 * (corners + tiles.size) / atlas - 1])
    return records


def tile_records(
    viewer: Array, planes: Planes, depths: Array, tiles: Tiles, corners: NDArray[np.integer]
) -> NDArray[np.void]:
    """Composite records of n tiles at `corners` (n, 2), still without their objects. viewer: (n, 3), object frame;
    depths: (n, 2), least and greatest behind the plane."""
    records = np.zeros(len(corners), COMPOSITE_RECORD)
    records["right"] = np.column_stack([planes.right, planes.low[:, 0]])
    records["up"] = np.column_stack([planes.up, planes.low[:, 1]])
    records["normal"] = np.column_stack([planes.normal, planes.distance])
    distance = planes.distance[:, None]
    records["reach"] = np.column_stack([planes.high, distance / (distance + depths)])
    records["origin"] = np.column_stack([viewer, tiles.nearest])
    records["to_x"], records["to_y"], records["to_w"] = np.moveaxis(tiles.texel, 1, 0)
    records["tile"] = np.column_stack([corners, tiles.size])
    records["pixel"] = tiles.pixel
    return records


def place_tiles(records: NDArray[np.void], viewer: Array, scale: Array, rotation: Array) -> None:
    """Completes composite records of n objects, in the order of their numbers. viewer: (n, 3), the present one in their
    frames."""
    records["viewer"][:, :3], records["viewer"][:, 3] = viewer, scale
    records["rotation"] = rotation
    records["objects"] = np.column_stack([np.arange(len(records)), np.ones(len(records))])
