"""Measure what depth images leave out: the part of a surface that views can see and that no image holds."""

from collections.abc import Iterator

import numpy as np
from scipy.spatial.transform import Rotation

from depthwalk.bake.face_grid import FaceGrid, Projection
from depthwalk.bake.images import BakedObject, DepthImage, Face
from depthwalk.bake.model import BakedModel
from depthwalk.bake.ownership import footprints
from depthwalk.bake.placement import Placement
from depthwalk.bake.raycast import RayCaster
from depthwalk.bake.sampling import probe
from depthwalk.ingest.mesh import Mesh
from depthwalk.types import Array, Mask

_PROBES = 4000
_SAME = 1.5  # footprints: how far a sample may be from a point that it holds, along the ray


def measure_left_out(mesh: Mesh, model: BakedModel) -> float:
    """Measure what part of a mesh's visible surface is in none of its depth images.

    Points are spread over the surface and weighted by how much of the sky sees them. An image holds a point where one
    of the four samples around the point's ray is as deep as the point, within the distance between samples.

    Parameters
    ----------
    mesh
        The mesh, asset frame, metres.
    model
        Its depth images.

    Returns
    -------
    float
        0 to 1; 0 where nothing of the mesh can be seen.
    """
    probes = probe(mesh, RayCaster(mesh), _PROBES)
    seen = probes.take(np.flatnonzero(probes.weight > 0))
    left = np.ones(len(seen), bool)
    for part in model.parts:
        placement = Placement(position=np.asarray(part.position), rotation=Rotation.from_quat(part.rotation))
        point, normal = placement.into_object(seen.point), placement.turned_into_object(seen.normal)
        rows = np.flatnonzero(left)
        left[rows] = ~_held(part, point[rows], normal[rows])
    return float(seen.weight[left].sum() / seen.weight.sum()) if len(seen) else 0.0


def _held(part: BakedObject, point: Array, normal: Array) -> Mask:
    """Return which points (n, 3) with normals (n, 3), object frame, an image of `part` holds."""
    held = np.zeros(len(point), bool)
    for face in Face:
        images = [image for image in part.images if image.face is face]
        if images:
            grid = FaceGrid.of(part.cylinder, images[0])
            for seen_from in _projections(grid, point):
                size = footprints(grid, seen_from, normal)
                rows = np.flatnonzero(np.isfinite(size) & ~held)
                held[rows] = _sampled(grid, images, seen_from.take(rows), _SAME * size[rows])
    return held


def _projections(grid: FaceGrid, point: Array) -> Iterator[Projection]:
    """Yield where points (n, 3) fall on a face: on the side twice, since they lie on rays past the axis, too."""
    before = grid.project(point)
    yield before
    if grid.face is Face.SIDE:
        u = (before.u + 0.5) % 1
        origin, direction = grid.rays_at(u, before.v)
        yield Projection(point=point, u=u, v=before.v, origin=origin, direction=direction)


def _sampled(grid: FaceGrid, images: list[DepthImage], seen_from: Projection, tolerance: Array) -> Mask:
    """Return beside which of n points an image has a sample of about the same depth; tolerance: (n,) metres."""
    depth, sampled = seen_from.depth, np.zeros(len(tolerance), bool)
    column, row = seen_from.u * grid.width - 0.5, seen_from.v * grid.height - 0.5
    for right, above in (0, 0), (0, 1), (1, 0), (1, 1):
        columns = np.floor(column).astype(np.int64) + right
        columns = columns % grid.width if grid.face is Face.SIDE else columns.clip(0, grid.width - 1)
        texel = (np.floor(row).astype(np.int64) + above).clip(0, grid.height - 1) * grid.width + columns
        for image in images:
            sampled |= np.abs(image.depth.take(texel) - depth) < tolerance
    return sampled
