"""From a mesh to depth images: Liu, Liu and Wu 2007, §3.1, by ray casting with layers by depth peeling or by the
paper's six views, and a per-triangle cut of what does not lie on the surface."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.border import trace_border
from depthwalk.bake.connectivity import connect
from depthwalk.bake.grid import usable_steps
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
    with_margins,
)
from depthwalk.bake.ownership import Inner, assign_owners, inner_texels, worth_adding, yield_triangles
from depthwalk.bake.parallel import Map, batches, thread_map
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
Layers = int | Literal["auto"]
_LEAST_SHARE = 0.3  # of the 5 × 5 texels around that a flank must sample better than others, to be worth the trouble
_BATCH = 1 << 15  # samples at a time
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
    """resolution: side image W = H and cap image N, texels; layers: depth-peeled surfaces per image, auto: as many as
    there may be; method: how the surfaces are sampled; refinements: all of them. Raises InputError for layers that the
    method cannot make."""

    resolution: int = 512
    layers: Layers = 3
    method: Method = "raycast"
    refinements: Refinements = field(default=EVERYTHING, kw_only=True)

    def __post_init__(self) -> None:
        if self.method == "six-view" and self.layers != 1:
            raise InputError(f"layers {self.layers}: method six-view sees one surface per ray; say 1, or use raycast")


def bake_object(
    mesh: Mesh,
    params: BakeParams,
    key: str,
    progress: Progress = lambda stage: None,
    two_sided: bool | None = None,
    workers: int | None = None,
) -> BakedObject:
    """Side, caps and flanks of `mesh`, `params.layers` deep; `progress` is called with the name of each stage.

    Flanks hold only what the others sample badly; six views make none. two_sided: see `RayCaster`; workers: see
    `thread_map`.
    """
    cylinder = with_margins(enclosing_cylinder(mesh.positions), params.resolution)
    refinements = params.refinements
    caster = RayCaster(mesh, two_sided)
    steps = usable_steps((params.resolution, params.resolution))
    images: list[DepthImage] = []
    inner: Inner = {}
    seen: dict[Face, FaceSamples] = {}
    if params.method == "six-view":
        from depthwalk.bake.six_view import sample_six_views  # here: ray casting needs no OpenGL

        progress("six views")
        seen = sample_six_views(mesh, cylinder, params.resolution)
    with thread_map(workers) as each:
        for face in tuple(seen) or (Face if refinements.flanks else PAPER_FACES):
            progress(face.name.lower())
            if face not in seen:
                seen[face] = cast_face(mesh, caster, cylinder, face, params, images, inner, each)
            layers = connect_face(caster, cylinder, face, seen[face], steps, refinements, each)
            if layers:
                inner[face] = inner_texels(layers)
            images += layers
        if refinements.owners:
            progress("owners")
            owners = assign_owners(cylinder, images, inner, each)
            images = [replace(image, owner=owner) for image, owner in zip(images, owners, strict=True)]
            images = yield_triangles(cylinder, images, inner, each)
        progress("borders")
        borders = trace_borders(caster, cylinder, seen, images, each) if refinements.borders else []
        images, borders = trim(images, borders, each)
    return BakedObject(cylinder, tuple(images), tuple(borders), mean_shininess(mesh), steps, key)


def peeled_layers(params: BakeParams, caster: RayCaster) -> int:
    """How many surfaces a ray counts: twice as many of an open mesh, which shows its inside, though little of it."""
    if params.layers == "auto":
        return MAX_DPCI_LAYERS
    return min(params.layers * (2 if caster.two_sided else 1), MAX_DPCI_LAYERS)


def cast_face(
    mesh: Mesh,
    caster: RayCaster,
    cylinder: Cylinder,
    face: Face,
    params: BakeParams,
    others: Sequence[DepthImage] = (),
    inner: Inner | None = None,
    each: Map = map,
) -> FaceSamples:
    """What rays from one face meet, `params.layers` deep, less what nobody outside can see; of a flank, less what the
    images of `others`, with their `inner_texels`, sample well enough."""
    size = params.resolution
    centres = texel_centres(size)
    origin, direction = (part.reshape(-1, 3) for part in surface_rays(cylinder, face, centres, centres[:, None]))
    hits = caster.peel(origin, direction, peeled_layers(params, caster), face_reach(cylinder, face), each)
    found = np.isfinite(hits.distance)
    if face in FLANKS and inner:
        layer, ray = found.nonzero()

        def worth_it(some: slice) -> NDArray[np.bool_]:
            at = layer[some], ray[some]
            points = origin[at[1]] + hits.distance[at][:, None] * direction[at[1]]
            return worth_adding(cylinder, list(others), inner, face, points, hits.normal[at])

        worth = np.zeros(found.shape, bool)
        worth[found] = np.concatenate(list(each(worth_it, batches(len(layer), _BATCH))))
        found &= _spread(worth.reshape(-1, size, size)).reshape(found.shape)
    hits = prune_hidden(caster, (origin, direction), hits, (size, size), found, each)
    return face_samples(mesh, hits, size, each)


def _spread(worth: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """`worth` (L, H, W) without specks, and a few texels around."""
    from scipy.ndimage import maximum_filter, uniform_filter

    worth = worth & (uniform_filter(worth.astype(np.float32), (1, 5, 5)) > _LEAST_SHARE)
    return maximum_filter(worth, (1, 2 * _OVERLAP + 1, 2 * _OVERLAP + 1))


def connect_face(
    caster: RayCaster,
    cylinder: Cylinder,
    face: Face,
    seen: FaceSamples,
    steps: int,
    refinements: Refinements = EVERYTHING,
    each: Map = map,
) -> list[DepthImage]:
    """The layers of one face that see anything at all; each owns all it sees until owners are assigned."""
    if not np.isfinite(seen.samples.depth).any():
        return []
    depth = seen.samples.depth
    cells = connect(caster, cylinder, face, depth, steps, refinements.cut, refinements.across_layers, each)
    owner = np.full(depth.shape[1:], face, np.uint8)
    return [
        DepthImage(face, layer, depth[layer], seen.normal[layer], seen.albedo[layer], tuple(cells[layer]), owner)
        for layer in range(len(depth))
    ]


def trace_borders(
    caster: RayCaster, cylinder: Cylinder, seen: Mapping[Face, FaceSamples], images: list[DepthImage], each: Map = map
) -> list[Border]:
    """The borders of `images`, level by level, from what was `seen`. What another face owns needs none."""

    def trace(task: tuple[int, Face]) -> Border:
        level, face = task
        layers = [image for image in images if image.face is face]
        codes, wanted = [image.cells[level] for image in layers], np.stack([image.owner == face for image in layers])
        return trace_border(caster, cylinder, face, seen[face].samples, level, codes, wanted)

    steps = len(images[0].cells) if images else 0
    faces = dict.fromkeys(image.face for image in images)
    return list(each(trace, product(range(steps), faces)))
