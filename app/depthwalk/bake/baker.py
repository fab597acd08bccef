"""From a mesh to depth images: Liu, Liu and Wu 2007, §3.1, with ray casting in place of six rendered views,
layers by depth peeling, and a per-triangle cut of what does not lie on the surface."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.images import (
    BakedObject,
    Cylinder,
    DepthImage,
    Face,
    cell_triangles,
    grid_cells,
    surface_rays,
    texel_centres,
    texel_size,
    usable_steps,
)
from depthwalk.bake.raycast import RayCaster
from depthwalk.bake.surface import mean_shininess, surface_at
from depthwalk.ingest.mesh import Mesh

# A triangle is dropped where the surface behind its centre is off the triangle by more than this part of the
# triangle's own depth range: half-way values separate a slope (0) from a step (0.33 to 0.67), measured on five models.
CUT_TOLERANCE = 0.15

Progress = Callable[[str], None]


@dataclass(frozen=True)
class BakeParams:
    """resolution: side image W = H and cap image N, texels; layers: depth-peeled surfaces per image."""

    resolution: int = 512
    layers: int = 3


def enclosing_cylinder(mesh: Mesh) -> Cylinder:
    """The smallest cylinder about +Y that holds the mesh, widened by 1e-4 so that no ray starts on the surface."""
    radius = float(np.hypot(mesh.positions[:, 0], mesh.positions[:, 2]).max()) * 1.0001
    low, high = mesh.bounds
    slack = 1e-4 * max(radius, float(high[1] - low[1]))
    radius = max(radius, slack)
    return Cylinder(radius, float(low[1]) - slack, float(high[1]) + slack, radius, radius)


def bake_object(mesh: Mesh, params: BakeParams, key: str, progress: Progress = lambda stage: None) -> BakedObject:
    """Side and both caps of `mesh`, `params.layers` deep; `progress` is called with the name of each stage."""
    cylinder = enclosing_cylinder(mesh)
    caster = RayCaster(mesh)
    steps = usable_steps((params.resolution, params.resolution))
    images: list[DepthImage] = []
    for face in Face:
        progress(face.name.lower())
        images += bake_face(mesh, caster, cylinder, face, params, steps)
    return BakedObject(cylinder, tuple(images), mean_shininess(mesh), steps, key)


def bake_face(
    mesh: Mesh, caster: RayCaster, cylinder: Cylinder, face: Face, params: BakeParams, steps: int
) -> list[DepthImage]:
    """The layers of one face that see anything at all."""
    size = params.resolution
    reach = 2 * cylinder.radius if face is Face.SIDE else cylinder.height
    centres = texel_centres(size)
    origin, direction = surface_rays(cylinder, face, centres, centres[:, None])
    hits = caster.peel(origin.reshape(-1, 3), direction.reshape(-1, 3), params.layers, reach)
    depths = [hit.distance.reshape(size, size) for hit in hits]
    cells = connect(caster, cylinder, face, depths, steps)
    images = []
    for layer, hit in enumerate(hits):
        if np.isfinite(depths[layer]).any():
            normal, albedo = surface_at(mesh, hit)
            shape = (size, size, -1)
            images.append(
                DepthImage(face, layer, depths[layer], normal.reshape(shape), albedo.reshape(shape), cells[layer])
            )
    return images


def connect(
    caster: RayCaster, cylinder: Cylinder, face: Face, depths: list[NDArray[np.float32]], steps: int
) -> list[NDArray[np.uint32]]:
    """Which grid triangles lie on the surface: the `cells` (H, W) of every layer, for all steps.

    A triangle whose depths differ by less than a cell is taken as surface; a steeper one is tested with one more ray
    through its centre (DESIGN §4).
    """
    shape = depths[0].shape
    height, width = shape
    cells = [np.zeros(shape, np.uint32) for _ in depths]
    for level in range(steps):
        step = 1 << level
        i0, j0, i1, j1 = grid_cells(shape, face, step)
        columns, rows = cell_triangles(face, i0, j0, i1, j1)  # (2, cells, 3)
        corners = [depth[rows, columns] for depth in depths]
        with np.errstate(invalid="ignore"):
            spread = [corner.max(-1) - corner.min(-1) for corner in corners]
        cell_size = step * max(texel_size(cylinder, face, shape))
        complete = [np.isfinite(corner).all(-1) for corner in corners]
        steep = [ok & (extent > cell_size) for ok, extent in zip(complete, spread, strict=True)]
        tested = np.logical_or.reduce(steep)
        # The unwrapped column of a wrapped corner, so that a centre never averages across the seam.
        unwrapped = np.where(columns < i0[None, :, None], columns + width, columns)
        u = (unwrapped[tested].mean(-1) + 0.5) / width
        v = (rows[tested].mean(-1) + 0.5) / height
        centre_depths = _surface_depths(caster, cylinder, face, u, v, len(depths))  # (layers, tested)
        for layer, cell in enumerate(cells):
            on_surface = complete[layer].copy()
            middle = corners[layer][tested].mean(-1)
            doubtful = steep[layer][tested]
            with np.errstate(invalid="ignore"):
                off = np.abs(centre_depths - middle).min(axis=0)
                on = ~doubtful | (off <= CUT_TOLERANCE * spread[layer][tested])
            import os
            if os.environ.get("EXP", "1") == "1":
                wall = np.flatnonzero(doubtful & ~on)
                flat_rows = rows[tested][wall]; flat_cols = unwrapped[tested][wall]
                d = corners[layer][tested][wall]
                o, dr = surface_rays(cylinder, face, (flat_cols + 0.5) / width, (flat_rows + 0.5) / height)
                P = o + d[..., None] * dr
                n = np.cross(P[:, 1] - P[:, 0], P[:, 2] - P[:, 0]); n /= np.maximum(np.linalg.norm(n, axis=1, keepdims=True), 1e-12)
                short = np.minimum.reduce([np.linalg.norm(P[:, a] - P[:, b], axis=1) for a, b in ((0, 1), (1, 2), (2, 0))])
                K = float(os.environ.get("KK", "1.0"))
                near = np.zeros(len(wall), bool)
                c = P.mean(1)
                lim = K * np.minimum(short, step*max(texel_size(cylinder, face, shape)))
                for sgn in (1, -1):
                    dd = (sgn * n).astype(np.float32)
                    # back off, so that a surface on either side is met front on
                    hit = caster.peel((c - dd * lim[:, None]).astype(np.float32), dd, 2, 1e9)
                    for h in hit:
                        # facing must agree with triangle normal
                        near |= (h.distance <= 2*lim) & (sgn < 0) & ~h.flipped
                on[wall] = near
            on_surface[tested] &= on
            bits = on_surface[0] | (on_surface[1].astype(np.uint32) << 1)
            cell[j0, i0] |= (bits << (2 * level)).astype(np.uint32)
    return cells


def _surface_depths(
    caster: RayCaster, cylinder: Cylinder, face: Face, u: NDArray[np.floating], v: NDArray[np.floating], layers: int
) -> NDArray[np.float32]:
    """Depth (layers, n) of the surfaces along the rays at (u, v), +inf where there are fewer."""
    origin, direction = surface_rays(cylinder, face, u, v)
    reach = 2 * cylinder.radius if face is Face.SIDE else cylinder.height
    return np.stack([hit.distance for hit in caster.peel(origin, direction, layers, reach)])
