"""Baked files that are large, malformed or damaged."""

import errno
import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
import OpenEXR
import pytest
from hypothesis import given
from hypothesis import strategies as st
from typer.testing import CliRunner

from baked_files import Channels, Parts, identical, refused, rewrite
from depthwalk import limits
from depthwalk.bake.file import read_baked, read_header, write_baked
from depthwalk.bake.grid import MAX_STEPS
from depthwalk.bake.header import inspect_header
from depthwalk.bake.images import BakedObject, BoundaryStrip, Face
from depthwalk.commands.cli import app
from depthwalk.cook.cook import CookOptions, cook_object
from depthwalk.cook.cooked_file import read_cooked, write_cooked
from depthwalk.errors import InputError
from depthwalk.ingest.mesh import Material, Reflection
from shapes import bake, box, joined, model_of, panes


@pytest.fixture(scope="module")
def baked() -> BakedObject:
    """Two boxes, three faces of two layers at most, with borders."""
    return bake(joined(box(1, 1, 1, (0, 0.5, 0)), box(0.2, 0.2, 0.2, (0.9, 0.5, 0))), resolution=32, layers=2)


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory, baked: BakedObject) -> bytes:
    """The bytes of a file of `baked`."""
    path = tmp_path_factory.mktemp("valid") / "x.dpci.exr"
    write_baked(path, model_of(baked))
    return path.read_bytes()


@pytest.fixture
def path(tmp_path: Path, data: bytes) -> Path:
    path = tmp_path / "x.dpci.exr"
    path.write_bytes(data)
    return path


def with_border(baked: BakedObject, **changes: Any) -> BakedObject:
    """`baked` with its first border changed."""
    return replace(baked, boundary_strips=(replace(baked.boundary_strips[0], **changes), *baked.boundary_strips[1:]))


def test_a_name_that_no_file_may_have_is_the_systems_error(tmp_path: Path, baked: BakedObject) -> None:
    with pytest.raises(OSError, match="Cannot open"):
        write_baked(tmp_path / f"{'x' * 300}.dpci.exr", model_of(baked))


def test_what_is_read_is_written_again_to_the_byte(path: Path, tmp_path: Path) -> None:
    write_baked(tmp_path / "again.dpci.exr", read_baked(path))
    assert (tmp_path / "again.dpci.exr").read_bytes() == path.read_bytes()


def test_unlit_surfaces_stay_so_in_files(tmp_path: Path) -> None:
    """Of depth images, and of what is cooked from them."""
    square = panes((0.0, Material(unlit=True, specular=0.0)))
    (lit,) = model_of(bake(replace(square, materials=(Material(),)), resolution=16, layers=1)).parts
    model = model_of(bake(square, resolution=16, layers=1))
    assert model.parts[0].is_unlit and not lit.is_unlit
    write_baked(tmp_path / "a.dpci.exr", model)
    (read,) = read_baked(tmp_path / "a.dpci.exr").parts
    assert read.is_unlit
    write_cooked(tmp_path / "a.dpci.npz", read.key, (cook_object(read, CookOptions()),))
    assert [cooked.outline.is_unlit for cooked in read_cooked(tmp_path / "a.dpci.npz")] == [True]


def test_reflections_stay_so_in_files(tmp_path: Path) -> None:
    """Of depth images, and of what is cooked from them."""
    model = model_of(bake(panes((0.0, Material(reflection=Reflection(0.25, 0.5)))), resolution=16, layers=1))
    write_baked(tmp_path / "a.dpci.exr", model)
    (read,) = read_baked(tmp_path / "a.dpci.exr").parts
    assert read.reflection == (0.25, 0.5)
    write_cooked(tmp_path / "a.dpci.npz", read.key, (cook_object(read, CookOptions()),))
    assert [cooked.outline.reflection for cooked in read_cooked(tmp_path / "a.dpci.npz")] == [(0.25, 0.5)]


