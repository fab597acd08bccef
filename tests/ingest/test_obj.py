"""OBJ text: what is read, what is refused and where, and that time grows with the file and no faster."""

import time
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.strategies._internal.core import DataObject

from depthwalk.errors import InputError
from depthwalk.ingest.loader import load_mesh
from depthwalk.ingest.obj import ObjMesh, parse_obj
from depthwalk.ingest.reader import read_soup

VERTICES = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"
PATH = Path("a.obj")


def parsed(text: str) -> ObjMesh:
    return parse_obj(text.encode(), PATH)


def refusal(text: str) -> str:
    with pytest.raises(InputError) as caught:
        parsed(text)
    return str(caught.value)


@pytest.mark.parametrize(
    ("line", "defect"),
    [
        ("v", "a vertex needs three numbers"),
        ("v 1 2", "a vertex needs three numbers"),
        ("v one 2 3", "a vertex needs three numbers"),
        ("v 1.2.3 4 5", "cannot read the number '1.2.3'"),
        ("v 1 2 3 red", "cannot read the number 'red'"),
        ("v 1_0 2 3", "a vertex needs three numbers"),
        ("vt 0.5 x", "cannot read the number 'x'"),
        ("vn 0 1-2 0", "cannot read the number '1-2'"),
        ("f 1 2", "a face needs at least three corners"),
        ("f 1 2 +3", "cannot read the face '1 2 +3'"),
        ("f 1 2 --3", "cannot read the face '1 2 --3'"),
        ("f 1 2 1-2", "cannot read the face '1 2 1-2'"),
        ("f 1/1/1/1 2 3", "cannot read the face '1/1/1/1 2 3'"),
        ("f /1 /1 /1", "cannot read the face '/1 /1 /1'"),
        ("f 1 2 5", "face refers to vertex 5 of 4"),
        ("f 1 2 -5", "face refers to vertex -5 of 4"),
        ("f 1/1 2/1 3/1", "face refers to texture coordinate 1 of 0"),
        ("f 1//1 2//1 3//1", "face refers to normal 1 of 0"),
        ("f 1 2 99999999999999999999", f"face refers to vertex {2**63 - 1} of 4"),
    ],
)
def test_defects_are_located(line: str, defect: str) -> None:
    assert refusal(f"{VERTICES}f 1 2 3\n\n{line}\nf 1 2 4\n") == f"a.obj:7: {defect}"


def test_relative_indices_and_what_they_may_not_reach() -> None:
    corners = parsed(f"{VERTICES}f -4 -3 -2\nv 1 1 1\nf -1 -4 2\n").corners[:, 0]
    assert corners.tolist() == [1, 2, 3, 5, 2, 2]


@pytest.mark.parametrize(
    ("face", "corners"),
    [
        ("1 2 3", [[1, 0, 0], [2, 0, 0], [3, 0, 0]]),
        ("1/1 2/1 3/1", [[1, 1, 0], [2, 1, 0], [3, 1, 0]]),
        ("1/1/ 2/1/ 3/1/", [[1, 1, 0], [2, 1, 0], [3, 1, 0]]),
        ("1// 2// 3//", [[1, 0, 0], [2, 0, 0], [3, 0, 0]]),
        ("1//1 2//1 3//1", [[1, 0, 1], [2, 0, 1], [3, 0, 1]]),
        ("1/1/1 2/1/1 3/1/1", [[1, 1, 1], [2, 1, 1], [3, 1, 1]]),
        ("1 2/1 3//1", [[1, 0, 0], [2, 1, 0], [3, 0, 1]]),
    ],
)
def test_styles_of_corners(face: str, corners: Sequence[Sequence[int]]) -> None:
    assert parsed(f"{VERTICES}vt 0 0\nvn 0 0 1\nf {face}\n").corners.tolist() == corners


def test_rows_of_unequal_length_are_cut_to_the_shortest() -> None:
    mesh = parsed("v 0 0 0 1 1 1\nv 1 0 0\nv 0 1 0 0.5\nvt 1 2 3\nvt 4 5\nf 1 2 3\n")
    assert mesh.vertices.tolist() == [[0, 0, 0], [1, 0, 0], [0, 1, 0]] and mesh.colours is None
    assert mesh.texture is not None
    assert mesh.texture.tolist() == [[1, 2], [4, 5]]


