"""Models of several objects: where they are cut, and their files."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from depthwalk.bake.baker import bake_object
from depthwalk.bake.division import Cell, part_faces
from depthwalk.bake.face_grid import FaceGrid
from depthwalk.bake.file import read_baked, read_header, write_baked
from depthwalk.bake.model import BakedModel
from depthwalk.bake.params import BakeParams, ModelParams
from depthwalk.bake.parts import bake_model, submesh
from depthwalk.commands.cli import app
from depthwalk.errors import InputError
from depthwalk.geometry.quaternions import rotate
from depthwalk.ingest.mesh import Material, Mesh, Part
from depthwalk.types import Array
from files import write_ply
from shapes import box, joined, sphere


def heap(side: int) -> Mesh:
    """side³ boxes with gaps between: a line through them meets many surfaces."""
    middles = np.arange(side) - (side - 1) / 2
    return joined(*(box(0.7, 0.7, 0.7, (x, y, z)) for x in middles for y in middles for z in middles))


def points_of(model: BakedModel) -> Array:
    """Every sample (n, 3) of a model, asset's frame."""
    return np.concatenate(
        [
            rotate(
                np.array(part.rotation), FaceGrid.of(part.cylinder, image).points(image.depth)[np.isfinite(image.depth)]
            )
            + np.array(part.position)
            for part in model.parts
            for image in part.images
        ]
    )


@pytest.fixture(scope="module")
def model() -> BakedModel:
    """A heap, in as many parts as it takes for one layer."""
    return bake_model(heap(3), ModelParams(resolution=64, layers=1, parts="auto"), "key")


def test_what_straddles_a_cut_belongs_to_both_sides() -> None:
    mesh = sphere(1.0, columns=64, rows=32)
    near, far = (part_faces(mesh, cell, 0.0) for cell in Cell().cut(np.array([1.0, 0, 0, 0.25])))
    x = mesh.positions[:, 0][mesh.faces]
    assert (near | far).all()
    np.testing.assert_array_equal(near & far, (x.min(1) <= 0.25) & (x.max(1) >= 0.25))
    wider = part_faces(mesh, Cell().cut(np.array([1.0, 0, 0, 0.25]))[0], 0.1)
    np.testing.assert_array_equal(wider, x.min(1) <= 0.35)


def test_a_part_of_a_mesh_keeps_materials_and_corners() -> None:
    mesh = joined(box(1, 1, 1, colour=(1, 2, 3)), box(1, 1, 1, (5, 0, 0)), box(1, 1, 1, (9, 0, 0)))
    mesh = replace(
        mesh,
        parts=(Part(0, 12, 2), Part(12, 12, 0), Part(24, 12, 1)),
        materials=(Material(), Material(specular=0.5), Material(specular=0.7)),
    )
    kept = np.zeros(36, bool)
    kept[[1, 30, 31]] = True
    part = submesh(mesh, kept)
    assert part.parts == (Part(0, 1, 2), Part(1, 2, 1)) and part.materials == mesh.materials
    for name in ("positions", "normals", "colours", "uv"):
        np.testing.assert_array_equal(getattr(part, name)[part.faces], getattr(mesh, name)[mesh.faces[kept]])


@pytest.mark.slow
def test_a_ball_is_one_part_and_a_heap_several(model: BakedModel) -> None:
    assert (
        len(bake_model(sphere(columns=48, rows=24), ModelParams(resolution=32, layers=1, parts="auto"), "").parts) == 1
    )
    assert 1 < len(model.parts) <= 16 and model.key == "key" and {part.key for part in model.parts} == {"key"}


@pytest.mark.slow
def test_parts_hold_what_one_object_does_not(model: BakedModel) -> None:
    """The gaps beside the box in the middle, of which one layer sees nothing from outside."""
    held = points_of(model)
    inside = [
        np.abs(points).max(1) < 0.5
        for points in (points_of(bake_model(heap(3), ModelParams(resolution=64, layers=1), "")), held)
    ]
    assert inside[0].sum() == 0 and inside[1].sum() > 1000
    off = np.abs(np.abs((held + 0.5) % 1 - 0.5) - 0.35).min(1)  # from the nearest side of a box, along an axis
    assert off.max() < 2e-3


