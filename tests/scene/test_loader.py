"""Loading: defaults, overrides, files, nodes, grids and scatters."""

import math
import os
from pathlib import Path

import numpy as np
import pytest

from depthwalk.errors import InputError, UnbakableError
from depthwalk.scene.arrays import Representation
from depthwalk.scene.loader import load_scene
from depthwalk.scene.path import load_path
from depthwalk.scene.scene import DepthImageAsset, MeshAsset, Scene, told_at

ASSETS = "version: 1\nassets: {baked: {mesh: box.obj, dpci: {}}, plain: {mesh: box.obj}}\n"
CHECKOUT = Path(__file__).resolve().parents[2]
SHARED = Path(os.environ.get("DEPTHWALK_TEST_SCENES", CHECKOUT.parent / "shared" / "scenes"))


def load(folder: Path, text: str, **overrides: str) -> Scene:
    (folder / "box.obj").touch()
    (folder / "scene.yaml").write_text(text)
    return load_scene(folder / "scene.yaml", (), {key.replace("__", "."): value for key, value in overrides.items()})


def complaint(folder: Path, text: str, overrides: dict[str, str]) -> str:
    (folder / "box.obj").touch()
    (folder / "scene.yaml").write_text(text)
    with pytest.raises(InputError) as caught:
        load_scene(folder / "scene.yaml", (), overrides)
    return str(caught.value)


def test_smallest_scene_has_the_defaults(tmp_path: Path) -> None:
    scene = load(tmp_path, ASSETS + "objects: [{asset: baked}]\n")
    assert scene.environment.sky is None
    assert scene.environment.ground is None
    assert scene.environment.sun.intensity > 0
    assert scene.camera is None
    asset = scene.assets[0]
    assert isinstance(asset, MeshAsset) and asset.dpci is not None
    assert asset == MeshAsset(
        name="baked", mesh=tmp_path / "box.obj", texture=None, up="y", height=None, dpci=asset.dpci
    )
    assert (asset.dpci.resolution, asset.dpci.layers) == (512, 3)
    assert scene.objects.rotation.tolist() == [[0, 0, 0, 1]]


def test_representation_defaults_to_auto_where_the_asset_has_both(tmp_path: Path) -> None:
    relief = "{depth_image: {depth: box.obj, colour: box.obj, size: [2, 1], range: 0.1}}"
    text = f"version: 1\nassets: {{b: {{mesh: box.obj, dpci: {{}}}}, p: {{mesh: box.obj}}, r: {relief}}}\n"
    text += "objects: [{asset: b}, {asset: p}, {asset: r}, {asset: b, representation: dmesh}]\n"
    scene = load(tmp_path, text)
    wanted = [Representation.AUTO, Representation.MESH, Representation.DPCI, Representation.DMESH]
    assert scene.objects.representation.tolist() == wanted
    assert isinstance(scene.assets[2], DepthImageAsset)
    assert scene.assets[2].size == (2, 1)


def test_a_relief_has_no_mesh(tmp_path: Path) -> None:
    text = "version: 1\nassets: {r: {depth_image: {depth: box.obj, colour: box.obj, size: [2, 1], range: 1}}}\n"
    text += "objects: [{asset: r, representation: mesh}]\n"
    possible = (
        "'dpci', 'dmesh', 'relief', 'distance', 'parallax', 'bump', 'displacement', 'relief-texture' or 'bar-texture'"
    )
    assert complaint(tmp_path, text, {}).endswith(f"must be {possible}, not 'mesh': asset 'r' has no mesh")


def test_angles_and_colours(tmp_path: Path) -> None:
    text = "camera: {position: [0, 1, 5], target: [0, 1, 0], fov: 45}\nenvironment: {background: '#ff8000', sky: {}}\n"
    scene = load(tmp_path, ASSETS + text)
    assert scene.camera is not None
    assert scene.camera.fov == pytest.approx(math.radians(45))
    assert scene.environment.background == (1.0, 128 / 255, 0.0)
    assert scene.environment.sky is not None


