"""Tell which object of the scene is in front at each pixel of a frame."""

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

# How far apart two passes may draw one surface, of its distance: polygons that are farther are hidden, by the ground or
# by what a pass of the user's drew. Where pixels have several samples, drivers differ in where they take its depth.
_SAME_SURFACE, _SAME_SURFACE_SAMPLED = 1e-3, 5e-2


def object_ids(renderer: Renderer, ids: ObjectIdPass, scene_objects: Objects) -> NDArray[np.int32]:
    """Return which object of the scene is in front at each pixel of the frame drawn last.

    Objects drawn as depth images or captured views are read from the visibility buffer. Polygons leave no trace in
    it: an object that `ids` found counts as seen where it is as near as what the frame shows.

    Parameters
    ----------
    renderer
        The renderer, which has just drawn a frame; its context is current.
    ids
        One of the renderer's passes, which finds objects drawn as polygons; its `requested` was set before that frame.
    scene_objects
        The objects of the scene, one row for each number.

    Returns
    -------
    numpy.ndarray
        (H, W) int32, row 0 at the bottom; −1 where there is no object. Supersampled pictures have a value for every
        sample.
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
    """Return the scene's object (n,) of each of the n objects that are drawn: one has a row for each of its parts."""
    number, parts = renderer.world.objects().asset, renderer.assets.parts
    shown = np.unique(number[number >= parts.first]).tolist()
    first_parts = {parts.numbers(parts.asset_of(part)).start for part in shown}
    begins = (number < parts.first) | np.isin(number, list(first_parts))
    return np.asarray(np.cumsum(begins) - 1, np.int64)


def _mesh_objects(meshes: DrawList, view: View, objects: Objects) -> NDArray[np.int32]:
    """Return the scene's object (m,) of each of the m records of polygons, by its place: records hold no numbers."""
    found = np.full(len(meshes.records), -1, np.int32)
    place = np.column_stack([objects.position - view.position, objects.rotation, objects.scale])
    for asset, rows in _records_by_asset(meshes):
        candidates = np.flatnonzero(objects.asset == asset)
        found[rows] = candidates[KDTree(place[candidates]).query(_places(meshes.records[rows]))[1]]
    return found


def _records_by_asset(meshes: DrawList) -> Iterator[tuple[int, Rows]]:
    """Yield each asset with the rows of its records."""
    asset = np.repeat([batch.asset for batch in meshes.batches], [batch.count for batch in meshes.batches])
    row = np.concatenate([np.arange(batch.first, batch.first + batch.count) for batch in meshes.batches])
    for number in np.unique(asset).tolist():
        yield number, row[asset == number]


def _places(records: NDArray[np.void]) -> Array:
    """Return position, rotation and scale (m, 8) of m records, relative to the viewer."""
    return np.column_stack([records["origin"], records["rotation"], records["scale"]])
