"""Find the samples that can be seen at all, unlike those in a closed cavity or inside a closed shell."""

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.raycast import Hits, RayCaster, join_hits, no_hits
from depthwalk.geometry.triangles import row_ids
from depthwalk.geometry.vectors import lengths
from depthwalk.parallel import Map, batches
from depthwalk.types import Mask

_QUARTERS = 4  # of the samples; undecided samples of one quarter cast their first ray together
_NEAR = 9  # texels, square, for which one escaping ray decides
_AROUND = 65  # texels, square, over which the second rays are counted
_LEAST_SHARE = 1e-3  # of these that must escape
_CROWDED = 9  # surfaces along a ray, from which it counts as passing through foliage
_CROWDED_SHARE = 0.25  # of the rays that hit anything, from which the images count as showing foliage
_EVERY = 61  # every how many rays one is tested
_BATCH = 1 << 15  # rays at a time, each of which may hit 64 surfaces
_DEEPEST = 64  # surfaces along a ray among which the most visible are chosen
_SKY_RAYS = 2  # from each hit, to estimate how much of the sky it sees


@dataclass(frozen=True, kw_only=True)
class _Behind:
    """Hold n samples behind the first ones of their rays.

    layer (minus one) and texel: (n,); start: (n, 3) metres, above the surface; normal: (n, 3), unit, toward its open
    side; shape: (L − 1, H, W), of the images that they are in.
    """

    layer: NDArray[np.intp]
    texel: NDArray[np.intp]
    start: NDArray[np.floating]
    normal: NDArray[np.floating]
    shape: tuple[int, int, int]

    def marked(self, selected: NDArray[np.intp]) -> Mask:
        """Return the images, True at the samples `selected`."""
        images = np.zeros(self.shape, bool)
        images.reshape(len(images), -1)[self.layer[selected], self.texel[selected]] = True
        return images

    def without(self, selected: NDArray[np.intp], images: Mask) -> NDArray[np.intp]:
        """Return those of the samples `selected` at which `images` are False."""
        return selected[~images.reshape(len(images), -1)[self.layer[selected], self.texel[selected]]]


def is_crowded(caster: RayCaster, rays: tuple[NDArray[np.float32], NDArray[np.float32]], max_distance: float) -> bool:
    """Return whether a quarter of the rays that hit anything hit more surfaces than layers can hold, as in foliage.

    Parameters
    ----------
    caster
        The mesh, ready for ray casting, object frame.
    rays
        Origins and directions (n, 3) float32, metres and unit vectors.
    max_distance
        Length of the rays, metres.

    Returns
    -------
    bool
        Whether `peel_exposed` is worth its time; otherwise the nearest layers are the right ones.
    """
    origin, direction = (part[::_EVERY] for part in rays)
    met = np.isfinite(caster.peel(origin, direction, _CROWDED, max_distance).distance)
    return bool(met[-1].sum() > _CROWDED_SHARE * met[0].sum())


def peel_exposed(
    caster: RayCaster,
    rays: tuple[NDArray[np.float32], NDArray[np.float32]],
    layers: int,
    max_distance: float,
    voxel: float,
    parallel_map: Map = map,
) -> Hits:
    """Find surfaces along rays: the first, and of those behind it the ones that see most of the sky.

    If a ray hits more surfaces than there are layers, the nearest are often the worst choice: behind the first leaf of
    a tree come leaves that can hardly be seen, and behind all of them the ground, which is seen from the side. How much
    of the sky a hit sees is estimated by a few random rays, and averaged over hits that lie in one voxel and face the
    same way, so that neighbours choose alike.

    Parameters
    ----------
    caster
        The mesh, ready for ray casting, object frame.
    rays
        Origins and directions (n, 3) float32, metres and unit vectors.
    layers
        How many hits of each ray to keep.
    max_distance
        Length of the rays, metres.
    voxel
        Edge of the voxels, metres.
    parallel_map
        `map`, or what `thread_map` yields to work in several threads.

    Returns
    -------
    Hits
        L = `layers` hits along each ray, nearest first.
    """

    def peeled(batch: slice) -> Hits:
        return _peel_exposed(caster, (rays[0][batch], rays[1][batch]), layers, max_distance, voxel)

    return join_hits(list(parallel_map(peeled, batches(len(rays[0]), _BATCH))))


def _peel_exposed(
    caster: RayCaster,
    rays: tuple[NDArray[np.float32], NDArray[np.float32]],
    layers: int,
    max_distance: float,
    voxel: float,
) -> Hits:
    """Do what `peel_exposed` does, for one batch of rays."""
    origin, direction = rays
    hits = caster.peel(origin, direction, layers + 1, max_distance)
    more = np.flatnonzero(np.isfinite(hits.distance[layers]))
    hits = Hits(**{field.name: getattr(hits, field.name)[:layers] for field in fields(Hits)})
    if len(more):
        deep = caster.peel(origin[more], direction[more], _DEEPEST, max_distance)
        exposure = _exposures(caster, origin[more], direction[more], deep, voxel)
        best = np.argsort(-exposure, axis=0, kind="stable")[:layers]
        kept = np.zeros(exposure.shape, bool)
        np.put_along_axis(kept, best, True, axis=0)
        chosen = compacted(deep, kept & np.isfinite(deep.distance))
        for field in fields(Hits):
            getattr(hits, field.name)[: len(chosen), more] = getattr(chosen, field.name)
    return hits


