"""Flatten the scene graph into arrays.

Python loops only over the items of the file; all objects of an item, millions for a grid, are placed at once.
"""

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from depthwalk.errors import InputError, suggest
from depthwalk.limits import MAX_GROUP_DEPTH, MAX_INSTANCES
from depthwalk.scene.arrays import HEIGHT_FIELDS, OF_MESH, Nodes, Objects, Representation, place_nodes, place_objects
from depthwalk.scene.document import Loc
from depthwalk.scene.schema import (
    AssetParams,
    BakedAssetParams,
    DepthImageAssetParams,
    GridItemParams,
    GridParams,
    GroupItemParams,
    GroupParams,
    ItemParams,
    ObjectParams,
    PlacesItemParams,
    PlacesParams,
    ScatterItemParams,
    ScatterParams,
)
from depthwalk.scene.similarity import Similarity, from_angles, identities
from depthwalk.scene.validate import Source

MAX_WORLD_COORDINATE = 1e7  # metres
MIN_WORLD_SCALE, MAX_WORLD_SCALE = 1e-6, 1e6

Spec = ObjectParams | GridParams | PlacesParams | ScatterParams | GroupParams
Places = Mapping[Loc, Similarity]  # transforms from the files of `places` items, by the item's location

_BY_LABEL = {kind.label: kind for kind in Representation}
_HEIGHT_FIELDS = tuple(kind.label for kind in HEIGHT_FIELDS)
_OF_MESH = tuple(kind.label for kind in OF_MESH)


@dataclass(frozen=True, kw_only=True)
class ListedItem:
    """Hold one item of the file's scene graph.

    Attributes
    ----------
    loc
        Location of the item in the file: keys and list indices from the root.
    spec
        The values that the file gives the item.
    parent
        Row of the group that holds the item, −1 at the top.
    depth
        Number of groups that enclose the item.
    """

    loc: Loc
    spec: Spec
    parent: int
    depth: int


@dataclass(frozen=True, kw_only=True)
class Flat:
    """Hold the arrays into which a scene graph of m nodes and n objects is flattened, the same as in `Scene`.

    Attributes
    ----------
    objects
        The n objects, in the world.
    nodes
        The m nodes that hold them.
    instances
        n transforms, float32, metres: the placement of each object in the frame of its node.
    owner
        (n,) int32, the row in `nodes` of the node that holds each object.
    """

    objects: Objects
    nodes: Nodes
    instances: Similarity
    owner: NDArray[np.int32]


def list_items(items: list[ItemParams], source: Source) -> list[ListedItem]:
    """List the items of a scene file in order, groups before their members.

    Parameters
    ----------
    items
        The file's `objects`.
    source
        Origin of the values, to locate errors.

    Returns
    -------
    list
        One row for each item.

    Raises
    ------
    InputError
        If groups are nested too deeply.
    """
    rows: list[ListedItem] = []
    stack: list[Iterator[tuple[Loc, ItemParams, int]]] = [_members(("objects",), items, -1)]
    while stack:
        entry = next(stack[-1], None)
        if entry is None:
            stack.pop()
            continue
        loc, item, parent = entry
        loc, spec = _unwrap(loc, item)
        if len(stack) > MAX_GROUP_DEPTH + 1:
            raise source.error(loc, f"groups nest deeper than {MAX_GROUP_DEPTH}")
        rows.append(ListedItem(loc=loc, spec=spec, parent=parent, depth=len(stack) - 1))
        if isinstance(spec, GroupParams):
            stack.append(_members((*loc, "objects"), spec.objects, len(rows) - 1))
    return rows


