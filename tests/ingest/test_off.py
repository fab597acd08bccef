"""OFF files, read as OBJ files."""

from pathlib import Path

import numpy as np
import pytest

from depthwalk.errors import InputError
from depthwalk.ingest.loader import load_mesh
from depthwalk.ingest.off import obj_from_off
from depthwalk.ingest.reader import read_soup

CORNERS = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n"
FACES = "3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n"


def written(folder: Path, text: str, name: str = "a.off") -> Path:
    (path := folder / name).write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize(
    "text",
    [
        f"OFF\n4 4 6\n{CORNERS}{FACES}",
        f"OFF4 4 0\n{CORNERS}{FACES}",  # as in ModelNet
        f"# made by hand\n\n  OFF # kind\n# counts\n4 4\n\n{CORNERS}\n# faces\n{FACES}5 0 0 0",
        f"4 4 6\n{CORNERS}{FACES}",
        f"off\r\n4 6 6\r\n{CORNERS}{FACES}2 0 1\n1 3\n".replace("\n", "\r\n").replace("\r\r", "\r"),
        f"OFF\n4 4 6\n{CORNERS}{FACES}".replace("3 1 2 3", "3 1 2 3 255 0 0"),  # a colour of the face
    ],
)
def test_a_tetrahedron_is_read_however_it_is_written(tmp_path: Path, text: str) -> None:
    soup = read_soup(written(tmp_path, text))
    assert sorted(map(tuple, soup.positions[soup.faces].reshape(-1, 9).tolist())) == sorted(
        [
            (0, 0, 0, 0, 1, 0, 1, 0, 0),
            (0, 0, 0, 1, 0, 0, 0, 0, 1),
            (0, 0, 0, 0, 0, 1, 0, 1, 0),
            (1, 0, 0, 0, 1, 0, 0, 0, 1),
        ]
    )


def test_polygons_are_divided_and_colours_kept(tmp_path: Path) -> None:
    corners = "0 0 0 255 0 51 255\n2 0 0 0 255 51 255\n2 1 0 0 0 51 255\n0 1 0 0 0 51 255\n"
    soup = read_soup(written(tmp_path, f"COFF\n4 1 4\n{corners}4 0 1 2 3\n"))
    assert len(soup.faces) == 2
    places = soup.positions.tolist()
    assert soup.colours[places.index([2, 0, 0])].tolist() == [0, 255, 51]
    floats = corners.replace("255 0 51 255", "1.0 0.0 0.2 1.0").replace("0 255 51 255", "0.0 1.0 0.2 1")
    floats = floats.replace("0 0 51 255", "0.0 0.0 0.2 1.0")
    np.testing.assert_array_equal(
        read_soup(written(tmp_path, f"COFF\n4 1 4\n{floats}4 0 1 2 3\n")).colours, soup.colours
    )


def test_normals_before_colours_are_skipped(tmp_path: Path) -> None:
    corners = "".join(f"{x} {y} 0 0 0 1 10 20 30\n" for x, y in ((0, 0), (1, 0), (0, 1)))
    soup = read_soup(written(tmp_path, f"CNOFF\n3 1 3\n{corners}3 0 1 2\n"))
    assert (soup.colours == (10, 20, 30)).all() and (soup.positions[:, 2] == 0).all()


def test_without_faces_it_is_a_scan(tmp_path: Path) -> None:
    turn = np.pi * (1 + np.sqrt(5)) * np.arange(200)
    z = 1 - (2 * np.arange(200) + 1) / 200
    points = np.column_stack([np.sqrt(1 - z * z) * np.cos(turn), np.sqrt(1 - z * z) * np.sin(turn), z])
    rows = "\n".join(" ".join(map(str, row)) for row in points.tolist())
    assert len(load_mesh(written(tmp_path, f"OFF\n200 0 0\n{rows}\n")).faces) == 396


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("solid a\n", "a.off: not an OFF file"),
        ("# nothing\n", "a.off: not an OFF file"),
        ("OFF BINARY\n4 4 6\n", "a.off: only OFF files of text, with three coordinates, are read"),
        (f"4OFF\n4 4 6\n{CORNERS}", "a.off: only OFF files of text, with three coordinates, are read"),
        ("OFF\n", "a.off:1: not the numbers of vertices and faces: ''"),
        ("OFF\n4 x 6\n", "a.off:2: not the numbers of vertices and faces: '4 x 6'"),
        (f"OFF\n4 4 6\n{CORNERS}3 0 1 2\n", "a.off: truncated: 5 lines for 4 vertices and 4 faces"),
        (f"OFF\n99999999999 1 6\n{CORNERS}", "a.off: truncated: 4 lines for 99999999999 vertices and 1 faces"),
        (f"OFF\n4 1 6\n{CORNERS}4 0 1 2\n", "a.off:7: not a face: '4 0 1 2'"),
        (f"OFF\n4 1 6\n{CORNERS}3 0 1 -2\n", "a.off:7: not a face: '3 0 1 -2'"),
    ],
)
def test_mistakes_are_told_where_they_are(tmp_path: Path, text: str, told: str) -> None:
    with pytest.raises(InputError) as caught:
        read_soup(written(tmp_path, text))
    assert str(caught.value) == f"{tmp_path}/{told}"


@pytest.mark.parametrize(
    ("text", "line"),
    [(f"OFF\n\n4 1 6\n{CORNERS}3 0 1 9\n", 8), ("OFF\n3 1 6\n0 0 0\n1 0 zero\n0 1 0\n3 0 1 2\n", 4)],
)
def test_what_the_reader_of_obj_files_finds_is_on_the_same_line(tmp_path: Path, text: str, line: int) -> None:
    with pytest.raises(InputError, match=rf"a\.off:{line}: "):
        read_soup(written(tmp_path, text))


def test_every_line_stays_in_its_place(tmp_path: Path) -> None:
    text = f"OFF\n# four\n4 1 0\n{CORNERS}3 0 1 2".encode()
    assert obj_from_off(text, tmp_path).splitlines() == [
        b"", b"", b"", b"v 0 0 0", b"v 1 0 0", b"v 0 1 0", b"v 0 0 1", b"f 1 2 3",
    ]  # fmt: skip