def test_polygons_become_fans(tmp_path: Path) -> None:
    path = tmp_path / "p.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0.5 2 0\nv 0 1 0\nf 1 2 3 4 5\nf 1 2 3 4\nf 1 2 3\n")
    assert read_soup(path).faces.tolist() == [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 1, 2], [2, 3, 0], [0, 1, 2]]


@pytest.mark.parametrize("turned", range(5))
def test_concave_polygons_are_cut_within(tmp_path: Path, turned: int) -> None:
    """Two of a letter V, each in a group of its own, the last of which comes first."""
    outline = [(0, 0), (4, 0), (5, 3), (2, 1), (-1, 3)]
    places = outline[turned:] + outline[:turned]
    vertices = "".join(f"v {x} {y} 0\n" for x, y in places)
    path = tmp_path / "v.obj"
    path.write_text(f"{vertices}usemtl a\nf 1 2 3 4 5\nusemtl b\nf 1 2 3 4 5\nf 1 2 3\n")
    soup = read_soup(path)
    first, second, third = soup.positions[soup.faces].transpose(1, 0, 2)
    areas = np.cross(second - first, third - first)[:, 2] / 2
    assert len(areas) == 7
    for letter in areas[:3], areas[4:]:
        assert (letter > 0).all() and letter.sum() == pytest.approx(9)


@pytest.mark.parametrize(("corner", "expected"), [(1, [[1, 2, 3], [3, 0, 1]]), (2, [[0, 1, 2], [2, 3, 0]])])
def test_arrowheads_are_cut_from_their_notch(tmp_path: Path, corner: int, expected: list[list[int]]) -> None:
    places = [(0, 0), (4, 0), (4, 4), (0, 4)]
    places[corner] = {1: (1, 2), 2: (1, 1)}[corner]
    path = tmp_path / "a.obj"
    path.write_text("".join(f"v {x} {y} 0\n" for x, y in places) + "f 1 2 3 4\n")
    faces = [min(face[k:] + face[:k] for k in range(3)) for face in read_soup(path).faces.tolist()]
    assert sorted(faces) == sorted(min(face[k:] + face[:k] for k in range(3)) for face in expected)


def test_colours_may_reach_to_255(tmp_path: Path) -> None:
    """As 3DDFA and others write them, which were all white."""
    path = tmp_path / "c.obj"
    path.write_text("v 0 0 0 255 0 128\nv 1 0 0 0 1 0\nv 0 1 0 12 34 56\nf 1 2 3\n")
    assert read_soup(path).colours.tolist() == [[255, 0, 128], [0, 1, 0], [12, 34, 56]]
    path.write_text("v 0 0 0 1.01 0 0.5\nv 1 0 0 0 1 0\nv 0 1 0 0.2 0 0\nf 1 2 3\n")
    assert read_soup(path).colours.tolist() == [[255, 0, 128], [0, 255, 0], [51, 0, 0]]


def test_groups_follow_usemtl_and_keep_apart(tmp_path: Path) -> None:
    mesh = parsed(f"{VERTICES}f 1 2 3\nusemtl a b\nf 1 2 4\nusemtl none\nusemtl c\nf 1 3 4\nusemtl a b\nf 2 3 4\n")
    assert mesh.material_names == (None, "a b", "c") and mesh.group.tolist() == [0, 1, 2, 1]
    (tmp_path / "m.mtl").write_text("newmtl a b\nKd 1 0 0\nnewmtl c\nKd 0 1 0\nNs 7\nKs none\n")
    path = tmp_path / "g.obj"
    path.write_text(f"mtllib m.mtl\n{VERTICES}usemtl c\nf 1 2 3\nusemtl a b\nf 1 2 4\nusemtl gone\nf 2 3 4\n")
    soup = read_soup(path)
    assert [soup.materials[m].base_colour for m in soup.material] == [(0.8, 0.8, 0.8), (1, 0, 0), (0, 1, 0)]
    assert soup.materials[soup.material[-1]].shininess == 7


