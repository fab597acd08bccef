"""Group the passes of a frame that need no picture between them, so that each group is drawn by one program."""

from collections.abc import Collection, Iterable, Iterator, Sequence
from typing import Any

from depthwalk.render.frame import Pass
from depthwalk.render.pixel_pass import DrawnPass, PixelPass
from depthwalk.render.pixel_source import PixelSource, maps_colour


def neighbours(
    drawn: Iterable[DrawnPass], passes: Sequence[Pass[Any]], kept: Collection[str] | None
) -> Iterator[list[DrawnPass]]:
    """Group the passes of a frame into those that are drawn together.

    Parameters
    ----------
    drawn : the passes that have anything to draw, in their order. The one that follows a `PixelPass` or `PixelSource`
        is taken from it before that is yielded.
    passes : all passes of the frame, in their order.
    kept : names of the targets that are read after the frame; None: each pass is drawn alone.

    Yields
    ------
    Adjacent passes: several `PixelPass`, a `PixelSource` followed by such, or one pass of any class.
    """
    group: list[DrawnPass] = []
    for current in drawn:
        if group and (kept is None or not _together(group, current, passes, kept)):
            yield group
            group = []
        if isinstance(current.pass_, PixelPass | PixelSource):
            group.append(current)
        else:
            yield [current]
    if group:
        yield group


def _together(group: Sequence[DrawnPass], other: DrawnPass, passes: Sequence[Pass[Any]], kept: Collection[str]) -> bool:
    """Return whether the pass `other` may share the program of `group`: nothing else reads the target in between."""
    last = group[-1]
    if not (isinstance(last.pass_, PixelPass | PixelSource) and isinstance(other.pass_, PixelPass)):
        return False
    if not last.pass_.fuses_with_next(last.frame, last.params):
        return False
    if not other.pass_.fuses_with_previous(other.frame, other.params):
        return False
    if isinstance(group[0].pass_, PixelSource) and not maps_colour(other):
        return False
    (between,) = last.pass_.writes
    if between in other.pass_.writes:
        return True
    after = passes[passes.index(other.pass_) + 1 :]
    return between not in kept and not any(between in later.reads for later in after)