def test_that_texels_tell_roughness_stays_so_in_files(tmp_path: Path) -> None:
    """Of depth images, and of what is cooked from them; files of other meshes do not mention it."""
    told = np.array([[(51, 0), (204, 255)]], np.uint8)
    plain = Material(reflection=Reflection(0.25, 0.5))
    for material in (plain, replace(plain, reflection_map=told)):
        model = model_of(bake(panes((0.0, material)), resolution=16, layers=1))
        write_baked(tmp_path / "a.dpci.exr", model)
        (read,) = read_baked(tmp_path / "a.dpci.exr").parts
        assert read.tells_roughness == (material is not plain)
        assert ("depthwalk.tells_roughness" in read_header(tmp_path / "a.dpci.exr")) == read.tells_roughness
        write_cooked(tmp_path / "a.dpci.npz", read.key, (cook_object(read, CookOptions()),))
        (cooked,) = read_cooked(tmp_path / "a.dpci.npz")
        assert cooked.outline.tells_roughness == read.tells_roughness


def test_borders_of_more_entries_than_fit_4096_rows_are_read_back(
    tmp_path: Path, baked: BakedObject, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Rows of lists are no texels, of which images may have 4096."""
    monkeypatch.setattr("depthwalk.bake.file_parts._LIST_WIDTH", 16)
    count = 4096 * 16 + 1
    triangles = np.tile(np.arange(3, dtype=np.int32), (count, 1))
    nothing = np.zeros((0, 2), np.float16)
    border = BoundaryStrip(
        face=Face.TOP, level=0, start=np.zeros(0, np.int32), offset=nothing, rise=nothing[:, 0], triangles=triangles
    )
    write_baked(tmp_path / "x.dpci.exr", model_of(replace(baked, boundary_strips=(border,))))
    np.testing.assert_array_equal(read_baked(tmp_path / "x.dpci.exr").parts[0].boundary_strips[0].triangles, triangles)


def test_borders_past_their_limit_are_neither_written_nor_read(
    path: Path, baked: BakedObject, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = path.read_bytes()
    monkeypatch.setattr(limits, "MAX_BOUNDARY_STRIP_ENTRIES", 4096)
    with pytest.raises(
        InputError, match=r"x\.dpci\.exr: boundary strips of \d+ entries; at most 4096 are allowed: bake at"
    ):
        write_baked(path, model_of(baked))
    assert path.read_bytes() == before and list(path.parent.iterdir()) == [path]
    refused(path, r"boundary strips of \d+ entries; at most 4096 are allowed")


def test_images_past_their_limit_are_not_read(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(limits, "MAX_DPCI_RESOLUTION", 31)
    refused(path, "image of 32 texels; at most 31 are allowed")


@pytest.mark.parametrize(
    ("attribute", "value", "message"),
    [
        ("version", "six", "baked by another version"),
        ("version", 5, "baked by another version"),
        ("version", 6.0, "baked by another version"),
        ("radius", "wide", "radius is 'wide', not a finite number"),
        ("radius", float("nan"), "radius is nan, not a finite number"),
        ("radius", 0.0, "its cylinder has no volume"),
        ("half_depth", -1.0, "its cylinder has no volume"),
        ("top", -9.0, "its cylinder has no volume"),
        ("bottom", float("-inf"), "bottom is -inf, not a finite number"),
        ("y", float("inf"), "y is inf, not a finite number"),
        ("qw", 3.0, "not a unit quaternion"),
        ("shininess", -1.0, "its shininess is negative"),
        ("roughness", 0.5, "its roughness or metalness is not a number from 0 to 1"),
        ("metalness", 1.5, "its roughness or metalness is not a number from 0 to 1"),
        ("steps", 0, "steps is 0, not a number from 1 to 7"),
        ("left_out", 1.5, "left_out is 1.5, not a number from 0 to 1"),
        ("left_out", "half", "left_out is 'half', not a number from 0 to 1"),
        ("mesh_triangles", 0, "mesh_triangles is 0, not a whole number above 0"),
        ("mesh_triangles", 12.0, "mesh_triangles is 12.0, not a whole number above 0"),
        ("steps", -3, "steps is -3, not a number"),
        ("steps", MAX_STEPS + 1, "steps is 8, not a number"),
        ("steps", "many", "steps is 'many', not a number"),
        ("steps", 1, "other channels"),
        ("key", 5, "key is not text"),
        ("key", "../../outside", "key is not text"),
        ("checksum", 1, "checksum is not text"),
        ("radius", None, "header lacks radius"),
    ],
)
def test_headers_out_of_range_are_refused(path: Path, attribute: str, value: float | str | None, message: str) -> None:
    def change(parts: Parts) -> Parts:
        for _, header, _ in parts:
            header.pop(f"depthwalk.{attribute}", None)
            if value is not None:
                header[f"depthwalk.{attribute}"] = value
        return parts

    rewrite(path, change)
    refused(path, message)
    with pytest.raises(InputError, match=message):
        read_header(path)


def test_parts_whose_headers_differ_are_refused(path: Path) -> None:
    rewrite(path, lambda parts: [*parts[:-1], (parts[-1][0], parts[-1][1] | {"depthwalk.radius": 2.0}, parts[-1][2])])
    refused(path, "the headers of its parts differ")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("border.top.0", "border", "unknown part 'border'"),
        ("border.top.0", "border.lid.0", "unknown part"),
        ("border.top.0", "border.top.6", "unknown part"),
        ("border.top.0", "other", "unknown part 'other'"),
        ("side.1", "side.8", "unknown part"),
        ("side.1", "side.7", "layers are missing"),
        ("triangles.side.0", "border.bottom.5", "unknown part"),
    ],
)
def test_parts_of_other_names_are_refused(path: Path, old: str, new: str, message: str) -> None:
    def change(parts: Parts) -> Parts:
        assert old in [name for name, _, _ in parts]
        return [(new if name == old else name, header, channels) for name, header, channels in parts]

    rewrite(path, change)
    refused(path, message)


@pytest.mark.parametrize(
    ("missing", "message"),
    [
        (("triangles.side.0",), "a boundary strip without its triangles"),
        (("side.0",), "layers are missing"),
        (("top.0", "top.1"), "or its face"),
    ],
)
def test_files_that_lack_a_part_are_refused(path: Path, missing: tuple[str, ...], message: str) -> None:
    rewrite(path, lambda parts: [part for part in parts if part[0] not in missing])
    refused(path, message)


@pytest.mark.parametrize(
    ("channels", "message"),
    [
        (lambda old: old | {"extra": old["Z"]}, "other channels"),
        (lambda old: {name: plane for name, plane in old.items() if name != "cells.0"}, "other channels"),
        (lambda old: old | {"Z": old["Z"].astype(np.float16)}, "channels of another type: Z"),
        (lambda old: {name: plane[:16].copy() for name, plane in old.items()}, "its images differ in size"),
    ],
)
def test_images_of_another_layout_are_refused(
    path: Path, channels: Callable[[Channels], Channels], message: str
) -> None:
    def change(parts: Parts) -> Parts:
        name, header, old = parts[0]
        new = channels(old)
        height, width = next(iter(new.values())).shape
        window = np.zeros(2, np.int32), np.array([width - 1, height - 1], np.int32)
        return [(name, header | {"dataWindow": window}, new), *parts[1:]]

    rewrite(path, change)
    refused(path, message)


def test_a_tiny_file_that_claims_large_images_is_refused_before_they_are_decoded(path: Path) -> None:
    """Its images and display window are enlarged in place: 32 texels become 4096."""
    data = bytearray(path.read_bytes())
    for window in (b"dataWindow\0box2i\0\x10\0\0\0", b"displayWindow\0box2i\0\x10\0\0\0"):
        at = data.find(window)
        while at >= 0:
            corner = slice(at + len(window) + 8, at + len(window) + 16)
            if data[corner] == np.array([31, 31], "<i4").tobytes():
                data[corner] = np.array([4095, 4095], "<i4").tobytes()
            at = data.find(window, at + 1)
    path.write_bytes(data)
    refused(path, r"too short for its \d+ bytes of pixels")


def test_corners_on_layers_that_are_not_there_are_refused(tmp_path: Path, baked: BakedObject) -> None:
    first = baked.images[0]
    for code in (1 | 7 << 1, 1 | 7 << 4, (1 | 7 << 1) << 7, (1 | 7 << 4) << 7):
        cells = first.cells[0].copy()
        cells[3] = code
        write_baked(
            tmp_path / "x.dpci.exr",
            model_of(replace(baked, images=(replace(first, cells=(cells, *first.cells[1:])), *baked.images[1:]))),
        )
        refused(tmp_path / "x.dpci.exr", r"part top\.0 has triangles on layers that its face does not have")


def test_texels_of_no_face_are_refused(tmp_path: Path, baked: BakedObject) -> None:
    owner = np.full_like(baked.images[0].owner, len(Face))
    images = (replace(baked.images[0], owner=owner), *baked.images[1:])
    write_baked(tmp_path / "x.dpci.exr", model_of(replace(baked, images=images)))
    refused(tmp_path / "x.dpci.exr", r"part top\.0 has texels that belong to no face")


@pytest.mark.parametrize("place", [(0, 0), (0, 1), (-1, 2)])
def test_border_triangles_outside_their_face_are_refused(
    tmp_path: Path, baked: BakedObject, place: tuple[int, int]
) -> None:
    triangles = baked.boundary_strips[0].triangles.copy()
    triangles[place] = 1 << 20
    write_baked(tmp_path / "x.dpci.exr", model_of(with_border(baked, triangles=triangles[np.argsort(triangles[:, 0])])))
    refused(tmp_path / "x.dpci.exr", r"part border\.top\.0 points outside its face")


def test_border_vertices_outside_their_face_are_refused(tmp_path: Path, baked: BakedObject) -> None:
    start = baked.boundary_strips[0].start.copy()
    start[-1] = 1 << 20
    write_baked(tmp_path / "x.dpci.exr", model_of(with_border(baked, start=start)))
    refused(tmp_path / "x.dpci.exr", r"part border\.top\.0 points outside its face")


def test_border_places_that_are_no_numbers_are_refused(tmp_path: Path, baked: BakedObject) -> None:
    write_baked(
        tmp_path / "x.dpci.exr", model_of(with_border(baked, rise=np.full_like(baked.boundary_strips[0].rise, np.nan)))
    )
    refused(tmp_path / "x.dpci.exr", r"part border\.top\.0 holds places that are not numbers")


def test_info_names_the_fault_of_a_file_and_exits_with_2(path: Path) -> None:
    def change(parts: Parts) -> Parts:
        return [(name, header | {"depthwalk.radius": "wide"}, channels) for name, header, channels in parts]

    assert CliRunner().invoke(app, ["info", str(path)]).exit_code == 0
    rewrite(path, change)
    result = CliRunner().invoke(app, ["info", str(path)])
    assert result.exit_code == 2
    assert "radius is 'wide', not a finite number" in result.stderr.replace("\n", "")


def test_what_the_library_says_of_damage_stays_off_standard_output(
    path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    data = bytearray(path.read_bytes())
    data[-300] ^= 255
    path.write_bytes(data)
    refused(path, "damaged depth images")
    assert capsys.readouterr().out == ""


@pytest.fixture(scope="module")
def valid(tmp_path_factory: pytest.TempPathFactory, data: bytes) -> tuple[Path, bytes, int]:
    """A file's path and bytes, and where its headers end."""
    path = tmp_path_factory.mktemp("valid") / "x.dpci.exr"
    path.write_bytes(data)
    return path, data, data.rindex(b"screenWindowWidth") + 32


@given(st.floats(0, 1, exclude_max=True), st.integers(1, 255), st.booleans())
def test_a_flipped_byte_is_refused_or_does_no_harm(
    valid: tuple[Path, bytes, int], baked: BakedObject, place: float, flip: int, in_header: bool
) -> None:
    path, data, header = valid
    damaged = bytearray(data)
    damaged[int(place * (header if in_header else len(data)))] ^= flip
    target = path.with_name("damaged.dpci.exr")
    target.write_bytes(damaged)
    try:
        again = read_baked(target)
    except InputError as error:
        assert str(error).startswith(f"{target}: ")
    else:
        assert identical(again, read_baked(path))


@pytest.mark.parametrize("read", [read_baked, inspect_header])
def test_what_the_machine_lacks_is_no_damage(
    path: Path, monkeypatch: pytest.MonkeyPatch, read: Callable[[Path], object]
) -> None:
    def no_memory(*arguments: object, **options: object) -> NoReturn:
        raise MemoryError

    monkeypatch.setattr(OpenEXR, "File", no_memory)
    with pytest.raises(MemoryError):
        read(path)


@pytest.mark.parametrize("code, error", [(errno.EMFILE, OSError), (errno.EACCES, InputError)])
def test_a_file_that_cannot_be_opened_is_not_damaged(
    path: Path, monkeypatch: pytest.MonkeyPatch, code: int, error: type[Exception]
) -> None:
    def fail(*arguments: object, **options: object) -> NoReturn:
        raise OSError(code, os.strerror(code), str(path))

    def unopened(*arguments: object, **options: object) -> NoReturn:
        raise RuntimeError(f"Unable to open '{path}' for read")

    monkeypatch.setattr(OpenEXR, "File", unopened)
    monkeypatch.setattr(Path, "open", fail)
    with pytest.raises(error, match=os.strerror(code)):
        read_baked(path)


def test_channels_left_out_for_lack_of_memory_are_no_damage(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    original = OpenEXR.File

    def without_pixels(*arguments: Any, **options: Any) -> OpenEXR.File:
        if options.get("separate_channels"):
            print("Warning: Exception raised reading pixel data for part 2 - MemoryError: Unable to allocate 7 KiB")
        return original(*arguments, **options)

    monkeypatch.setattr(OpenEXR, "File", without_pixels)
    with pytest.raises(MemoryError):
        read_baked(path)


@pytest.mark.parametrize("triangles", (None, 24))
def test_files_say_how_many_triangles_the_mesh_has(tmp_path: Path, baked: BakedObject, triangles: int | None) -> None:
    path = tmp_path / "x.dpci.exr"
    write_baked(path, model_of(replace(baked, mesh_triangles=triangles)))
    assert [part.mesh_triangles for part in read_baked(path).parts] == [triangles]


@pytest.mark.parametrize("interior", (False, True))
def test_files_say_whether_the_mesh_has_an_interior(tmp_path: Path, baked: BakedObject, interior: bool) -> None:
    path = tmp_path / "x.dpci.exr"
    write_baked(path, model_of(replace(baked, has_interior=interior)))
    assert [part.has_interior for part in read_baked(path).parts] == [interior]


def test_without_a_texture_files_are_as_ever(path: Path) -> None:
    """So files of before are read, and earlier programs read those of now."""
    assert read_header(path)["depthwalk.version"] == 10
    with OpenEXR.File(str(path), header_only=True) as file:
        channels = {channel.name for part in file.parts for channel in part.header["channels"]}
        names = {part.header["name"] for part in file.parts}
    assert "uv" not in channels and not any("texture" in name for name in names)
    (read,) = read_baked(path).parts
    assert read.texture is None and all(image.coordinates is None for image in read.images)
