"""Bake a mesh as one object, or as several parts with a cylinder each if one would sample it badly."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.axis import choose_axis
from depthwalk.bake.baker import Progress, bake_object
from depthwalk.bake.depth import Depth, deep_enough, measure_depth
from depthwalk.bake.division import divide, part_faces
from depthwalk.bake.images import BakedObject
from depthwalk.bake.interior import has_interior
from depthwalk.bake.model import BakedModel
from depthwalk.bake.params import NAMED, BakeParams, Direction, ModelParams
from depthwalk.bake.placement import Placement, cylinder_around, extent, place_along
from depthwalk.bake.raycast import RayCaster
from depthwalk.bake.sampling import probe
from depthwalk.ingest.mesh import Mesh, Part
from depthwalk.limits import MIN_DPCI_RESOLUTION

_PROBES = 1000
_DEPTH_PROBES = 4000  # one layer may be worth a thousandth of the surface
_OVERLAP = 2.0  # texels of surface beyond a cut that a part holds in addition to its own


def bake_model(
    mesh: Mesh,
    params: ModelParams,
    key: str,
    progress: Progress = lambda stage: None,
    workers: int | None = None,
    max_stepped: int | None = None,
) -> BakedModel:
    """Bake a mesh to depth images, as one object or as several.

    Parameters
    ----------
    mesh
        The mesh, asset frame, metres.
    params
        How the mesh is sampled and split.
    key
        Hex digest of what the model is made from, stored with it.
    progress
        Called with the name of each stage as it begins.
    workers
        Number of threads to use; None: the number that `default_workers` returns.
    max_stepped
        Largest side, texels, of images that get the grids of all steps; larger ones get only the grid of step 1. None:
        images of every size get all.

    Returns
    -------
    BakedModel
        One object for each part, placed in the asset's frame.

    Raises
    ------
    InputError
        If the mesh cannot be baked by the requested method.
    """
    caster = RayCaster(mesh)
    interior = has_interior(mesh, caster)
    if params.parts != 1:
        progress("parts")
        upright = cylinder_around(place_along(NAMED["y"], mesh.positions), mesh.positions)
        texel = extent(upright) / params.resolution
        cells = divide(mesh, caster, params, texel, None if params.parts == "auto" else params.parts)
        if len(cells) > 1:
            pieces = (submesh(mesh, part_faces(mesh, cell, _OVERLAP * texel)) for cell in cells)
            options = caster.two_sided, workers, max_stepped, texel
            baked = (_bake_placed(piece, params, key, progress, *options) for piece in pieces)
            return _of_mesh(mesh, interior, *baked)
    return _of_mesh(mesh, interior, _bake_placed(mesh, params, key, progress, caster.two_sided, workers, max_stepped))


def _of_mesh(mesh: Mesh, interior: bool, *parts: BakedObject) -> BakedModel:
    """Return a model of `parts`, with the number of triangles of `mesh` and whether it has an interior."""
    return BakedModel(
        parts=tuple(replace(part, mesh_triangles=len(mesh.faces), has_interior=interior) for part in parts)
    )


def submesh(mesh: Mesh, kept: NDArray[np.bool_]) -> Mesh:
    """Return the part of `mesh` with the faces `kept`, (F,) bool, and the vertices and materials that they use."""
    used, corners = np.unique(mesh.faces[kept], return_inverse=True)
    counts = [int(kept[run.first_face : run.first_face + run.face_count].sum()) for run in mesh.parts]
    firsts = np.cumsum([0, *counts]).tolist()
    runs = [Part(first, n, run.material) for first, n, run in zip(firsts, counts, mesh.parts, strict=False) if n]
    return replace(
        mesh,
        positions=mesh.positions[used],
        normals=mesh.normals[used],
        colours=mesh.colours[used],
        uv=mesh.uv[used],
        faces=corners.reshape(-1, 3).astype(np.int32),
        parts=tuple(runs),
    )


def _bake_placed(
    mesh: Mesh,
    params: ModelParams,
    key: str,
    progress: Progress,
    two_sided: bool,
    workers: int | None,
    max_stepped: int | None,
    texel: float | None = None,
) -> BakedObject:
    """Bake `mesh` about the requested axis.

    two_sided: see `RayCaster`. texel: side of a texel, metres; None uses the requested resolution.
    """
    placement = place_along(_direction(mesh, params, progress, two_sided), mesh.positions)
    if texel is not None:
        texels = extent(cylinder_around(placement, mesh.positions)) / texel
        params = replace(params, resolution=_resolution(texels, params.resolution))
    if params.layers == "auto":
        progress("layers")
        params = replace(params, layers=deep_enough(probed_depth(mesh, placement, params, two_sided)).layers)
    baked = bake_object(placement.placed(mesh), params, key, progress, two_sided, workers, max_stepped)
    position, rotation = placement.position.tolist(), placement.rotation.as_quat().tolist()
    return replace(baked, position=tuple(position), rotation=tuple(rotation))


def probed_depth(mesh: Mesh, placement: Placement, params: BakeParams, two_sided: bool | None = None) -> list[Depth]:
    """Measure how well depth images would sample a mesh, for each number of layers.

    Parameters
    ----------
    mesh
        The mesh, asset frame, metres.
    placement
        The frame of the cylinder in the asset's.
    params
        How the mesh would be baked; its `layers` is ignored.
    two_sided
        Whether surfaces are visible from behind too; None: only those of an open mesh.

    Returns
    -------
    list
        The results for images of 1, 2, … `MAX_DPCI_LAYERS` layers, in this order.
    """
    caster = RayCaster(mesh, two_sided)
    probes = probe(mesh, caster, _DEPTH_PROBES)
    return measure_depth(caster, probes, placement, cylinder_around(placement, mesh.positions), params)


def _direction(mesh: Mesh, params: ModelParams, progress: Progress, two_sided: bool | None) -> Direction:
    """Return the requested axis, or the best one if the choice is left to the baker."""
    if params.axis == "auto":
        progress("axis")
        caster = RayCaster(mesh, two_sided)
        return choose_axis(caster, mesh.positions, probe(mesh, caster, _PROBES), params)
    return params.axis if isinstance(params.axis, tuple) else NAMED[params.axis]


def _resolution(texels: float, most: int) -> int:
    """Return the side of an image that holds `texels`, at most `most`."""
    rounded = -(-int(np.ceil(texels)) // MIN_DPCI_RESOLUTION) * MIN_DPCI_RESOLUTION
    return min(max(rounded, 4 * MIN_DPCI_RESOLUTION), most)