numbers = st.floats(-1e6, 1e6).map(lambda value: np.round(value, 6))
points = st.lists(st.tuples(numbers, numbers, numbers), min_size=3, max_size=20)


@given(points=points, data=st.data(), ending=st.sampled_from(["\n", "\r\n", "\r"]), blank=st.sampled_from([" ", "\t "]))
def test_what_was_written_is_read(
    points: Sequence[tuple[float, float, float]], data: DataObject, ending: str, blank: str
) -> None:
    index = st.integers(1, len(points))
    faces = data.draw(st.lists(st.lists(index, min_size=3, max_size=6), min_size=1, max_size=10))
    lines = [blank.join(["v", *(repr(float(value)) for value in point)]) for point in points]
    for number, face in enumerate(faces):
        lines.insert(data.draw(st.integers(0, len(lines))), f"# face {number}")
        lines.append(blank.join(["", "f", *map(str, face)]))
    mesh = parsed(ending.join(lines))
    np.testing.assert_array_equal(mesh.vertices, np.array(points, float))
    assert [corners.tolist() for corners in np.split(mesh.corners[:, 0], np.cumsum(mesh.sizes)[:-1])] == faces


def seconds(path: Path) -> float:
    """The shortest of three readings, in seconds of this process: other programs do not count."""
    taken = []
    for _ in range(3):
        start = time.process_time()
        load_mesh(path)
        taken.append(time.process_time() - start)
    return min(taken)


HOSTILE: dict[str, Callable[[int], str]] = {
    "blanks": lambda n: f"mtllib{' ' * 40 * n}\n{VERTICES}f 1 2 3\n",
    "blanks within": lambda n: f"mtllib a{' ' * 40 * n}b\n{VERTICES}f 1 2 3\n",
    "lines of blanks": lambda n: f"{VERTICES}f 1 2 3\n" + "   \t \n" * 8 * n,
    "comments": lambda n: f"{VERTICES}f 1 2 3\n" + "# # #\n" * 4 * n,
    "continuations": lambda n: f"{VERTICES}f 1 2 3" + " \\\n" * 8 * n,
    "materials": lambda n: VERTICES + "".join(f"usemtl m{i}\nf 1 2 3\nf 1 2 4\n" for i in range(n)),
    "relative": lambda n: "".join(f"{VERTICES}f -1 -2 -3\n" for _ in range(n)),
    "mixed": lambda n: VERTICES + "vt 0 0\nf 1 2 3 4\nf 1/1 2 3\n" * n,
    "kinds in turn": lambda n: f"{VERTICES}vt 0 0\nvn 0 0 1\nf 1/1/1 2/1/1 3/1/1\n" * n,
    "one polygon": lambda n: VERTICES + "f" + " 1 2 3" * n + "\n",
}


@pytest.mark.slow
@pytest.mark.parametrize("kind", HOSTILE)
def test_twice_the_file_takes_about_twice_the_time(tmp_path: Path, kind: str) -> None:
    """Four times as much may take eight times as long, not sixteen times; what takes no time at all is not measured."""
    size, path = 2_000, tmp_path / "a.obj"
    path.write_text(HOSTILE[kind](size))
    once = seconds(path)
    path.write_text(HOSTILE[kind](4 * size))
    assert seconds(path) < 8 * max(once, 0.01)


def test_a_comment_that_ends_with_a_backslash_continues_nothing() -> None:
    assert parsed(f"{VERTICES}# a comment \\\nf 1 2 3 # another \\\nf 1 2 4\n").sizes.tolist() == [3, 3]


def test_lines_after_continued_ones_keep_their_numbers() -> None:
    text = f"{VERTICES}f 1 \\\n 2 \\\n3\n"  # lines 5 to 7
    assert parsed(f"{text}f 1 2 4\n").corners[:, 0].tolist() == [1, 2, 3, 1, 2, 4]
    assert refusal(f"{text}f 1 2 9\n") == "a.obj:8: face refers to vertex 9 of 4"
    assert refusal(f"{VERTICES}f 1 \\\n 2 \\\n9\n") == "a.obj:5: face refers to vertex 9 of 4"
