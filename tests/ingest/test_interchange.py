"""FBX, COLLADA, 3D Studio and 3MF files: the same scene is the same in all of them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from depthwalk.errors import InputError
from depthwalk.ingest.loader import load_mesh, measure_mesh
from depthwalk.ingest.mesh_head import is_all_translucent, read_head
from depthwalk.ingest.reader import read_soup
from depthwalk.ingest.soup import Soup
from depthwalk.ingest.units import unit_hint
from fuzz.case import write_files
from fuzz.dae_files import dae
from fuzz.fbx_files import fbx
from fuzz.small_scenes import Paint, Use, cube
from fuzz.three_mf_files import three_mf
from interchange_scenes import WRITERS, picture, scene, written

EACH = pytest.mark.parametrize("kind", WRITERS)


def triangles(soup: Soup) -> NDArray[np.float64]:
    """Return each triangle's corners with texture coordinates if it has a texture, and its colour; sorted."""
    textured = np.array([each.texture is not None for each in soup.materials])[soup.material]
    colours = np.array([each.base_colour for each in soup.materials])[soup.material]
    colours = colours * np.where(
        soup.colours[soup.faces[:, 0]] == 255, 1.0, (soup.colours[soup.faces[:, 0]] / 255) ** 2.2
    )
    corners = np.concatenate([soup.positions[soup.faces], np.nan_to_num(soup.uv[soup.faces])], axis=2)
    corners[~textured, :, 3:] = 0
    first = np.lexsort(corners.round(3).transpose(2, 0, 1)[::-1], axis=1)[:, 0]
    corners = np.stack([corners[np.arange(len(corners)), (first + k) % 3] for k in range(3)], axis=1)
    rows = np.hstack([corners.reshape(len(corners), -1), colours])
    return rows[np.lexsort(rows.round(3).T[::-1])]


@EACH
def test_a_scene_is_the_same_in_every_format(tmp_path: Path, kind: str) -> None:
    pictures = {"skin.png": picture()}
    expected = read_soup(written(tmp_path, "obj", scene(), pictures))
    found = read_soup(written(tmp_path, kind, scene(), pictures))
    np.testing.assert_allclose(triangles(found), triangles(expected), atol=0.02 if "3mf" in kind else 2e-3)
    textured = [each.texture for each in found.materials if each.texture is not None]
    assert len(textured) == 1
    np.testing.assert_array_equal(
        textured[0], next(each.texture for each in expected.materials if each.texture is not None)
    )


