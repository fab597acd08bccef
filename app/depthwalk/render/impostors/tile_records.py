"""Make the instance records that the shaders of passes 1 and 2 read: planes, tiles, and their places in the atlas."""

import numpy as np
from numpy.typing import NDArray

from depthwalk.render import kernels
from depthwalk.render.impostors.tile_mapping import Tiles
from depthwalk.render.impostors.warp_planes import Planes
from depthwalk.scene.arrays import Objects
from depthwalk.types import Array, Rows

# What warp.vert reads per object:
# right, up, normal: the plane's axes, with the epipole's coordinates, and the plane's offset, in w;
# depths: the viewer's distance to the plane, the tile's nearest w / λ, and a number to add to the numbers of images;
# to_x, to_y, to_w: rows that map plane coordinates to the atlas in clip space;
# bounds: the tile's corners in clip space;
# rotation: unit quaternion of the object, for light.
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
        ("rotation", "4f4"),
    ]
)
# What composite.vert reads per object. Of its tile:
# right, up, normal: the plane's axes, with the rectangle's low corner, and the distance of the viewer that the tile was
#     warped for, in w;
# high: the rectangle's high corner, and λ of the object's nearest and farthest points;
# origin: the viewer that it was warped for, object frame, and the tile's nearest w / λ;
# to_x, to_y, to_w: rows that map plane coordinates to its texels;
# tile: where it lies in the atlas, texels; pixel: where it lies in the picture, see `Tiles`;
# diagonals: where the corners of its rectangle are cut off, see `Planes`.
# Of the object: viewer: the present one in its frame, and its scale; rotation: its own;
# objects: the number of its first object in the phase, and how many it shows.
COMPOSITE_RECORD = np.dtype(
    [
        ("right", "4f4"),
        ("up", "4f4"),
        ("normal", "4f4"),
        ("high", "4f4"),
        ("origin", "4f4"),
        ("to_x", "3f4"),
        ("to_y", "3f4"),
        ("to_w", "3f4"),
        ("tile", "4f4"),
        ("diagonals", "4f4"),
        ("viewer", "4f4"),
        ("rotation", "4f4"),
        ("pixel", "2f4"),
        ("objects", "2f4"),
    ]
)


def warp_records(
    planes: Planes, tiles: Tiles, corners: Rows, atlas_size: tuple[int, int], rotation: Array
) -> NDArray[np.void]:
    """Return the records by which pass 1 warps n impostors, each into a tile of its own.

    The number that pass 1 adds to those of images is 0; only members of far clusters have others.

    Parameters
    ----------
    planes : the planes of n objects.
    tiles : how the planes map to texels.
    corners : (n, 2) where the tiles lie, texels of the atlas.
    atlas_size : width and height of the atlas, texels.
    rotation : (n, 4) unit quaternions (x, y, z, w) of the objects, world from object.

    Returns
    -------
    (n,) WARP_RECORD.
    """
    loops = kernels.loaded()
    if loops is not None:
        numbers = loops.warp_records(
            right=planes.right,
            up=planes.up,
            normal=planes.normal,
            epipole=planes.epipole,
            offset=planes.offset,
            distance=planes.distance,
            texel=tiles.texel,
            nearest=tiles.nearest,
            size=tiles.size,
            corner=corners,
            width=float(atlas_size[0]),
            height=float(atlas_size[1]),
            rotation=rotation,
        )
        return np.asarray(numbers.view(WARP_RECORD)[:, 0])
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
    records["rotation"] = rotation
    return records


def tile_records(viewer: Array, planes: Planes, depths: Array, tiles: Tiles, corners: Rows) -> NDArray[np.void]:
    """Return the records by which pass 2 draws n tiles, without the fields of their objects that `place_tiles` adds.

    Parameters
    ----------
    viewer : (n, 3) the viewer that the tiles are warped for, in the objects' frames, metres.
    planes : the planes of n objects.
    depths : (n, 2) least and greatest depth of each object behind its plane, metres.
    tiles : how the planes map to texels.
    corners : (n, 2) where the tiles lie, texels of the atlas.

    Returns
    -------
    (n,) COMPOSITE_RECORD.
    """
    loops = kernels.loaded()
    if loops is not None:
        numbers = loops.tile_records(
            viewer=viewer,
            right=planes.right,
            up=planes.up,
            normal=planes.normal,
            distance=planes.distance,
            low=planes.low,
            high=planes.high,
            diagonals=planes.diagonals,
            depths=depths,
            texel=tiles.texel,
            nearest=tiles.nearest,
            size=tiles.size,
            pixel=tiles.pixel,
            corner=corners,
        )
        return np.asarray(numbers.view(COMPOSITE_RECORD)[:, 0])
    records = np.zeros(len(corners), COMPOSITE_RECORD)
    records["right"] = np.column_stack([planes.right, planes.low[:, 0]])
    records["up"] = np.column_stack([planes.up, planes.low[:, 1]])
    records["normal"] = np.column_stack([planes.normal, planes.distance])
    distance = planes.distance[:, None]
    records["high"] = np.column_stack([planes.high, distance / (distance + depths)])
    records["diagonals"] = planes.diagonals
    records["origin"] = np.column_stack([viewer, tiles.nearest])
    records["to_x"], records["to_y"], records["to_w"] = np.moveaxis(tiles.texel, 1, 0)
    records["tile"] = np.column_stack([corners, tiles.size])
    records["pixel"] = tiles.pixel
    return records


def place_tiles(tiles: NDArray[np.void], row: Rows, viewer: Array, objects: Objects, at: Rows) -> NDArray[np.void]:
    """Return the records by which pass 2 draws d tiles where their objects are now, numbered in this order.

    Parameters
    ----------
    tiles : (t,) COMPOSITE_RECORD of all tiles, without `viewer`, `rotation` and `objects`.
    row : (d,) indices of those to draw.
    viewer : (d, 3) the present viewer in the frames of the objects that they show, metres.
    objects : n objects.
    at : (d,) index of the object that each tile shows.

    Returns
    -------
    (d,) COMPOSITE_RECORD.
    """
    loops = kernels.loaded()
    if loops is not None:
        numbers = record_numbers(tiles)
        placed = loops.composite_records(numbers, row, viewer, objects.scale, objects.rotation, at)
        return np.asarray(placed.view(tiles.dtype)[:, 0])
    records = tiles.take(row)  # far quicker for records than indexing
    records["viewer"][:, :3], records["viewer"][:, 3] = viewer, objects.scale[at]
    records["rotation"] = objects.rotation[at]
    records["objects"] = np.column_stack([np.arange(len(records)), np.ones(len(records))])
    return records


def record_numbers(records: NDArray[np.void]) -> NDArray[np.float32]:
    """Return the fields of n records as the rows (n, k) of one array, which shares their memory."""
    return records.view(np.float32).reshape(len(records), records.dtype.itemsize // 4)
