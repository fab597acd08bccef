"""Capture pictures of a mesh from many directions.

Brucks 2018, "Octahedral impostors": each picture is orthographic, encloses the bounding sphere, and holds colour,
coverage, normal and depth in eight bits each. Texels outside the silhouette are dilated: they take the values of the
nearest texel inside, so that filtering brings in no other colours.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

from depthwalk.bake.captured_views import CapturedViews, CaptureParams
from depthwalk.bake.normal_maps import NormalMaps, footprint_area
from depthwalk.bake.raycast import RayCaster
from depthwalk.bake.reflection_code import reflections_of_codes
from depthwalk.bake.surface import mean_reflection, mean_shininess, surface_at
from depthwalk.geometry.view_directions import view_axes
from depthwalk.ingest.gltf_reflection import phong_strength
from depthwalk.ingest.mesh import Mesh
from depthwalk.parallel import Map


def capture_views(mesh: Mesh, params: CaptureParams, parallel_map: Map = map) -> CapturedViews:
    """Capture a mesh from all directions in `params`, one ray per texel.

    Parameters
    ----------
    mesh
        The mesh, asset frame.
    params
        The directions, and the resolution of the pictures.
    parallel_map
        `map`, or what `thread_map` yields to work in several threads.

    Returns
    -------
    CapturedViews
        One picture for each direction.
    """
    low, high = mesh.bounds
    centre = np.asarray((low + high) / 2, np.float64)
    radius = float(np.linalg.norm(mesh.positions - centre, axis=1).max())
    caster, side, maps = RayCaster(mesh), params.resolution, NormalMaps.of(mesh)
    at = (2 * np.arange(side) + 1) / side - 1
    offsets = radius * np.stack(np.broadcast_arrays(at[None], at[:, None]), -1).reshape(-1, 2)
    within = np.flatnonzero(np.linalg.norm(offsets, axis=1) <= radius)
    start = 1.001 * radius  # in front of anything that touches the sphere

    def capture(axes: NDArray[np.float64]) -> tuple[NDArray[np.uint8], NDArray[np.uint8], float]:
        origin = centre + offsets[within] @ axes[:2] + start * axes[2]
        along = np.broadcast_to(-axes[2], origin.shape)
        hits = caster.peel(origin.astype(np.float32), np.ascontiguousarray(along, np.float32), 1, 2 * start)
        normal, albedo = surface_at(mesh, hits)
        if maps is not None:
            normal = maps.turned(hits, normal, footprint_area((2 * radius / side) ** 2, hits.normal, along))
        solid = np.zeros(side * side, bool)
        solid[within] = hits.face[0] >= 0
        met = hits.face[0] >= 0
        texels = np.zeros((side * side, 8))
        texels[solid, :3] = np.sqrt(albedo[0, met, :3])
        texels[solid, 4:7] = normal[0, met] / 2 + 0.5
        texels[solid, 7] = (hits.distance[0, met] - (start - radius)) / (2 * radius)
        filled = _dilated(texels.reshape(side, side, 8), solid.reshape(side, side))
        filled[..., 3] = solid.reshape(side, side)
        eight_bits = (np.clip(filled, 0, 1) * 255 + 0.5).astype(np.uint8)
        strength = albedo[0, met, 3]
        if mesh.has_reflection_maps:
            strength = phong_strength(*reflections_of_codes(strength))
        specular = float(strength.mean()) if met.any() else 0.0
        return eight_bits[..., :4], eight_bits[..., 4:], specular

    captured = list(parallel_map(capture, view_axes(params.unit_vectors())))
    colour, surface, specular = zip(*captured, strict=True)
    return CapturedViews(
        centre=centre.astype(np.float32),
        half_size=np.asarray((high - low) / 2, np.float32),
        radius=radius,
        colour=np.stack(colour),
        surface=np.stack(surface),
        specular=float(np.mean(specular)),
        shininess=mean_shininess(mesh),
        reflection=mean_reflection(mesh),
    )


def _dilated(texels: NDArray[np.float64], solid: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Return texels (H, W, c) where those that are not `solid` (H, W) take the value of the nearest solid one."""
    if not solid.any():
        return texels
    row, column = distance_transform_edt(~solid, return_distances=False, return_indices=True)
    return np.asarray(texels[row, column])
