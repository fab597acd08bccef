"""Keep places in a queue, the one whose collapse costs least first: a binary heap in which each knows its rank."""

import numpy as np

from depthwalk.cook.kernels.surface_loops import Surface
from depthwalk.kernels.compilation import compiled


@compiled
def update(s: Surface, size: int, number: int) -> int:
    """Put a place where its cost belongs, out of the queue if it is infinite; return the new size of the queue."""
    place = s.places[number]
    if place.cost == np.inf:
        return remove(s, size, number)
    if place.rank < 0:
        place.rank = size
        s.lists[size].queue = number
        size += 1
    _sift(s, size, place.rank)
    return size


@compiled
def remove(s: Surface, size: int, number: int) -> int:
    """Take a place out of the queue, if it is there; return the new size."""
    at = s.places[number].rank
    if at < 0:
        return size
    s.places[number].rank = -1
    size -= 1
    if at < size:
        s.lists[at].queue = s.lists[size].queue
        _sift(s, size, at)
    return size


@compiled
def _sift(s: Surface, size: int, at: int) -> None:
    """Move an entry up or down to where its cost belongs."""
    number = s.lists[at].queue
    own = s.places[number].cost
    while at > 0 and s.places[s.lists[(at - 1) // 2].queue].cost > own:
        above = s.lists[(at - 1) // 2].queue
        s.lists[at].queue, s.places[above].rank = above, at
        at = (at - 1) // 2
    while 2 * at + 1 < size:
        child = 2 * at + 1
        if child + 1 < size and s.places[s.lists[child + 1].queue].cost < s.places[s.lists[child].queue].cost:
            child += 1
        below = s.lists[child].queue
        if s.places[below].cost >= own:
            break
        s.lists[at].queue, s.places[below].rank = below, at
        at = child
    s.lists[at].queue, s.places[number].rank = number, at
