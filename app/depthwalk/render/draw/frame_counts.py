"""Count what a frame draws, for HUD and benchmark; only when the counts are asked for."""

from dataclasses import dataclass

import numpy as np

from depthwalk.cook.cases import Case, drawn_cases
from depthwalk.geometry.soa import StructOfArrays
from depthwalk.types import Array, Rows

Counts = dict[str, int | float]
"""The numbers that HUD and benchmark show, by name."""


@dataclass(frozen=True, kw_only=True)
class DrawnTiles(StructOfArrays):
    """Describe the d impostor tiles that pass 2 draws.

    Attributes
    ----------
    level : (d,) level of detail of each tile, see `CachedTiles`.
    pieces : (d,) pieces that each tile shows, bit masks, see `CachedTiles`.
    resolution : (d,) texels along each side of each tile over those that it should have there, 0 to 1.
    error : (d,) reprojection error of each tile, 1 where it is as large as allowed.
    step : (d,) the paper's Iter_step of the object that each tile shows, see `iter_step`.
    members : (d,) how many objects each tile shows: one, or those of a far cluster.
    """

    level: Rows
    pieces: Rows
    resolution: Array
    error: Array
    step: Array
    members: Rows

    def of_objects(self) -> "DrawnTiles":
        """Return the tile of each object that these tiles show, in the order of the objects' numbers."""
        return self.take(np.repeat(np.arange(len(self.members)), self.members))

    @property
    def grid_steps(self) -> Rows:
        """Return the steps (d,) that grids have: the powers of two that are at most `step`."""
        return 1 << np.floor(np.log2(self.step)).astype(np.int64)

    def counts(self) -> Counts:
        """Return how many tiles have each level, step and case, the lowest resolution and the largest error."""
        return {
            **{f"level_{level}": n for level, n in _occurrences(self.level)},
            **{f"step_{step}": n for step, n in _occurrences(self.grid_steps)},
            **{f"case_{Case(case).name.lower()}": n for case, n in _occurrences(drawn_cases(self.pieces))},
            "tile_resolution": float(self.resolution.min(initial=1)),
            "tile_error": float(self.error.max(initial=0)),
        }


def _occurrences(numbers: Rows) -> list[tuple[int, int]]:
    """Return the distinct `numbers` in rising order, each with how often it occurs."""
    found, count = np.unique(numbers, return_counts=True)
    return list(zip(found.tolist(), count.tolist(), strict=True))
