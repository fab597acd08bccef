"""From a mesh to depth images: Liu, Liu and Wu 2007, §3.1, with ray casting in place of six rendered views,
layers by depth peeling, and a per-triangle cut of what does not lie on the surface."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from depthwalk.bake.border import Samples, trace_borders
from depthwalk.bake.connectivity import connect
from depthwalk.bake.images import (
    BakedObject,
    Border,
    Cylinder,
    DepthImage,
    Face,
    surface_rays,
    texel_centres,
    usable_steps,
)
from depthwalk.bake.ownership import assign_owners
from depthwalk.bake.raycast import RayCaster
from depthwalk.bake.surface import mean_shininess, surface_at
from depthwalk.bake.visibility import prune_hidden
from depthwalk.ingest.mesh import Mesh
from depthwalk.limits import MAX_DPCI_LAYERS

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
    borders: list[Border] = []
    for face in Face:
        progress(face.name.lower())
        seen, edges = bake_face(mesh, caster, cylinder, face, params, steps)
        images += seen
        borders += edges
    progress("owners")
    owners = assign_owners(cylinder, images)
    images = [replace(image, owner=owner) for image, owner in zip(images, owners, strict=True)]
    return BakedObject(cylinder, tuple(images), tuple(borders), mean_shininess(mesh), steps, key)


def bake_face(
    mesh: Mesh, caster: RayCaster, cylinder: Cylinder, face: Face, params: BakeParams, steps: int
) -> tuple[list[DepthImage], list[Border]]:
    """The layers of one face that see anything at all, and their borders; each owns all it sees until owners are
    assigned."""
    size = params.resolution
    reach = 2 * cylinder.radius if face is Face.SIDE else cylinder.height
    centres = texel_centres(size)
    origin, direction = (part.reshape(-1, 3) for part in surface_rays(cylinder, face, centres, centres[:, None]))
    # An open mesh shows its inside as well: twice the surfaces, of which few can be seen.
    wanted = min(params.layers * (2 if caster.two_sided else 1), MAX_DPCI_LAYERS)
    hits = caster.peel(origin, direction, wanted, reach)
    if not np.isfinite(hits.distance).any():
        return [], []
    points = origin + np.where(np.isfinite(hits.distance), hits.distance, 0)[..., None] * direction
    hits = prune_hidden(caster, points, hits, (size, size))
    shape = (len(hits), size, size)
    samples = Samples(hits.distance.reshape(shape), hits.normal.reshape(*shape, 3), hits.flipped.reshape(shape))
    cells = connect(caster, cylinder, face, samples.depth, steps)
    normal, albedo = (channel.reshape(*shape, -1) for channel in surface_at(mesh, hits))
    owner = np.full((size, size), face, np.uint8)
    images = [
        DepthImage(face, layer, samples.depth[layer], normal[layer], albedo[layer], tuple(cells[layer]), owner)
        for layer in range(len(hits))
    ]
    return images, trace_borders(caster, cylinder, face, samples, cells)
