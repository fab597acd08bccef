"""PLY files of polygons: of any numbers of corners, concave ones, and what belongs to a face or a corner."""

import struct
import tracemalloc
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from depthwalk.errors import InputError
from depthwalk.ingest.loader import load_mesh
from depthwalk.ingest.ply_polygons import with_triangles
from depthwalk.ingest.reader import read_soup

CUBE = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1), (0.5, 1.5, 0.5)]
HOUSE = [
    (3, 2, 1, 0),
    (4, 5, 6, 7),
    (0, 1, 5, 4),
    (1, 2, 6, 5),
    (3, 0, 4, 7),
    (2, 3, 8),
    (7, 6, 8),
    (6, 2, 8),
    (3, 7, 8),
]
KINDS = {"binary_little_endian": "<", "binary_big_endian": ">"}


def house(form: str, *, ends: str = "\n", lists: bool = False, colours: bool = False) -> bytes:
    """A house with a tent roof, as Blender writes it; with lists in its vertices, or colours of its faces."""
    lines = [
        *("ply", f"format {form} 1.0", "comment Created in Blender", f"element vertex {len(CUBE)}"),
        *(f"property float {name}" for name in "xyz"),
        *(["property list uchar short near"] if lists else []),
        f"element face {len(HOUSE)}",
        "property list uchar uint vertex_indices",
        *([f"property uchar {name}" for name in ("red", "green", "blue")] if colours else []),
        *("element edge 1", "property int vertex1", "property int vertex2", "end_header"),
    ]
    near = [list(range(number % 3)) if lists else None for number in range(len(CUBE))]
    shades: list[Sequence[int]] = [(number, 2, 3) if colours else () for number in range(len(HOUSE))]
    head = "".join(line + ends for line in lines).encode()
    if form == "ascii":
        vertices = [
            (*place, *([] if some is None else [len(some), *some])) for place, some in zip(CUBE, near, strict=True)
        ]
        faces = [(len(face), *face, *shade) for face, shade in zip(HOUSE, shades, strict=True)]
        return head + "".join(" ".join(map(str, row)) + ends for row in [*vertices, *faces, (0, 1)]).encode()
    order = KINDS[form]
    body = b"".join(
        struct.pack(f"{order}3f", *place)
        + (b"" if some is None else struct.pack(f"{order}B{len(some)}h", len(some), *some))
        for place, some in zip(CUBE, near, strict=True)
    )
    for face, shade in zip(HOUSE, shades, strict=True):
        body += struct.pack(f"{order}B{len(face)}I", len(face), *face) + bytes(shade)
    return head + body + struct.pack(f"{order}2i", 0, 1)


@pytest.mark.parametrize("lists", [False, True])
@pytest.mark.parametrize("form", ["ascii", *KINDS])
def test_faces_have_any_number_of_corners(tmp_path: Path, form: str, lists: bool) -> None:
    (file := tmp_path / "house.ply").write_bytes(house(form, lists=lists, ends="\r\n" if form == "ascii" else "\n"))
    soup = read_soup(file)
    assert soup.faces.shape == (14, 3)
    first, second, third = soup.positions[soup.faces].transpose(1, 0, 2)
    volume = np.einsum("ij,ij->i", first, np.cross(second, third)).sum() / 6
    assert volume == pytest.approx(1 + 0.5 / 3)  # all faces are there, and turned outward


@pytest.mark.parametrize("form", ["ascii", *KINDS])
def test_triangles_have_the_colours_of_their_polygons(tmp_path: Path, form: str) -> None:
    (file := tmp_path / "house.ply").write_bytes(house(form, colours=True))
    soup = read_soup(file)
    shades = soup.colours[soup.faces[:, 0]]
    assert shades[:, 0].tolist() == [0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 6, 7, 8] and (shades[:, 1:] == (2, 3)).all()


