"""Bake a cylindrical panorama with depth to the depth images of a cylinder that is seen from inside.

A panorama's rays meet in its pinhole (McMillan and Bishop 1995); those of a DPCI are horizontal (Liu, Liu and Wu 2007,
§3.1 and figure 6, which shows both). So the pixels are turned into a mesh, like those of any range image, and rays are
cast at it. Rays of caps and box faces pass through surfaces that they first hit from behind; rays of the side start at
the axis. What these hit is beyond the axis, at depths greater than the cylinder's radius, and faces it: the inner walls
of a room.
"""

from dataclasses import replace

import numpy as np

from depthwalk.bake.baker import connect_face, owned_images, trace_boundary_strips
from depthwalk.bake.face_grid import FaceGrid
from depthwalk.bake.grid import grid_cells, usable_steps
from depthwalk.bake.images import BakedObject, DepthImage, Face, enclosing_cylinder, with_margins
from depthwalk.bake.ownership import FaceLayers, face_layers
from depthwalk.bake.planar import range_mesh
from depthwalk.bake.raycast import RayCaster
from depthwalk.bake.samples import FaceSamples, face_samples
from depthwalk.bake.surface import mean_shininess
from depthwalk.bake.trim import trim
from depthwalk.bake.visibility import compacted
from depthwalk.errors import InputError
from depthwalk.ingest.range_image import RangeImage
from depthwalk.limits import MIN_DPCI_RESOLUTION
from depthwalk.parallel import thread_map

# Below a table is the floor; and if nothing is torn, rubber sheets across the jumps in depth lie above both.
_LAYERS = 4
# Cosine between ray and normal below which a sample is left to other faces, one of which is within 55° of any normal.
# Of a floor, horizontal rays hit only the unevenness, and triangles would span from there to the wall.
_GRAZING = 0.3
_MAX_TEXELS = 1024  # a side: baking seven faces of four layers takes some 3 GB of memory


def bake_panorama(image: RangeImage, key: str, cut: bool = True) -> BakedObject:
    """Resample a panorama to the faces of a cylinder about its pinhole.

    Parameters
    ----------
    image
        The panorama, whose lens is a `PanoramaLens`.
    key
        Hex digest of what the object is made from, kept with it.
    cut
        Whether to tear the surface where the depth jumps; the paper connects all pixels, by rubber sheets that then
        count as surface.

    Returns
    -------
    BakedObject
        The object, placed in the asset's frame: the pinhole is above the origin, and the lowest point is at height 0. A
        texel of the side is as wide as a pixel, but there are at most 1024 in a full turn.

    Raises
    ------
    InputError
        If no two neighbouring pixels show the same surface, or all rays only graze it.
    """
    mesh = range_mesh(image, cut)
    side = int(np.clip(image.depth.shape[1], MIN_DPCI_RESOLUTION, _MAX_TEXELS))
    cylinder = with_margins(enclosing_cylinder(mesh.positions), side)
    caster, steps = RayCaster(mesh, two_sided=False, front_only=True), usable_steps((side, side))
    grids = {face: FaceGrid(cylinder=cylinder, face=face, height=side, width=side) for face in Face}
    seen: dict[Face, FaceSamples] = {}
    layers: dict[Face, FaceLayers] = {}
    with thread_map() as parallel_map:
        for face, grid in grids.items():
            origin, direction = (part.reshape(-1, 3) for part in grid.rays)
            start = np.float32(cylinder.radius if face is Face.SIDE else 0)
            reach = grid.max_depth - float(start)
            hits = caster.peel(origin + start * direction, direction, _LAYERS, reach, parallel_map)
            facing = -np.einsum("lni,ni->ln", hits.normal, direction)
            hits = compacted(replace(hits, distance=hits.distance + start), facing > _GRAZING)
            seen[face] = face_samples(mesh, hits, grid.shape, parallel_map)
            if connected := connect_face(caster, grid, seen[face], steps, parallel_map=parallel_map):
                layers[face] = face_layers(grid, connected)
        if not layers:
            raise InputError("the panorama holds no surface that a depth image could show")
        images = owned_images(layers, [image for rival in layers.values() for image in rival.images], parallel_map)
        images, borders = trim(images, trace_boundary_strips(caster, grids, seen, images, parallel_map), parallel_map)
    if all(image.face is not Face.SIDE for image in images):
        images.append(_empty_side(grids[Face.SIDE], steps))
    return BakedObject(
        cylinder=cylinder,
        images=tuple(images),
        boundary_strips=tuple(borders),
        shininess=mean_shininess(mesh),
        steps=steps,
        key=key,
        position=(0.0, -float(mesh.bounds[0][1]), 0.0),
    )


def _empty_side(grid: FaceGrid, steps: int) -> DepthImage:
    """Return a side image without samples, which marks objects that surround their axis; a plain lies wholly below."""
    return DepthImage(
        face=Face.SIDE,
        layer=0,
        depth=np.full(grid.shape, np.inf, np.float32),
        normal=np.zeros((*grid.shape, 3), np.float32),
        albedo=np.zeros((*grid.shape, 4), np.float32),
        cells=tuple(np.zeros(len(grid_cells(grid.shape, Face.SIDE, 1 << k)[0]), np.uint16) for k in range(steps)),
        owner=np.full(grid.shape, Face.SIDE, np.uint8),
    )
