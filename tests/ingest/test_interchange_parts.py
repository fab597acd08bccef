"""What single formats have: joints, pivots, strips, layers, materials of several programs."""

import io
import re
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from depthwalk.commands.cli import app
from depthwalk.geometry.triangulation import triangulated
from depthwalk.ingest.interchange.model import Polygons, posed
from depthwalk.ingest.interchange.reader import parse
from depthwalk.ingest.reader import read_soup
from depthwalk.ingest.soup import Soup, unit_normals
from fuzz.dae_files import dae, skinned_dae
from fuzz.fbx_files import fbx, skinned_fbx
from fuzz.small_scenes import Paint, Use, cube
from fuzz.three_ds_files import three_ds
from fuzz.three_mf_files import zipped

BOX = [Use(name="a", shape=cube(), paint=Paint(name="a", picture="skin.png"))]


def read(folder: Path, name: str, data: bytes | str) -> Soup:
    (path := folder / name).write_bytes(data if isinstance(data, bytes) else data.encode())
    return read_soup(path)


def png(colour: tuple[int, ...] = (10, 20, 30)) -> bytes:
    Image.new("RGBA" if len(colour) == 4 else "RGB", (4, 4), colour).save(file := io.BytesIO(), "PNG")
    return file.getvalue()


def areas(positions: NDArray[np.float64], triangles: NDArray[np.int64]) -> NDArray[np.float64]:
    first, second, third = positions[triangles].transpose(1, 0, 2)
    return np.asarray(np.cross(second - first, third - first)[:, 2] / 2)


@pytest.mark.parametrize(("name", "data"), [("a.dae", skinned_dae()), ("a.fbx", skinned_fbx())])
def test_joints_hold_the_vertices_of_skins(tmp_path: Path, name: str, data: bytes) -> None:
    soup = read(tmp_path, name, data)
    places = np.unique(soup.positions[soup.faces].reshape(-1, 3), axis=0)
    # Of the upper corners one hangs on the joint alone, which has risen by 2, and the other half on each.
    np.testing.assert_allclose(places, [[0, 0, 0], [0, 2, 0], [1, 0, 0], [1, 3, 0]], atol=1e-12)


def test_concave_polygons_are_cut_within(tmp_path: Path) -> None:
    comb = np.array([[0, 0], [6, 0], [6, 3], [5, 3], [4, 1], [3, 3], [2, 1], [1, 3], [0, 3]], np.float64)
    for outline in (comb, comb[::-1], np.roll(comb, 4, axis=0)):
        flat = np.column_stack([outline, np.zeros(len(outline))])
        triangles, polygon = triangulated(flat, np.array([len(flat)]))
        found = areas(flat, triangles)
        x, y = outline.T
        whole = (x * np.roll(y, -1) - y * np.roll(x, -1)).sum() / 2
        assert (found * np.sign(whole) > 0).all() and found.sum() == pytest.approx(whole)
        assert (polygon == 0).all() and len(triangles) == len(flat) - 2


def test_polygons_that_cross_themselves_are_still_cut() -> None:
    star = np.array([[np.cos(a), np.sin(a), 0] for a in 4 * np.pi * np.arange(5) / 5])
    triangles, _ = triangulated(star, np.array([5]))
    assert triangles.shape == (3, 3) and set(triangles.ravel().tolist()) == set(range(5))


