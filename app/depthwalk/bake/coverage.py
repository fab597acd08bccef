"""Measure what depth images leave out: the part of the visible surface that no image holds."""

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
_SAME = 1.5  # footprints: how far along the ray a sample may be from a point and still hold it


def measure_left_out(mesh: Mesh, model: BakedModel) -> float:
    """Measure what part of a mesh's visible surface is in none of its depth images.

    Points are spread over the surface and weighted by how much of the sky sees them. An image holds a point if one of
    the four samples around the point's ray is as deep as the point, within the distance between samples.

    Parameters
    ----------
    mesh
        The mesh, asset frame, metres.
    model
        Its depth images.

    Returns
    -------
    float
        0 to 1; 0 if nothing of the mesh can be seen.
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
    """Return which points (n, 3) with normals (n, 3), object frame, are held by an image of `part`."""
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
    """Yield the projections of points (n, 3) onto a face; the side gets two, since its rays go on past the axis."""
    before = grid.project(point)
    yield before
    if grid.face is Face.SIDE:
        u = (before.u + 0.5) % 1
        origin, direction = grid.rays_at(u, before.v)
        yield Projection(point=point, u=u, v=before.v, origin=origin, direction=direction)


def _sampled(grid: FaceGrid, images: list[DepthImage], seen_from: Projection, tolerance: Array) -> Mask:
    """Return which of n points have a sample of about the same depth beside them; tolerance: (n,) metres."""
    depth, sampled = seen_from.depth, np.zeros(len(tolerance), bool)
    column, row = seen_from.u * grid.width - 0.5, seen_from.v * grid.height - 0.5
    for right, above in (0, 0), (0, 1), (1, 0), (1, 1):
        columns = np.floor(column).astype(np.int64) + right
        columns = columns % grid.width if grid.face is Face.SIDE else columns.clip(0, grid.width - 1)
        texel = (np.floor(row).astype(np.int64) + above).clip(0, grid.height - 1) * grid.width + columns
        for image in images:
            sampled |= np.abs(image.depth.take(texel) - depth) < tolerance
    return sampled