@EACH
def test_surfaces_face_outward_with_their_normals(tmp_path: Path, kind: str) -> None:
    mesh = load_mesh(written(tmp_path, kind, scene(), {"skin.png": picture()}))
    first, second, third = mesh.positions[mesh.faces].transpose(1, 0, 2)
    normals = np.cross(second - first, third - first)
    assert ((mesh.normals[mesh.faces] * normals[:, None]).sum(axis=-1) > 0).all()
    expected = load_mesh(written(tmp_path, "obj", scene(), {"skin.png": picture()}))
    for found in (mesh, expected):  # the volume, positive where outsides are outside
        corners = found.positions[found.faces].astype(np.float64)
        assert np.einsum("ni,ni->n", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6 == pytest.approx(
            16.0, rel=0.2
        )


@EACH
def test_the_head_names_the_files_and_what_materials_are(tmp_path: Path, kind: str) -> None:
    pictures = {"skin.png": picture()}
    path = written(tmp_path, kind, scene(), pictures)
    head = read_head(path)
    embedded = "embedded" in kind or "3mf" in kind
    assert head.files == ((path,) if embedded else (path, path.with_name("skin.png")))
    assert head.is_textured and not head.is_translucent and not head.has_glow


@EACH
def test_opacity(tmp_path: Path, kind: str) -> None:
    glass = [replace(use, paint=Paint(name="glass", colour=(0.2, 0.4, 0.1), opacity=0.4)) for use in scene()]
    path = written(tmp_path, kind, glass)
    (material,) = read_soup(path).materials
    assert material.opacity == pytest.approx(0.4, abs=0.01)
    assert is_all_translucent(path)


@pytest.mark.parametrize("kind", [kind for kind in WRITERS if "3mf" not in kind])
def test_highlights(tmp_path: Path, kind: str) -> None:
    shiny = [replace(use, paint=Paint(name="a", specular=0.5, exponent=64)) for use in scene()]
    (material,) = read_soup(written(tmp_path, kind, shiny)).materials
    assert material.specular == pytest.approx(0.5, abs=0.01) and material.shininess == pytest.approx(64, rel=0.01)


@pytest.mark.parametrize("kind", ["fbx", "fbx-text", "dae"])
def test_emission_and_colours_of_vertices(tmp_path: Path, kind: str) -> None:
    glowing = Use(name="a", shape=cube(), paint=Paint(name="a", colour=(1, 1, 1), emission=(0, 0.5, 0.25)))
    path = written(tmp_path, kind, [glowing])
    soup = read_soup(path)
    assert soup.materials[0].emission == pytest.approx((0, 0.5, 0.25)) and read_head(path).has_glow
    np.testing.assert_allclose(soup.colours, (soup.positions / 2 + 0.5) * 255, atol=0.51)


def test_files_say_their_axes_and_units(tmp_path: Path) -> None:
    turned = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])  # from y upward to z upward
    tall = replace(cube(), positions=cube().positions * [1, 2, 3] @ turned.T)
    uses = [Use(name="a", shape=tall, paint=Paint(name="a"))]
    for number, (files, unit) in enumerate(
        (
            (fbx(uses, {}, z_up=True, centimetres=2.54), 0.0254),
            (dae(uses, {}, up="Z_UP", metre=0.5), 0.5),
            (
                three_mf([replace(uses[0], shape=replace(tall, positions=tall.positions @ turned))], {}, unit="inch"),
                0.0254,
            ),
        )
    ):
        (folder := tmp_path / str(number)).mkdir()
        path = write_files(folder, files)
        extent = measure_mesh(path)
        np.testing.assert_allclose(extent.high - extent.low, np.array([2, 4, 6]) * unit, rtol=1e-5)
        assert unit_hint(path, np.full(3, 1e4), "x") == ""
    assert "1e+04 m large" in unit_hint(Path("a.3ds"), np.full(3, 1e4), "x")


@pytest.mark.parametrize("kind", ["fbx", "fbx-text", "dae", "3ds"])
def test_pictures_outside_the_folder_are_not_read(tmp_path: Path, kind: str, caplog: pytest.LogCaptureFixture) -> None:
    (tmp_path / "secret.png").write_bytes(picture())
    for name in ("../secret.png", str(tmp_path / "secret.png"), f"file://{tmp_path}/secret.png"):
        uses = [replace(scene()[0], paint=Paint(name="a", picture=name))]
        (folder := tmp_path / str(len(list(tmp_path.iterdir())))).mkdir()
        made = WRITERS[kind](uses, {name: picture()} if kind == "dae" else {})
        path = write_files(folder, {next(iter(made)): next(iter(made.values()))})
        caplog.clear()
        assert read_soup(path).materials[0].texture is None
        assert "is missing or outside the folder" in caplog.text
        assert read_head(path).files == (path,)


@EACH
def test_damaged_pictures_are_reported(tmp_path: Path, kind: str) -> None:
    path = written(tmp_path, kind, scene(), {"skin.png": b"\x89PNG no picture"})
    with pytest.raises(InputError, match=r"skin\.png: cannot be read as an image"):
        read_soup(path)


@EACH
def test_a_texture_given_by_the_user_replaces_those_of_the_file(tmp_path: Path, kind: str) -> None:
    path = written(tmp_path, kind, scene()[:3], {"skin.png": picture()})
    Image.new("RGB", (2, 2), (9, 8, 7)).save(tmp_path / "other.png")
    mesh = load_mesh(path, texture=tmp_path / "other.png")
    assert mesh.materials[0].texture is not None and mesh.materials[0].texture[0, 0].tolist() == [9, 8, 7, 255]
