"""A coarse mesh of a large file, or the surface through some of its points: where the whole one is, soon."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import cKDTree

from depthwalk.assets import asset_files
from depthwalk.ingest.loader import load_mesh
from depthwalk.ingest.point_cloud import PointCloud
from depthwalk.ingest.preview import coarse_soup, thinned
from depthwalk.ingest.reader import read_soup
from depthwalk.scene.scene import MeshAsset
from files import write_ply
from shapes import box, joined, sphere


@pytest.fixture
def ball(tmp_path: Path) -> Path:
    return write_ply(tmp_path / "ball.ply", joined(sphere(0.5, 200, 100), box(0.2, 0.2, 0.2, (1, 0, 0))))


@pytest.mark.parametrize("cells", [12, 30])
def test_its_surface_lies_within_a_cell_of_the_whole_one(ball: Path, cells: int) -> None:
    soup = read_soup(ball)
    coarse = coarse_soup(soup, cells)
    diagonal = np.sqrt(3) * np.ptp(soup.positions, axis=0).max() / cells
    assert 100 < len(coarse.faces) < len(soup.faces) / 4 and coarse.faces.max() < len(coarse.positions)
    assert (np.sort(np.unique(coarse.faces)) == np.arange(len(coarse.positions))).all()
    whole, kept = cKDTree(soup.positions), cKDTree(coarse.positions)
    assert (whole.query(coarse.positions)[0] == 0).all()  # vertices are some of the file's
    assert kept.query(soup.positions)[0].max() <= diagonal
    # Each triangle once, as it was turned: outward from the ball.
    assert len(np.unique(np.sort(coarse.faces, 1), axis=0)) == len(coarse.faces)
    corners = coarse.positions[coarse.faces]
    of_ball = corners[..., 0].max(1) < 0.6
    outward = np.einsum(
        "ij,ij->i", np.cross(*np.diff(corners, axis=1).transpose(1, 0, 2)), corners.mean(1) - (0, 0.5, 0)
    )
    assert (outward[of_ball] > 0).mean() > 0.9  # a few fold over


def test_colours_and_materials_are_those_of_what_is_kept(ball: Path) -> None:
    soup = read_soup(ball)
    tinted = replace(
        soup,
        colours=(255 * (soup.positions > 0.3)).astype(np.uint8),
        material=(soup.positions[soup.faces[:, 0], 0] > 0.6).astype(np.int64),
        materials=soup.materials * 2,
    )
    coarse = coarse_soup(tinted, 20)
    np.testing.assert_array_equal(coarse.colours, 255 * (coarse.positions > 0.3))
    np.testing.assert_array_equal(coarse.material, coarse.positions[coarse.faces[:, 0], 0] > 0.6)
    assert 0 < coarse.material.mean() < 1


def test_what_lies_within_one_cell_stays_as_it_is(ball: Path) -> None:
    soup = read_soup(ball)
    assert coarse_soup(soup, 1) is soup
    point = replace(soup, positions=np.zeros_like(soup.positions))
    assert coarse_soup(point) is point


def test_vertices_without_a_face_may_be_anything(ball: Path) -> None:
    soup = read_soup(ball)
    with_stray = replace(
        soup,
        positions=np.concatenate([soup.positions, [[np.nan, np.inf, 1e300]]]),
        normals=np.concatenate([soup.normals, soup.normals[:1]]),
        colours=np.concatenate([soup.colours, soup.colours[:1]]),
        uv=np.concatenate([soup.uv, soup.uv[:1]]),
    )
    np.testing.assert_array_equal(coarse_soup(with_stray).positions, coarse_soup(soup).positions)


def test_only_large_files_have_one(ball: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It stands where the whole mesh does, as high."""
    spec = MeshAsset(name="ball", mesh=ball, texture=None, up="z", height=3.0, dpci=None)
    assert asset_files.read_preview(spec) is None
    monkeypatch.setattr(asset_files, "PREVIEWED", ball.stat().st_size)
    preview, whole = asset_files.read_preview(spec), asset_files.read_mesh(spec)
    assert preview is not None and len(preview.faces) <= len(whole.faces)
    np.testing.assert_allclose(preview.bounds, whole.bounds, atol=3.0 / 160 * np.sqrt(3))
    np.testing.assert_array_equal(load_mesh(ball, up="z", height=3.0).faces, whole.faces)


