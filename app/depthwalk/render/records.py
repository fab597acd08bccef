"""What the shaders read per object: instance records, and how they follow from planes, tiles and places."""

import numpy as np
from numpy.typing import NDArray

from depthwalk.render.planes import Planes
from depthwalk.render.rotation import rotate
from depthwalk.render.tiles import Tiles
from depthwalk.render.view import View
from depthwalk.scene.arrays import Objects

Array = NDArray[np.floating]

# What warp.vert reads per object: plane axes with the epipole or the plane's offset in w; the viewer's distance to the
# plane and the tile's nearest w / λ; rows that map plane coordinates to the atlas in clip space; its corners there.
WARP_RECORD = np.dtype(
    [
        ("right", "4f4"),
        ("up", "4f4"),
        ("normal", "4f4"),
        ("depths", "2f4"),
        ("to_x", "3f4"),
        ("to_y", "3f4"),
        ("to_w", "3f4"),
        ("bounds", "4f4"),
    ]
)
# What composite.vert reads per object: rays from the viewer to the rectangle's corner and along its edges (world), and
# the tile's homogeneous texels there; the viewer in the object's frame, the object's rotation, the tile in texels,
# the object's scale and the tile's nearest w / λ.
COMPOSITE_RECORD = np.dtype(
    [
        ("corner", "3f4"),
        ("edge_u", "3f4"),
        ("edge_v", "3f4"),
        ("texel", "3f4"),
        ("texel_u", "3f4"),
        ("texel_v", "3f4"),
        ("viewer", "3f4"),
        ("rotation", "4f4"),
        ("tile", "4f4"),
        ("scales", "2f4"),
    ]
)
# What mesh.vert and dmesh.vert read per object: where it stands relative to the viewer, and how it is turned.
PLACED_RECORD = np.dtype([("origin", "3f4"), ("rotation", "4f4"), ("scale", "f4")])


def warp_records(
    planes: Planes, tiles: Tiles, corners: NDArray[np.int64], atlas_size: tuple[int, int]
) -> NDArray[np.void]:
    records = np.zeros(len(corners), WARP_RECORD)
    records["right"] = np.column_stack([planes.right, planes.epipole[:, 0]])
    records["up"] = np.column_stack([planes.up, planes.epipole[:, 1]])
    records["normal"] = np.column_stack([planes.normal, planes.offset])
    records["depths"] = np.column_stack([planes.distance, tiles.nearest])
    atlas = np.asarray(atlas_size, float)
    w = tiles.texel[:, 2]
    for axis, name in enumerate(("to_x", "to_y")):
        records[name] = 2 * (tiles.texel[:, axis] + corners[:, axis, None] * w) / atlas[axis] - w
    records["to_w"] = w
    records["bounds"] = np.column_stack([2 * corners / atlas - 1, 2 * (corners + tiles.size) / atlas - 1])
    return records


def composite_records(
    objects: Objects, viewer: Array, planes: Planes, tiles: Tiles, corners: NDArray[np.int64]
) -> NDArray[np.void]:
    """Of n objects with the viewer (n, 3) in their frames, whose tiles lie at `corners` (n, 2)."""
    records = np.zeros(len(corners), COMPOSITE_RECORD)
    corner = planes.low[:, :1] * planes.right + planes.low[:, 1:] * planes.up - planes.distance[:, None] * planes.normal
    extent = planes.high - planes.low
    vectors = (("corner", corner), ("edge_u", extent[:, :1] * planes.right), ("edge_v", extent[:, 1:] * planes.up))
    for name, vector in vectors:
        records[name] = rotate(objects.rotation, vector) * objects.scale[:, None]
    records["texel"] = np.einsum("nij,nj->ni", tiles.texel, np.column_stack([planes.low, np.ones(len(corners))]))
    records["texel_u"] = tiles.texel[..., 0] * extent[:, :1]
    records["texel_v"] = tiles.texel[..., 1] * extent[:, 1:]
    records["viewer"] = viewer
    records["rotation"] = objects.rotation
    records["tile"] = np.column_stack([corners, tiles.size])
    records["scales"] = np.column_stack([objects.scale, tiles.nearest])
    return records


def placed_records(view: View, objects: Objects) -> NDArray[np.void]:
    """Of n objects that are drawn straight to the screen."""
    records = np.zeros(len(objects), PLACED_RECORD)
    records["origin"] = objects.position - view.position
    records["rotation"], records["scale"] = objects.rotation, objects.scale
    return records
