"""Planar depth images of known shape, the meshes of their surfaces, and what a view sees of them."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.planar import bake_planar
from depthwalk.gpu.device import Device
from depthwalk.ingest.image import PlanarImage
from depthwalk.ingest.mesh import Mesh
from depthwalk.reference.height_field import first_hits
from depthwalk.render.resources.relative_depth import relative_depth
from depthwalk.render.view.view import View, view_distance
from depthwalk.scene.arrays import Representation
from depthwalk.types import Array
from shapes import ShapeLibrary, mesh_of, scene_of, shared
from stage import SIZE, OnScreen, set_all, view_of

SIDE = 96  # texels
WIDTH, HEIGHT, RANGE = 1.6, 1.2, 0.3  # metres
VIEWS = {
    "front": view_of((0.2, 0.8, 1.6), (0.0, 0.6, -0.1)),
    "aside": view_of((1.3, 1.0, 0.9), (0.0, 0.55, -0.15)),
}
_TRUE = 400, 20  # steps


def image_of(depth: Array) -> PlanarImage:
    """A grey picture with a depth (H, W), metres, lower row first."""
    colour = np.full((*depth.shape, 3), 170, np.uint8)
    filled = np.where(np.isfinite(depth), depth, 0)
    slope = np.gradient(filled, HEIGHT / depth.shape[0], WIDTH / depth.shape[1])
    normal = np.stack([slope[1], slope[0], np.ones_like(depth)], -1)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    return PlanarImage(
        depth=depth.astype(np.float32), colour=colour, normal=normal.astype(np.float32), size=(WIDTH, HEIGHT)
    )


def depths(kind: str) -> NDArray[np.float32]:
    """The depth image (H, W), metres, of a sphere's cap on a plane, a ramp, a step, or a wire before a plane."""
    y, x = (np.mgrid[:SIDE, :SIDE] + 0.5) / SIDE * 2 - 1
    if kind == "cap":
        relief = np.sqrt(np.maximum(1.25**2 - x**2 - y**2, 0.75**2)) - 0.75
        relief /= relief.max()
    elif kind == "ramp":
        relief = (x + 1) / 2
    elif kind == "step":
        relief = (x > 0.1).astype(float)
    else:
        relief = (np.abs(x - 0.2) < 0.03).astype(float)
    return np.asarray(RANGE * (1 - relief), np.float32)


def surface_mesh(depth: NDArray[np.float32]) -> Mesh:
    """The mesh through the middles of the texels, two triangles between four of them."""
    rows, columns = depth.shape
    y, x = np.mgrid[:rows, :columns] + 0.5
    points = np.stack([(x / columns - 0.5) * WIDTH, y / rows * HEIGHT, -depth], -1).reshape(-1, 3)
    number = np.arange(rows * columns).reshape(rows, columns)
    here, right, up, across = number[:-1, :-1], number[:-1, 1:], number[1:, :-1], number[1:, 1:]
    faces = np.concatenate([np.stack([here, right, up], -1), np.stack([right, across, up], -1)], 0).reshape(-1, 3)
    return mesh_of(points, faces, np.tile([0.0, 0, 1], (len(points), 1)))


def field_library(depth: NDArray[np.float32], *others: Mesh) -> ShapeLibrary:
    """A height field, with its mesh, and other meshes."""
    baked = shared(bake_planar, image_of(depth), "field", False)
    return ShapeLibrary([surface_mesh(depth), *others], [baked, *(None for _ in others)])


def picture_distance(stage: OnScreen, view: View) -> Array:
    """Metres along the view axis (H, W), row 0 below, of what is in sight; +inf for nothing."""
    stage.draw(view)
    assert stage.renderer.targets is not None and stage.renderer.view is not None
    stored = np.frombuffer(stage.renderer.targets.depth.read(alignment=1), np.float32).reshape(SIZE[::-1])
    return np.asarray(view_distance(stored, *stage.renderer.view.depth_range))


def drawn_distance(
    device: Device,
    depth: NDArray[np.float32],
    kind: Representation,
    view: View,
    settings: Mapping[str, object] = MappingProxyType({}),
) -> Array:
    """The same, of a height field alone, in a representation and with render settings by name."""
    scene = scene_of((0, (0, 0, 0), 0.0, 1.0), representation=kind)
    set_all(scene.render, settings)
    with OnScreen(device, scene, field_library(depth)) as stage:
        return picture_distance(stage, view)


def true_distance(depth: NDArray[np.float32], view: View, steps: tuple[int, int] = _TRUE) -> Array:
    """The same, of rays cast at the surface in so many linear and binary steps."""
    return _true_distances(depth.tobytes(), depth.shape, view, steps)


@cache
def _true_distances(*call: object) -> Array:
    return shared(_true_distance, *call)


def _true_distance(texels: bytes, shape: tuple[int, ...], view: View, steps: tuple[int, int]) -> Array:
    depth = np.frombuffer(texels, np.float32).reshape(shape)
    return twin_distance(depth, view, lambda field, viewer, rays, size: first_hits(field, viewer, rays, *steps))


def twin_distance(depth: NDArray[np.float32], view: View, hits: Callable[..., Array]) -> Array:
    """The same, of `hits`, called with the relative depth, the viewer, rays, and the size of the box, metres."""
    baked, view = (
        shared(bake_planar, image_of(depth), "field", False),
        replace(view),
    )  # whose matrices cannot be pickled
    x, y = ((np.arange(n) + 0.5) / n * 2 - 1 for n in SIZE)
    screen = np.stack(np.broadcast_arrays(x[None], y[:, None], 1.0), -1).reshape(-1, 3)
    size = np.array([WIDTH, HEIGHT, baked.cylinder.height])
    scale = np.array([1, -1, -1]) / size
    viewer = view.position * scale + [0.5, 1.0, 0.0]
    found = hits(relative_depth(baked), viewer, screen @ view.ray_from_screen.T * scale, size)
    return np.where(np.isnan(found), np.inf, found).reshape(SIZE[::-1])


def parts_off(found: Array, expected: Array, within: float) -> tuple[float, float]:
    """What part of the pixels that show both surfaces are farther apart than `within` metres, and show one alone."""
    both, either = np.isfinite(found) & np.isfinite(expected), np.isfinite(found) | np.isfinite(expected)
    off = np.abs(found[both] - expected[both]) > within
    return float(off.mean()), float((either & ~both).sum() / either.sum())
