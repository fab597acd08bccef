"""Items of a scene file as rows and arrays."""

from typing import Any

import pytest

from depthwalk.errors import InputError
from depthwalk.scene.arrays import Representation
from depthwalk.scene.document import Document, parse_document
from depthwalk.scene.flatten import Flat, flatten, list_items, reference_errors
from depthwalk.scene.schema import SceneFile
from depthwalk.scene.similarity import identities
from depthwalk.scene.validate import check_model

ASSETS = "version: 1\nassets: {baked: {mesh: a.obj, dpci: {}}, plain: {mesh: a.obj}, relief: {depth_image: "
ASSETS += "{depth: a.npy, size: [1, 1]}}}\n"
_OF_MESH = "'mesh', 'mesh-lod', 'mesh-clusters', 'octahedral' or 'billboard'"


def parts(text: str) -> tuple[SceneFile, Any]:
    document: Document = parse_document(ASSETS + text, "file")
    return check_model(document, SceneFile)


def flat(text: str) -> Flat:
    file, source = parts(text)
    return flatten(list_items(file.objects, source), file.assets, {}, source)


def test_rows_come_in_the_order_of_the_file_groups_first() -> None:
    text = "objects: [{asset: plain}, {group: {objects: [{asset: baked}, {group: {objects: []}}]}}, {asset: relief}]"
    file, source = parts(text)
    rows = list_items(file.objects, source)
    assert [(row.parent, row.depth) for row in rows] == [(-1, 0), (-1, 0), (1, 1), (1, 1), (-1, 0)]
    assert rows[2].loc == ("objects", 1, "group", "objects", 0)


@pytest.mark.parametrize(
    ("item", "errors"),
    [
        ("{asset: plain, representation: mesh-lod}", []),
        ("{asset: relief, representation: dmesh}", []),
        ("{asset: nothing}", ["unknown asset 'nothing'; 'assets' has none of that name"]),
        ("{asset: plian}", ["unknown asset 'plian'; did you mean 'plain'?"]),
        (
            "{asset: plain, representation: dmesh}",
            [f"must be {_OF_MESH}, not 'dmesh': asset 'plain' has no dpci"],
        ),
        ("{asset: relief, representation: displacement}", []),
        (
            "{asset: plain, representation: relief}",
            [f"must be {_OF_MESH}, not 'relief': asset 'plain' is no relief, one planar depth image"],
        ),
        (
            "{asset: baked, representation: bump}",
            [
                "must be 'auto', 'dpci', 'mesh', 'mesh-lod', 'mesh-clusters', 'octahedral', 'billboard' or 'dmesh', "
                "not 'bump': asset 'baked' is "
                "no relief, one planar depth image"
            ],
        ),
    ],
)
def test_references(item: str, errors: list[str]) -> None:
    file, source = parts(f"objects: [{item}]")
    found = reference_errors(list_items(file.objects, source), file.assets, source)
    assert [str(error).split(": ", 2)[2] for error in found] == errors


def test_what_is_not_said_is_chosen_where_there_is_a_choice() -> None:
    objects = flat("objects: [{asset: baked}, {asset: plain}, {asset: relief}]").objects
    assert objects.representation.tolist() == [Representation.AUTO, Representation.MESH, Representation.DPCI]
    assert objects.asset.tolist() == [0, 1, 2]


def test_a_subtree_is_one_run_of_nodes_and_of_objects() -> None:
    grid = "{grid: {asset: plain, count: [2, 3], spacing: [1, 1]}}"
    nodes = flat(f"objects: [{{asset: plain}}, {{group: {{objects: [{grid}, {{asset: plain}}]}}}}]").nodes
    assert nodes.end.tolist() == [1, 4, 3, 4]
    assert nodes.first_object.tolist() == [0, 1, 1, 7] and nodes.object_count.tolist() == [1, 7, 6, 1]


def test_lists_of_places_are_scaled() -> None:
    file, source = parts("objects: [{places: {asset: plain, file: a.csv, scale: 3}}]")
    rows = list_items(file.objects, source)
    placed = flatten(rows, file.assets, {rows[0].loc: identities(4)}, source).objects
    assert len(placed) == 4 and (placed.scale == 3).all()


def test_what_is_too_far_away() -> None:
    inner = "{group: {position: [900000, 0, 0], scale: 100, objects: [{asset: plain, position: [900000, 0, 0]}]}}"
    with pytest.raises(InputError, match=r"farther than 1e\+07 m from the origin"):
        flat(f"objects: [{inner}]")


def test_nothing_is_a_scene() -> None:
    empty = flat("objects: []")
    assert len(empty.objects) == len(empty.nodes) == 0
