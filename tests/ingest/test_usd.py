"""USD files as meshes."""

import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from typer.testing import CliRunner

from depthwalk.commands.cli import app
from depthwalk.errors import InputError
from depthwalk.ingest.loader import load_mesh
from depthwalk.ingest.mesh_head import read_head
from depthwalk.ingest.reader import read_soup
from depthwalk.ingest.soup import Soup
from usd_files import material, mesh, prim, translate_here, write_usda, xform

BOUND = "rel material:binding = </World/Skin>"
BIND = 'prepend apiSchemas = ["MaterialBindingAPI"]'
SQUARE = "(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0)"
UV = 'texCoord2f[] primvars:st = [(0, 0), (1, 0), (1, 1), (0, 1)] (\ninterpolation = "vertex"\n)'
RED = np.array([255, 0, 0])


@pytest.fixture(autouse=True)
def _here(monkeypatch: pytest.MonkeyPatch) -> None:
    translate_here(monkeypatch)


def corners(soup: Soup) -> np.ndarray:
    """The triangles (F, 3, 3), in the order of their middles."""
    found = soup.positions[soup.faces]
    return found[np.lexsort(found.mean(axis=1).round(4).T)]


def square(*lines: str) -> str:
    return mesh("square", *lines, points=SQUARE, faces="0, 1, 2, 3", sizes="4")


def described(path: Path) -> str:
    run = CliRunner().invoke(app, ["info", str(path)])
    assert run.exit_code == 0, run.stderr
    return run.stdout


def test_transforms_the_axis_and_the_unit_are_applied(tmp_path: Path) -> None:
    body = xform("World", xform("a", mesh(), translate="(100, 0, 0)", scale="(2, 2, 2)"))
    soup = read_soup(write_usda(tmp_path / "a.usda", body, up="Z", unit=0.01))
    np.testing.assert_allclose(soup.positions.min(axis=0), [1, 0, -0.04], atol=1e-6)
    np.testing.assert_allclose(soup.positions.max(axis=0), [1.02, 0.06, 0], atol=1e-6)


def test_left_handed_faces_are_turned_and_mirrored_ones_stay_outside(tmp_path: Path) -> None:
    right = read_soup(write_usda(tmp_path / "a.usda", xform("World", mesh())))
    left = read_soup(
        write_usda(tmp_path / "b.usda", xform("World", mesh("m", 'uniform token orientation = "leftHanded"')))
    )
    np.testing.assert_array_equal(np.sort(left.faces[:, ::-1].ravel()), np.sort(right.faces.ravel()))
    mirrored = read_soup(write_usda(tmp_path / "c.usda", xform("World", mesh(), scale="(-1, 1, 1)")))
    volumes = [np.linalg.det(soup.positions[soup.faces]).sum() for soup in (right, left, mirrored)]
    assert volumes == pytest.approx([6, -6, 6])


def test_concave_faces_are_cut_at_their_ears_and_holes_left_out(tmp_path: Path) -> None:
    points = "(0, 0, 0), (4, 0, 0), (4, 4, 0), (2, 1, 0), (0, 4, 0), (9, 9, 9)"
    body = mesh("m", "int[] holeIndices = [1]", points=points, faces="0, 1, 2, 3, 4, 0, 1, 5", sizes="5, 3")
    a, b, c = np.moveaxis(corners(read_soup(write_usda(tmp_path / "a.usda", xform("World", body)))), 1, 0)
    areas = np.cross(b - a, c - a)[:, 2] / 2
    assert len(areas) == 3 and (areas > 0).all() and areas.sum() == pytest.approx(10)


def test_what_is_hidden_or_meant_for_editing_is_left_out(tmp_path: Path) -> None:
    hidden = xform("hidden", 'token visibility = "invisible"', mesh())
    guides = [prim("Xform", kind, f'uniform token purpose = "{kind}"', mesh()) for kind in ("guide", "proxy", "render")]
    unused = prim("Mesh", "none").replace("def", "class")
    body = xform("World", hidden, *guides, unused, mesh("off").replace("(\n", "(\nactive = false\n", 1))
    assert len(read_soup(write_usda(tmp_path / "a.usda", body)).faces) == 4


@pytest.mark.parametrize(
    ("interpolation", "colours", "first"),
    [
        ("constant", "(1, 0, 0)", 12),
        ("uniform", "(1, 0, 0), (0, 0, 1), (0, 0, 1), (0, 0, 1)", 3),
        ("vertex", "(1, 0, 0), (0, 0, 1), (0, 0, 1), (0, 0, 1)", 3),
        ("faceVarying", ", ".join(["(1, 0, 0)"] * 5 + ["(0, 0, 1)"] * 7), 5),
    ],
)
def test_colours_by_each_interpolation(tmp_path: Path, interpolation: str, colours: str, first: int) -> None:
    body = mesh("m", f'color3f[] primvars:displayColor = [{colours}] (\ninterpolation = "{interpolation}"\n)')
    soup = read_soup(write_usda(tmp_path / "a.usda", xform("World", body)))
    assert (soup.colours[soup.faces.ravel()] == RED).all(axis=1).sum() == first


