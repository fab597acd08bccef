"""Find the object of the scene that is in front at each pixel of a frame, or at one point."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from pyglm import glm

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
# How far from its place in a frame a point of another picture may be found, pixels, and how much nearer or farther.
_NEIGHBOURHOOD, _SAME_DISTANCE = 4.0, 0.02


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
    shown = renderer.world.owners()
    owner = np.concatenate([[-1], shown[plan.object_rows]]).astype(np.int32)
    found: NDArray[np.int32] = owner[image_object]
    captured = (visible[..., 0] == 0) & (visible[..., 1] >= FIRST_CAPTURED)
    row = (visible[..., 1][captured] - FIRST_CAPTURED) >> COVERAGE_BITS
    found[captured] = shown[row]
    meshes = ids.read()
    if meshes is None or not len(plan.polygons.records):
        return found
    depth = np.frombuffer(targets.depth.read(alignment=1), np.float32).reshape(height, width)
    near, far = view.depth_range
    tolerance = _SAME_SURFACE if targets.samples == 1 else _SAME_SURFACE_SAMPLED
    surface, polygons = view_distance(depth, near, far), view_distance(meshes.depth, near, far)
    in_front = (image_object == 0) & ~captured & (meshes.depth < 1) & (polygons <= surface * (1 + tolerance))
    shown_records, number = np.unique(meshes.number[in_front], return_inverse=True)
    found[in_front] = _mesh_objects(plan.polygons, shown_records, view, scene_objects)[number]
    return found


def _mesh_objects(meshes: DrawList, shown: Rows, view: View, objects: Objects) -> NDArray[np.int32]:
    """Return the scene's object number (k,) of those polygon records that are `shown` (k,), rising.

    They are matched by their transforms, as records have no numbers.
    """
    found = np.full(len(shown), -1, np.int32)
    place = np.column_stack([objects.position - view.position, objects.rotation, objects.scale])
    for asset, rows in _records_by_asset(meshes):
        candidates, wanted = np.flatnonzero(objects.asset == asset), np.isin(shown, rows).nonzero()[0]
        if len(wanted):
            found[wanted] = candidates[_nearest(place[candidates], _places(meshes.records[shown[wanted]]))]
    return found


def _nearest(points: Array, wanted: Array) -> Rows:
    """Return which of the `points` (n, d) is nearest to each of those that are `wanted` (m, d), (m,)."""
    if len(wanted) == 1:
        return np.array([((points - wanted) ** 2).sum(1).argmin()])
    from scipy.spatial import KDTree  # not at the top: it would delay a window's first picture

    return np.asarray(KDTree(points).query(wanted)[1])


def _records_by_asset(meshes: DrawList) -> Iterator[tuple[int, Rows]]:
    """Yield each asset number with the rows of its records."""
    asset = np.repeat([batch.asset for batch in meshes.batches], [batch.count for batch in meshes.batches])
    row = np.concatenate([np.arange(batch.first, batch.first + batch.count) for batch in meshes.batches])
    for number in np.unique(asset).tolist():
        yield number, row[asset == number]


def _places(records: NDArray[np.void]) -> Array:
    """Return position, rotation and scale (m, 8) of m records, relative to the viewer."""
    return np.column_stack([records["origin"], records["rotation"], records["scale"]])


def object_at(renderer: Renderer, ids: ObjectIdPass, point: glm.dvec3) -> int | None:
    """Return the object of the scene to which a surface point belongs that the frame drawn last shows.

    Parameters
    ----------
    renderer
        The renderer, which has just drawn a frame. Its context must be current.
    ids
        The pass of this renderer that finds objects drawn as polygons, which it did in this frame.
    point
        The point, metres, world: what another picture showed at a place. Frames differ by what their impostors are off,
        so its neighbourhood is searched.

    Returns
    -------
    int or None
        The row in `Scene.objects`; None where the point belongs to no object, or the frame does not show it.
    """
    targets, view = renderer.targets, renderer.view
    assert targets is not None and view is not None  # the frame made them
    offset = np.array([*point]) - view.position
    right, up, ahead = (view.axes @ offset).tolist()
    if ahead <= 0:
        return None
    (width, height), (wide, high) = targets.size, view.half_extent
    column, row = (1 + right / (ahead * wide)) / 2 * width - 0.5, (1 + up / (ahead * high)) / 2 * height - 0.5
    depth = np.frombuffer(targets.depth.read(alignment=1), np.float32).reshape(height, width)
    rows, columns = np.indices(depth.shape)
    away = np.hypot(rows - row, columns - column)
    is_near = away <= _NEIGHBOURHOOD
    is_near[is_near] = np.abs(view_distance(depth[is_near], *view.depth_range) - ahead) <= _SAME_DISTANCE * ahead
    if not is_near.any():
        return None
    number = int(object_ids(renderer, ids, renderer.scene.objects).flat[np.where(is_near, away, np.inf).argmin()])
    return number if number >= 0 else None