@pytest.mark.parametrize(
    ("element", "expected"),
    [
        ("<tristrips count='1'>{}<p>0 1 3 2</p></tristrips>", [[0, 1, 3], [1, 2, 3]]),
        ("<trifans count='1'>{}<p>0 1 2 3</p></trifans>", [[0, 1, 2], [0, 2, 3]]),
        ("<triangles count='2'>{}<p>0 1 2 0 2 3</p></triangles>", [[0, 1, 2], [0, 2, 3]]),
        ("<polygons count='2'>{}<p>0 1 2</p><ph><p>0 2 3</p></ph></polygons>", [[0, 1, 2], [0, 2, 3]]),
    ],
)
def test_polygons_of_collada(tmp_path: Path, element: str, expected: list[list[int]]) -> None:
    text = skinned_dae().decode()
    text = re.sub("<polygons.*</polygons>", element.format('<input semantic="VERTEX" source="#v" offset="0"/>'), text)
    text = re.sub("<library_controllers>.*</library_controllers>", "", text, flags=re.DOTALL)
    text = text.replace("instance_controller", "instance_geometry").replace('url="#c"', 'url="#g"')
    soup = read(tmp_path, "a.dae", text)
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]]) + 9
    found = [
        [int(np.flatnonzero((square == place).all(axis=1))[0]) for place in soup.positions[face]] for face in soup.faces
    ]
    assert sorted(min(face[k:] + face[:k] for k in range(3)) for face in found) == expected


def test_collada_by_other_programs(tmp_path: Path) -> None:
    (tmp_path / "my skin.png").write_bytes(png())
    text = next(iter(dae(BOX, {"skin.png": b""}).values())).decode()
    text = text.replace(
        "<init_from>skin.png</init_from>\n</image>", "<init_from>file:///C:/x/my%20skin.png</init_from></image>"
    )
    text = text.replace("<float>32.0</float>", "<float>64,5</float>")  # a decimal comma
    through = '<transparent opaque="RGB_ZERO"><color>.5 .5 .5 1</color></transparent>'
    assert "<transparency>\n<float>1.0" in text
    text = text.replace("<transparency>\n<float>1.0", f"{through}<transparency><float>.5")
    (material,) = read(
        tmp_path, "a.dae", text.replace("<specular>\n<color>0 0 0", "<specular><color>.1 .2 .3")
    ).materials
    assert material.texture is not None and material.texture[0, 0, :3].tolist() == [10, 20, 30]
    assert material.shininess == 64.5 and material.specular == pytest.approx(0.3)
    assert material.opacity == pytest.approx(0.75, abs=1e-3)


@pytest.mark.parametrize("prop", ["TransparentColor", "3dsMax|Parameters|TransparencyFactor"])
def test_the_alpha_of_the_picture_of_colours_cuts_out(tmp_path: Path, prop: str) -> None:
    text = next(iter(fbx(BOX, {}, text=True).values())).decode()
    link = re.findall(r'C: "OP", (\d+), (\d+), "DiffuseColor"', text)[0]
    (tmp_path / "skin.png").write_bytes(png((10, 20, 30, 0)))
    assert read(tmp_path, "a.fbx", text).materials[0].cutoff is None
    more = f'C: "OP", {link[0]}, {link[1]}, "{prop}"\n'
    assert (
        read(tmp_path, "a.fbx", text.replace("Connections:  {\n", "Connections: {\n" + more)).materials[0].cutoff == 0.5
    )


def test_physical_materials_and_normal_maps_of_fbx(tmp_path: Path) -> None:
    text = next(iter(fbx(BOX, {}, text=True).values())).decode()
    (tmp_path / "skin.png").write_bytes(png((128, 128, 255)))
    text = text.replace('"DiffuseColor"\n', '"3dsMax|Parameters|norm_map"\n')
    text = text.replace('"DiffuseColor", "Color"', '"3dsMax|Parameters|base_color", "Color"').replace("0.8,", "0.25,")
    (material,) = read(tmp_path, "a.fbx", text).materials
    assert material.texture is None and material.normal_map is not None
    assert material.base_colour == pytest.approx((0.25, 0.25, 0.8))