def test_overrides_apply_before_validation(tmp_path: Path) -> None:
    text = ASSETS + "objects: [{asset: baked, scale: -1}]\n"
    overrides = {"objects[0].scale": "2.5", "render.lod.bias": "1", "environment.background": "#00ff00"}
    (tmp_path / "box.obj").touch()
    (tmp_path / "scene.yaml").write_text(text)
    scene = load_scene(tmp_path / "scene.yaml", overrides=overrides)
    assert scene.objects.scale.tolist() == [2.5]
    assert scene.render.lod.bias == 1
    assert scene.environment.background == (0, 1, 0)


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("render.lod.bais", "1", "--set render.lod.bais: unknown key; did you mean 'bias'?"),
        ("render.fog", "1", "--set render.fog: unknown key; did you mean 'environment.fog'?"),
        ("fog.colour", "red", "--set fog.colour: fog: unknown key; did you mean 'environment.fog'?"),
        ("rendr.lod.bias", "1", "--set rendr.lod.bias: rendr: unknown key; did you mean 'render'?"),
        ("render.lod.bias", "x", "--set render.lod.bias: must be a number, not 'x'"),
        ("render", "{lod: {bais: 1}}", "--set render: lod.bais: unknown key; did you mean 'bias'?"),
        ("objects.0.scale", "-1", "--set objects.0.scale: must be at least 0.0001, not -1"),
        ("objects.7.scale", "1", "--set objects.7.scale: objects has no item '7', it has 1"),
        (
            "assets.bakd.height",
            "2",
            "--set assets.bakd.height: assets.bakd: needs exactly one of 'mesh', 'baked', 'depth_image'; "
            "did you mean 'baked'?",
        ),
        (
            "assets.statue.height",
            "2",
            "--set assets.statue.height: assets.statue: needs exactly one of 'mesh', 'baked', 'depth_image'; "
            "the file has baked, plain",
        ),
        ("objects.0.asset", "bakd", "--set objects.0.asset: unknown asset 'bakd'; did you mean 'baked'?"),
        ("version.minor", "1", "--set version.minor: version is 1, it has no keys"),
        ("camera.fov", "60", "--set camera.fov: camera: missing key 'position'"),
        ("a..b", "1", "--set a..b: must be a dotted path such as render.lod.bias"),
        (
            "environment.sky",
            "{model: image, image: no.hdr}",
            "--set environment.sky: image: file 'no.hdr' not found",
        ),
        ("environment.ground.texture", "no.png", "--set environment.ground.texture: file 'no.png' not found"),
        ("version", "[1", "--set version: value:1:1: not valid YAML: expected ',' or ']' before the end of the text"),
    ],
)
def test_override_messages(tmp_path: Path, key: str, value: str, message: str) -> None:
    text = ASSETS + "objects: [{asset: baked}]\n"
    assert complaint(tmp_path, text, {key: value}).splitlines()[0] == message


def test_files_are_looked_for_in_the_folder_then_in_the_roots(tmp_path: Path) -> None:
    scenes, root = tmp_path / "scenes", tmp_path / "root"
    for folder in (scenes, root):
        folder.mkdir()
        (folder / "both.obj").touch()
    (root / "far.obj").touch()
    path = scenes / "scene.yaml"
    path.write_text("version: 1\nassets: {a: {mesh: both.obj}, b: {mesh: far.obj}, c: {mesh: ../root/far.obj}}\n")
    scene = load_scene(path, [root])
    found = [asset.mesh for asset in scene.assets if isinstance(asset, MeshAsset)]
    assert found == [
        scenes / "both.obj",
        root / "far.obj",
        root / "far.obj",
    ]


def test_symbolic_links_do_not_lead_out(tmp_path: Path) -> None:
    inside, outside = tmp_path / "inside", tmp_path / "outside"
    inside.mkdir()
    outside.mkdir()
    (outside / "secret.obj").touch()
    (inside / "link.obj").symlink_to(outside / "secret.obj")
    path = inside / "scene.yaml"
    path.write_text("version: 1\nassets: {a: {mesh: link.obj}}\n")
    told = r"leaves the scene's folder and every asset root; name its folder by --asset-root DIR$"
    with pytest.raises(InputError, match=rf":2:20: assets\.a\.mesh: file 'link\.obj' {told}"):
        load_scene(path)
    (asset,) = load_scene(path, [outside]).assets
    assert isinstance(asset, MeshAsset) and asset.mesh == outside / "secret.obj"