def _exposures(
    caster: RayCaster,
    origin: NDArray[np.float32],
    direction: NDArray[np.float32],
    hits: Hits,
    voxel: float,
) -> NDArray[np.float64]:
    """Estimate what part (L, n) of the sky hits see; 2 for the first hit of each ray, −1 where there is none."""
    random = np.random.default_rng(0)
    exposure = np.where(np.isfinite(hits.distance), 2.0, -1.0)
    layer, ray = np.isfinite(hits.distance[1:]).nonzero()
    start, normal = _above(caster, (origin, direction), hits, 1 + layer, ray)
    free = np.zeros(len(layer))
    for _ in range(_SKY_RAYS):
        free += caster.escapes(start, _around(normal, random))
    axis = np.abs(normal).argmax(1)
    facing = 2 * axis + (np.take_along_axis(normal, axis[:, None], 1)[:, 0] > 0)
    places = np.column_stack([np.floor(start / voxel).astype(np.int64), facing])
    group = row_ids(places)[0]
    exposure[1 + layer, ray] = (np.bincount(group, free) / np.bincount(group))[group] / _SKY_RAYS
    return exposure


def prune_hidden(
    caster: RayCaster,
    rays: tuple[NDArray[np.float32], NDArray[np.float32]],
    hits: Hits,
    shape: tuple[int, int],
    found: NDArray[np.bool_],
    parallel_map: Map = map,
) -> Hits:
    """Drop samples that cannot be seen from outside: those in a closed cavity or on the inside of a closed shell.

    Parameters
    ----------
    caster
        The mesh, ready for ray casting, object frame.
    rays
        Origins and directions (n, 3) float32 of the texels' rays, metres and unit vectors, object frame.
    hits
        The hits of the rays, L layers.
    shape
        Height H and width W of the image; n = H · W.
    found
        (L, n) bool, True for the hits that may be kept. Those of the first layer always are.
    parallel_map
        `map`, or what `thread_map` yields to work in several threads.

    Returns
    -------
    Hits
        The remaining hits, moved up to the first layers.
    """
    layer, texel = found[1:].nonzero()
    if not len(layer):
        return compacted(hits, found)
    start, normal = _above(caster, rays, hits, 1 + layer, texel)
    behind = _Behind(
        layer=layer,
        texel=texel,
        start=start,
        normal=normal,
        shape=(len(found) - 1, *shape),
    )
    seen = _seen(caster, behind, parallel_map).reshape(len(found) - 1, -1)
    return compacted(hits, found & np.concatenate([np.ones_like(seen[:1]), seen]))


def _seen(caster: RayCaster, behind: _Behind, parallel_map: Map) -> Mask:
    """Return where random rays show that samples are visible from outside.

    A first ray that escapes decides for the samples around it. Samples still in doubt cast a second one. Through a
    narrow opening one ray in hundreds escapes, so these are counted over a wide neighbourhood: if every ray decided
    only for its own surroundings, the border of the kept area would be frayed at random. A minimum share of escaping
    rays is required, because stray rays slip out of any scan.
    """
    from scipy.ndimage import maximum_filter

    random = np.random.default_rng(0)

    def escaping(selected: NDArray[np.intp]) -> Mask:
        direction = _around(behind.normal.take(selected, 0), random)
        return behind.marked(selected[caster.escapes(behind.start.take(selected, 0), direction, parallel_map)])

    def spread(escaped: Mask) -> Mask:
        return np.stack(list(parallel_map(lambda image: maximum_filter(image, _NEAR), escaped)))

    seen = np.zeros(behind.shape, bool)
    doubtful = np.arange(len(behind.layer))
    quarter = (behind.texel % seen.shape[2] + 2 * (behind.texel // seen.shape[2])) % _QUARTERS
    for number in range(_QUARTERS):
        seen |= spread(escaping(doubtful[quarter[doubtful] == number]))
        doubtful = behind.without(doubtful, seen)
    escaped = escaping(doubtful)
    free, cast = (np.stack(list(parallel_map(_density, images))) for images in (escaped, behind.marked(doubtful)))
    return seen | spread(escaped) | (free >= _LEAST_SHARE * cast)


def _density(image: Mask) -> NDArray[np.float32]:
    from scipy.ndimage import uniform_filter

    return np.asarray(uniform_filter(image.astype(np.float32), _AROUND))


def compacted(hits: Hits, kept: NDArray[np.bool_]) -> Hits:
    """Return the hits `kept` (L, n) bool, moved up to the first layers; at least one layer."""
    layer = np.cumsum(kept, axis=0, dtype=np.int8) - 1
    compact = no_hits(max(1, int(layer.max(initial=0)) + 1), kept.shape[1])
    places = layer[kept], kept.nonzero()[1]
    for field in fields(Hits):
        getattr(compact, field.name)[places] = getattr(hits, field.name)[kept]
    return compact


def _above(
    caster: RayCaster,
    rays: tuple[NDArray[np.float32], NDArray[np.float32]],
    hits: Hits,
    layer: NDArray[np.intp],
    ray: NDArray[np.intp],
) -> tuple[NDArray[np.floating], NDArray[np.floating]]:
    """Return points (n, 3) just above the hits (n,) of `rays`, metres, and the normals (n, 3) there."""
    normal = hits.normal[layer, ray]
    point = rays[0].take(ray, 0) + hits.distance[layer, ray, None] * rays[1].take(ray, 0)
    return point + caster.epsilon * normal, normal


def _around(normal: NDArray[np.floating], random: np.random.Generator) -> NDArray[np.floating]:
    """Return a random direction about each unit normal (n, 3), more likely the nearer to it (cosine-weighted)."""
    return _unit(normal + 0.98 * _unit(random.normal(size=normal.shape)))


def _unit(vectors: NDArray[np.floating]) -> NDArray[np.floating]:
    return np.asarray(vectors / np.maximum(lengths(vectors), 1e-12)[:, None])