def test_pivots_and_turns_of_fbx(tmp_path: Path) -> None:
    text = next(iter(fbx(BOX, {}, text=True).values())).decode()
    lines = (
        'P: "RotationActive", "bool", "", "", 1',
        'P: "RotationOrder", "enum", "", "", 5',  # z, then y, then x
        'P: "PreRotation", "Vector3D", "Vector", "", 0, 0, 90',
        'P: "RotationPivot", "Vector3D", "Vector", "", 1, 0, 0',
        'P: "ScalingPivot", "Vector3D", "Vector", "", 1, 0, 0',
        'P: "RotationOffset", "Vector3D", "Vector", "", 0, 0, 5',
        'P: "GeometricTranslation", "Vector3D", "Vector", "", 1, 1, 1',
    )
    text = re.sub(
        r'P: "Lcl Rotation".*', 'P: "Lcl Rotation", "Lcl Rotation", "", "A", 90, 0, 90\n' + "\n".join(lines), text
    )
    text = re.sub(r'P: "Lcl Scaling".*', 'P: "Lcl Scaling", "Lcl Scaling", "", "A", 2, 2, 2', text)
    soup = read(tmp_path, "a.fbx", text)
    # Of the corner (1, 1, 1), by hand: moved to (2, 2, 2), scaled about (1, 0, 0) to (3, 4, 4); about the pivot it is
    # (2, 4, 4), turned about z (−4, 2, 4), about x (−4, −4, 2), and before all about z (4, −4, 2).
    corner = soup.positions[(soup.colours == 255).all(axis=1)]
    np.testing.assert_allclose(corner, np.tile([5.0, -4, 7], (len(corner), 1)), atol=1e-9)


def test_layers_of_fbx(tmp_path: Path) -> None:
    text = next(iter(fbx(BOX, {}, text=True).values())).decode()
    flat = re.sub(
        r"LayerElementColor: 0 \{.*?a: .*?\n\t\t\t\}", 'LayerElementColor: 0 {\n'
        '\t\t\tMappingInformationType: "ByPolygon"\n\t\t\tReferenceInformationType: "Direct"\n\t\t\tColors: *24 {\n'
        f"\t\t\t\ta: {','.join(['1,0,0,1'] * 5 + ['0,0,1,1'])}\n\t\t\t}}",
        text, count=1, flags=re.DOTALL,
    )  # fmt: skip
    colours = read(tmp_path, "a.fbx", flat).colours
    assert (colours == [255, 0, 0]).all(axis=1).sum() == 20 and (colours == [0, 0, 255]).all(axis=1).sum() == 4
    hidden = text.replace('P: "Lcl Scaling"', 'P: "Visibility", "Visibility", "", "A", 0\nP: "Lcl Scaling"')
    with pytest.raises(Exception, match="no faces"):
        read(tmp_path, "a.fbx", hidden)


def test_pictures_of_3d_studio_are_scaled_and_shifted(tmp_path: Path) -> None:
    data = next(iter(three_ds(BOX, {}).values()))
    name = bytes.fromhex("00a3") + (15).to_bytes(4, "little") + b"skin.png\0"
    laid = b"".join(
        kind.to_bytes(2, "little") + (10).to_bytes(4, "little") + np.float32(value).tobytes()
        for kind, value in ((0xA356, 2.0), (0xA354, 3.0), (0xA358, 0.25), (0xA35A, 0.5))
    )
    longer, at = data.replace(name, name + laid), data.index(name)
    starts = 0, data.index(b"\x3d\x3d", 6), data.index(b"\xff\xaf"), data.rindex(b"\x00\xa2", 0, at)
    for start, kind in zip(starts, (0x4D4D, 0x3D3D, 0xAFFF, 0xA200), strict=True):
        assert int.from_bytes(data[start : start + 2], "little") == kind
        length = int.from_bytes(data[start + 2 : start + 6], "little") + len(laid)
        longer = longer[: start + 2] + length.to_bytes(4, "little") + longer[start + 6 :]
    (tmp_path / "skin.png").write_bytes(png())
    before, after = read(tmp_path, "a.3ds", data), read(tmp_path, "b.3ds", longer)
    np.testing.assert_allclose(after.uv, before.uv * [2, 3] + [0.25, 0.5])