@pytest.mark.parametrize("name", ['"\\0"', "x" * 5000, "."])
def test_unusable_file_names(tmp_path: Path, name: str) -> None:
    assert ":2:20: assets.a.mesh: file" in complaint(tmp_path, f"version: 1\nassets: {{a: {{mesh: {name}}}}}\n", {})


def test_a_missing_asset_root_is_named(tmp_path: Path) -> None:
    (tmp_path / "scene.yaml").write_text("version: 1\n")
    with pytest.raises(InputError, match=r"^--asset-root nowhere: no such folder$"):
        load_scene(tmp_path / "scene.yaml", ["nowhere"])


def test_sixty_four_groups_nest(tmp_path: Path) -> None:
    text = "[{group: {objects: " * 64 + "[{asset: plain}]" + "}}]" * 64
    scene = load(tmp_path, ASSETS + f"objects: {text}\n")
    assert len(scene.objects) == 1
    assert scene.nodes.depth.max() == 64


def test_nested_scales_stay_in_range(tmp_path: Path) -> None:
    text = "[{group: {scale: 1000, objects: " * 3 + "[{asset: plain}]" + "}}]" * 3
    assert "scale is 1e+09 with its groups'" in complaint(tmp_path, ASSETS + f"objects: {text}\n", {})


def test_aliases_of_a_modest_size_work(tmp_path: Path) -> None:
    scene = load(tmp_path, ASSETS + "objects:\n- &one {asset: plain, position: [1, 0, 0]}\n- *one\n")
    assert scene.objects.position.tolist() == [[1, 0, 0], [1, 0, 0]]


def test_node_table(tmp_path: Path) -> None:
    text = (
        "objects:\n"
        "- {asset: plain}\n"
        "- group:\n"
        "    name: outer\n"
        "    objects:\n"
        "    - {grid: {name: rows, asset: baked, count: [2, 3], spacing: [1, 1]}}\n"
        "    - {group: {objects: []}}\n"
        "    - {asset: plain, name: last}\n"
        "- {asset: plain}\n"
    )
    nodes = load(tmp_path, ASSETS + text).nodes
    assert nodes.name == ("", "outer", "rows", "", "last", "")
    assert nodes.parent.tolist() == [-1, -1, 1, 1, 1, -1]
    assert nodes.depth.tolist() == [0, 0, 1, 1, 1, 0]
    assert nodes.end.tolist() == [1, 5, 3, 4, 5, 6]
    assert nodes.first_object.tolist() == [0, 1, 1, 7, 7, 8]
    assert nodes.object_count.tolist() == [1, 7, 6, 0, 1, 1]


def test_grid_stands_centred_in_rows(tmp_path: Path) -> None:
    text = "objects: [{grid: {asset: baked, count: [3, 2], spacing: [2, 5], position: [10, 1, 0], scale: 3}}]\n"
    objects = load(tmp_path, ASSETS + text).objects
    wanted = [[8, 1, -2.5], [10, 1, -2.5], [12, 1, -2.5], [8, 1, 2.5], [10, 1, 2.5], [12, 1, 2.5]]
    assert objects.position.tolist() == wanted
    assert objects.scale.tolist() == [3] * 6


def test_grid_yaw_turns_x_towards_minus_z(tmp_path: Path) -> None:
    text = "objects: [{grid: {asset: baked, count: [2, 1], spacing: [2, 2], yaw: 90}}]\n"
    objects = load(tmp_path, ASSETS + text).objects
    np.testing.assert_allclose(objects.position, [[0, 0, 1], [0, 0, -1]], atol=1e-6)
    np.testing.assert_allclose(objects.rotation, [[0, math.sqrt(0.5), 0, math.sqrt(0.5)]] * 2, atol=1e-6)


@pytest.mark.slow
def test_a_million_objects_come_from_one_line(tmp_path: Path) -> None:
    text = "objects: [{grid: {asset: baked, count: [1000, 1000], spacing: [3, 3], position: [0, 2, 0]}}]\n"
    objects = load(tmp_path, ASSETS + text).objects
    assert len(objects) == 1_000_000
    assert objects.position[[0, -1]].tolist() == [[-1498.5, 2, -1498.5], [1498.5, 2, 1498.5]]


