"""Files that are read without trimesh, as trimesh reads them: the same triangles to the last bit."""

import io
import logging
import subprocess
import sys
from dataclasses import fields
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from depthwalk.errors import InputError
from depthwalk.ingest.binary_records import read_binary_ply, read_binary_stl
from depthwalk.ingest.gltf import read_header
from depthwalk.ingest.gltf_triangles import read_gltf_triangles
from depthwalk.ingest.mesh import Material
from depthwalk.ingest.reader import read_soup
from depthwalk.ingest.soup import Soup
from depthwalk.ingest.sources import Sources
from depthwalk.ingest.trimesh_reader import read_by_trimesh
from glb_files import Glb

VERTICES, FACES = 40, 60
PLY = Path("a.ply")
NAMES = {"f4": "float", "f8": "double", "i2": "short", "u1": "uchar", "u2": "ushort", "i4": "int", "u4": "uint32"}


def equal(one: Any, other: Any) -> bool:
    if isinstance(one, np.ndarray):
        same = one.dtype == other.dtype and one.shape == other.shape
        return bool(same and np.array_equal(one, other, equal_nan=one.dtype.kind == "f"))
    if isinstance(one, Soup | Material):
        return all(equal(getattr(one, each.name), getattr(other, each.name)) for each in fields(one))
    return len(one) == len(other) and all(map(equal, one, other)) if isinstance(one, tuple) else bool(one == other)


def ply(order: str, place: str, normal: str, colour: str, index: str, length: str, seed: int = 0) -> bytes:
    """A binary PLY file with these types of numbers, "" for none."""
    random = np.random.default_rng(seed)
    listed = ("x", place), ("y", place), ("z", place), ("quality", "f4"), ("nx", normal), ("ny", normal), ("nz", normal)
    types = [(name, order + kind) for name, kind in listed if kind]
    types += [(name, order + colour) for name in ("red", "green", "blue", "alpha") if colour]
    vertices, faces = np.zeros(VERTICES, types), np.zeros(FACES, [("n", order + length), ("i", order + index, 3)])
    for name, kind in types:
        vertices[name] = random.integers(0, 99, VERTICES) if kind[1] in "ui" else random.normal(size=VERTICES)
    for name in ("nx", "ny", "nz") if normal else ():
        vertices[name][3] = 0
    faces["n"], faces["i"] = 3, random.integers(0, VERTICES, (FACES, 3))
    header = f"ply\nformat binary_{'little' if order == '<' else 'big'}_endian 1.0\ncomment made\n"
    header += f"element vertex {VERTICES}\n" + "".join(f"property {NAMES[t[1:]]} {name}\n" for name, t in types)
    header += f"element face {FACES}\nproperty list {NAMES[length]} {NAMES[index]} vertex_indices\nend_header\n"
    return header.encode() + vertices.tobytes() + faces.tobytes()


@pytest.mark.slow
@pytest.mark.parametrize("order", "<>")
def test_binary_ply(order: str) -> None:
    kinds = product(("f4", "f8", "i2"), ("", "f4", "f8"), ("", "u1"), ("i4", "u1", "u2", "u4"), ("u1", "i4"))
    for seed, types in enumerate(kinds):
        data = ply(order, *types, seed=seed)
        soup = read_binary_ply(data, PLY)
        assert soup is not None and equal(soup, read_by_trimesh(data, PLY, Sources())), types


@pytest.mark.parametrize(
    "change",
    [
        lambda data: data[:-1],
        lambda data: data + b"\0",
        lambda data: data.replace(b"float quality", b"float s"),
        lambda data: data.replace(b"float quality", b"float x"),
        lambda data: data.replace(b"comment made", b"comment TextureFile a.png"),
        lambda data: data.replace(b"element vertex", b"element edge 0\nelement vertex"),
        lambda data: data.replace(b"element face 60", b"element face 0"),
        lambda data: data.replace(b"end_header\n", b"property float flags\nend_header\n"),
        lambda data: data.replace(b"uchar red", b"float red"),
        lambda data: data[: -13 * FACES] + b"\4" + data[1 - 13 * FACES :],
        lambda data: data[: data.find(b"end_header")],
        lambda data: b"ply\n",
    ],
)
def test_other_ply_files_are_left_to_trimesh(change: Any) -> None:
    data = ply("<", "f4", "f4", "u1", "i4", "u1")
    assert read_binary_ply(data, PLY) is not None and read_binary_ply(change(data), PLY) is None


