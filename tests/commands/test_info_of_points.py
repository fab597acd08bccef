"""What `info` says of scans of points, without making the surface through them."""

from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from depthwalk.commands.cli import app
from glb_files import Glb
from las_files import write_las

COUNT = 100
POINTS = np.random.default_rng(1).uniform(0, [2, 3, 4], (COUNT, 3))
COLOURED = "property uchar red\nproperty uchar green\nproperty uchar blue\n"
NORMALS = "property float nx\nproperty float ny\nproperty float nz\n"


def rows(path: Path) -> dict[str, str]:
    done = CliRunner().invoke(app, ["info", str(path)])
    assert done.exit_code == 0, done.stderr
    return {line[:24].strip(): line[25:] for line in done.stdout.splitlines()}


def ply(path: Path, more: str, text: str, points: np.ndarray = POINTS) -> Path:
    places = "property float x\nproperty float y\nproperty float z\n"
    lines = "".join(f"{x:.9g} {y:.9g} {z:.9g}{text}\n" for x, y, z in points)
    path.write_text(f"ply\nformat ascii 1.0\nelement vertex {len(points)}\n{places}{more}end_header\n{lines}")
    return path


@pytest.fixture(autouse=True)
def without_surface(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("depthwalk.geometry.point_surface.point_surface", lambda *_: pytest.fail("a surface is made"))


def test_a_scan_says_what_it_is(tmp_path: Path) -> None:
    found = rows(ply(tmp_path / "a.ply", COLOURED, " 1 2 3"))
    assert found["kind"] == "scan of points, of which the surface through them is drawn"
    assert found["points"] == "100" and found["colours"] == "one for each point"
    assert found["normals"] == "none; they are found from the points"
    assert "triangles" not in found and "vertices" not in found
    size = [float(number) for number in found["size"].removesuffix(" m").split(" × ")]
    np.testing.assert_allclose(size, np.ptp(POINTS, axis=0), rtol=1e-4)


def test_normals_and_points_that_are_left_out(tmp_path: Path) -> None:
    points = np.concatenate([POINTS, POINTS[:3], [[np.nan, 0, 0]]])
    found = rows(ply(tmp_path / "a.ply", NORMALS, " 0 0 1", points))
    assert found["points"] == "100, without 4 that are not finite or at the place of another"
    assert found["colours"] == "none" and found["normals"] == "one for each point"


def test_an_obj_and_a_gltf_file_of_points(tmp_path: Path) -> None:
    (tmp_path / "a.obj").write_text("".join(f"v {x} {y} {z}\n" for x, y, z in POINTS))
    assert rows(tmp_path / "a.obj")["points"] == "100"
    glb = Glb()
    glb.mesh({"POSITION": glb.accessor(POINTS), "NORMAL": glb.accessor(POINTS)}, None, mode=0)
    found = rows(glb.write(tmp_path / "a.glb"))
    assert found["points"] == "100" and found["normals"] == "one for each point" and "not read" not in found


def test_points_beside_triangles_are_listed(tmp_path: Path) -> None:
    glb = Glb()
    glb.mesh({})
    glb.mesh({"POSITION": glb.accessor(POINTS)}, None, mode=0)
    found = rows(glb.write(tmp_path / "a.glb", {"mesh": 0}, {"mesh": 1}))
    assert found["kind"] == "mesh" and found["triangles"] == "2" and found["not read"] == "100 points"


@pytest.mark.slow
def test_a_laser_scan(tmp_path: Path) -> None:
    found = rows(write_las(tmp_path / "a.laz", POINTS))
    assert found["points"] == "100" and found["colours"] == "none" and "unit" not in found


def test_a_scene_counts_triangles_and_points(tmp_path: Path) -> None:
    ply(tmp_path / "scan.ply", "", "")
    (tmp_path / "face.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    scene = tmp_path / "a.yaml"
    scene.write_text(
        "version: 1\nassets:\n  scan: {mesh: scan.ply}\n  face: {mesh: face.obj}\n"
        "objects:\n  - {asset: scan}\n  - {asset: scan, position: [9, 0, 0]}\n  - {asset: face}\n"
    )
    found = rows(scene)
    assert found["made of"] == "1 triangle and 200 points"
    assert found["asset scan"] == "scan.ply, 2 objects of 100 points"
