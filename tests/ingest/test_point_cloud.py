"""Files of points, as scanners write them, are read as the surface through their points."""

import json
import logging
import struct
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from depthwalk.errors import InputError
from depthwalk.ingest.loader import load_mesh
from depthwalk.ingest.mesh_head import read_head
from depthwalk.ingest.reader import read_soup

COUNT = 400
_TURN = np.pi * (1 + np.sqrt(5)) * np.arange(COUNT)
_Z = 1 - (2 * np.arange(COUNT) + 1) / COUNT
BALL = np.column_stack([np.sqrt(1 - _Z * _Z) * np.cos(_TURN), np.sqrt(1 - _Z * _Z) * np.sin(_TURN), _Z])
RED = np.tile([200, 30, 10], (COUNT, 1))


def ply(columns: NDArray[np.float64], names: str, faces: str = "") -> bytes:
    """Return an ASCII PLY file of vertices with these `names` of properties, and the lines of its faces."""
    kinds = ["uchar" if name in ("red", "green", "blue") else "float" for name in names.split()]
    head = "".join(f"property {kind} {name}\n" for kind, name in zip(kinds, names.split(), strict=True))
    count = f"element face {faces.count(chr(10))}\nproperty list uchar int vertex_indices\n" if faces else ""
    rows = "\n".join(" ".join(f"{value:.9g}" for value in row) for row in columns)
    return f"ply\nformat ascii 1.0\nelement vertex {len(columns)}\n{head}{count}end_header\n{rows}\n{faces}".encode()


def written(folder: Path, name: str, data: bytes | str) -> Path:
    file = folder / name
    file.write_bytes(data.encode() if isinstance(data, str) else data)
    return file


def obj(points: NDArray[np.float64], *others: str) -> str:
    return "\n".join(["v " + " ".join(f"{value:.9g}" for value in row) for row in points] + list(others)) + "\n"


def glb(positions: NDArray[np.float64], colours: NDArray[np.float64]) -> bytes:
    """Return a GLB file of points, raised by 5 m by its node."""
    parts = [values.astype(np.float32).tobytes() for values in (positions, colours)]
    lengths = [len(part) for part in parts]
    low, high = positions.min(0).tolist(), positions.max(0).tolist()
    header = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "translation": [0, 5, 0]}],
        "meshes": [{"primitives": [{"mode": 0, "attributes": {"POSITION": 0, "COLOR_0": 1}}]}],
        "buffers": [{"byteLength": sum(lengths)}],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": lengths[0]},
            {"buffer": 0, "byteOffset": lengths[0], "byteLength": lengths[1]},
        ],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": COUNT, "type": "VEC3", "min": low, "max": high},
            {"bufferView": 1, "componentType": 5126, "count": COUNT, "type": "VEC3"},
        ],
    }
    text = json.dumps(header).encode()
    text += b" " * (-len(text) % 4)
    data = b"".join(parts)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(data), b"BIN\0") + data
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def test_a_ply_file_of_points_is_a_surface_with_their_colours(tmp_path: Path) -> None:
    file = written(tmp_path, "ball.ply", ply(np.column_stack([BALL, RED]), "x y z red green blue"))
    mesh = load_mesh(file)
    assert len(mesh.positions) == COUNT and len(mesh.faces) == 2 * COUNT - 4
    np.testing.assert_allclose(np.ptp(mesh.positions, axis=0), np.ptp(BALL, axis=0), atol=1e-5)
    assert mesh.positions[:, 1].min() == pytest.approx(0, abs=1e-6)
    assert (mesh.colours == (200, 30, 10)).all()
    outward = mesh.positions - [0, 1, 0]
    assert (np.einsum("nd,nd->n", mesh.normals, outward) > 0.9).all()


def test_normals_of_the_file_are_taken(tmp_path: Path) -> None:
    soup = read_soup(written(tmp_path, "ball.ply", ply(np.column_stack([BALL, -2 * BALL]), "x y z nx ny nz")))
    np.testing.assert_allclose(soup.normals, -BALL, atol=1e-6)
    corners = soup.positions[soup.faces]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert (np.einsum("td,td->t", across, corners[:, 0]) < 0).all()


def test_an_obj_file_of_points(tmp_path: Path) -> None:
    coloured = written(tmp_path, "coloured.obj", obj(np.column_stack([BALL, RED / 255])))
    soup = read_soup(coloured)
    assert len(soup.faces) == 2 * COUNT - 4 and (soup.colours == (200, 30, 10)).all()
    normals = [f"vn {x:.9g} {y:.9g} {z:.9g}" for x, y, z in -BALL]
    np.testing.assert_allclose(read_soup(written(tmp_path, "n.obj", obj(BALL, *normals))).normals, -BALL, atol=1e-6)
    too_few = read_soup(written(tmp_path, "few.obj", obj(BALL, *normals[1:])))
    assert (np.einsum("nd,nd->n", too_few.normals, BALL) > 0.9).all()  # which belongs to which is not known


def test_points_of_gltf_are_placed_and_their_colours_linear(tmp_path: Path) -> None:
    soup = read_soup(written(tmp_path, "ball.glb", glb(BALL, np.full((COUNT, 3), 0.5))))
    np.testing.assert_allclose(soup.positions, BALL + np.array([0, 5, 0]), atol=1e-6)
    assert len(soup.faces) == 2 * COUNT - 4
    assert np.abs(soup.colours.astype(int) - 188).max() <= 1  # sRGB of half the light


def test_points_beside_triangles_are_not_drawn(tmp_path: Path) -> None:
    soup = read_soup(written(tmp_path, "both.ply", ply(BALL, "x y z", faces="3 0 1 2\n")))
    assert len(soup.faces) == 1


