"""Find the samples that can be seen at all: those in a closed cavity, or inside a closed shell, never are."""

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.raycast import Hits, RayCaster, no_hits
from depthwalk.geometry.vectors import lengths
from depthwalk.parallel import Map
from depthwalk.types import Mask

_QUARTERS = 4  # of the samples: those still in doubt in each cast their first ray together
_NEAR = 9  # texels, square, for which a ray that escapes speaks
_AROUND = 65  # texels, square, over which the second rays are counted
_LEAST_SHARE = 1e-3  # of these that must escape


@dataclass(frozen=True, kw_only=True)
class _Behind:
    """Hold n samples behind the first ones of their rays.

    layer, less one, and texel: (n,); start: (n, 3) metres, above the surface; normal: (n, 3), unit, into its open side;
    shape: (L − 1, H, W), of the images that they are in.
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
        The mesh, ready for rays, object frame.
    rays
        Origins and directions (n, 3) float32 of the texels' rays, metres and unit vectors, object frame.
    hits
        What the rays meet, L layers.
    shape
        Height H and width W of the image; n = H · W.
    found
        (L, n) bool, True for the hits that may stay. Of these, those of the first layer always do.
    parallel_map
        `map`, or what `thread_map` yields to work in several threads.

    Returns
    -------
    Hits
        The remaining hits, moved up to the first layers.
    """
    origin, inward = rays
    layer, texel = found[1:].nonzero()
    if not len(layer):
        return _compacted(hits, found)
    normal = hits.normal[1 + layer, texel]
    start = origin.take(texel, 0) + hits.distance[1 + layer, texel, None] * inward.take(texel, 0)
    behind = _Behind(
        layer=layer,
        texel=texel,
        start=start + caster.epsilon * normal,
        normal=normal,
        shape=(len(found) - 1, *shape),
    )
    seen = _seen(caster, behind, parallel_map).reshape(len(found) - 1, -1)
    return _compacted(hits, found & np.concatenate([np.ones_like(seen[:1]), seen]))


def _seen(caster: RayCaster, behind: _Behind, parallel_map: Map) -> Mask:
    """Return where samples are that rays in random directions tell to be seen from outside.

    A first ray that escapes decides for the samples around it. What is still in doubt casts a second one. Through a
    narrow opening one in hundreds escapes, so they are counted over a wide neighbourhood: if every ray decided only for
    its own surroundings, the border of what is kept would be frayed at random. A minimum share of escaping rays is
    required, because a stray ray slips out of any scan.
    """
    from scipy.ndimage import maximum_filter

    random = np.random.default_rng(0)

    def escaping(selected: NDArray[np.intp]) -> Mask:
        direction = behind.normal.take(selected, 0) + 0.98 * _unit(
            random.normal(size=(len(selected), 3))
        )  # cosine-weighted
        return behind.marked(selected[caster.escapes(behind.start.take(selected, 0), _unit(direction), parallel_map)])

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


def _compacted(hits: Hits, kept: NDArray[np.bool_]) -> Hits:
    """Return the hits `kept` (L, n), moved up to the first layers; at least one layer."""
    layer = np.cumsum(kept, axis=0, dtype=np.int8) - 1
    compact = no_hits(max(1, int(layer.max(initial=0)) + 1), kept.shape[1])
    places = layer[kept], kept.nonzero()[1]
    for field in fields(Hits):
        getattr(compact, field.name)[places] = getattr(hits, field.name)[kept]
    return compact


def _unit(vectors: NDArray[np.floating]) -> NDArray[np.floating]:
    return np.asarray(vectors / np.maximum(lengths(vectors), 1e-12)[:, None])