def test_scatter_keeps_its_distance_and_its_area(tmp_path: Path) -> None:
    text = "{scatter: {asset: baked, count: 500, area: [80, 40], seed: 7, scale: [0.8, 1.2], spacing: 1.5}}"
    first = load(tmp_path, ASSETS + f"objects: [{text}]\n").objects
    again = load(tmp_path, ASSETS + f"objects: [{text}]\n").objects
    other = load(tmp_path, ASSETS + f"objects: [{text}]\n".replace("seed: 7", "seed: 8")).objects
    assert len(first) == 500
    np.testing.assert_array_equal(first.position, again.position)
    assert not np.array_equal(first.position, other.position)
    assert (np.abs(first.position) <= [40, 0, 20]).all()
    assert np.abs(first.position[:, 0]).max() > 30
    gaps = np.linalg.norm(first.position[:, None] - first.position[None], axis=2) + 1e9 * np.eye(500)
    assert gaps.min() >= 1.5 - 1e-5
    assert 0.8 <= first.scale.min() < 0.9 < 1.1 < first.scale.max() <= 1.2001
    assert len(np.unique(first.rotation[:, 1])) > 490


@pytest.mark.skipif(not SHARED.is_dir(), reason=f"no real scenes: DEPTHWALK_TEST_SCENES or {SHARED.name}/ is missing")
def test_real_scenes_load() -> None:
    counts = {path.stem: len(load_scene(path).objects) for path in sorted(SHARED.glob("*.yaml")) if is_scene(path)}
    assert counts["bust"] == 1
    assert counts["mixed"] == 5
    assert counts["plaza"] == 10_000


@pytest.mark.skipif(not SHARED.is_dir(), reason=f"no real paths: DEPTHWALK_TEST_SCENES or {SHARED.name}/ is missing")
def test_real_paths_load() -> None:
    frames = {path.stem: len(load_path(path).frames()) for path in sorted(SHARED.glob("*.yaml")) if not is_scene(path)}
    assert frames["poses"] == 12
    assert frames["stroll"] == 601


def is_scene(path: Path) -> bool:
    return "\nkeyframes:" not in path.read_text()


def test_a_missing_version_hides_no_other_mistake(tmp_path: Path) -> None:
    """Those of keys, or else those of names and files; another version does, since its keys may mean other things."""
    missing = "scene.yaml:1:1: missing key 'version'; begin the file with 'version: 1'"

    def told(text: str) -> list[str]:
        (file := tmp_path / "scene.yaml").write_text(text)
        with pytest.raises(InputError) as caught:
            load_scene(file)
        return [line.removeprefix(f"{tmp_path}/") for line in caught.value.lines]

    assert told("objects: []") == [missing]
    keys = told("assets: {a: {mesh: gone.ply, hight: 3}}\ncamera: {position: [0, 0]}")
    assert keys[0] == missing and ["hight" in line for line in keys] == [False, True, False, False]
    names = told("assets: {a: {mesh: gone.ply}}\nobjects: [{asset: b}]")
    assert names[0] == missing and [line[:16] for line in names[1:]] == ["scene.yaml:2:19:", "scene.yaml:1:20:"]
    assert told("version: 2\nassets: {a: {mesh: gone.ply, hight: 3}}") == ["scene.yaml:1:10: version: must be 1, not 2"]


def test_errors_about_models_without_a_scene_file_stay_as_they_are() -> None:
    asset = MeshAsset(name="model", mesh=Path("a.ply"), texture=None, up="y", height=None, dpci=None)
    error = InputError("a.ply: damaged")
    with pytest.raises(InputError) as raised, told_at(asset):
        raise error
    assert raised.value is error and error.__cause__ is None  # not itself: whoever follows causes would not end


def test_a_place_comes_first_once() -> None:
    error = InputError("a.ply: damaged", "s.yaml:3:4: assets.a: b.ply: damaged")
    located = ("s.yaml:3:4: assets.a: a.ply: damaged", "s.yaml:3:4: assets.a: b.ply: damaged")
    assert error.at("s.yaml:3:4: assets.a").lines == located and error.at("") is error
    flat = UnbakableError("a.ply: is flat", "draw it").at("s.yaml:3:4: assets.a")
    assert flat.reason == "s.yaml:3:4: assets.a: a.ply: is flat" and str(flat) == f"{flat.reason}; draw it"
