"""Keep copies of shadow maps into which what moves by itself is drawn, so that the maps themselves stay as they are."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

from depthwalk.render.shadows.casters import MovingCasters, Rectangle, ShadowMap
from depthwalk.render.shadows.shadow_atlas import ShadowAtlas


@dataclass(frozen=True, kw_only=True)
class Late:
    """Hold a copy that must be drawn again.

    Attributes
    ----------
    tile
        Its tile.
    still
        The map that it is a copy of.
    casters
        What moves and is drawn into it; None: nothing any more.
    is_new
        Whether it must be copied whole, since the map is another one.
    """

    tile: int
    still: ShadowMap
    casters: MovingCasters | None
    is_new: bool

    @property
    def triangles(self) -> int:
        """Return how many triangles of depth images are drawn into it."""
        return 0 if self.casters is None else self.casters.map.triangles


class MovingShadows:
    """Know which parts of the copies show something that has moved on, and must be copied again.

    Parameters
    ----------
    atlas
        Holds the copies.

    Attributes
    ----------
    atlas
        The same.
    """

    def __init__(self, atlas: ShadowAtlas) -> None:
        self.atlas = atlas
        self._drawn: dict[int, MovingCasters] = {}  # by tile, in the order of drawing

    def late(self, requested: Mapping[int, ShadowMap], shown: Callable[[int], ShadowMap]) -> Iterator[Late]:
        """Yield the copies that show what moves elsewhere than it is, those first that have been so for longest.

        Parameters
        ----------
        requested
            The maps that a frame asks for, by tile.
        shown
            Returns the map that a tile holds, of which the copy is made.
        """
        age = {tile: number for number, tile in enumerate(self._drawn)}
        for tile in sorted(requested, key=lambda tile: age.get(tile, -1)):
            plan, still = requested[tile].moving, shown(tile)
            casters = None if plan is None else plan(still.view)
            before, is_new = self._drawn.get(tile), not self.atlas.holds(tile, still)
            if is_new or before is None or casters is None or not casters.map.shows_same(before.map):
                yield Late(tile=tile, still=still, casters=casters, is_new=is_new)

    def begin(self, late: "Late") -> Rectangle:
        """Return which part of a copy must be copied again, before the casters are drawn into it; width 0 for none."""
        before = self._drawn.pop(late.tile, None)
        if late.casters is not None:
            self._drawn[late.tile] = late.casters  # now the last in the order of drawing
        if late.is_new:
            self.atlas.begin(late.tile, late.still)
            return 0, 0, late.still.view.resolution, late.still.view.resolution
        return (0, 0, 0, 0) if before is None else before.rectangle

    def forget(self) -> None:
        """Forget what the tiles hold, so that all of them are copied again."""
        self.atlas.forget()
        self._drawn.clear()

    def release(self) -> None:
        """Release the copies."""
        self.atlas.release()
        self._drawn.clear()
