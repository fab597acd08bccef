"""Which samples can be seen at all: what lies in a closed cavity, or on the inside of a closed shell, never is."""

from dataclasses import fields

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter

from depthwalk.bake.raycast import Hits, RayCaster

_ROUNDS = 8  # each casts rays from a quarter of the samples still in doubt; with the neighbours' about 160 decide
_NEIGHBOURHOOD = 9  # texels
_NOTHING = {"distance": np.inf, "face": -1}


def prune_hidden(
    caster: RayCaster,
    points: NDArray[np.floating],
    hits: Hits,
    shape: tuple[int, int],
    found: NDArray[np.bool_],
) -> Hits:
    """Of `hits` (L, n) of an image of `shape`, those `found` (L, n), without what nobody outside can see; the rest move
    up a layer.

    points: (L, n, 3). Samples behind the first are tested with rays in random directions into the open side of their
    surface: where any ray of a neighbourhood escapes, the sample stays.
    """
    hidden_candidates = found.copy()
    hidden_candidates[0] = False
    layer, sample = hidden_candidates.nonzero()
    random = np.random.default_rng(0)
    normal, start = hits.normal[layer, sample], points[layer, sample]
    near = np.zeros(hits.distance.shape, bool)
    undecided = np.arange(len(layer))
    quarter = (sample % shape[1] + 2 * (sample // shape[1])) % 4
    for number in range(_ROUNDS):
        doubtful = undecided[quarter[undecided] == number % 4]
        direction = normal[doubtful] + 0.98 * _unit(random.normal(size=(len(doubtful), 3)))  # cosine-weighted
        ray = start[doubtful] + caster.epsilon * normal[doubtful], _unit(direction)
        escaped = doubtful[np.isinf(caster.first(*ray).distance)]
        seen = np.zeros(near.shape, bool)
        seen[layer[escaped], sample[escaped]] = True
        around = maximum_filter(seen.reshape(-1, *shape), size=(1, _NEIGHBOURHOOD, _NEIGHBOURHOOD))
        near |= around.reshape(near.shape)
        undecided = undecided[~near[layer[undecided], sample[undecided]]]
    return _compacted(hits, found & (near | ~hidden_candidates))


def _compacted(hits: Hits, kept: NDArray[np.bool_]) -> Hits:
    """Those `kept` (L, n), moved up to the first layers; at least one layer."""
    some = np.flatnonzero((~kept[:-1] & kept[1:]).any(0))  # the columns with gaps
    order = np.argsort(~kept[:, some], axis=0, kind="stable")
    used = max(1, int(kept.sum(0).max(initial=0)))
    values = {}
    for field in fields(Hits):
        value = getattr(hits, field.name).copy()
        value[~kept] = _NOTHING.get(field.name, 0)
        index = order if value.ndim == 2 else order[..., None]
        value[:, some] = np.take_along_axis(value[:, some], index, 0)
        values[field.name] = value[:used]
    return Hits(**values)


def _unit(vectors: NDArray[np.floating]) -> NDArray[np.floating]:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-12)