def scanned(folder: Path, count: int = 20_000) -> tuple[PointCloud, Path]:
    """Points spread over a ball of radius 1, with normals and colours of their own, and their PLY file."""
    points = np.random.default_rng(3).normal(size=(count, 3))
    points /= np.linalg.norm(points, axis=1)[:, None]
    colours = np.round(127.5 + 127.5 * points).astype(np.uint8)
    names = [*(f"float {name}" for name in ("x", "y", "z", "nx", "ny", "nz")), "uchar red", "uchar green", "uchar blue"]
    header = "".join(f"property {name}\n" for name in names)
    rows = np.concatenate([np.tile(points, 2).astype("<f4").view(np.uint8), colours], axis=1)
    text = f"ply\nformat binary_little_endian 1.0\nelement vertex {count}\n{header}element face 0\n"
    text += "property list uchar int vertex_indices\nend_header\n"
    (path := folder / "scan.ply").write_bytes(text.encode() + rows.tobytes())
    return PointCloud(points, points, colours), path


def test_of_points_one_in_each_cell_is_kept_with_its_normal_and_colour(tmp_path: Path) -> None:
    cloud, _ = scanned(tmp_path)
    coarse = thinned(cloud, 20)
    assert 800 < len(coarse.positions) < 3000 and coarse.colours is not None
    cells = np.floor((coarse.positions - cloud.positions.min(0)) / (np.ptp(cloud.positions, axis=0).max() / 20))
    assert len(np.unique(np.minimum(cells, 19), axis=0)) == len(coarse.positions)
    assert cKDTree(coarse.positions).query(cloud.positions)[0].max() <= np.sqrt(3) * 2 / 20
    np.testing.assert_array_equal(coarse.normals, coarse.positions)
    np.testing.assert_array_equal(coarse.colours, np.round(127.5 + 127.5 * coarse.positions))


def test_points_that_are_not_finite_are_not_kept(tmp_path: Path) -> None:
    cloud, _ = scanned(tmp_path, 500)
    with_stray = cloud._replace(positions=np.where(np.arange(500)[:, None] == 0, np.inf, cloud.positions))
    assert np.isfinite(thinned(with_stray, 9).positions).all()
    single = PointCloud(np.zeros((3, 3)), np.zeros((3, 3)), None)
    assert thinned(single) is single
    nothing = PointCloud(np.full((3, 3), np.nan), np.zeros((3, 3)), None)
    assert thinned(nothing) is nothing


def test_small_files_of_points_have_a_preview_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, ball: Path) -> None:
    """Their surface takes longer than reading as large a mesh. The preview lies within a cell of it."""
    _, path = scanned(tmp_path)
    spec = MeshAsset(name="scan", mesh=path, texture=None, up="y", height=2.0, dpci=None)
    assert not asset_files.is_large(spec)
    monkeypatch.setattr(asset_files, "PREVIEWED_POINTS", path.stat().st_size)
    monkeypatch.setattr("depthwalk.ingest.preview.thinned.__defaults__", (20,))
    preview, whole = asset_files.read_preview(spec), asset_files.read_mesh(spec)
    assert preview is not None and len(preview.faces) < len(whole.faces) / 5
    assert np.abs(np.linalg.norm(preview.positions - (0, 1, 0), axis=1) - 1).max() < 0.01
    assert cKDTree(preview.positions).query(whole.positions)[0].max() < np.sqrt(3) * 2 / 20
    monkeypatch.setattr(asset_files, "PREVIEWED_POINTS", 0)
    assert not asset_files.is_large(MeshAsset(name="ball", mesh=ball, texture=None, up="y", height=1.0, dpci=None))
    assert not asset_files.is_large(
        MeshAsset(name="none", mesh=tmp_path / "no.ply", texture=None, up="y", height=1.0, dpci=None)
    )


def test_a_preview_warns_of_nothing(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """The whole mesh does, when it is read."""
    cloud, path = scanned(tmp_path, 500)
    text = path.read_bytes().replace(np.float32(cloud.positions[7, 0]).tobytes(), np.float32(np.nan).tobytes())
    path.write_bytes(text)
    load_mesh(path, coarse=True)
    assert not caplog.records
    load_mesh(path)
    assert "NaN" in caplog.text