def test_defects_of_binary_ply_are_told_alike(tmp_path: Path) -> None:
    data, path = ply("<", "f4", "", "", "i4", "u1"), tmp_path / "a.ply"
    outside = data[:-4] + (VERTICES).to_bytes(4, "little")
    path.write_bytes(outside)
    for read in (read_soup, lambda path: read_by_trimesh(path.read_bytes(), path, Sources())):
        with pytest.raises(InputError, match="face 59 refers to vertex 40 of 0 to 39"):
            read(path)


def test_binary_stl() -> None:
    corners = np.random.default_rng(0).normal(size=(50, 3, 3)).astype("<f4")
    records = np.zeros(50, [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    records["corners"] = corners
    data = bytes(80) + (50).to_bytes(4, "little") + records.tobytes()
    soup = read_binary_stl(data, Path("a.stl"))
    assert soup is not None and read_binary_stl(data[:-1], Path("a.stl")) is None
    np.testing.assert_array_equal(soup.positions[soup.faces], corners)
    assert np.isnan(soup.normals).all() and np.isnan(soup.uv).all() and (soup.colours == 255).all()


def picture(random: np.random.Generator, kind: str) -> bytes:
    file = io.BytesIO()
    Image.fromarray(random.integers(0, 255, (8, 8, 3), np.uint8)).save(file, kind)
    return file.getvalue()


def random_glb(path: Path, seed: int) -> Path:
    """A scene of nodes below each other that show meshes of several primitives, with all kinds of materials."""
    random = np.random.default_rng(seed)
    glb = Glb()
    (path.parent / "a b.jpg").write_bytes(picture(random, "JPEG"))
    glb.header["images"] = [{"bufferView": glb.view(picture(random, "PNG"))}, {"uri": "a%20b.jpg"}, {"uri": "no.png"}]
    glb.header["textures"] = [{"source": 0}, {"source": 1}, {"source": 2}, {}]
    glb.header["materials"] = [random_material(random) for _ in range(3)]
    for _ in range(3):
        glb.mesh(random_attributes(glb, random), random.integers(0, 12, 30), material=int(random.integers(3)))
        glb.mesh(random_attributes(glb, random), None)
        glb.header["meshes"][-2]["primitives"] += glb.header["meshes"].pop()["primitives"] * int(random.integers(2))
    nodes: list[dict[str, Any]] = [{"children": list(range(1, 7))}]
    for _ in range(6):
        matrix = np.eye(4)
        matrix[:3] = random.normal(size=(3, 4))
        turn = random.normal(size=4)
        turned: dict[str, Any] = {
            "rotation": np.float32(turn / np.linalg.norm(turn)).tolist(),
            "translation": [1, 2, 0.1],
        }
        scaled = {**turned, "scale": random.normal(size=3).tolist()}
        placed: list[dict[str, Any]] = [turned, scaled, {"matrix": matrix.T.ravel().tolist()}, {}]
        nodes.append({**placed[random.integers(4)], "mesh": int(random.integers(3)), "children": [len(nodes) + 6]})
    nodes += [{**turned, "mesh": 1} for _ in range(6)]
    return glb.write(path, *nodes, roots=[0])


def random_attributes(glb: Glb, random: np.random.Generator) -> dict[str, int]:
    made = {"POSITION": glb.accessor(random.normal(size=(12, 3)))}
    if random.random() < 0.5:
        made["NORMAL"] = glb.accessor(random.normal(size=(12, 3)))
    if random.random() < 0.7:
        made["TEXCOORD_0"] = glb.accessor(random.normal(size=(12, 2)))
    kind = random.integers(4)
    if kind < 2:
        made["COLOR_0"] = glb.accessor(random.random((12, 3 + kind)) * 1.2 - 0.1)
    elif kind == 2:
        made["COLOR_0"] = glb.accessor(random.integers(0, 255, (12, 4)), "u1", normalized=True)
    return made


def random_material(random: np.random.Generator) -> dict[str, Any]:
    texture = {"index": int(random.integers(5))}  # one of which there is none
    rough = {
        "baseColorFactor": random.random(4).tolist(),
        "roughnessFactor": float(random.random()),
        "metallicFactor": 1,
    }
    rough |= {"baseColorTexture": texture, "metallicRoughnessTexture": texture}
    made = {
        "name": 'a "b"',
        "pbrMetallicRoughness": {key: value for key, value in rough.items() if random.random() < 0.6},
        "emissiveFactor": random.random(3).tolist(),
        "emissiveTexture": texture,
        "normalTexture": texture | {"scale": 0.5},
        "alphaMode": ("OPAQUE", "MASK", "BLEND")[random.integers(3)],
        "alphaCutoff": 0.3,
        "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 3.0}, "KHR_materials_unlit": {}},
    }
    return {key: value for key, value in made.items() if random.random() < 0.7}


@pytest.mark.slow
def test_gltf(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.CRITICAL)
    for seed in range(20):
        path = random_glb(tmp_path / f"{seed}.glb", seed)
        data = path.read_bytes()
        soup = read_gltf_triangles(read_header(data, path), data, path, Sources())
        assert soup is not None and equal(soup, read_by_trimesh(data, path, Sources())), seed


def test_other_gltf_files_are_left_to_trimesh(tmp_path: Path) -> None:
    glossy = {"extensions": {"KHR_materials_pbrSpecularGlossiness": {"glossinessFactor": 0.5}}}
    for more in ({"mode": 5}, {"material": 0}):
        glb = Glb()
        glb.header["materials"] = [glossy]
        glb.mesh({}, **more)
        path = glb.write(tmp_path / "a.glb")
        data = path.read_bytes()
        assert read_gltf_triangles(read_header(data, path), data, path, Sources()) is None
        assert isinstance(read_soup(path), Soup)


def test_numbers_that_warn_when_they_are_converted(tmp_path: Path) -> None:
    glb = Glb()
    signalling = np.full((4, 3), 0x7FA00000, np.uint32).view(np.float32)
    glb.mesh({"NORMAL": glb.accessor(signalling)})
    path = glb.write(tmp_path / "a.glb")
    data = path.read_bytes()
    soup = read_gltf_triangles(read_header(data, path), data, path, Sources())
    assert soup is not None and np.isnan(soup.normals).all()
    glb.header["accessors"][glb.header["meshes"][0]["primitives"][0]["indices"]] |= {"componentType": 5126, "count": 3}
    data = glb.write(path).read_bytes()
    assert read_gltf_triangles(read_header(data, path), data, path, Sources()) is None


@pytest.mark.slow
def test_trimesh_is_not_imported(tmp_path: Path) -> None:
    stl = bytes(80) + (1).to_bytes(4, "little") + np.arange(12, dtype="<f4").tobytes() + bytes(2)
    (tmp_path / "a.stl").write_bytes(stl)
    (tmp_path / "a.ply").write_bytes(ply("<", "f4", "f4", "u1", "i4", "u1"))
    random_glb(tmp_path / "a.glb", 0)
    code = "import sys\nfrom pathlib import Path\nfrom depthwalk.ingest.reader import read_soup\n"
    code += f"for suffix in ('stl', 'ply', 'glb'):\n    read_soup(Path({str(tmp_path)!r}) / f'a.{{suffix}}')\n"
    code += "assert not {'trimesh', 'scipy'} & sys.modules.keys()"
    subprocess.run([sys.executable, "-c", code], check=True, env={"PYTHONPATH": ":".join(filter(None, sys.path))})