def test_colours_by_index_and_normals_of_faces(tmp_path: Path) -> None:
    terms = '(\nelementSize = 1\ninterpolation = "vertex"\n)'
    colours = f"color3f[] primvars:displayColor = [(1, 0, 0), (0, 0, 1)] {terms}"
    normals = 'normal3f[] normals = [(0, 0, 5), (0, 1, 0), (1, 0, 0), (0, 0, 0)] (\ninterpolation = "uniform"\n)'
    body = mesh("m", colours, "int[] primvars:displayColor:indices = [1, 1, 1, 0]", normals)
    soup = read_soup(write_usda(tmp_path / "a.usda", xform("World", body, scale="(1, 2, 1)")))
    assert (soup.colours[soup.faces.ravel()] == RED).all(axis=1).sum() == 3
    np.testing.assert_allclose(soup.normals[soup.faces[0]], [[0, 0, 1]] * 3)
    assert np.isnan(soup.normals[soup.faces[3]]).all()


def test_materials_are_those_of_glTF(tmp_path: Path) -> None:
    inputs = [
        "color3f inputs:diffuseColor = (1, 0.5, 0)",
        "float inputs:opacity = 0.25",
        "color3f inputs:emissiveColor = (0, 4, 0)",
        "float inputs:roughness = 0.2",
        "float inputs:metallic = 1",
    ]
    body = xform("World", square(BOUND).replace("(\n", f"(\n{BIND}\n", 1), material("Skin", *inputs))
    path = write_usda(tmp_path / "a.usda", body)
    (found,) = load_mesh(path).materials
    assert found.base_colour == pytest.approx((1, 0.5, 0), abs=0.005) and found.opacity == pytest.approx(
        0.25, abs=0.005
    )
    assert found.emission == pytest.approx((0, 4, 0)) and found.specular == pytest.approx(0.8, abs=0.01)
    head = read_head(path)
    assert head.files == (path,) and head.is_all_translucent and head.has_glow and not head.is_textured


@pytest.mark.parametrize("packed", [False, True])
def test_textures_are_found_beside_the_file_and_in_archives(tmp_path: Path, packed: bool) -> None:
    pixels = np.zeros((2, 2, 4), np.uint8)
    pixels[0, 0] = 255, 0, 0, 255  # the corner where u is 0 and v is 1
    Image.fromarray(pixels).save(tmp_path / "skin.png")
    inputs = [
        "color3f inputs:diffuseColor.connect = <OWN/C.outputs:rgb>",
        "float inputs:opacity.connect = <OWN/C.outputs:a>",
        "float inputs:opacityThreshold = 0.5",
    ]
    skin = material("Skin", *inputs, textures="C=./skin.png")
    path = write_usda(tmp_path / "a.usda", xform("World", square(BOUND, UV).replace("(\n", f"(\n{BIND}\n", 1), skin))
    if packed:
        from pxr import UsdUtils

        assert UsdUtils.CreateNewUsdzPackage(str(path), str(tmp_path / "a.usdz"))
        path.unlink()
        (tmp_path / "skin.png").unlink()
        path = tmp_path / "a.usdz"
    mesh_read = load_mesh(path)
    (found,) = mesh_read.materials
    assert found.texture is not None and found.cutoff == pytest.approx(0.5)
    np.testing.assert_array_equal(found.texture, pixels)
    soup = read_soup(path)
    np.testing.assert_allclose(soup.uv, soup.positions[:, :2] / 2)


def test_alpha_and_roughness_come_from_pictures_of_their_own(tmp_path: Path) -> None:
    Image.new("RGB", (4, 4), (0, 255, 0)).save(tmp_path / "colour.jpg", quality=95)
    Image.new("L", (2, 2), 128).save(tmp_path / "half.png")
    Image.new("L", (2, 2), 51).save(tmp_path / "rough.png")
    inputs = [
        "color3f inputs:diffuseColor.connect = <OWN/C.outputs:rgb>",
        "float inputs:opacity.connect = <OWN/A.outputs:r>",
        "float inputs:roughness.connect = <OWN/R.outputs:r>",
        "float inputs:metallic = 1",
    ]
    skin = material("Skin", *inputs, textures="C=./colour.jpg A=./half.png R=./rough.png")
    body = xform("World", square(BOUND, UV).replace("(\n", f"(\n{BIND}\n", 1), skin)
    (found,) = load_mesh(write_usda(tmp_path / "a.usda", body)).materials
    assert found.texture is not None and found.texture.shape == (4, 4, 4)
    assert (found.texture[..., 3] == 128).all() and (abs(found.texture[..., 1].astype(int) - 255) < 3).all()
    assert found.specular == pytest.approx(0.8, abs=0.01)


