"""Keys of assets: what a result depends on changes its key, and nothing else does."""

import hashlib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import shapes
from depthwalk.assets.asset_files import (
    complaints_about,
    levels_key,
    mesh_key,
    mesh_source,
    range_key,
    read_body,
    read_hashed,
    read_mesh,
    read_relief,
)
from depthwalk.bake.params import ModelParams
from depthwalk.errors import InputError
from depthwalk.ingest.mesh_head import read_head
from depthwalk.ingest.sources import Sources, hash_files
from depthwalk.scene.loader import load_scene
from depthwalk.scene.scene import DepthImageAsset, MeshAsset
from files import write_ply
from glb_files import Glb

PARAMS = ModelParams(resolution=32, layers=1)


def plain_hash(spec: MeshAsset) -> str:
    """The hash of the files of an asset, as it was before any mark was added."""
    return hash_files(read_head(spec.mesh, spec.texture).files, Sources())


@pytest.fixture
def spec(tiny_scene: Path) -> MeshAsset:
    """The ball of the small scene."""
    (ball,) = load_scene(tiny_scene).assets
    assert isinstance(ball, MeshAsset)
    return ball


def test_a_mesh_and_the_hash_of_its_bytes_belong_together(spec: MeshAsset) -> None:
    mesh, source = read_hashed(spec)
    assert source == plain_hash(spec)
    np.testing.assert_array_equal(mesh.positions, read_mesh(spec).positions)
    assert mesh_key(spec, PARAMS, source) == mesh_key(spec, PARAMS)


def test_everything_that_a_bake_depends_on_is_in_its_key(spec: MeshAsset) -> None:
    key = mesh_key(spec, PARAMS)
    others = [
        mesh_key(replace(spec, up="z"), PARAMS),
        mesh_key(replace(spec, height=3.0), PARAMS),
        *(
            mesh_key(spec, replace(PARAMS, **change))
            for change in ({"resolution": 64}, {"layers": 2}, {"parts": 2}, {"axis": "x"}, {"method": "six-view"})
        ),
    ]
    write_ply(spec.mesh, shapes.sphere(2.0, columns=16, rows=8))
    others.append(mesh_key(spec, PARAMS))
    assert len({key, *others}) == 1 + len(others)


def test_only_textured_meshes_have_keys_of_texture_coordinates(spec: MeshAsset, tmp_path: Path) -> None:
    """So what was baked of other meshes before there were any is found on."""
    never = replace(PARAMS, coordinates="never")
    assert mesh_key(spec, PARAMS) == mesh_key(spec, never)
    textured = replace(spec, texture=tmp_path / "t.png")
    Image.new("RGB", (2, 2)).save(tmp_path / "t.png")
    assert mesh_key(textured, PARAMS) != mesh_key(textured, never)
    source = mesh_source(textured)
    assert mesh_key(textured, PARAMS, source) == mesh_key(textured, PARAMS)
    assert mesh_key(textured, never, source) == mesh_key(textured, never)
    views = replace(PARAMS, method="six-view")
    assert mesh_key(textured, views) == mesh_key(textured, replace(views, coordinates="never"))
    assert levels_key(textured, source) == levels_key(textured, plain_hash(textured))


def test_the_name_of_an_asset_is_not(spec: MeshAsset) -> None:
    assert mesh_key(replace(spec, name="another"), PARAMS) == mesh_key(spec, PARAMS)


def test_levels_depend_on_the_mesh_as_it_stands(spec: MeshAsset) -> None:
    source = plain_hash(spec)
    keys = {levels_key(spec, source), levels_key(spec, "other"), levels_key(replace(spec, height=3.0), source)}
    assert len(keys | {mesh_key(spec, PARAMS, source)}) == 4


def test_range_images_depend_on_their_files_and_their_lens(tiny_scene: Path) -> None:
    file = tiny_scene.with_name("d.npy")
    np.save(file, np.ones((8, 8), np.float32))
    keys = set()
    for focal in (50, 60):
        lens = f"intrinsics: {{fx: {focal}, fy: 50, cx: 4, cy: 4}}"
        tiny_scene.write_text(f"version: 1\nassets: {{seen: {{depth_image: {{depth: d.npy, {lens}}}}}}}\n")
        (seen,) = load_scene(tiny_scene).assets
        assert isinstance(seen, DepthImageAsset)
        keys.add(range_key(seen))
    np.save(file, np.full((8, 8), 2, np.float32))
    assert isinstance(seen, DepthImageAsset) and len(keys | {range_key(seen)}) == 3


def test_panoramas_depend_on_their_files_their_horizon_and_how_pixels_are_connected(tiny_scene: Path) -> None:
    file = tiny_scene.with_name("d.npy")
    np.save(file, np.ones((8, 16), np.float32))
    keys = set()
    for how in ("panorama: {}", "panorama: {horizon: 2}", "panorama: {}, method: paper", "panorama: {}, unit: 2"):
        tiny_scene.write_text(f"version: 1\nassets: {{seen: {{depth_image: {{depth: d.npy, {how}}}}}}}\n")
        (seen,) = load_scene(tiny_scene).assets
        assert isinstance(seen, DepthImageAsset)
        keys.add(range_key(seen))
    np.save(file, np.full((8, 16), 2, np.float32))
    assert isinstance(seen, DepthImageAsset) and len(keys | {range_key(seen)}) == 5