@pytest.mark.slow
def test_texels_of_parts_are_about_as_large_as_the_whole_has(model: BakedModel) -> None:
    (one,) = bake_model(heap(3), ModelParams(resolution=64, layers=1), "").parts
    size = max(2 * one.cylinder.radius, one.cylinder.height) / 64
    for part in model.parts:
        extent = max(2 * part.cylinder.radius, part.cylinder.height)
        assert 0.5 * size < extent / part.images[0].depth.shape[0] <= 1.01 * size


@pytest.mark.slow
def test_parts_are_at_most_as_many_as_wanted() -> None:
    assert len(bake_model(heap(2), ModelParams(resolution=32, layers=1, parts=2), "").parts) == 2
    for parts in (0, 17):
        with pytest.raises(InputError, match="must be 1 to 16, or auto"):
            ModelParams(parts=parts)


@pytest.mark.slow
def test_a_file_holds_all_parts(tmp_path: Path, model: BakedModel) -> None:
    path = tmp_path / "x.dpci.exr"
    write_baked(path, model)
    again = read_baked(path)
    assert len(again.parts) == len(model.parts) and again.key == "key" == read_header(path)["depthwalk.key"]
    for old, new in zip(model.parts, again.parts, strict=True):
        assert np.allclose(new.position, old.position, atol=1e-6) and np.allclose(new.rotation, old.rotation, atol=1e-6)
        assert [image.name for image in new.images] == [image.name for image in old.images]
        for one, other in zip(old.images, new.images, strict=True):
            np.testing.assert_array_equal(one.depth, other.depth)
        triangles = [sum(len(border.triangles) for border in part.boundary_strips) for part in (old, new)]
        assert triangles[0] == triangles[1] > 0
    assert read_header(path)["name"].startswith("part1.")
    shown = CliRunner().invoke(app, ["info", str(path)]).stdout
    assert f"{'parts':<24} {len(model.parts)}\n" in shown and "part part2." in shown


@pytest.mark.parametrize(
    ("parts", "message"),
    [
        (lambda part: (part, replace(part, key="other")), "the headers of its objects differ"),
        (lambda part: (part,) * 17, "objects are missing or too many"),
    ],
)
def test_files_of_parts_that_do_not_fit_are_refused(tmp_path: Path, parts: Callable[..., Any], message: str) -> None:
    params = BakeParams(resolution=16, layers=1)
    small = bake_object(sphere(columns=16, rows=8), params, "test", max_stepped=1)  # one level: fewer images to write
    write_baked(tmp_path / "x.dpci.exr", BakedModel(parts=parts(small)))
    with pytest.raises(InputError, match=message):
        read_baked(tmp_path / "x.dpci.exr")


@pytest.mark.parametrize(
    ("option", "message"),
    [
        (["--layers", "9"], "--layers 9: must be auto or a whole number from 1 to 8"),
        (
            ["--layers", "auto", "--method", "six-view"],
            "--layers auto: method six-view sees one surface per ray; say 1, or use raycast",
        ),
        (["--parts", "17"], "--parts 17: must be auto or a whole number from 1 to 16"),
        (["--parts", "few"], "--parts few: must be auto or a whole number from 1 to 16"),
        (["--axis", "w"], "--axis w: must be auto, x, y, z, or a direction X,Y,Z"),
        (["--axis", "0,0,0"], "--axis 0,0,0: must not be all 0, and each must be within ±1e+06"),
        (["--axis", "nan,0,0"], "--axis nan,0,0: must not be all 0, and each must be within ±1e+06"),
    ],
)
@pytest.mark.parametrize("command", ["bake", "compare"])
def test_options_that_say_nothing_of_use_are_refused(
    tmp_path: Path, command: str, option: Sequence[str], message: str
) -> None:
    ball = write_ply(tmp_path / "ball.ply", sphere(columns=8, rows=4))
    result = CliRunner().invoke(app, [command, str(ball), *option])
    assert (result.exit_code, result.stdout, result.stderr.strip()) == (2, "", message)


@pytest.mark.slow
def test_bake_says_how_many_parts(tmp_path: Path) -> None:
    mesh = write_ply(tmp_path / "heap.ply", heap(2))
    arguments = ["--dpci-resolution", "32", "--layers", "1", "--parts", "2", "--axis", "auto"]
    result = CliRunner().invoke(app, ["bake", str(mesh), *arguments])
    assert result.exit_code == 0 and "96 triangles, 2 parts, " in result.stdout and "at most 32²" in result.stdout
    assert len(read_baked(tmp_path / "heap.dpci.exr").parts) == 2
