"""Define the parts of a frame's plan: the draw lists that the planner makes and the passes draw."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import groupby
from operator import add, attrgetter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthwalk.cook.cases import ALL_PIECES
from depthwalk.render.draw.frame_counts import Counts, DrawnTiles
from depthwalk.render.resources.placed_records import PLACED_RECORD
from depthwalk.render.world.asset_table import AssetTable
from depthwalk.scene.arrays import Representation
from depthwalk.types import Array, Mask, Rows

_JOINED_BY: dict[str, Any] = {"objects": max, "atlas_used": max}  # how phases' counts are joined; others are added
_LATER = ("occluded", "clusters", "shadow_maps", "shadow_maps_waiting", "shadow_triangles")  # noted by later steps


@dataclass(frozen=True, kw_only=True)
class DrawBatch:
    """Describe one draw call for instances of one asset with the same indices.

    Attributes
    ----------
    asset : the number in `CookedParts` of the asset that is drawn.
    first : the first instance record of the batch.
    count : how many instance records it has.
    indices : the first index and the number of indices of each run in the asset's index buffer; none for meshes.
    clipped : whether samples may fall outside their tile, so that they must be clipped to it.
    level : the level of detail that is drawn, 0 the finest.
    pieces : the pieces that the indices hold, a bit mask, see `cook.cases`.
    """

    asset: int
    first: int
    count: int
    indices: tuple[tuple[int, int], ...] = ()
    clipped: bool = False
    level: int = 0
    pieces: int = ALL_PIECES

    @property
    def triangles(self) -> int:
        """Return how many triangles of depth images one instance has."""
        return sum([length for _, length in self.indices]) // 3


PART_TRIANGLES = 100_000  # per part of a pass: a software rasteriser draws them in some 20 ms


@dataclass(kw_only=True)
class DrawList:
    """Hold instance records and the batches that draw them.

    Attributes
    ----------
    records : (n,) records of the kind that the pass reads, sorted so that each batch is one run of them.
    batches : the draw calls.
    """

    records: NDArray[np.void]
    batches: list[DrawBatch] = field(default_factory=list)

    def records_of(self, batch: DrawBatch) -> NDArray[np.void]:
        """Return the records of one of the batches."""
        return self.records[batch.first : batch.first + batch.count]

    def by_asset(self) -> Iterator[tuple[int, Iterator[DrawBatch]]]:
        """Yield the batches by asset, so that a pass sets the state of each asset once.

        Yields
        ------
        The number of an asset in `CookedParts`, and the batches that draw it.
        """
        return groupby(self.batches, attrgetter("asset"))

    def parts(self, triangles: int) -> Iterator["DrawList"]:
        """Yield lists of about `triangles` triangles each that together draw the same; larger batches are divided."""
        if self.batches and sum([batch.count * batch.triangles for batch in self.batches]) <= triangles:
            yield self
            return
        part: list[DrawBatch] = []
        room = triangles
        for batch in self.batches:
            per_instance, drawn = max(batch.triangles, 1), 0
            while drawn < batch.count:
                count = min(batch.count - drawn, max(room // per_instance, 1))
                whole = count == batch.count
                part.append(batch if whole else replace(batch, first=batch.first + drawn, count=count))
                drawn, room = drawn + count, room - count * per_instance
                if room < per_instance:
                    yield replace(self, batches=part)
                    part, room = [], triangles
        if part:
            yield replace(self, batches=part)

    @classmethod
    def joined(cls, lists: Sequence["DrawList"]) -> "DrawList":
        """Concatenate `lists` into one."""
        drawn = [part for part in lists if len(part.records)]
        if len(drawn) < 2:  # the usual case; joining records of many fields is slow
            return drawn[0] if drawn else lists[0]
        starts = np.cumsum([0] + [len(part.records) for part in lists]).tolist()
        parts = zip(starts, lists, strict=False)
        batches = [
            replace(batch, first=start + batch.first) if start else batch
            for start, part in parts
            for batch in part.batches
        ]
        return cls(records=_joined_records([part.records for part in lists]), batches=batches)


@dataclass(kw_only=True)
class ImpostorDraws:
    """Hold what pass 2 draws for the impostors: for each a rectangle less its empty corners, an octagon.

    Attributes
    ----------
    records : (d,) `tile_records.COMPOSITE_RECORD`, first the aligned ones; within either kind the nearest first.
    aligned : how many of the records are aligned, that is, their texels are pixels of the picture.
    rows : (d,) row of the object that each shows; far clusters are numbered after all objects.
    """

    records: NDArray[np.void]
    aligned: int
    rows: Rows

    @classmethod
    def joined(cls, phases: Sequence["ImpostorDraws"]) -> "ImpostorDraws":
        """Join those of all phases: first the aligned ones of all, then the others."""
        aligned = [part.records[: part.aligned] for part in phases]
        others = [part.records[part.aligned :] for part in phases]
        rows = [part.rows[: part.aligned] for part in phases] + [part.rows[part.aligned :] for part in phases]
        count = sum(part.aligned for part in phases)
        return cls(records=_joined_records(aligned + others), aligned=count, rows=np.concatenate(rows))


@dataclass(kw_only=True)
class ClusterDraws:
    """Hold the mesh clusters to draw: pairs of an object and a cluster, grouped by asset.

    Attributes
    ----------
    objects : the objects, with `placed_records.PLACED_RECORD`. Each batch holds objects of one asset and one level, the
        level of the simplified mesh (mesh-lod) that has the same error.
    asset : (a,) the assets in the order of their pairs; an asset may occur several times.
    first : (a + 1,) the first pair of each, and the end.
    record : (k,) row of `objects.records` of each pair.
    cluster : (k,) number of each pair's cluster, see `MeshClusters`.
    """

    objects: DrawList
    asset: Rows
    first: Rows
    record: Rows
    cluster: Rows

    def __bool__(self) -> bool:
        """Return whether there are any objects."""
        return len(self.objects.records) > 0

    @classmethod
    def none(cls) -> "ClusterDraws":
        """Return an empty list."""
        numbers = np.zeros(0, np.int64)
        objects = DrawList(records=np.zeros(0, PLACED_RECORD))
        return cls(objects=objects, asset=numbers, first=np.zeros(1, np.int64), record=numbers, cluster=numbers)

    @classmethod
    def joined(cls, parts: Sequence["ClusterDraws"]) -> "ClusterDraws":
        """Concatenate `parts` into one."""
        if not any(parts):  # as in nearly every scene
            return parts[0]
        records = np.cumsum([0] + [len(part.objects.records) for part in parts])
        pairs = np.cumsum([0] + [len(part.record) for part in parts])
        return cls(
            objects=DrawList.joined([part.objects for part in parts]),
            asset=np.concatenate([part.asset for part in parts]),
            first=np.concatenate([[0], *(part.first[1:] + start for part, start in zip(parts, pairs, strict=False))]),
            record=np.concatenate([part.record + start for part, start in zip(parts, records, strict=False)]),
            cluster=np.concatenate([part.cluster for part in parts]),
        )


@dataclass(kw_only=True)
class FrameDrawLists:
    """Hold what the passes draw in one phase of a frame, or in all of them.

    Attributes
    ----------
    warp : what pass 1 warps into impostor tiles, with `tile_records.WARP_RECORD`.
    composite : the impostors that pass 2 draws.
    dmesh : depth images drawn straight into the picture, with `placed_records.PLACED_RECORD`.
    mesh : polygon meshes, with `placed_records.PLACED_RECORD`.
    clusters : polygon meshes drawn by clusters.
    cleared : (n, 4) slots of the atlas (x, y, width, height), texels, that pass 1 clears before it fills them.
    noted : numbers for HUD and benchmark, by name, that cannot be counted from the lists; later steps add to them.
    tiles : the impostor tiles that `composite` draws.
    object_rows : (d,) rows of the objects that `composite`, `dmesh` and the passes of `height_fields` draw, in the
        order of the numbers that these passes write for them.
    drawn_as : (d,) uint8, the `Representation` by which each of the `object_rows` is drawn: DPCI by `composite`, DMESH
        by `dmesh`, whether or not the scene asks for that.
    height_fields : planar depth images drawn by another of `scene.arrays.HEIGHT_FIELDS`, with
        `placed_records.PLACED_RECORD`; only those representations that draw anything.
    captured : meshes drawn by one of `scene.arrays.CAPTURED`, with `placed_records.CAPTURED_RECORD`; only those
        representations that draw anything.
    first_object_id : the number that passes write for the first of the `object_rows`; 0 stands for no object.
    continues : whether an earlier phase of the same frame has drawn other objects already.
    polygons_before : how many records of `mesh`, and of `clusters.objects`, the earlier phases of the same frame have.
    polygon_error : (p,) error of each record of `polygons` in the whole frame, 1 where it is as large as
        `render.mesh.error` allows; None unless false colours are to tell it.
    """

    warp: DrawList
    composite: ImpostorDraws
    dmesh: DrawList
    mesh: DrawList
    cleared: Rows
    noted: Counts
    tiles: DrawnTiles
    object_rows: Rows
    drawn_as: NDArray[np.uint8]
    height_fields: Mapping[Representation, DrawList] = field(default_factory=dict)
    captured: Mapping[Representation, DrawList] = field(default_factory=dict)
    first_object_id: int = 1
    continues: bool = False
    clusters: ClusterDraws = field(default_factory=lambda: ClusterDraws.none())
    polygons_before: tuple[int, int] = (0, 0)
    polygon_error: Array | None = None

    @property
    def polygons_after(self) -> tuple[int, int]:
        """Return what `polygons_before` of the next phase is."""
        meshes, clustered = self.polygons_before
        return meshes + len(self.mesh.records), clustered + len(self.clusters.objects.records)

    @property
    def polygons(self) -> DrawList:
        """Return all polygon meshes, those by clusters last; batches have the level by which lines are drawn."""
        return DrawList.joined([self.mesh, self.clusters.objects]) if self.clusters else self.mesh

    @property
    def tiled(self) -> Mask:
        """Return which of the `object_rows`, (d,) bool, are drawn by `composite`."""
        return np.equal(self.drawn_as, Representation.DPCI)

    @property
    def next_object_id(self) -> int:
        """Return the first number that the next phase may write for an object."""
        return self.first_object_id + len(self.object_rows)

    @property
    def counts(self) -> Counts:
        """Return the numbers for HUD and benchmark, by name; each access counts them again."""
        batches = self.warp.batches + self.dmesh.batches
        drawn: Counts = {
            "dpci": int(self.tiled.sum()),
            "dmesh": len(self.dmesh.records),
            "mesh": len(self.mesh.records) + len(self.clusters.objects.records),
            "height_fields": sum(len(fields.records) for fields in self.height_fields.values()),
            "captured": sum(len(views.records) for views in self.captured.values()),
            "warped": len(self.warp.records),
            "warped_triangles": sum(batch.count * length for batch in batches for _, length in batch.indices) // 3,
            "draw_batches": len(self.warp.batches),
        }
        return dict.fromkeys(_LATER, 0) | self.noted | drawn | self.tiles.counts()

    def note(self, name: str, count: int) -> None:
        """Add to one of the numbers for HUD and benchmark."""
        self.noted[name] = self.noted.get(name, 0) + count

    def first_id_of(self, representation: Representation) -> int:
        """Return the number that a pass writes for the first object of `height_fields` in one representation."""
        return self.first_object_id + int(np.argmax(self.drawn_as == representation))

    @classmethod
    def joined(cls, phases: Sequence["FrameDrawLists"]) -> "FrameDrawLists":
        """Join the plans of all `phases` of a frame into one, with their counts."""
        if len(phases) == 1:
            return phases[0]
        lists: dict[str, Any] = {
            name: DrawList.joined([getattr(phase, name) for phase in phases]) for name in ("warp", "dmesh", "mesh")
        }
        noted: Counts = {}
        for phase in phases:
            for name, count in phase.noted.items():
                noted[name] = _JOINED_BY.get(name, add)(noted[name], count) if name in noted else count
        lists["clusters"] = ClusterDraws.joined([phase.clusters for phase in phases])
        lists["height_fields"] = _joined_by_kind([phase.height_fields for phase in phases])
        lists["captured"] = _joined_by_kind([phase.captured for phase in phases])
        lists["composite"] = ImpostorDraws.joined([phase.composite for phase in phases])
        columns: dict[str, Any] = {
            name: np.concatenate([getattr(phase, name) for phase in phases])
            for name in ("cleared", "object_rows", "drawn_as")
        }
        return cls(**lists, **columns, noted=noted, tiles=DrawnTiles.joined([phase.tiles for phase in phases]))


def _joined_records(parts: Sequence[NDArray[np.void]]) -> NDArray[np.void]:
    """Concatenate records of one dtype; as bytes, since joining them field by field takes longer."""
    dtype = parts[0].dtype
    return np.concatenate([part.view(np.dtype((np.void, dtype.itemsize))) for part in parts]).view(dtype)


def _joined_by_kind(phases: Sequence[Mapping[Representation, DrawList]]) -> dict[Representation, DrawList]:
    """Join the draw lists of several phases for each representation."""
    kinds = dict.fromkeys(kind for lists in phases for kind in lists)
    return {kind: DrawList.joined([lists[kind] for lists in phases if kind in lists]) for kind in kinds}


def draw_batches(
    table: AssetTable,
    asset: Rows,
    level: Rows | None = None,
    pieces: Rows | None = None,
    clipped: Mask | None = None,
) -> list[DrawBatch]:
    """Divide n sorted instances into batches: runs that are equal in every given key.

    The loop runs over batches, not over instances.

    Parameters
    ----------
    table : the index ranges of the assets.
    asset : (n,) the number in `CookedParts` of each instance's asset.
    level : (n,) level of detail of each instance; None: 0 for all.
    pieces : (n,) bit mask of the pieces of each instance, whose runs of indices the batches then hold; None: the
        batches hold no runs, as for meshes.
    clipped : (n,) whether samples may fall outside their tile; None: nowhere.

    Returns
    -------
    The batches, in the order of the instances.
    """
    if not len(asset):
        return []
    keys = [key for key in (asset, level, pieces, clipped) if key is not None]
    changed = keys[0][1:] != keys[0][:-1]
    for key in keys[1:]:
        changed |= key[1:] != key[:-1]
    starts = [0, *(changed.nonzero()[0] + 1).tolist()]
    first = np.array(starts)
    levels, masks, clips = (
        [default] * len(starts) if key is None else key[first].tolist()
        for key, default in ((level, 0), (pieces, ALL_PIECES), (clipped, False))
    )
    return [
        DrawBatch(
            asset=number,
            first=start,
            count=stop - start,
            indices=() if pieces is None else table.runs(number, of_level, mask),
            clipped=clip,
            level=of_level,
            pieces=mask,
        )
        for number, start, stop, of_level, mask, clip in zip(
            asset[first].tolist(), starts, [*starts[1:], len(asset)], levels, masks, clips, strict=True
        )
    ]