def test_a_relief_has_the_size_that_the_scene_gives_it(tiny_scene: Path) -> None:
    np.save(tiny_scene.with_name("d.npy"), np.linspace(0, 1, 64, dtype=np.float32).reshape(8, 8))
    tiny_scene.write_text("version: 1\nassets: {wall: {depth_image: {depth: d.npy, size: [3, 2]}}}\n")
    (wall,) = load_scene(tiny_scene).assets
    assert isinstance(wall, DepthImageAsset)
    relief = read_relief(wall)
    assert relief.size == (3, 2) and relief.depth.shape == (8, 8)


def test_a_mesh_without_height_can_be_drawn_but_not_baked(spec: MeshAsset) -> None:
    flat = shapes.box(1.0, 0.0, 1.0)
    write_ply(spec.mesh, flat)
    assert len(read_mesh(spec).faces) > 0
    with pytest.raises(InputError, match=r"ball\.ply"):
        read_body(spec)


def test_complaints_begin_with_the_file(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"a\.png: too dark"), complaints_about(tmp_path / "a.png"):
        raise InputError("too dark")


def test_what_was_baked_with_glass_as_a_solid_is_made_anew(tmp_path: Path) -> None:
    """And nothing else: a library that says of all materials that they are opaque changes no key."""
    (tmp_path / "m.obj").write_text("mtllib m.mtl\n")
    spec = MeshAsset(name="m", mesh=tmp_path / "m.obj", texture=None, up="y", height=None, dpci=None)
    for terms, same in (("d 1.0\nKe 1 1 1\n", True), ("d 0.5\n", False)):
        (tmp_path / "m.mtl").write_text(f"newmtl m\n{terms}")
        assert (mesh_source(spec) == plain_hash(spec)) == same


def test_what_was_lit_though_it_is_unlit_is_made_anew(tmp_path: Path) -> None:
    """Other files, also those of which only some materials are unlit, keep what was made of them."""
    spec = MeshAsset(name="m", mesh=tmp_path / "m.glb", texture=None, up="y", height=None, dpci=None)
    lit: dict[str, Any] = {"pbrMetallicRoughness": {"metallicFactor": 0}}
    cases: list[tuple[dict[str, Any], bool]] = [({"extensions": {"KHR_materials_unlit": {}}}, False), (lit, True)]
    for other, same in cases:
        glb = Glb()
        glb.header["materials"] = [lit | {"extensions": {"KHR_materials_unlit": {}}}, other]
        for number in range(2):
            glb.mesh({}, material=number)
        glb.write(spec.mesh, {"mesh": 0}, {"mesh": 1})
        assert (mesh_source(spec) == plain_hash(spec)) == same


@pytest.mark.parametrize(
    ("terms", "same"),
    [
        ({"metallicFactor": 0, "roughnessFactor": 1}, True),
        ({"metallicFactor": 0}, True),
        ({"metallicFactor": 0, "roughnessFactor": 0.4}, False),
        ({"roughnessFactor": 1}, False),
    ],
)
def test_what_was_baked_without_its_reflections_is_made_anew(tmp_path: Path, terms: dict[str, Any], same: bool) -> None:
    """And nothing else: dull materials that are not metal, which must be said, keep what was made of them."""
    spec, glb = MeshAsset(name="m", mesh=tmp_path / "m.glb", texture=None, up="y", height=None, dpci=None), Glb()
    glb.header["materials"] = [{"pbrMetallicRoughness": terms}]
    glb.mesh({}, material=0)
    glb.write(spec.mesh, {"mesh": 0})
    assert (mesh_source(spec) == plain_hash(spec)) == same


def test_what_was_baked_with_the_mean_of_a_roughness_map_is_made_anew(tmp_path: Path) -> None:
    spec, glb = MeshAsset(name="m", mesh=tmp_path / "m.glb", texture=None, up="y", height=None, dpci=None), Glb()
    terms = {"metallicFactor": 0, "metallicRoughnessTexture": {"index": 0}}
    glb.header["materials"] = [{"pbrMetallicRoughness": terms}]
    glb.mesh({}, material=0)
    glb.write(spec.mesh, {"mesh": 0})
    digest = plain_hash(spec)
    for mark in ("+roughness-maps", "+reflections"):
        digest = hashlib.sha256(f"{digest}{mark}".encode()).hexdigest()
    assert mesh_source(spec) not in (plain_hash(spec), digest)


def test_what_was_baked_without_its_normal_maps_is_made_anew(tmp_path: Path) -> None:
    """And again when the map changes."""
    (tmp_path / "m.obj").write_text("mtllib m.mtl\n")
    spec = MeshAsset(name="m", mesh=tmp_path / "m.obj", texture=None, up="y", height=None, dpci=None)
    found = set()
    for line in ("norm n.png", "map_Bump n.png"):
        (tmp_path / "m.mtl").write_text(f"newmtl m\n{line}\n")
        for contents in (b"one", b"other"):
            (tmp_path / "n.png").write_bytes(contents)
            assert mesh_source(spec) != plain_hash(spec)
            found.add(mesh_source(spec))
    assert len(found) == 4