def reference_errors(
    rows: list[ListedItem], assets: Mapping[str, AssetParams], source: Source, missing: Collection[str] = ()
) -> list[InputError]:
    """Return errors about assets that do not exist, and about representations that an asset cannot be drawn as.

    Parameters
    ----------
    rows
        The items of the file, as `list_items` returns them.
    assets
        The assets by name.
    source
        Origin of the values, to locate errors.
    missing
        Names of baked assets whose mesh was not found, so that only their depth images can be drawn.

    Returns
    -------
    list
        One error for each mistake.
    """
    errors = []
    for row in rows:
        if isinstance(row.spec, GroupParams):
            continue
        asset, wanted = assets.get(row.spec.asset), row.spec.representation
        if asset is None:
            hint = suggest(row.spec.asset, list(assets)) or "; 'assets' has none of that name"
            errors.append(source.error((*row.loc, "asset"), f"unknown asset {row.spec.asset!r}{hint}"))
        elif wanted is not None and wanted not in (possible := _representations(asset)):
            no_images = wanted in ("dpci", "dmesh") or (wanted == "auto" and "dpci" not in possible)
            lack = "has no dpci" if no_images else "has no mesh"
            lack = "is no relief, one planar depth image" if wanted in _HEIGHT_FIELDS else lack
            *others, last = map(repr, possible)
            choice = f"{', '.join(others)} or {last}"
            message = f"must be {choice}, not {wanted!r}: asset {row.spec.asset!r} {lack}"
            errors.append(source.error((*row.loc, "representation"), message))
        elif wanted is not None and row.spec.asset in missing and wanted in _OF_MESH:
            message = f"{wanted!r} needs the mesh of asset {row.spec.asset!r}, whose file is missing"
            errors.append(source.error((*row.loc, "representation"), message))
    return errors


def flatten(rows: list[ListedItem], assets: Mapping[str, AssetParams], places: Places, source: Source) -> Flat:
    """Turn the items of a scene file into nodes and objects.

    Parameters
    ----------
    rows
        The items of the file, as `list_items` returns them.
    assets
        The assets by name; all referenced ones must exist (see `reference_errors`).
    places
        For each `places` item, by its location in the scene file, the transforms that its own file lists.
    source
        Origin of the values, to locate errors.

    Returns
    -------
    Flat
        The nodes, and the objects that they hold.

    Raises
    ------
    InputError
        If there are too many objects (before memory is allocated), if a scatter finds no room, or if nested transforms
        leave the range of the arrays.
    """
    own = _own_counts(rows, places, source)
    nodes = _nodes(rows, own)
    place_nodes(nodes, np.arange(len(nodes)))
    _check_range(nodes.world, rows, source)
    owner = np.repeat(np.arange(len(rows), dtype=np.int32), own)
    instances = _instances(rows, own, places, source)
    asset, representation = _looks(rows, assets)
    count = len(owner)
    objects = Objects(
        asset=asset[owner],
        position=np.zeros((count, 3), np.float32),
        rotation=np.zeros((count, 4), np.float32),
        scale=np.ones(count, np.float32),
        representation=representation[owner],
    )
    place_objects(objects, nodes, instances, owner, slice(0, count))
    far = np.flatnonzero(np.abs(objects.position).max(axis=1, initial=0) > MAX_WORLD_COORDINATE)
    if len(far):
        raise source.error(rows[owner[far[0]]].loc, f"reaches farther than {MAX_WORLD_COORDINATE:g} m from the origin")
    return Flat(objects=objects, nodes=nodes, instances=instances, owner=owner)


def _members(loc: Loc, items: list[ItemParams], parent: int) -> Iterator[tuple[Loc, ItemParams, int]]:
    return (((*loc, i), item, parent) for i, item in enumerate(items))


def _unwrap(loc: Loc, item: ItemParams) -> tuple[Loc, Spec]:
    match item:
        case GridItemParams():
            return (*loc, "grid"), item.grid
        case GroupItemParams():
            return (*loc, "group"), item.group
        case PlacesItemParams():
            return (*loc, "places"), item.places
        case ScatterItemParams():
            return (*loc, "scatter"), item.scatter
    return loc, item


def _representations(asset: AssetParams) -> tuple[str, ...]:
    """Return the representations that an asset can be drawn as, the default first."""
    if isinstance(asset, DepthImageAssetParams):
        return ("dpci", "dmesh", *_HEIGHT_FIELDS) if asset.depth_image.size else ("dpci", "dmesh")
    if isinstance(asset, BakedAssetParams):
        return ("auto", "dpci", *_OF_MESH, "dmesh") if asset.mesh else ("dpci", "dmesh")
    return ("auto", "dpci", *_OF_MESH, "dmesh") if asset.dpci else _OF_MESH


def _looks(rows: list[ListedItem], assets: Mapping[str, AssetParams]) -> tuple[NDArray[np.int32], NDArray[np.uint8]]:
    """Return the asset index and Representation of each row; 0 for groups, which own no objects."""
    index = {name: i for i, name in enumerate(assets)}
    asset, representation = np.zeros(len(rows), np.int32), np.zeros(len(rows), np.uint8)
    for i, row in enumerate(rows):
        if not isinstance(row.spec, GroupParams):
            asset[i] = index[row.spec.asset]
            name = row.spec.representation or _representations(assets[row.spec.asset])[0]
            representation[i] = _BY_LABEL[name]
    return asset, representation


