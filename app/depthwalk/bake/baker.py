"""Bake a mesh to the depth images of one cylinder (Liu, Liu and Wu 2007, §3.1).

Surfaces are sampled by ray casting, with layers by depth peeling, or from the paper's six views. Neighbouring samples
are connected to triangles, and triangles that do not lie on the surface are dropped.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import product

import numpy as np

from depthwalk.bake.boundary_strip import trace_boundary_strip
from depthwalk.bake.connectivity import connect
from depthwalk.bake.face_grid import FaceGrid
from depthwalk.bake.grid import usable_steps
from depthwalk.bake.images import (
    BOX_FACES,
    PAPER_FACES,
    BakedObject,
    BoundaryStrip,
    DepthImage,
    Face,
    enclosing_cylinder,
    with_margins,
)
from depthwalk.bake.normal_maps import NormalMaps, footprint_area
from depthwalk.bake.ownership import FaceLayers, Rivals, assign_owners, face_layers, worth_adding, yield_triangles
from depthwalk.bake.params import EVERYTHING, NOTHING, BakeParams, Refinements
from depthwalk.bake.raycast import RayCaster
from depthwalk.bake.samples import FaceSamples, face_samples
from depthwalk.bake.surface import mean_reflection, mean_shininess
from depthwalk.bake.texture_coordinates import TexturedFaces, are_worth_keeping, textured_faces, with_coordinates
from depthwalk.bake.trim import trim
from depthwalk.bake.visibility import is_crowded, peel_exposed, prune_hidden
from depthwalk.ingest.mesh import Mesh
from depthwalk.limits import MAX_DPCI_LAYERS
from depthwalk.parallel import Map, batches, thread_map
from depthwalk.types import Mask

Progress = Callable[[str], None]
_LEAST_SHARE = 0.3  # of the 5 × 5 texels around a texel, which a box face must sample better than others to keep it …
_LONE_SHARE = 0.9  # … or of the samples in them
_BATCH = 1 << 15  # samples at a time
_VOXEL = 4  # texels, edge of the voxels over which the samples' sky visibility is averaged
_OVERLAP = 3  # texels by which a box face extends beyond the area that it samples better than the others


def bake_object(
    mesh: Mesh,
    params: BakeParams,
    key: str,
    progress: Progress = lambda stage: None,
    two_sided: bool | None = None,
    workers: int | None = None,
    max_stepped: int | None = None,
) -> BakedObject:
    """Sample a mesh by the depth images of one cylinder (Liu, Liu and Wu 2007, §3.1).

    Box faces hold only what side and caps sample badly. Baking from six views makes no box faces.

    Parameters
    ----------
    mesh
        The mesh, metres, in the object frame: the cylinder's axis is +Y through the origin.
    params
        How the mesh is sampled.
    key
        Hex digest of what the object is made from, stored with it.
    progress
        Called with the name of each stage as it begins.
    two_sided
        Whether surfaces are visible from behind too; None: only those of an open mesh.
    workers
        Number of threads to use; None: the number that `default_workers` returns.
    max_stepped
        Largest side, texels, of images that get the grids of all steps; larger ones get only the grid of step 1, for
        callers that use no coarser grids. None: images of every size get all.

    Returns
    -------
    BakedObject
        The depth images, their boundary strips and the cylinder, object frame, metres.
    """
    cylinder = with_margins(enclosing_cylinder(mesh.positions), params.resolution)
    refinements, side = NOTHING if params.method == "paper" else params.refinements, params.resolution
    grids = {face: FaceGrid(cylinder=cylinder, face=face, height=side, width=side) for face in Face}
    caster = RayCaster(mesh, two_sided)
    steps = usable_steps((side, side)) if max_stepped is None or side <= max_stepped else 1
    rivals: dict[Face, FaceLayers] = {}
    seen: dict[Face, FaceSamples] = {}
    textured = textured_faces(mesh, params.resolution) if params.keeps_coordinates else None
    normal_maps = NormalMaps.of(mesh)
    if params.by_six_views:
        from depthwalk.bake.six_view import sample_six_views  # here: ray casting needs no OpenGL

        progress("drawing six views")
        seen = sample_six_views(mesh, cylinder, side)
    with thread_map(workers) as parallel_map:
        for face in tuple(seen) or (Face if refinements.box_faces else PAPER_FACES):
            progress(f"{face.name.lower()} image")
            if face not in seen:
                seen[face] = cast_face(mesh, caster, grids[face], params, rivals, parallel_map, textured, normal_maps)
            layers = connect_face(caster, grids[face], seen[face], steps, refinements, parallel_map)
            if layers:
                rivals[face] = face_layers(grids[face], layers)
        images = [image for layers in rivals.values() for image in layers.images]
        if refinements.owners:
            progress("best samples")
            images = owned_images(rivals, images, parallel_map)
        progress("edges")
        borders = (
            trace_boundary_strips(caster, grids, seen, images, parallel_map) if refinements.boundary_strips else []
        )
        images, borders = trim(images, borders, parallel_map)
    if textured is not None and not are_worth_keeping(images, textured.texture):
        images, textured = [replace(image, coordinates=None) for image in images], None
    return BakedObject(
        cylinder=cylinder,
        images=tuple(images),
        boundary_strips=tuple(borders),
        shininess=mean_shininess(mesh),
        reflection=mean_reflection(mesh),
        tells_roughness=mesh.has_reflection_maps,
        steps=steps,
        key=key,
        texture=None if textured is None else textured.texture,
        keeps_normals=normal_maps is not None and all(material.cutoff is None for material in mesh.materials),
    )


def owned_images(rivals: Rivals, images: list[DepthImage], parallel_map: Map = map) -> list[DepthImage]:
    """Assign each piece of surface to an owner, the face that samples it best.

    Parameters
    ----------
    rivals
        The layers of each face.
    images
        The depth images of all these faces.
    parallel_map
        `map`, or what `thread_map` yields to work in several threads.

    Returns
    -------
    list
        The images with their owners, and with those triangles marked that other faces hold better.
    """
    owners = assign_owners(rivals, parallel_map)
    owned = [replace(image, owner=owner) for image, owner in zip(images, owners, strict=True)]
    layers = {
        face: replace(rival, images=[image for image in owned if image.face is face]) for face, rival in rivals.items()
    }
    return yield_triangles(layers, parallel_map)


def peeled_layers(params: BakeParams, caster: RayCaster) -> int:
    """Return how many surfaces along each ray become layers, at most `MAX_DPCI_LAYERS`.

    An open mesh gets twice the layers of `params`, because its inside is visible as well.

    Parameters
    ----------
    params
        How the mesh is baked; `layers` "auto" asks for as many layers as a file may hold.
    caster
        The mesh, ready for ray casting; it knows whether it is open.

    Returns
    -------
    int
        The number of surfaces.
    """
    if params.layers == "auto":
        return MAX_DPCI_LAYERS
    return min(params.layers * (2 if caster.two_sided else 1), MAX_DPCI_LAYERS)


def cast_face(
    mesh: Mesh,
    caster: RayCaster,
    grid: FaceGrid,
    params: BakeParams,
    rivals: Rivals | None = None,
    parallel_map: Map = map,
    textured: TexturedFaces | None = None,
    normal_maps: NormalMaps | None = None,
) -> FaceSamples:
    """Sample the surfaces that the rays of one face hit, except those that cannot be seen from outside.

    Parameters
    ----------
    mesh, caster
        The mesh, object frame, and the same mesh ready for ray casting.
    grid
        The face, with one ray per texel.
    params
        How the mesh is baked; `layers` limits the surfaces along a ray.
    rivals
        The faces that were sampled before, if any. A box face leaves out what these hold well enough.
    parallel_map
        `map`, or what `thread_map` yields to work in several threads.
    textured
        The texture in which the samples are located; None for none.
    normal_maps
        The normal maps of the mesh; None if it has none.

    Returns
    -------
    FaceSamples
        Depths, normals and colours, L layers of (H, W) texels.
    """
    origin, direction = (part.reshape(-1, 3) for part in grid.rays)
    layers, rays = peeled_layers(params, caster), (origin, direction)
    if is_crowded(caster, rays, grid.max_depth):
        hits = peel_exposed(caster, rays, layers, grid.max_depth, _VOXEL * grid.longest_texel, parallel_map)
    else:
        hits = caster.peel(origin, direction, layers, grid.max_depth, parallel_map)
    found = np.isfinite(hits.distance)
    if grid.face in BOX_FACES and rivals:
        layer, ray = found.nonzero()

        def worth_it(batch: slice) -> Mask:
            at = layer[batch], ray[batch]
            points = origin[at[1]] + hits.distance[at][:, None] * direction[at[1]]
            return worth_adding(rivals, grid, points, hits.normal[at])

        worth = np.zeros(found.shape, bool)
        worth[found] = np.concatenate(list(parallel_map(worth_it, batches(len(layer), _BATCH))))
        found &= _spread(*(mask.reshape(-1, *grid.shape) for mask in (worth, found))).reshape(found.shape)
    hits = prune_hidden(caster, rays, hits, grid.shape, found, parallel_map)
    area = footprint_area(grid.texel_area(hits.distance), hits.normal, direction) if normal_maps else None
    return face_samples(mesh, hits, grid.shape, parallel_map, textured, normal_maps, area)


def _spread(worth: Mask, found: Mask) -> Mask:
    """Return `worth` (L, H, W) without specks on other surfaces, of those `found`, and dilated by a few texels."""
    from scipy.ndimage import maximum_filter, uniform_filter

    share, samples = (uniform_filter(mask.astype(np.float32), (1, 5, 5)) for mask in (worth, found))
    lone = share > _LONE_SHARE * samples  # of thin bars, with empty texels on either side
    worth = worth & ((share > _LEAST_SHARE) | lone)
    return np.asarray(maximum_filter(worth, (1, 2 * _OVERLAP + 1, 2 * _OVERLAP + 1)))


def connect_face(
    caster: RayCaster,
    grid: FaceGrid,
    seen: FaceSamples,
    steps: int,
    refinements: Refinements = EVERYTHING,
    parallel_map: Map = map,
) -> list[DepthImage]:
    """Build the depth images of one face from its samples; a face without samples gets none.

    Until owners are assigned, the face owns all its samples.

    Parameters
    ----------
    caster
        The mesh, ready for ray casting, object frame; rays find the triangles that are off its surface.
    grid
        Rays and texels of the face.
    seen
        The samples of the face, one or several layers.
    steps
        Number of grids, of steps 1, 2, … 2^(steps − 1).
    refinements
        What to do beyond the paper; only `discontinuity_cut` and `across_layers` matter here.
    parallel_map
        `map`, or what `thread_map` yields to work in several threads.

    Returns
    -------
    list
        The depth images of the face, layer 0 first.
    """
    depth = seen.samples.depth
    if not np.isfinite(depth).any():
        return []
    cells = connect(caster, grid, depth, steps, refinements.discontinuity_cut, refinements.across_layers, parallel_map)
    owner = np.full(grid.shape, grid.face, np.uint8)
    images = [
        DepthImage(
            face=grid.face,
            layer=layer,
            depth=depth[layer],
            normal=seen.normal[layer],
            albedo=seen.albedo[layer],
            cells=tuple(cells[layer]),
            owner=owner,
            mapped_normal=None if seen.mapped_normal is None else seen.mapped_normal[layer],
        )
        for layer in range(len(depth))
    ]
    return images if seen.places is None else [with_coordinates(image, seen.places) for image in images]


def trace_boundary_strips(
    caster: RayCaster,
    grids: Mapping[Face, FaceGrid],
    seen: Mapping[Face, FaceSamples],
    images: Sequence[DepthImage],
    parallel_map: Map = map,
) -> list[BoundaryStrip]:
    """Trace the boundary strips of `images`, level by level and face by face.

    A surface that another face owns gets no strip on this one.

    Parameters
    ----------
    caster
        The mesh, ready for ray casting, object frame.
    grids
        The rays and texels of each face that has images.
    seen
        The samples of each face that has images.
    images
        The depth images of all faces, with their owners.
    parallel_map
        `map`, or what `thread_map` yields to work in several threads.

    Returns
    -------
    list
        A strip for each face and level that has a boundary.
    """

    def trace(task: tuple[int, Face]) -> BoundaryStrip:
        level, face = task
        layers = [image for image in images if image.face is face]
        codes, wanted = [image.cells[level] for image in layers], np.stack([image.owner == face for image in layers])
        return trace_boundary_strip(caster, grids[face], seen[face].samples, level, codes, wanted)

    steps = len(images[0].cells) if images else 0
    faces = dict.fromkeys(image.face for image in images)
    return list(parallel_map(trace, product(range(steps), faces)))
