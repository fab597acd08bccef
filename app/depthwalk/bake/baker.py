"""From a mesh to depth images: Liu, Liu and Wu 2007, §3.1, by ray casting with layers by depth peeling or by the
paper's six views, and a per-triangle cut of what does not lie on the surface."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from depthwalk.bake.border import trace_borders
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
from depthwalk.bake.samples import FaceSamples, face_samples
from depthwalk.bake.surface import mean_shininess
from depthwalk.bake.visibility import prune_hidden
from depthwalk.errors import InputError
from depthwalk.ingest.mesh import Mesh
from depthwalk.limits import MAX_DPCI_LAYERS

Progress = Callable[[str], None]
Method = Literal["raycast", "six-view"]


@dataclass(frozen=True)
class BakeParams:
    """resolution: side image W = H and cap image N, texels; layers: depth-peeled surfaces per image; method: how the
    surfaces are sampled. Raises InputError for layers that the method cannot make."""

    resolution: int = 512
    layers: int = 3
    method: Method = "raycast"

    def __post_init__(self) -> None:
        if self.method == "six-view" and self.layers != 1:
            raise InputError(f"layers: {self.layers}: method six-view sees one surface per ray; say 1, or use raycast")


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
    views: dict[Face, FaceSamples] = {}
    if params.method == "six-view":
        from depthwalk.bake.six_view import sample_six_views  # here: ray casting needs no OpenGL

        progress("six views")
        views = sample_six_views(mesh, cylinder, params.resolution)
    for face in Face:
        progress(face.name.lower())
        seen = views[face] if views else cast_face(mesh, caster, cylinder, face, params)
        layers, edges = connect_face(caster, cylinder, face, seen, steps)
        images += layers
        borders += edges
    progress("owners")
    owners = assign_owners(cylinder, images)
    images = [replace(image, owner=owner) for image, owner in zip(images, owners, strict=True)]
    return BakedObject(cylinder, tuple(images), tuple(borders), mean_shininess(mesh), steps, key)


def cast_face(mesh: Mesh, caster: RayCaster, cylinder: Cylinder, face: Face, params: BakeParams) -> FaceSamples:
    """What rays from one face meet, `params.layers` deep, less what nobody outside can see."""
    size = params.resolution
    reach = 2 * cylinder.radius if face is Face.SIDE else cylinder.height
    centres = texel_centres(size)
    origin, direction = (part.reshape(-1, 3) for part in surface_rays(cylinder, face, centres, centres[:, None]))
    # An open mesh shows its inside as well: twice the surfaces, of which few can be seen.
    wanted = min(params.layers * (2 if caster.two_sided else 1), MAX_DPCI_LAYERS)
    hits = caster.peel(origin, direction, wanted, reach)
    points = origin + np.where(np.isfinite(hits.distance), hits.distance, 0)[..., None] * direction
    return face_samples(mesh, prune_hidden(caster, points, hits, (size, size)), size)


def connect_face(
    caster: RayCaster, cylinder: Cylinder, face: Face, seen: FaceSamples, steps: int
) -> tuple[list[DepthImage], list[Border]]:
    """The layers of one face that see anything at all, and their borders; each owns all it sees until owners are
    assigned."""
    if not np.isfinite(seen.samples.depth).any():
        return [], []
    cells = connect(caster, cylinder, face, seen.samples.depth, steps)
    owner = np.full(seen.samples.depth.shape[1:], face, np.uint8)
    images = [
        DepthImage(face, layer, depth, seen.normal[layer], seen.albedo[layer], tuple(cells[layer]), owner)
        for layer, depth in enumerate(seen.samples.depth)
    ]
    return images, trace_borders(caster, cylinder, face, seen.samples, cells)