def _own_counts(rows: list[ListedItem], places: Places, source: Source) -> list[int]:
    """Return how many objects each row holds directly."""
    counts, total = [], 0
    for row in rows:
        match row.spec:
            case GridParams():
                counts.append(row.spec.count[0] * row.spec.count[1])
            case ScatterParams():
                counts.append(row.spec.count)
            case PlacesParams():
                counts.append(len(places[row.loc]))
            case spec:
                counts.append(int(isinstance(spec, ObjectParams)))
        total += counts[-1]
        if total > MAX_INSTANCES:
            loc = (*row.loc, "count") if isinstance(row.spec, GridParams | ScatterParams) else row.loc
            raise source.error(loc, f"makes {total} objects in all; the limit is {MAX_INSTANCES}")
    return counts


def _nodes(rows: list[ListedItem], own: list[int]) -> Nodes:
    count = len(rows)
    depth = [row.depth for row in rows]
    end = list(range(1, count + 1))
    for i in range(count - 1, -1, -1):  # a group ends where its last member does
        if (parent := rows[i].parent) >= 0:
            end[parent] = max(end[parent], end[i])
    starts = np.concatenate([[0], np.cumsum(own, dtype=np.int64)]).astype(np.int32)
    angles = np.radians([(row.spec.yaw, row.spec.pitch, row.spec.roll) for row in rows]).reshape(-1, 3)
    local = Similarity(
        np.array([row.spec.position for row in rows], float).reshape(-1, 3),
        from_angles(*angles.T),
        # The scale of a grid, a scatter or places applies to their objects only: spacing stays in metres.
        np.array([row.spec.scale if isinstance(row.spec, ObjectParams | GroupParams) else 1 for row in rows], float),
    )
    return Nodes(
        name=tuple(row.spec.name or "" for row in rows),
        parent=np.array([row.parent for row in rows], np.int32),
        depth=np.array(depth, np.int32),
        end=np.array(end, np.int32),
        first_object=starts[:-1],
        object_count=starts[np.array(end, int)] - starts[:-1],
        angles=angles,
        local=local,
        world=identities(count),
    )


def _instances(rows: list[ListedItem], own: list[int], places: Places, source: Source) -> Similarity:
    instances = identities(sum(own), np.float32)
    first = 0
    for row, count in zip(rows, own, strict=True):
        spec = row.spec
        if isinstance(spec, GridParams):
            from depthwalk.scene.scatter import grid_instances  # here and below: many scenes need none of these

            instances[slice(first, first + count)] = grid_instances(spec.count, spec.spacing, spec.scale)
        elif isinstance(spec, ScatterParams):
            instances[slice(first, first + count)] = _scattered(row.loc, spec, source)
        elif isinstance(spec, PlacesParams):
            read = places[row.loc]
            instances[slice(first, first + count)] = replace(read, scale=read.scale * np.float32(spec.scale))
        first += count
    return instances


def _scattered(loc: Loc, spec: ScatterParams, source: Source) -> Similarity:
    from depthwalk.scene.scatter import room_for, scatter_instances

    placed = None
    if spec.count <= room_for(spec.area, spec.spacing):
        placed = scatter_instances(spec.count, spec.area, spec.spacing, spec.scale, spec.seed)
    if placed is None or len(placed) < spec.count:
        raise source.error((*loc, "count"), f"{spec.count} objects {spec.spacing:g} m apart do not fit in the area")
    return placed


def _check_range(world: Similarity, rows: list[ListedItem], source: Source) -> None:
    """Raise InputError if transforms, multiplied through nested groups, come near the limits of float32."""
    scale_fits = (world.scale >= MIN_WORLD_SCALE) & (world.scale <= MAX_WORLD_SCALE)
    if not scale_fits.all():
        i = int(np.argmin(scale_fits))
        limits = f"{MIN_WORLD_SCALE:g} to {MAX_WORLD_SCALE:g}"
        raise source.error(rows[i].loc, f"scale is {world.scale[i]:g} with its groups'; it must be {limits}")
    near = np.abs(world.position).max(axis=1, initial=0) <= MAX_WORLD_COORDINATE
    if not near.all():
        loc = rows[int(np.argmin(near))].loc
        raise source.error(loc, f"lies farther than {MAX_WORLD_COORDINATE:g} m from the origin")
