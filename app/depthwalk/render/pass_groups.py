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
        is taken before that is yielded.
    passes : all passes of the frame, in their order.
    kept : names of the targets that somebody reads when the frame is over; None: each pass is drawn alone.

    Yields
    ------
    Passes that follow each other: several `PixelPass`, a `PixelSource` and those, or one pass of any class.
    """
    group: list[DrawnPass] = []
    for each in drawn:
        if group and (kept is None or not _together(group, each, passes, kept)):
            yield group
            group = []
        if isinstance(each.pass_, PixelPass | PixelSource):
            group.append(each)
        else:
            yield [each]
    if group:
        yield group


def _together(group: Sequence[DrawnPass], other: DrawnPass, passes: Sequence[Pass[Any]], kept: Collection[str]) -> bool:
    """Return whether a pass may share the program of the `group` before it: nobody else reads what lies between."""
    one = group[-1]
    if not (isinstance(one.pass_, PixelPass | PixelSource) and isinstance(other.pass_, PixelPass)):
        return False
    if not (
        one.pass_.fuses_with_next(one.frame, one.params) and other.pass_.fuses_with_previous(other.frame, other.params)
    ):
        return False
    if isinstance(group[0].pass_, PixelSource) and not maps_colour(other):
        return False
    (between,) = one.pass_.writes
    if between in other.pass_.writes:
        return True
    after = passes[passes.index(other.pass_) + 1 :]
    return between not in kept and not any(between in each.reads for each in after)