def test_subsets_have_materials_of_their_own(tmp_path: Path) -> None:
    part = prim(
        "GeomSubset", "part", 'uniform token elementType = "face"', 'uniform token familyName = "materialBind"',
        "int[] indices = [1, 2]", BOUND, terms=BIND,
    )  # fmt: skip
    skin = material("Skin", "color3f inputs:diffuseColor = (0, 0, 1)")
    soup = read_soup(write_usda(tmp_path / "a.usda", xform("World", mesh("m", part), skin)))
    blue = [each.base_colour == pytest.approx((0, 0, 1)) for each in soup.materials]
    assert np.count_nonzero(np.array(blue)[soup.material]) == 2


def test_copies_are_where_instances_and_points_place_them(tmp_path: Path) -> None:
    write_usda(tmp_path / "parts" / "wedge.usda", xform("World", xform("a", mesh(), translate="(0, 0, 1)")))
    reference = "instanceable = true\nreferences = @./parts/wedge.usda@"
    instance = xform("one", terms=reference, translate="(10, 0, 0)")
    points = prim(
        "PointInstancer", "points", "rel prototypes = [</World/points/p>]", "int[] protoIndices = [0, 0, 0]",
        "point3f[] positions = [(0, 5, 0), (0, 6, 0), (0, 7, 0)]",
        "float3[] scales = [(1, 1, 1), (2, 2, 2), (1, 1, 1)]",
        "quath[] orientations = [(1, 0, 0, 0), (0.7071, 0, 0.7071, 0), (1, 0, 0, 0)]", "int64[] invisibleIds = [2]",
        xform("p", terms="references = @./parts/wedge.usda@", translate="(0, 0, 100)"),
    )  # fmt: skip
    soup = read_soup(write_usda(tmp_path / "a.usda", xform("World", instance, points, mesh("alone"))))
    assert len(soup.faces) == 4 * 4
    wedge = np.array([(0, 0, 0), (1, 0, 0), (0, 2, 0), (0, 0, 3)])
    turned = 2 * (wedge + np.array([0, 0, 101])) @ np.array([(0, 0, -1), (0, 1, 0), (1, 0, 0)]) + np.array([0, 6, 0])
    wanted = np.concatenate([wedge + np.array([10, 0, 1]), wedge + np.array([0, 5, 101]), turned, wedge])
    found = np.unique(soup.positions.round(3), axis=0)
    np.testing.assert_allclose(found, np.unique(wanted.round(3), axis=0), atol=2e-3)


def test_what_is_not_read_is_told(tmp_path: Path) -> None:
    others = [prim("Points", "dots"), prim("Sphere", "ball"), prim("BasisCurves", "hair"), prim("RectLight", "lamp")]
    cage = mesh().replace('"none"', '"catmullClark"')
    text = described(write_usda(tmp_path / "a.usda", xform("World", cage, *others)))
    for each in (
        "1 subdivision surface but for its cage",
        "1 set of points",
        "1 sphere",
        "1 set of curves",
        "1 RectLight",
    ):
        assert each in text


def test_cameras_and_lights_that_copies_share_are_told(tmp_path: Path) -> None:
    write_usda(tmp_path / "room.usda", xform("World", mesh(), prim("SphereLight", "lamp"), prim("Camera", "eye")))
    body = xform("World", xform("room", terms="instanceable = true\nreferences = @./room.usda@"))
    text = described(write_usda(tmp_path / "a.usda", body))
    assert "1 light in a copy" in text and "1 camera in a copy" in text


def test_a_damaged_picture_and_shaders_in_a_circle_are_told(tmp_path: Path) -> None:
    noise = np.random.default_rng(0).integers(0, 255, (32, 32), np.uint8)
    Image.fromarray(noise).save(tmp_path / "rough.png")
    (tmp_path / "rough.png").write_bytes((tmp_path / "rough.png").read_bytes()[:-300])
    skin = material("Skin", "float inputs:roughness.connect = <OWN/R.outputs:r>", textures="R=./rough.png")
    body = xform("World", square(BOUND, UV).replace("(\n", f"(\n{BIND}\n", 1), skin)
    with pytest.raises(InputError, match=r"a\.usda: the picture @\./rough\.png@ is damaged"):
        load_mesh(write_usda(tmp_path / "a.usda", body))
    turned = 'uniform token info:id = "UsdTransform2d"\nfloat2 inputs:in.connect = <OWN/Reader.outputs:result>'
    circle = turned.replace("OWN", "/World/Skin")
    assert 'uniform token info:id = "UsdPrimvarReader_float2"' in body
    body = body.replace('uniform token info:id = "UsdPrimvarReader_float2"', circle)
    with pytest.raises(InputError, match=r"a\.usda: a shader reads what it makes itself, in a circle"):
        load_mesh(write_usda(tmp_path / "a.usda", body))