def test_concave_polygons_are_cut_within(tmp_path: Path) -> None:
    outline = [(4, 0), (5, 3), (2, 1), (-1, 3), (0, 0)]
    rows = "".join(f"{x} {y} 0\n" for x, y in outline)
    head = "ply\nformat ascii 1.0\nelement vertex 5\nproperty double x\nproperty double y\nproperty double z\n"
    text = f"{head}element face 1\nproperty list uchar int vertex_index\nend_header\n{rows}5 0 1 2 3 4\n"
    (file := tmp_path / "v.ply").write_text(text)
    soup = read_soup(file)
    first, second, third = soup.positions[soup.faces].transpose(1, 0, 2)
    areas = np.cross(second - first, third - first)[:, 2] / 2
    assert (areas > 0).all() and areas.sum() == pytest.approx(9)


def test_corners_keep_their_texture_coordinates(tmp_path: Path) -> None:
    head = "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\n"
    head += "element face 2\nproperty list uchar int vertex_indices\nproperty list uchar float texcoord\nend_header\n"
    rows = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n2 0 0\n"
    faces = "4 0 1 2 3 8 0 0 0.5 0 0.5 1 0 1\n3 1 4 2 6 0.6 0 1 0 0.6 1\n"
    (file := tmp_path / "t.ply").write_text(head + rows + faces)
    mesh = load_mesh(file)
    found = {(*place, *uv) for place, uv in zip(mesh.positions[:, :2].tolist(), mesh.uv.round(3).tolist(), strict=True)}
    low = mesh.positions[:, 0].min()
    assert {(round(x - low, 3), round(u, 3)) for x, _, u, _ in found} == {(0, 0), (1, 0.5), (1, 0.6), (2, 1)}


@pytest.mark.parametrize("form", ["ascii", *KINDS])
def test_damage_is_told(tmp_path: Path, form: str) -> None:
    file = tmp_path / "house.ply"
    for data in (
        house(form)[:-40],
        house(form).replace(b"vertex 9", b"vertex 8"),
        house(form).replace(b"face 9", b"face 99"),
    ):
        file.write_bytes(data)
        with pytest.raises(InputError, match=r"house\.ply: "):
            read_soup(file)


@pytest.mark.parametrize(
    ("right", "wrong"),
    [(b"property float y", b"property float x"), (b"property float z", b"p float z"), (b"10", b"-1")],
)
def test_headers_that_cannot_be_understood_are_left_to_trimesh(tmp_path: Path, right: bytes, wrong: bytes) -> None:
    """The fuzzer found the first two, which were read otherwise than by trimesh."""
    data = house("ascii").replace(b"vertex 9", b"vertex 10").replace(b"0.5 1.5 0.5\n", b"0.5 1.5 0.5\n0 0 0\n")
    assert (
        with_triangles(data, tmp_path) is not None and with_triangles(data.replace(right, wrong, 1), tmp_path) is None
    )


@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        (b"\n4 3 2 1 0", b"\ninf 3 2 1 0"),
        (b"\n3 2 3 8", b"\ninf 2 3 8"),
        (b"vertex 9", b"vertex 9" + b"0" * 30),
    ],
)
def test_numbers_that_no_file_can_hold_are_damage(tmp_path: Path, right: bytes, wrong: bytes) -> None:
    path, data = tmp_path / "a.ply", house("ascii")
    assert right in data
    path.write_bytes(data.replace(right, wrong, 1))
    with pytest.raises(InputError, match=r"a\.ply: "):
        read_soup(path)


def test_long_words_take_no_more_memory_than_they_are_long() -> None:
    lines = ["ply", "format ascii 1.0", "element vertex 20000", *(f"property float {name}" for name in "xyz")]
    lines += ["element face 1", "property list uchar int vertex_indices", "end_header"]
    lines += [f"0 0 {'0' * 3000}", *["0 0 0"] * 19_999, "3 0 1 2", ""]
    tracemalloc.start()
    try:
        assert with_triangles("\n".join(lines).encode(), Path("a.ply")) is None
        assert tracemalloc.get_traced_memory()[1] < 20e6
    finally:
        tracemalloc.stop()
