"""Find the object of the scene that is in front at each pixel of a frame."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from depthwalk.cook.lod_geometry import IMAGE_BITS
from depthwalk.render.draw.draw_lists import DrawList
from depthwalk.render.passes.object_id import ObjectIdPass
from depthwalk.render.renderer import Renderer
from depthwalk.render.resources.placed_records import COVERAGE_BITS, FIRST_CAPTURED
from depthwalk.render.view.view import View, view_distance
from depthwalk.scene.arrays import Objects
from depthwalk.types import Array, Rows

# Relative difference in distance up to which two passes count as having drawn the same surface. A polygon farther away
# is hidden, by the ground or by what a user's pass drew. With several samples per pixel the tolerance is larger, since
# drivers differ in where within the pixel they take the depth.
_SAME_SURFACE, _SAME_SURFACE_SAMPLED = 1e-3, 5e-2


def object_ids(renderer: Renderer, ids: ObjectIdPass, scene_objects: Objects) -> NDArray[np.int32]:
    """Return the object of the scene that is in front at each pixel of the frame drawn last.

    Objects drawn as depth images or captured views are read from the visibility buffer. Polygons are not recorded
    there: an object that `ids` found is visible where it is as near as the surface in the frame's depth buffer.

    Parameters
    ----------
    renderer
        The renderer, which has just drawn a frame. Its context must be current.
    ids
        The pass of this renderer that finds objects drawn as polygons; its `requested` was set before the frame.
    scene_objects
        The objects of the scene; the result holds their row numbers.

    Returns
    -------
    numpy.ndarray
        (H, W) int32, row 0 at the bottom; −1 where there is no object. Supersampled frames have one value per sample.
    """
    targets, view, plan = renderer.targets, renderer.view, renderer.plan
    assert targets is not None and view is not None and plan is not None  # the frame made them
    width, height = targets.size
    visible = np.frombuffer(targets.visibility_texture.read(alignment=1), np.uint32).reshape(height, width, 2)
    image_object = visible[..., 0] >> IMAGE_BITS  # counted from 1; 0 for polygons and nothing
    owner = np.concatenate([[-1], _scene_objects(renderer)[plan.object_rows]]).astype(np.int32)
    found: NDArray[np.int32] = owner[image_object]
    captured = (image_object == 0) & (visible[..., 1] >= FIRST_CAPTURED)
    row = (visible[..., 1][captured] - FIRST_CAPTURED) >> COVERAGE_BITS
    found[captured] = _scene_objects(renderer)[row] if captured.any() else -1
    meshes = ids.read()
    if meshes is None or not len(plan.polygons.records):
        return found
    depth = np.frombuffer(targets.depth.read(alignment=1), np.float32).reshape(height, width)
    near, far = view.depth_range
    tolerance = _SAME_SURFACE if targets.samples == 1 else _SAME_SURFACE_SAMPLED
    shown, polygons = view_distance(depth, near, far), view_distance(meshes.depth, near, far)
    in_front = (image_object == 0) & ~captured & (meshes.depth < 1) & (polygons <= shown * (1 + tolerance))
    found[in_front] = _mesh_objects(plan.polygons, view, scene_objects)[meshes.number[in_front]]
    return found


def _scene_objects(renderer: Renderer) -> Rows:
    """Return the scene's object number (n,) of each of the n drawn objects; an asset with parts has a row for each."""
    number, parts = renderer.world.objects().asset, renderer.assets.parts
    shown = np.unique(number[number >= parts.first]).tolist()
    first_parts = {parts.numbers(parts.asset_of(part)).start for part in shown}
    begins = (number < parts.first) | np.isin(number, list(first_parts))
    return np.asarray(np.cumsum(begins) - 1, np.int64)


def _mesh_objects(meshes: DrawList, view: View, objects: Objects) -> NDArray[np.int32]:
    """Return the scene's object number (m,) of each of m polygon records, matched by transform: records have no IDs."""
    found = np.full(len(meshes.records), -1, np.int32)
    place = np.column_stack([objects.position - view.position, objects.rotation, objects.scale])
    for asset, rows in _records_by_asset(meshes):
        candidates = np.flatnonzero(objects.asset == asset)
        found[rows] = candidates[KDTree(place[candidates]).query(_places(meshes.records[rows]))[1]]
    return found


def _records_by_asset(meshes: DrawList) -> Iterator[tuple[int, Rows]]:
    """Yield each asset number with the rows of its records."""
    asset = np.repeat([batch.asset for batch in meshes.batches], [batch.count for batch in meshes.batches])
    row = np.concatenate([np.arange(batch.first, batch.first + batch.count) for batch in meshes.batches])
    for number in np.unique(asset).tolist():
        yield number, row[asset == number]


def _places(records: NDArray[np.void]) -> Array:
    """Return position, rotation and scale (m, 8) of m records, relative to the viewer."""
    return np.column_stack([records["origin"], records["rotation"], records["scale"]])
