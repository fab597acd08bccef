"""What the plan of a frame is made of, and made from: data between NumPy and the passes."""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from itertools import groupby
from operator import add, attrgetter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthwalk.cook.cases import ALL_PIECES, piece_runs
from depthwalk.render.world.asset_table import AssetTable

_OF_ROUNDS: dict[str, Any] = {  # how the counts of a frame's rounds make its own; others are added up
    "objects": max,
    "atlas_used": max,
    "tile_resolution": min,
    "tile_error": max,
}


@dataclass(frozen=True, kw_only=True)
class DrawBatch:
    """`count` instance records from `first` on are drawn with the same asset and indices."""

    asset: int
    first: int
    count: int
    indices: tuple[tuple[int, int], ...] = ()  # first index and number of indices of each run
    clipped: bool = False  # samples may fall outside their tile
    level: int = 0
    pieces: int = ALL_PIECES


@dataclass(kw_only=True)
class DrawList:
    """Instance records sorted so that each group is one run."""

    records: NDArray[np.void]
    groups: list[DrawBatch] = field(default_factory=list)

    def by_asset(self) -> Iterator[tuple[int, Iterator[DrawBatch]]]:
        """Runs of groups that share an asset, and its number: what all of them need is set once."""
        return groupby(self.groups, attrgetter("asset"))

    @classmethod
    def joined(cls, drawings: list["DrawList"]) -> "DrawList":
        """One after the other."""
        starts = np.cumsum([0] + [len(each.records) for each in drawings]).tolist()
        pairs = zip(starts, drawings, strict=False)
        groups = [replace(group, first=start + group.first) for start, each in pairs for group in each.groups]
        return cls(records=np.concatenate([each.records for each in drawings]), groups=groups)


@dataclass(kw_only=True)
class ImpostorQuads:
    """What pass 2 draws: records of which the first `aligned` have texels that are pixels; of either, nearest first."""

    records: NDArray[np.void]
    aligned: int

    @classmethod
    def joined(cls, rectangles: list["ImpostorQuads"]) -> "ImpostorQuads":
        """All of them; those of one round after those of another."""
        first = [each.records[: each.aligned] for each in rectangles]
        others = [each.records[each.aligned :] for each in rectangles]
        return cls(records=np.concatenate(first + others), aligned=sum(each.aligned for each in rectangles))


@dataclass(kw_only=True)
class FrameDrawLists:
    """What the passes draw. counts: numbers for HUD and benchmark; cleared: (n, 4), slots of the atlas, x, y, width and
    height, that pass 1 fills anew; numbered: (d,) rows of the objects that composite and dmesh draw, by the numbers
    that they write for them, from `first_object_id` on; tiled: (d,), whether composite does."""

    warp: DrawList
    composite: ImpostorQuads
    dmesh: DrawList
    mesh: DrawList
    cleared: NDArray[np.integer]
    counts: dict[str, int | float]
    numbered: NDArray[np.integer]
    tiled: NDArray[np.bool_]
    first_object_id: int = 1

    @classmethod
    def joined(cls, phases: list["FrameDrawLists"]) -> "FrameDrawLists":
        """All that the rounds of a frame draw."""
        if len(phases) == 1:
            return phases[0]
        drawings: dict[str, Any] = {
            name: DrawList.joined([getattr(each, name) for each in phases]) for name in ("warp", "dmesh", "mesh")
        }
        counts: dict[str, int | float] = {}
        for each in phases:
            for name, count in each.counts.items():
                counts[name] = _OF_ROUNDS.get(name, add)(counts[name], count) if name in counts else count
        drawings["composite"] = ImpostorQuads.joined([each.composite for each in phases])
        columns: dict[str, Any] = {
            name: np.concatenate([getattr(each, name) for each in phases]) for name in ("cleared", "numbered", "tiled")
        }
        return cls(**drawings, **columns, counts=counts)


def draw_batches(
    table: AssetTable,
    asset: NDArray[np.integer],
    level: NDArray[np.integer] | None = None,
    pieces: NDArray[np.integer] | None = None,
    clipped: NDArray[np.bool_] | None = None,
) -> list[DrawBatch]:
    """Runs of equal asset (n,), and of equal level, pieces and clipped (n,) where given. The loop is over groups. With
    pieces, bit masks, they hold the runs of indices that a depth object has for them."""
    if not len(asset):
        return []
    keys = [key for key in (asset, level, pieces) if key is not None]
    clipped = np.zeros(len(asset), bool) if clipped is None else clipped
    changed = np.logical_or.reduce([key[1:] != key[:-1] for key in (*keys, clipped)])
    starts = np.concatenate([[0], np.flatnonzero(changed) + 1])
    counts = np.diff(np.append(starts, len(asset)))
    groups = []
    for start, count in zip(starts.tolist(), counts.tolist(), strict=True):
        key = tuple(int(k[start]) for k in keys)
        runs: tuple[tuple[int, int], ...] = ()
        if pieces is not None:
            runs = piece_runs(table.index_first[key[:2]], table.index_count[key[:2]], key[2])
        groups.append(
            DrawBatch(
                asset=int(asset[start]),
                first=start,
                count=count,
                indices=runs,
                clipped=bool(clipped[start]),
                level=0 if level is None else int(level[start]),
                pieces=ALL_PIECES if pieces is None else int(pieces[start]),
            )
        )
    return groups
