"""Geometry: counts, frames, normals, colours and parts."""

import logging
import re
import time
from contextlib import nullcontext
from pathlib import Path
from typing import Literal

import numpy as np
import pytest
import trimesh
from PIL import Image
from trimesh.visual.material import PBRMaterial
from trimesh.visual.texture import TextureVisuals

from depthwalk.errors import InputError
from depthwalk.ingest.loader import check_height, check_mesh, load_mesh
from depthwalk.ingest.materials import plain_material
from depthwalk.ingest.mesh import Mesh
from depthwalk.ingest.mesh_head import read_head
from depthwalk.ingest.ply import with_usual_colours
from depthwalk.ingest.reader import read_soup
from depthwalk.types import Array
from files import written

MODELS = Path(__file__).parents[3] / "shared" / "scenes" / "models"
CUBE = """
v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1
f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 4 8 7 3\nf 1 5 8 4\nf 2 3 7 6
"""
TETRAHEDRON = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"


def face_normals(mesh: Mesh) -> Array:
    a, b, c = (mesh.positions[mesh.faces[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)


def test_cube_is_hard_and_split_only_at_its_edges(tmp_path: Path) -> None:
    mesh = load_mesh(written(tmp_path / "cube.obj", CUBE))
    assert mesh.faces.shape == (12, 3) and len(mesh.positions) == 24
    corner = mesh.normals[mesh.faces]
    np.testing.assert_allclose(corner, np.repeat(face_normals(mesh)[:, None], 3, axis=1), atol=1e-6)
    outward = face_normals(mesh) * (mesh.positions[mesh.faces].mean(axis=1) - [0, 0.5, 0])
    assert (outward.sum(axis=1) > 0).all()


@pytest.mark.parametrize("name", ["sphere.stl", "sphere.ply", "sphere.glb"])
def test_sphere_is_smooth_and_keeps_its_vertices(tmp_path: Path, name: str) -> None:
    sphere = trimesh.creation.icosphere(subdivisions=3)
    path = tmp_path / name
    sphere.export(path)
    mesh = load_mesh(path)
    assert len(mesh.faces) == len(sphere.faces) and len(mesh.positions) == len(sphere.vertices)
    radial = mesh.positions - [0, 1, 0]
    assert (np.einsum("ij,ij->i", mesh.normals, radial) / np.linalg.norm(radial, axis=1)).min() > 0.9999


def test_normals_have_no_seam_where_texture_coordinates_split(tmp_path: Path) -> None:
    turns = np.linspace(0, 2 * np.pi, 25)[:-1]
    lines = [f"v {np.cos(t)} {y} {-np.sin(t)}" for y in (0, 1) for t in turns]
    lines += [f"vt {i / 24} {y}" for y in (0, 1) for i in range(25)]
    for i in range(24):
        j = (i + 1) % 24
        lines.append(f"f {i + 1}/{i + 1} {j + 1}/{i + 2} {j + 25}/{i + 27} {i + 25}/{i + 26}")
    mesh = load_mesh(written(tmp_path / "tube.obj", "\n".join(lines)))
    assert len(mesh.positions) == 50  # the seam's two vertices are doubled for their uv
    radial = mesh.positions * [1, 0, 1]
    np.testing.assert_allclose(mesh.normals, radial, atol=1e-6)


def test_normals_are_weighted_by_angle_not_by_the_number_of_triangles(tmp_path: Path) -> None:
    # A low pyramid whose one side is cut into three slivers: its apex still points straight up.
    apex = "v 1 0 1\nv -1 0 1\nv -1 0 -1\nv 1 0 -1\nv 0 0.3 0\nv 0.3 0 1\nv -0.3 0 1\n"
    sides = "f 1 6 5\nf 6 7 5\nf 7 2 5\n".replace("f 1 6 5", "f 6 1 5").replace("f 6 7 5", "f 7 6 5")
    sides = sides.replace("f 7 2 5", "f 2 7 5") + "f 3 2 5\nf 4 3 5\nf 1 4 5\n"
    mesh = load_mesh(written(tmp_path / "pyramid.obj", apex + sides))
    top = np.argmax(mesh.positions[:, 1])
    np.testing.assert_allclose(np.abs(mesh.normals[top]), [0, 1, 0], atol=1e-6)


def test_normals_of_the_file_win(tmp_path: Path) -> None:
    text = TETRAHEDRON + "vn 0 0 -2\nvn 0 1 0\nf 1//1 3//1 2//1\nf 1//2 2//2 4//2\nf 1//2 4//2 3//2\nf 2//2 3//2 4//2\n"
    mesh = load_mesh(written(tmp_path / "t.obj", text))
    np.testing.assert_allclose(mesh.normals[mesh.faces[0]], [[0, 0, -1]] * 3)
    np.testing.assert_allclose(mesh.normals[mesh.faces[1:]], np.broadcast_to([0, 1, 0], (3, 3, 3)))


def test_zero_normals_of_the_file_are_computed(tmp_path: Path) -> None:
    text = CUBE.replace("f ", "vn 0 0 0\nf ", 1)
    text = "\n".join(
        "f " + " ".join(f"{i}//1" for i in line.split()[1:]) if line.startswith("f") else line
        for line in text.splitlines()
    )
    mesh = load_mesh(written(tmp_path / "cube.obj", text))
    np.testing.assert_allclose(mesh.normals[mesh.faces[:, 0]], face_normals(mesh), atol=1e-6)


def test_upright_scaled_and_standing_on_the_origin(tmp_path: Path) -> None:
    box = "v 10 20 30\nv 14 20 30\nv 10 22 30\nv 10 20 31\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
    mesh = load_mesh(written(tmp_path / "box.obj", box), height=4.0)
    np.testing.assert_allclose(mesh.bounds, [[-4, 0, -1], [4, 4, 1]])
    turned = load_mesh(tmp_path / "box.obj", up="z")
    np.testing.assert_allclose(turned.bounds, [[-2, 0, -1], [2, 1, 1]])
    # (x, y, z) → (x, z, −y): the vertex farthest along y is now farthest along −z.
    np.testing.assert_allclose(turned.positions[np.argmin(turned.positions[:, 2])], [-2, 0, -1])
    np.testing.assert_allclose(turned.normals[turned.faces[:, 0]], face_normals(turned), atol=1e-6)


def test_stray_vertices_and_degenerate_faces_do_not_count(tmp_path: Path) -> None:
    mesh = load_mesh(written(tmp_path / "c.obj", CUBE + "v 99 99 99\nv 2 2 2\nf 1 1 2\nf 1 7 10\n"))
    assert len(mesh.faces) == 12
    np.testing.assert_allclose(mesh.bounds, [[-0.5, 0, -0.5], [0.5, 1, 0.5]])


def test_relative_indices_count_from_where_they_stand(tmp_path: Path) -> None:
    lines = CUBE.strip().splitlines()
    one = [line for line in lines if line.startswith("v")]
    relative = ["f " + " ".join(str(int(i) - 9) for i in line.split()[1:]) for line in lines if line.startswith("f")]
    shifted = [f"v {float(line.split()[1]) + 5} {' '.join(line.split()[2:])}" for line in one]
    path = written(tmp_path / "two.obj", "\n".join([*one, *relative, *shifted, *relative]))
    mesh = load_mesh(path)
    assert len(mesh.faces) == 24
    np.testing.assert_allclose(mesh.bounds, [[-3, 0, -0.5], [3, 1, 0.5]])
    assert np.abs(mesh.positions[:, 0]).min() == 2  # nothing spans the gap


def test_mixed_styles_of_faces_keep_texture_coordinates(tmp_path: Path) -> None:
    text = TETRAHEDRON + "vt 0.25 0.75\nvn 0 1 0\nf 1/1 3/1 2/1\nf 1//1 2//1 4//1\nf 1 4 3\nf 2/1/1 3/1/1 4/1/1\n"
    mesh = load_mesh(written(tmp_path / "mixed.obj", text))
    np.testing.assert_allclose(mesh.uv[mesh.faces[[0, 3]]], np.broadcast_to([0.25, 0.75], (2, 3, 2)))
    assert (mesh.uv[mesh.faces[1:3]] == 0).all()


@pytest.mark.parametrize("ending", ["\n", "\r\n", "\r"])
def test_tabs_comments_continuations_and_line_ends(tmp_path: Path, ending: str) -> None:
    text = "# a cube\n" + CUBE.replace("v ", "  v\t").replace("f 1 4 3 2", "f 1 4 \\\n 3 2  # the front")
    path = tmp_path / "c.obj"
    path.write_bytes(text.replace("\n", ending).encode())
    assert len(load_mesh(path).faces) == 12


def test_names_in_latin_1(tmp_path: Path) -> None:
    (tmp_path / "m.mtl").write_bytes("newmtl grün\nKd 0 1 0\n".encode("latin-1"))
    (tmp_path / "c.obj").write_bytes(f"mtllib m.mtl\nusemtl grün\n{CUBE}".encode("latin-1"))
    assert load_mesh(tmp_path / "c.obj").materials[0].base_colour == (0.0, 1.0, 0.0)
    box = trimesh.creation.box()
    (tmp_path / "c.stl").write_bytes(f"solid grün\n{box.export(file_type='stl_ascii')}".encode("latin-1"))
    (tmp_path / "c.ply").write_bytes(
        box.export(file_type="ply").replace(b"\nelement", "\ncomment grün\nelement".encode("latin-1"), 1)
    )
    assert {len(load_mesh(tmp_path / name).faces) for name in ("c.stl", "c.ply")} == {12}


def test_gltf_in_several_files(tmp_path: Path) -> None:
    for name, data in trimesh.Scene(trimesh.creation.box()).export(file_type="gltf").items():
        (tmp_path / name).write_bytes(data)
    mesh = load_mesh(tmp_path / "model.gltf", height=3.0)
    assert len(mesh.faces) == 12
    np.testing.assert_allclose(mesh.bounds, [[-1.5, 0, -1.5], [1.5, 3, 1.5]])


@pytest.mark.parametrize(
    ("header", "attributes", "expected"),
    [
        (b"", [0, 0], None),
        (b"made by COLO", [31, 5], None),
        (b"", [1 << 15 | 31 << 10 | 16, 31], [[255, 0, 132], [255, 255, 255]]),  # VisCAM and SolidView
        (b"COLOR=\x10\x20\x30\xff,", [31 | 16 << 10, 1 << 15], [[255, 0, 132], [16, 32, 48]]),  # Magics
        (b"COLOR=\x10\x20\x30\xff", [0, 0], [[16, 32, 48], [16, 32, 48]]),
    ],
)
def test_colours_of_binary_stl(
    tmp_path: Path, header: bytes, attributes: list[int], expected: list[list[int]] | None
) -> None:
    triangle = np.array([[0, 0, 1], [0, 0, 0], [1, 0, 0], [0, 1, 0]], "<f4").tobytes()
    body = b"".join(triangle + value.to_bytes(2, "little") for value in attributes)
    (file := tmp_path / "c.stl").write_bytes(header.ljust(80, b"\0") + len(attributes).to_bytes(4, "little") + body)
    soup = read_soup(file)
    assert soup.colours[::3].tolist() == ([[255] * 3] * 2 if expected is None else expected)
    assert soup.materials == (plain_material(expected is not None),)


def test_ply_vertex_colours(tmp_path: Path) -> None:
    cube = trimesh.creation.box()
    colours = np.arange(24, dtype=np.uint8).reshape(8, 3) * 10
    cube.visual = trimesh.visual.ColorVisuals(cube, vertex_colors=colours)
    cube.export(tmp_path / "c.ply")
    mesh = load_mesh(tmp_path / "c.ply")
    places = (cube.vertices + np.array([0, 0.5, 0])).tolist()
    by_place = {tuple(p): tuple(c) for p, c in zip(places, colours.tolist(), strict=True)}
    assert {tuple(p): tuple(c) for p, c in zip(mesh.positions.tolist(), mesh.colours.tolist(), strict=True)} == by_place
    assert mesh.materials[0].base_colour == (1.0, 1.0, 1.0)


@pytest.mark.parametrize("ends", [b"\n", b"\r\n"])
@pytest.mark.parametrize("kind", ["vertex_colors", "face_colors"])
def test_ply_colours_by_the_names_of_older_programs(tmp_path: Path, kind: str, ends: bytes) -> None:
    cube = trimesh.creation.box()
    colours = np.arange(24 if kind == "vertex_colors" else 36, dtype=np.uint8).reshape(-1, 3) * 7
    cube.visual = trimesh.visual.ColorVisuals(cube, **{kind: colours})
    usual = cube.export(file_type="ply")
    head, body = usual.split(b"end_header\n")
    (tmp_path / "usual.ply").write_bytes(usual)
    older = re.sub(rb" (red|green|blue)\n", rb" diffuse_\1\n", head).replace(b"\n", ends)
    (tmp_path / "older.ply").write_bytes(older + b"end_header" + ends + body)
    expected, found = (load_mesh(tmp_path / f"{name}.ply") for name in ("usual", "older"))
    assert len(np.unique(expected.colours, axis=0)) > 1
    np.testing.assert_array_equal(found.colours, expected.colours)
    assert [read_head(tmp_path / f"{name}.ply").has_diffuse_colours for name in ("usual", "older")] == [False, True]


def test_usual_names_of_ply_colours_come_first() -> None:
    lines = "property uchar red\nproperty uchar diffuse_red\n"
    both, other = f"element vertex 3\n{lines}", "element face 1\nproperty uchar diffuse_red\n"
    assert with_usual_colours(both.encode()) == both.encode()
    assert with_usual_colours((both + other).encode()) == (both + other.replace("diffuse_", "")).encode()


def test_ply_face_colours(tmp_path: Path) -> None:
    cube = trimesh.creation.box()
    colours = np.arange(36, dtype=np.uint8).reshape(12, 3) * 7
    cube.visual = trimesh.visual.ColorVisuals(cube, face_colors=colours)
    cube.export(tmp_path / "c.ply")
    mesh = load_mesh(tmp_path / "c.ply")
    assert mesh.colours[mesh.faces].tolist() == np.repeat(colours[:, None], 3, axis=1).tolist()


def test_ply_vertex_texture_coordinates(tmp_path: Path) -> None:
    header = "ply\nformat ascii 1.0\nelement vertex 4\n" + "".join(f"property float {n}\n" for n in "xyzst")
    body = "0 0 0 .1 .2\n1 0 0 .3 .4\n0 1 0 .5 .6\n0 0 1 .7 .8\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n"
    path = written(
        tmp_path / "t.ply", header + "element face 4\nproperty list uchar int vertex_indices\nend_header\n" + body
    )
    mesh = load_mesh(path)
    assert {tuple(uv) for uv in mesh.uv.round(4).tolist()} == {
        tuple(np.array(uv, np.float32).round(4).tolist()) for uv in ((0.1, 0.2), (0.3, 0.4), (0.5, 0.6), (0.7, 0.8))
    }


def test_glb_with_materials_texture_and_nested_transforms(tmp_path: Path) -> None:
    picture = Image.fromarray(np.array([[[255, 0, 0, 255], [0, 255, 0, 255]]] * 2, np.uint8))
    textured = trimesh.creation.box()
    uv = np.random.default_rng(1).random((8, 2))
    textured.visual = TextureVisuals(
        uv=uv, material=PBRMaterial(name="a", baseColorTexture=picture, roughnessFactor=0.5, metallicFactor=0.0)
    )
    plain = trimesh.creation.box()
    plain.visual = TextureVisuals(material=PBRMaterial(name="b", baseColorFactor=[255, 0, 51, 255]))
    scene = trimesh.Scene()
    away, up = np.eye(4), np.eye(4)
    away[0, 3], up[2, 3] = 10, 4  # moves along x, and along z
    scene.graph.update(frame_to="arm", frame_from="world", matrix=away)
    scene.add_geometry(textured, geom_name="t", parent_node_name="arm", transform=up)
    scene.add_geometry(plain, geom_name="p", parent_node_name="arm", transform=np.diag([1.0, 2.0, -1.0, 1.0]))
    path = tmp_path / "s.glb"
    scene.export(path)

    mesh = load_mesh(path)
    assert [part.face_count for part in mesh.parts] == [12, 12] and mesh.parts[1].first_face == 12
    materials = (mesh.materials[part.material] for part in mesh.parts)
    plain, material = sorted(materials, key=lambda material: material.texture is not None)
    assert plain.texture is None and material.texture is not None
    assert material.texture[0, :, :3].tolist() == [[255, 0, 0], [0, 255, 0]]
    assert material.base_colour == (1.0, 1.0, 1.0)
    assert 1 < material.shininess < 64 and 0 < material.specular < 0.5
    np.testing.assert_allclose(plain.base_colour, (1, 0, 0.2), atol=1e-6)
    np.testing.assert_allclose(mesh.bounds, [[-0.5, 0, -2.5], [0.5, 2, 2.5]])
    for part in mesh.parts:  # the mirrored box as well: outside stays outside
        faces = mesh.faces[part.first_face : part.first_face + part.face_count]
        centre = mesh.positions[faces].reshape(-1, 3).mean(axis=0)
        outward = face_normals(mesh)[part.first_face :][: part.face_count] * (
            mesh.positions[faces].mean(axis=1) - centre
        )
        assert (outward.sum(axis=1) > 0).all()
    assert (np.einsum("fi,fki->fk", face_normals(mesh), mesh.normals[mesh.faces]) > 0.5).all()


MTL = "newmtl red\nKd 1 0 0\nKs 0.5 0.5 0.5\nNs 100\nnewmtl picture\nKd 0.5 0.5 0.5\nmap_Kd -s 1 1 1 maps/p.png\n"
TWO = "mtllib one.mtl\nmtllib two.mtl\n" + TETRAHEDRON + (
    "vt 0 0\nvt 1 0\nvt 0 1\nusemtl red\nf 1/1 3/3 2/2\nf 1/1 2/2 4/3\nusemtl picture\nf 1/1 4/3 3/2\nf 2/1 3/2 4/3\n"
)  # fmt: skip


def test_obj_with_material_libraries_and_texture(tmp_path: Path) -> None:
    (tmp_path / "maps").mkdir()
    top_left_white = np.zeros((2, 2, 3), np.uint8)
    top_left_white[0, 0] = 255
    Image.fromarray(top_left_white).save(tmp_path / "maps" / "p.png")
    red, picture = MTL.split("newmtl picture")
    written(tmp_path / "one.mtl", red)
    written(tmp_path / "two.mtl", "newmtl picture" + picture)
    mesh = load_mesh(written(tmp_path / "t.obj", TWO))
    by_colour = {
        mesh.materials[part.material].base_colour: (part, mesh.materials[part.material]) for part in mesh.parts
    }
    part, material = by_colour[1.0, 0.0, 0.0]
    assert (part.face_count, material.specular, material.shininess, material.texture) == (2, 0.5, 100.0, None)
    part, material = by_colour[0.5, 0.5, 0.5]
    assert part.face_count == 2 and material.texture is not None and material.texture.shape == (2, 2, 4)
    assert material.texture[..., 0].tolist() == [[255, 0], [0, 0]]  # row 0 is the top
    faces = mesh.faces[part.first_face : part.first_face + part.face_count]
    top = mesh.positions[faces][0][np.argmax(mesh.uv[faces][0][:, 1])]  # (u, v) = (0, 1) is the picture's top left
    np.testing.assert_allclose(top, [-0.5, 0, 0.5])


@pytest.mark.parametrize("name", ["../secret.png", "/secret.png", "..\\secret.png", "gone.png", "x" * 5000])
def test_textures_outside_the_folder_are_ignored_with_a_warning(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, name: str
) -> None:
    Image.new("RGB", (1, 1)).save(tmp_path / "secret.png")
    inside = tmp_path / "inside"
    inside.mkdir()
    written(inside / "m.mtl", f"newmtl m\nmap_Kd {name}\n")
    with caplog.at_level(logging.WARNING):
        mesh = load_mesh(written(inside / "t.obj", "mtllib m.mtl\nusemtl m\n" + CUBE))
    assert mesh.materials[0].texture is None
    assert any("missing or outside the folder" in record.message for record in caplog.records)


def test_link_that_leads_outside_is_ignored(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    Image.new("RGB", (1, 1)).save(tmp_path / "secret.png")
    inside = tmp_path / "inside"
    inside.mkdir()
    (inside / "link.png").symlink_to(tmp_path / "secret.png")
    written(inside / "m.mtl", "newmtl m\nmap_Kd link.png\n")
    mesh = load_mesh(written(inside / "t.obj", "mtllib m.mtl\nusemtl m\n" + CUBE))
    assert mesh.materials[0].texture is None


@pytest.mark.parametrize(("colour", "base"), [("", 0.8), (" 0.2 0.4 0.6", 1.0)])
def test_texture_coordinates_alone_darken_nothing(tmp_path: Path, colour: str, base: float) -> None:
    lines = TETRAHEDRON.splitlines()
    text = "\n".join(line + colour if line.startswith("v ") else line for line in lines)
    faces = "\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 3/3 2/2\nf 1/1 2/2 4/3\nf 1/1 4/3 3/2\nf 2/1 3/2 4/3\n"
    mesh = load_mesh(written(tmp_path / "t.obj", text + faces))
    assert np.isfinite(mesh.uv).all()
    assert [(material.base_colour, material.texture) for material in mesh.materials] == [((base,) * 3, None)]
    assert set(mesh.colours.ravel().tolist()) == ({51, 102, 153} if colour else {255})


def test_explicit_texture(tmp_path: Path) -> None:
    Image.new("RGB", (3, 2), (1, 2, 3)).save(tmp_path / "p.png")
    path = written(tmp_path / "t.obj", TWO)
    mesh = load_mesh(path, texture=tmp_path / "p.png")
    for part in mesh.parts:
        material = mesh.materials[part.material]
        assert material.base_colour == (1.0, 1.0, 1.0)
        assert material.texture is not None and material.texture.shape == (2, 3, 4)
    bare = written(tmp_path / "bare.obj", CUBE)
    with pytest.raises(InputError, match=r"bare\.obj: no texture coordinates for the texture .*p\.png$"):
        load_mesh(bare, texture=tmp_path / "p.png")


@pytest.mark.slow
@pytest.mark.skipif(not MODELS.is_dir(), reason="the shared models are not here")
@pytest.mark.parametrize(
    ("name", "up", "degenerate"),
    [("nefertiti", "z", 0), ("stanford-bunny", "y", 0), ("ogre", "y", 4), ("spot", "y", 0), ("teapot", "y", 0)],
)
def test_real_models_keep_their_triangles_and_load_fast(name: str, up: Literal["y", "z"], degenerate: int) -> None:
    path = MODELS / f"{name}.obj"
    count = path.read_bytes().count(b"\nf ")
    start = time.process_time()
    mesh = load_mesh(path, up=up, height=2.0)
    assert time.process_time() - start < 3.0  # 0.6 s on an idle core
    assert len(mesh.faces) == count - degenerate
    assert mesh.bounds[0][1] == 0 and mesh.bounds[1][1] == pytest.approx(2.0)
    np.testing.assert_allclose(np.linalg.norm(mesh.normals, axis=1), 1.0, atol=1e-6)
    assert (np.einsum("ij,ij->i", mesh.normals[mesh.faces[:, 0]], face_normals(mesh)) > 0).mean() > 0.99


def test_what_lies_level_has_no_height(tmp_path: Path) -> None:
    """It is drawn, and neither scaled to a height nor baked; what is flat and stands is like anything else."""
    path = tmp_path / "floor.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 1 0 1\nv 0 0 1\nf 1 4 3 2\n")
    floor = load_mesh(path)
    assert np.ptp(floor.positions, axis=0).tolist() == [1, 0, 1]
    with pytest.raises(InputError, match="is flat and horizontal: it cannot be scaled to a height"):
        load_mesh(path, height=2.0)
    with pytest.raises(InputError, match="is flat and horizontal; draw it as polygons"):
        check_height(floor, path)
    wall = load_mesh(path, up="z")
    check_height(wall, path)
    assert np.ptp(wall.positions, axis=0).tolist() == [1, 1, 0]


@pytest.mark.parametrize(("side", "fits"), [(1e-7, False), (2e-6, True), (39_000.0, True), (41_000.0, False)])
def test_depth_images_hold_what_float16_can(tmp_path: Path, side: float, fits: bool) -> None:
    """What is larger is drawn as polygons, or scaled."""
    path = tmp_path / "hill.obj"
    path.write_text(f"v 0 0 0\nv {side} 0 0\nv 0 {side} 0\nv 0 0 {side}\nf 1 2 3\nf 1 2 4\n")
    mesh = load_mesh(path)
    with nullcontext() if fits else pytest.raises(InputError, match=r"hill.obj: is \S+ m across, and depth images"):
        check_height(mesh, path)
    with nullcontext() if fits else pytest.raises(InputError, match=r"hold 1e-06 to 40000 m; give it another 'height'"):
        check_mesh(path, upright=True)
    check_mesh(path)
    check_height(load_mesh(path, height=2.0), path)