CASES = {
    "index": (mesh(faces="0, 9, 1", sizes="3"), "/World/mesh: faceVertexIndices refers to point 9 of 0 to 3"),
    "count": (mesh(sizes="3, 3"), "/World/mesh: faceVertexCounts add up to 6 corners, faceVertexIndices lists 12"),
    "negative": (mesh(sizes="-3, 15"), "/World/mesh: faceVertexCounts has -3, which is no number of corners"),
    "missing": (prim("Xform", "a", terms="references = @./x.usda@"), "/World/a: refers to @x.usda@, which is missing"),
    "cycle": (prim("Xform", "a", terms="references = @./cycle.usda@"), "/World/a/a: refers to itself, in a circle"),
    "outside": (
        prim("Xform", "a", terms="payload = @../other.usda@"),
        "/World/a refers to @../other.usda@, outside the folder of the file",
    ),
    "prototype": (
        prim("PointInstancer", "p", "int[] protoIndices = [3]", "point3f[] positions = [(0, 0, 0)]"),
        "/World/p: protoIndices refers to prototype 3 of 0",
    ),
    "within": (
        prim(
            "PointInstancer", "p", "rel prototypes = [</World>]", "int[] protoIndices = [0]",
            "point3f[] positions = [(0, 0, 0)]",
        ),
        "is a copy within itself",
    ),
    "syntax": ("def Xform {", "line 8: parse error"),
    "nothing": ("", "no faces; its scene shows neither triangles nor points"),
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_defects_are_told_in_one_line_with_their_prim(tmp_path: Path, name: str) -> None:
    body, said = CASES[name]
    path = write_usda(tmp_path / f"{name}.usda", body if name == "syntax" else xform("World", body))
    with pytest.raises(InputError) as raised:
        read_soup(path)
    assert said in str(raised.value) and str(raised.value).startswith(f"{path}: ") and "\n" not in str(raised.value)


def test_pictures_outside_the_folder_are_refused_and_missing_ones_left_out(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    Image.new("RGB", (1, 1)).save(tmp_path / "outside.png")
    for name in (str(tmp_path / "outside.png"), "../outside.png", "./none.png"):
        skin = material("Skin", "color3f inputs:diffuseColor.connect = <OWN/C.outputs:rgb>", textures=f"C={name}")
        body = xform("World", square(BOUND, UV).replace("(\n", f"(\n{BIND}\n", 1), skin)
        path = write_usda(tmp_path / "scene" / "a.usda", body)
        if name == "./none.png":
            assert load_mesh(path).materials[0].texture is None
            assert "/World/Skin/C: the picture @./none.png@ is missing; ignored" in caplog.text
        else:
            with pytest.raises(InputError, match=re.escape(f"refers to the picture @{name}@, outside the folder")):
                load_mesh(path)


def test_other_formats_and_unselected_variants_are_not_opened(tmp_path: Path) -> None:
    variants = 'variants = {\nstring a = "x"\n}\nprepend variantSets = "a"'
    chosen = 'variantSet "a" = {\n"x" {\n}\n"y" (\nreferences = @./none.usda@\n) {\n}\n}'
    body = xform(
        "World", mesh(), prim("Xform", "v", chosen, terms=variants), prim("Xform", "a", terms="references = @./a.abc@")
    )
    text = described(write_usda(tmp_path / "a.usda", body))
    assert "1 set of variants but for the selected one" in text and "1 reference to a .abc file" in text


def test_too_many_copies_for_one_mesh_ask_for_a_conversion(tmp_path: Path) -> None:
    positions = ", ".join(["(0, 0, 0)"] * 20_001)
    points = prim(
        "PointInstancer", "points", "rel prototypes = [</World/points/p>]",
        f"int[] protoIndices = [{', '.join(['0'] * 20_001)}]", f"point3f[] positions = [{positions}]",
        xform("p", mesh()),
    )  # fmt: skip
    with pytest.raises(InputError, match="its copies are too many for one mesh; `depthwalk convert`"):
        read_soup(write_usda(tmp_path / "a.usda", xform("World", points)))