def test_points_that_are_not_finite_are_left_out_and_told(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    points = np.concatenate([BALL, [[np.nan, 0, 0], [0, np.inf, 0]], BALL[:7]])  # the last are there twice
    with caplog.at_level(logging.WARNING):
        soup = read_soup(written(tmp_path, "holes.ply", ply(points, "x y z")))
    assert len(soup.positions) == COUNT
    assert "2 of 409 points have NaN or infinite coordinates; left out" in caplog.text


@pytest.mark.parametrize(
    ("points", "defect"),
    [
        (BALL[:2], "no faces, and fewer than three points; lines alone are not drawn"),
        (np.tile(BALL[:1], (9, 1)), "no faces, and fewer than three points; lines alone are not drawn"),
        (np.arange(20)[:, None] * np.array([[1.0, 2, 3]]), "no faces, and no surface passes through its 20 points"),
    ],
)
@pytest.mark.parametrize("suffix", [".ply", ".obj"])
def test_points_without_a_surface(tmp_path: Path, points: NDArray[np.float64], defect: str, suffix: str) -> None:
    file = written(tmp_path, f"few{suffix}", ply(points, "x y z") if suffix == ".ply" else obj(points))
    with pytest.raises(InputError) as caught:
        read_soup(file)
    assert str(caught.value) == f"{file}: {defect}"


@pytest.mark.parametrize(("size", "defect"), [(1e300, "out of range"), (1e-300, "out of range")])
def test_points_of_any_size_are_judged_as_meshes_are(tmp_path: Path, size: float, defect: str) -> None:
    file = written(tmp_path, "ball.obj", obj(size * BALL))
    with pytest.raises(InputError, match=defect):
        load_mesh(file)


def test_a_truncated_file_of_points(tmp_path: Path) -> None:
    data = ply(BALL, "x y z")
    file = written(tmp_path, "cut.ply", data[: data.rindex(b"\n", 0, -200)])
    with pytest.raises(InputError, match=r"cut\.ply: .*PLY"):
        read_soup(file)


def test_points_on_no_surface_are_told(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    line = np.linspace([3, 0, 0], [9, 0, 0], 50)
    with caplog.at_level(logging.WARNING):
        read_soup(written(tmp_path, "ball.obj", obj(BALL)))
        assert not caplog.text
        read_soup(written(tmp_path, "both.obj", obj(np.concatenate([BALL, line]))))
    assert "of 450 points are on no surface, and not shown" in caplog.text


SPLATS = "x y z nx ny nz f_dc_0 f_dc_1 f_dc_2 f_rest_0 opacity scale_0 scale_1 scale_2 rot_0 rot_1 rot_2 rot_3"


def splats(
    centres: NDArray[np.float64], opacity: NDArray[np.float64], dc: tuple[float, float, float]
) -> NDArray[np.float64]:
    """Return the columns `SPLATS` of Gaussian splats of one colour, as 3DGS writes them: without normals."""
    columns = np.zeros((len(centres), 18))
    columns[:, :3], columns[:, 6:9], columns[:, 10], columns[:, 14] = centres, dc, opacity, 1
    return columns


def test_gaussian_splats_are_a_surface_through_the_opaque_ones(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    haze = 5 * BALL[::8]  # which would pull the surface apart
    opacity = np.r_[np.full(COUNT, 0.5), np.full(len(haze), -0.5)]
    data = splats(np.vstack([BALL, haze]), opacity, (1.0, 0.0, -5.0))
    file = written(tmp_path, "splats.ply", ply(data, SPLATS))
    with caplog.at_level(logging.WARNING):
        mesh = load_mesh(file)
    share = f"the {COUNT} of {COUNT + len(haze)} that are at least half opaque"
    told = f"Gaussian splats, drawn as the surface through the centres of {share}"
    assert caplog.messages == [f"{file}: {told}"]
    assert len(mesh.positions) == COUNT and np.ptp(mesh.positions, axis=0).max() < 2.01
    # 0.5 + 0.28209 · f_dc of 255, cut off at 0
    assert (mesh.colours == (199, 128, 0)).all() and mesh.is_unlit
    caplog.clear()
    assert load_mesh(file, coarse=True).is_unlit and not caplog.messages  # it is told with the whole mesh
    head = read_head(file)
    assert head.has_splats and not read_head(written(tmp_path, "scan.ply", ply(BALL, "x y z"))).has_splats
    double = ply(data, SPLATS).replace(b"property float", b"property double")
    assert read_head(written(tmp_path, "double.ply", double)).has_splats
    few = written(tmp_path, "few.ply", ply(data[COUNT - 2 : COUNT + 5], SPLATS))
    with pytest.raises(InputError) as error:
        load_mesh(few)
    assert str(error.value) == f"{few}: {told.replace(f'{COUNT} of {COUNT + len(haze)}', '2 of 7')}; that is too few"


def test_splats_may_have_no_opacity_and_usual_colours(tmp_path: Path) -> None:
    data = np.column_stack([BALL, RED, np.zeros((COUNT, 3))])
    file = written(tmp_path, "splats.ply", ply(data, "x y z red green blue f_dc_0 f_dc_1 f_dc_2"))
    mesh = load_mesh(file)
    assert len(mesh.positions) == COUNT and (mesh.colours == (200, 30, 10)).all()


def test_compressed_splats_are_told(tmp_path: Path) -> None:
    names = "".join(f"property uint packed_{name}\n" for name in ("position", "rotation", "scale", "color"))
    head = f"ply\nformat binary_little_endian 1.0\nelement vertex 4\n{names}end_header\n"
    file = written(tmp_path, "packed.ply", head.encode() + bytes(64))
    with pytest.raises(InputError, match=r"Gaussian splats that are compressed; save them as an uncompressed"):
        load_mesh(file)
