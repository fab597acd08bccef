"""Which samples can be seen at all: what lies in a closed cavity, or on the inside of a closed shell, never is."""

from dataclasses import fields

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter

from depthwalk.bake.raycast import Hits, RayCaster

_RAYS = 4  # per sample; with those of the neighbours about 300 decide
_NEIGHBOURHOOD = 9  # texels


def prune_hidden(caster: RayCaster, points: NDArray[np.floating], hits: Hits, shape: tuple[int, int]) -> Hits:
    """`hits` (L, n) of an image of `shape` without those that nobody outside can see; the rest move up a layer.

    points: (L, n, 3). Samples behind the first are tested with rays in random directions into the open side of their
    surface: where any ray of a neighbourhood escapes, the sample stays.
    """
    hidden_candidates = np.isfinite(hits.distance)
    hidden_candidates[0] = False
    layer, sample = hidden_candidates.nonzero()
    random = np.random.default_rng(0)
    escapes = np.zeros(len(layer), bool)
    normal, start = hits.normal[layer, sample], points[layer, sample]
    for _ in range(_RAYS):
        direction = normal + 0.98 * _unit(random.normal(size=normal.shape))  # cosine-weighted about the normal
        escapes |= np.isinf(caster.first(start + caster.epsilon * normal, _unit(direction)).distance)
    seen = np.zeros(hits.distance.shape, bool)
    seen[layer, sample] = escapes
    near = maximum_filter(seen.reshape(-1, *shape), size=(1, _NEIGHBOURHOOD, _NEIGHBOURHOOD)).reshape(seen.shape)
    return _compacted(hits, np.isfinite(hits.distance) & (near | ~hidden_candidates))


def _compacted(hits: Hits, kept: NDArray[np.bool_]) -> Hits:
    order = np.argsort(~kept, axis=0, kind="stable")
    kept = np.take_along_axis(kept, order, 0)
    used = max(1, int(kept.any(1).sum()))
    values = {}
    for field in fields(Hits):
        value = getattr(hits, field.name)
        index = order if value.ndim == 2 else order[..., None]
        values[field.name] = np.take_along_axis(value, index, 0)[:used]
    values["distance"][~kept[:used]] = np.inf
    values["face"][~kept[:used]] = -1
    return Hits(**values)


def _unit(vectors: NDArray[np.floating]) -> NDArray[np.floating]:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-12)
