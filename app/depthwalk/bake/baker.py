"""From a mesh to depth images: Liu, Liu and Wu 2007, §3.1, by ray casting with layers by depth peeling or by the
paper's six views, and a per-triangle cut of what does not lie on the surface."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter, uniform_filter

from depthwalk.bake.border import trace_borders
from depthwalk.bake.connectivity import connect
from depthwalk.bake.images import (
    FLANKS,
    PAPER_FACES,
    BakedObject,
    Border,
    Cylinder,
    DepthImage,
    Face,
    enclosing_cylinder,
    face_reach,
    surface_rays,
    texel_centres,
    usable_steps,
)
from depthwalk.bake.ownership import Inner, assign_owners, inner_texels, worth_adding, yield_triangles
from depthwalk.bake.raycast import RayCaster
from depthwalk.bake.samples import FaceSamples, face_samples
from depthwalk.bake.surface import mean_shininess
from depthwalk.bake.trim import trim
from depthwalk.bake.visibility import prune_hidden
from depthwalk.errors import InputError
from depthwalk.ingest.mesh import Mesh
from depthwalk.limits import MAX_DPCI_LAYERS

Progress = Callable[[str], None]
Method = Literal["raycast", "six-view"]
_LEAST_SHARE = 0.3  # of the 5 × 5 texels around that a flank must sample better than others, to be worth the trouble
_OVERLAP = 3  # texels by which a flank goes on beyond what it samples better than others


@dataclass(frozen=True)
class Refinements:
    """What the baker does beyond the paper, as docs/baking.md describes it; to be left out for the ablation only
    (docs/ablation.md)."""

    cut: bool = True
    across_layers: bool = True
    borders: bool = True
    owners: bool = True
    flanks: bool = True


EVERYTHING = Refinements()


@dataclass(frozen=True)
class BakeParams:
    """resolution: side image W = H and cap image N, texels; layers: depth-peeled surfaces per image; method: how the
    surfaces are sampled; refinements: all of them. Raises InputError for layers that the method cannot make."""

    resolution: int = 512
    layers: int = 3
    method: Method = "raycast"
    refinements: Refinements = field(default=EVERYTHING, kw_only=True)

    def __post_init__(self) -> None:
        if self.method == "six-view" and self.layers != 1:
            raise InputError(f"layers: {self.layers}: method six-view sees one surface per ray; say 1, or use raycast")


def bake_object(
    mesh: Mesh,
    params: BakeParams,
    key: str,
    progress: Progress = lambda stage: None,
    two_sided: bool | None = None,
) -> BakedObject:
    """Side, caps and flanks of `mesh`, `params.layers` deep; `progress` is called with the name of each stage.

    Flanks hold only what the others sample badly; six views make none. two_sided: see `RayCaster`.
    """
    cylinder, refinements = enclosing_cylinder(mesh.positions), params.refinements
    caster = RayCaster(mesh, two_sided)
    steps = usable_steps((params.resolution, params.resolution))
    images: list[DepthImage] = []
    inner: Inner = {}
    seen: dict[Face, FaceSamples] = {}
    if params.method == "six-view":
        from depthwalk.bake.six_view import sample_six_views  # here: ray casting needs no OpenGL

        progress("six views")
        seen = sample_six_views(mesh, cylinder, params.resolution)
    for face in tuple(seen) or (Face if refinements.flanks else PAPER_FACES):
        progress(face.name.lower())
        if face not in seen:
            seen[face] = cast_face(mesh, caster, cylinder, face, params, images, inner)
        layers = connect_face(caster, cylinder, face, seen[face], steps, refinements)
        if layers:
            inner[face] = inner_texels(layers)
        images += layers
    if refinements.owners:
        progress("owners")
        owners = assign_owners(cylinder, images, inner)
        images = [replace(image, owner=owner) for image, owner in zip(images, owners, strict=True)]
        images = yield_triangles(cylinder, images, inner)
    progress("borders")
    borders: list[Border] = []
    for face, samples in seen.items() if refinements.borders else ():
        borders += border_face(caster, cylinder, face, samples, [image for image in images if image.face is face])
    images, borders = trim(images, borders)
    return BakedObject(cylinder, tuple(images), tuple(borders), mean_shininess(mesh), steps, key)


def peeled_layers(params: BakeParams, caster: RayCaster) -> int:
    """How many surfaces a ray counts: twice as many of an open mesh, which shows its inside, though little of it."""
    return min(params.layers * (2 if caster.two_sided else 1), MAX_DPCI_LAYERS)


def cast_face(
    mesh: Mesh,
    caster: RayCaster,
    cylinder: Cylinder,
    face: Face,
    params: BakeParams,
    others: Sequence[DepthImage] = (),
    inner: Inner | None = None,
) -> FaceSamples:
    """What rays from one face meet, `params.layers` deep, less what nobody outside can see; of a flank, less what the
    images of `others`, with their `inner_texels`, sample well enough."""
    size = params.resolution
    centres = texel_centres(size)
    origin, direction = (part.reshape(-1, 3) for part in surface_rays(cylinder, face, centres, centres[:, None]))
    hits = caster.peel(origin, direction, peeled_layers(params, caster), face_reach(cylinder, face))
    found = np.isfinite(hits.distance)
    points = origin + np.where(found, hits.distance, 0)[..., None] * direction
    if face in FLANKS and inner:
        worth = np.zeros(found.shape, bool)
        worth[found] = worth_adding(cylinder, list(others), inner, face, points[found], hits.normal[found])
        found &= _spread(worth.reshape(-1, size, size)).reshape(found.shape)
    return face_samples(mesh, prune_hidden(caster, points, hits, (size, size), found), size)


def _spread(worth: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """`worth` (L, H, W) without specks, and a few texels around."""
    worth = worth & (uniform_filter(worth.astype(np.float32), (1, 5, 5)) > _LEAST_SHARE)
    return maximum_filter(worth, (1, 2 * _OVERLAP + 1, 2 * _OVERLAP + 1))


def connect_face(
    caster: RayCaster,
    cylinder: Cylinder,
    face: Face,
    seen: FaceSamples,
    steps: int,
    refinements: Refinements = EVERYTHING,
) -> list[DepthImage]:
    """The layers of one face that see anything at all; each owns all it sees until owners are assigned."""
    if not np.isfinite(seen.samples.depth).any():
        return []
    cells = connect(caster, cylinder, face, seen.samples.depth, steps, refinements.cut, refinements.across_layers)
    owner = np.full(seen.samples.depth.shape[1:], face, np.uint8)
    return [
        DepthImage(face, layer, depth, seen.normal[layer], seen.albedo[layer], tuple(cells[layer]), owner)
        for layer, depth in enumerate(seen.samples.depth)
    ]


def border_face(
    caster: RayCaster, cylinder: Cylinder, face: Face, seen: FaceSamples, images: list[DepthImage]
) -> list[Border]:
    """The borders of one face; images: its layers. What another face owns needs none."""
    if not images:
        return []
    wanted = np.stack([image.owner == face for image in images])
    return trace_borders(caster, cylinder, face, seen.samples, [list(image.cells) for image in images], wanted)