def test_colours_of_3mf(tmp_path: Path) -> None:
    model = (
        '<model unit="meter" xmlns:m="m"><resources>'
        '<m:colorgroup id="7"><m:color color="#ff0000"/><m:color color="#00ff0080"/><m:color color="#0000ff"/>'
        "</m:colorgroup>"
        '<basematerials id="8"><base name="b" displaycolor="#102030"/></basematerials>'
        '<object id="1" pid="8" pindex="0"><mesh><vertices>'
        '<vertex x="0" y="0" z="0"/><vertex x="1" y="0" z="0"/><vertex x="0" y="1" z="0"/></vertices><triangles>'
        '<triangle v1="0" v2="1" v3="2" pid="7" p1="0" p2="0" p3="2"/><triangle v1="0" v2="2" v3="1"/>'
        '<triangle v1="1" v2="2" v3="0" pid="7" p1="1"/></triangles></mesh></object>'
        '<object id="2" type="support"><mesh><vertices/><triangles/></mesh></object></resources>'
        '<build><item objectid="1"/><item objectid="2"/></build></model>'
    )
    soup = read(tmp_path, "a.3mf", zipped({"3D/3dmodel.model": model.encode()}))
    assert soup.colours[soup.faces].tolist() == [
        [[255, 0, 0], [255, 0, 0], [0, 0, 255]],
        [[16, 32, 48]] * 3,
        [[0, 255, 0]] * 3,
    ]
    assert [soup.materials[number].opacity for number in soup.material] == [None, None, pytest.approx(128 / 255)]


def test_info_lists_what_is_not_read(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = skinned_fbx().decode()
    more = 'Objects: {\nAnimationStack: 20, "AnimStack::", "" {\n}\nAnimationCurve: 21, "AnimCurve::", "" {\n}\n'
    more += 'NodeAttribute: 22, "NodeAttribute::", "Light" {\n}\nNodeAttribute: 23, "NodeAttribute::", "Camera" {\n}\n'
    (tmp_path / "a.fbx").write_text(text.replace("Objects: {\n", more + more.partition("\n")[2].replace("2", "9")))
    moving = skinned_dae().replace(b"</COLLADA>", b"<library_animations><animation/></library_animations></COLLADA>")
    (tmp_path / "a.dae").write_bytes(moving.replace(b"<translate>9", b'<instance_light url="#x"/><translate>9'))
    cube_only = next(iter(three_ds(BOX, {}).values()))
    (tmp_path / "a.3ds").write_bytes(cube_only)
    for name, expected in (
        ("a.fbx", ("2 animations", "2 cameras", "2 lamps")),
        ("a.dae", ("1 animation", "1 lamp")),
        ("a.3ds", ()),
    ):
        assert parse((tmp_path / name).read_bytes(), tmp_path / name, geometry=False).unread == expected
        with pytest.raises(SystemExit) as ended:
            app(["info", str(tmp_path / name)])
        assert not ended.value.code
        assert (f"not read                 {', '.join(expected)}" in capsys.readouterr().out) == bool(expected)


@pytest.mark.parametrize("scale", [(1, 1, 1), (2, 0.5, 1), (1, 1, -1)])
def test_normals_turn_with_the_joints(scale: tuple[float, float, float]) -> None:
    shape = cube()
    polygons = Polygons(
        positions=shape.positions,
        vertex=shape.vertex,
        sizes=np.array(shape.sizes),
        normals=shape.normals,
        material=np.zeros(6, np.int64),
        names=(None,),
    )
    joint = Use(name="a", shape=shape, paint=Paint(name="a"), moved=(1, 2, 3), turned=(30, 40, 50), scaled=scale).matrix
    rows = np.arange(8).repeat(2)
    found = posed(polygons, rows, np.tile(joint[:3], (16, 1, 1)), np.tile([0.25, 0.5], 8), np.eye(4))
    assert shape.normals is not None and found.normals is not None
    np.testing.assert_allclose(found.positions, shape.positions @ joint[:3, :3].T + joint[:3, 3])
    expected = shape.normals @ np.linalg.inv(joint[:3, :3])
    np.testing.assert_allclose(unit_normals(found.normals), unit_normals(expected), atol=1e-12)
    with pytest.raises(ValueError, match="missing"):
        posed(polygons, rows + 1, np.tile(joint[:3], (16, 1, 1)), np.ones(16), np.eye(4))
