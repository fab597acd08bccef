"""Which samples can be seen at all: what lies in a closed cavity, or on the inside of a closed shell, never is."""

from dataclasses import fields

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter

from depthwalk.bake.parallel import Map
from depthwalk.bake.raycast import Hits, RayCaster, no_hits
from depthwalk.bake.vectors import lengths

_ROUNDS = 8  # each casts rays from a quarter of the samples still in doubt; with the neighbours' about 160 decide
_NEIGHBOURHOOD = 9  # texels


def prune_hidden(
    caster: RayCaster,
    rays: tuple[NDArray[np.float32], NDArray[np.float32]],
    hits: Hits,
    shape: tuple[int, int],
    found: NDArray[np.bool_],
    each: Map = map,
) -> Hits:
    """Of `hits` (L, n) along `rays` (n, 3), (n, 3) of an image of `shape`, those `found` (L, n), without what nobody
    outside can see; the rest move up a layer.

    Samples behind the first are tested with rays in random directions into the open side of their surface: where any
    ray of a neighbourhood escapes, the sample stays.
    """
    origin, inward = rays
    layer, sample = found[1:].nonzero()
    layer += 1
    normal = hits.normal[layer, sample]
    start = origin.take(sample, 0) + hits.distance[layer, sample, None] * inward.take(sample, 0)
    start += caster.epsilon * normal
    random = np.random.default_rng(0)
    near = np.zeros(found.shape, bool)
    near[0] = True
    undecided = np.arange(len(layer))
    quarter = (sample % shape[1] + 2 * (sample // shape[1])) % 4
    for number in range(_ROUNDS if len(layer) else 0):
        doubtful = undecided[quarter[undecided] == number % 4]
        direction = normal.take(doubtful, 0) + 0.98 * _unit(random.normal(size=(len(doubtful), 3)))  # cosine-weighted
        escaped = doubtful[caster.escapes(start.take(doubtful, 0), _unit(direction), each)]
        seen = np.zeros((len(found) - 1, *shape), bool)
        seen.reshape(len(seen), -1)[layer[escaped] - 1, sample[escaped]] = True
        around = each(lambda image: maximum_filter(image, _NEIGHBOURHOOD), seen)
        near[1:] |= np.stack(list(around)).reshape(len(seen), -1)
        undecided = undecided[~near[layer[undecided], sample[undecided]]]
    return _compacted(hits, found & near)


def _compacted(hits: Hits, kept: NDArray[np.bool_]) -> Hits:
    """Those `kept` (L, n), moved up to the first layers; at least one layer."""
    layer = np.cumsum(kept, axis=0, dtype=np.int8) - 1
    compact = no_hits(max(1, int(layer.max(initial=0)) + 1), kept.shape[1])
    places = layer[kept], kept.nonzero()[1]
    for field in fields(Hits):
        getattr(compact, field.name)[places] = getattr(hits, field.name)[kept]
    return compact


def _unit(vectors: NDArray[np.floating]) -> NDArray[np.floating]:
    return vectors / np.maximum(lengths(vectors), 1e-12)[:, None]
