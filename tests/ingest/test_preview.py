"""A coarse mesh of a large file: where the whole one is, in a fraction of its triangles."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import cKDTree

from depthwalk.assets import asset_files
from depthwalk.ingest.loader import load_mesh
from depthwalk.ingest.preview import coarse_soup
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
