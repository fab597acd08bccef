"""What each bad scene of tests/hostile is told, word for word."""

from pathlib import Path

import pytest

from depthwalk.errors import InputError
from depthwalk.limits import MAX_SCENE_BYTES
from depthwalk.scene.loader import load_scene

HOSTILE = Path(__file__).parent.parent / "hostile"

MESSAGES = {
    "alias-bomb": [
        "2:13: a3[7][9][0][1]: aliases repeat more than 10000 values",
    ],
    "alias-loop": [
        "3:12: objects[0].group.objects[0].group.....objects[0].group.objects[0].group: nested too deeply",
    ],
    "angles": [
        "6:25: objects[0].pitch: must be a number, not a list",
        "7:24: objects[1].roll: must be at most 36000, not 1e+06",
        "8:18: objects[2].rotation: unknown key; did you mean 'yaw' or 'pitch' or 'roll'?",
    ],
    "bad-lamp": [
        "7:7: environment.lights[0]: missing key 'position'",
        "7:34: environment.lights[0].range: must be greater than 0, not 0",
        "7:44: environment.lights[0].angle: must be at most 180, not 400",
    ],
    "bad-representation": [
        "6:34: objects[0].representation: must be 'dpci', 'mesh', 'mesh-lod', 'mesh-clusters', 'dmesh', "
        "'relief', 'distance', 'parallax', 'bump', 'displacement', "
        "'relief-texture', 'bar-texture', 'octahedral', 'billboard' or 'auto', not 'hologram'",
    ],
    "camera-fov": [
        "5:55: camera.fov: must be at most 170, not 180",
    ],
    "camera-nowhere": [
        "5:9: camera: 'target' must be elsewhere than 'position'",
    ],
    "crowded-scatter": [
        "6:35: objects[0].scatter.count: 500 objects 1.5 m apart do not fit in the area",
    ],
    "dark-sun": [
        "5:32: environment.sun.direction: must not be the zero vector",
    ],
    "deep-brackets": [
        "2:233: not valid YAML: nested too deeply",
    ],
    "deep-groups": [
        "135:525: objects[0].group.objects[0].group.....group.objects[0].group.objects[0]: groups nest deeper than 64",
    ],
    "depth-image-no-shape": [
        "3:25: assets.relief.depth_image: needs exactly one of 'size', 'intrinsics', 'panorama'",
    ],
    "depth-image-two-shapes": [
        "5:7: assets.relief.depth_image: needs exactly one of 'size', 'intrinsics', 'panorama'",
    ],
    "depth-image-two-units": [
        "3:25: assets.relief.depth_image: needs 'range' or 'unit', not both",
    ],
    "duplicate-key": [
        "4:3: assets.box: duplicate key; it is in line 3 too",
    ],
    "empty-grid": [
        "6:37: objects[0].grid.count[1]: must be at least 1, not 0",
    ],
    "empty": [
        "1:1: the file is empty",
    ],
    "hash-colour": [
        "6:15: environment.background: '#' starts a comment; put the colour in quotes: \"#202020\"",
    ],
    "panorama-horizon": [
        "6:27: assets.seen.depth_image.panorama.horizon: must be a number, not 'low'",
    ],
    "panorama-normal": [
        "5:7: assets.seen.depth_image: needs 'normal' or 'panorama', not both: normals of a panorama are computed",
    ],
    "panorama-range": [
        "5:7: assets.seen.depth_image: needs 'range' or 'panorama', not both",
    ],
    "intrinsics-paper": [
        "5:7: assets.seen.depth_image: method paper is for reliefs and panoramas; "
        "a range image with 'intrinsics' is always cut",
    ],
    "intrinsics": [
        "6:24: assets.range.depth_image.intrinsics.fx: must be at least 1, not 0",
        "6:19: assets.range.depth_image.intrinsics: missing key 'cy'",
        "6:45: assets.range.depth_image.intrinsics.cz: unknown key; known here: 'fx', 'fy', 'cx', 'cy'",
    ],
    "list": [
        "1:1: the file must be a mapping of keys, not a list",
    ],
    "missing-files": [
        "3:15: assets.one.mesh: file 'models/one.obj' not found",
        "3:40: assets.one.texture: file 'one.png' not found",
        "4:15: assets.two.mesh: file '/etc/hostname' is absolute; paths are relative to the scene file",
        "5:32: assets.three.depth_image.depth: file '../../../no.png' leaves the scene's folder and every asset root; "
        "name its folder by --asset-root DIR",
        "7:21: environment.ground.texture: file 'lawn.png' not found",
    ],
    "mixed-up-files": [
        "3:18: assets.baked.baked: box.obj: does not hold depth images (.dpci.npz or .dpci.exr); "
        "a mesh is named by the key 'mesh'",
        "4:16: assets.mesh.mesh: bench.dpci.npz: depth images, no mesh; "
        "`view` opens them, and a scene names them by the key 'baked'",
        "5:39: assets.both.mesh: sundial.dpci.npz: depth images, no mesh; "
        "`view` opens them, and a scene names them by the key 'baked'",
    ],
    "misspelt-kind": [
        "6:6: objects[0].gird: unknown key; did you mean 'grid'?",
    ],
    "misspelt-render": [
        "6:9: render.lod.bais: unknown key; did you mean 'bias'?",
    ],
    "misspelt-version": [
        "1:1: verson: unknown key; did you mean 'version'?",
    ],
    "misspelt-top": [
        "5:1: objets: unknown key; did you mean 'objects'?",
    ],
    "nested-error": [
        "10:24: objects[0].group.objects[1].scael: unknown key; did you mean 'scale'?",
    ],
    "no-dpci": [
        "7:36: objects[1].representation: must be 'mesh', 'mesh-lod', 'mesh-clusters', 'octahedral' or "
        "'billboard', not 'dpci': "
        "asset 'plain' has no dpci",
    ],
    "no-file-name": [
        "3:9: assets.box.mesh: must be the name of a file, not null",
    ],
    "no-kind": [
        "6:5: objects[0]: needs exactly one of 'asset', 'grid', 'group', 'places', 'scatter'",
    ],
    "no-version": [
        "1:1: missing key 'version'; begin the file with 'version: 1'",
    ],
    "not-a-number": [
        "6:32: objects[0].position[1]: must be a finite number, not .nan",
    ],
    "not-utf8": [
        "3:6: not UTF-8 text (byte 0xe9)",
    ],
    "number-key": [
        "3:3: assets: a key must be text; put it in quotes",
    ],
    "python-tag": [
        "1:10: version: the tag 'tag:yaml.org,2002:python/object/apply:os.system' is not allowed",
    ],
    "scale-zero": [
        "7:12: objects[0].scale: must be at least 0.0001, not 0",
    ],
    "several": [
        "6:25: objects[0].scale: must be at least 0.0001, not -1",
        "7:18: objects[1].colour: unknown key; known here: "
        "'name', 'position', 'yaw', 'pitch', 'roll', 'animation', 'asset', 'scale', 'representation'",
        "8:9: camera: missing key 'position'",
    ],
    "shadow-no-cone": [
        "6:7: environment.lights[0]: 'shadow' needs a cone: give a 'direction'",
        "7:7: environment.lights[1]: 'shadow' needs a cone of at most 150 degrees",
        "8:60: environment.lights[2].shadow: must be true or false, not 2",
    ],
    "short-vector": [
        "6:28: objects[0].position: must be [x, y, z]",
    ],
    "syntax": [
        "3:7: not valid YAML: expected ',' or ']', not ':'; the '[' of line 2 is open",
    ],
    "tab": [
        "3:1: not valid YAML: a tab cannot indent; use spaces",
    ],
    "text-for-number": [
        "6:23: objects[0].yaw: must be a number, not '90'",
    ],
    "too-many": [
        "7:32: objects[1].grid.count: makes 1000000000001 objects in all; the limit is 4000000",
    ],
    "two-documents": [
        "2:1: not valid YAML: a second document starts here",
    ],
    "two-kinds": [
        "6:5: objects[0]: needs exactly one of 'asset', 'grid', 'group', 'places', 'scatter'",
    ],
    "unknown-asset": [
        "7:20: objects[1].grid.asset: unknown asset 'bix'; did you mean 'box'?",
    ],
    "version": [
        "1:10: version: must be 1, not 2",
    ],
}


@pytest.fixture
def boxes(tmp_path: Path) -> Path:
    """The asset root with the one file that the scenes name rightly."""
    (tmp_path / "box.obj").touch()
    return tmp_path


SLOW = {"deep-brackets"}  # to be read


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.slow) if name in SLOW else name for name in MESSAGES]
)
def test_message(name: str, boxes: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(HOSTILE)
    with pytest.raises(InputError) as caught:
        load_scene(f"{name}.yaml", [boxes])
    assert str(caught.value).splitlines() == [f"{name}.yaml:{line}" for line in MESSAGES[name]]


def test_every_hostile_scene_is_in_the_table() -> None:
    assert {path.stem for path in HOSTILE.glob("*.yaml")} == set(MESSAGES)


def test_file_too_large(tmp_path: Path) -> None:
    path = tmp_path / "large.yaml"
    with path.open("wb") as file:
        file.truncate(MAX_SCENE_BYTES + 1)
    with pytest.raises(InputError) as caught:
        load_scene(path)
    assert str(caught.value) == f"{path}:1:1: the file is larger than 16 MiB"


def test_a_binary_file(tmp_path: Path) -> None:
    path = tmp_path / "picture.psd"
    path.write_bytes(b"8BPS\0\1\x89\0\0")
    with pytest.raises(InputError) as caught:
        load_scene(path)
    meshes = ".obj, .ply, .stl, .off, .glb, .gltf, .usd, .usda, .usdc, .usdz, .las, .laz, .fbx, .dae, .3ds, .3mf"
    told = f"binary, not UTF-8 text; scenes and camera paths are YAML, meshes end in {meshes}"
    assert str(caught.value) == f"{path}:1:1: {told}"


def test_text_that_windows_programs_write(tmp_path: Path) -> None:
    path = tmp_path / "scene.yaml"
    path.write_bytes("version: 1\nassets: {}\n".encode("utf-16"))
    with pytest.raises(InputError) as caught:
        load_scene(path)
    assert str(caught.value) == f"{path}:1:1: UTF-16 text; save it as UTF-8"


def test_no_such_file() -> None:
    with pytest.raises(InputError) as caught:
        load_scene("nowhere.yaml")
    assert str(caught.value) == "nowhere.yaml: no such file"


def test_null_character_in_the_path() -> None:
    with pytest.raises(InputError, match=r"^a\\x00b\.yaml: no such file$"):
        load_scene("a\0b.yaml")


def test_a_misspelt_name_of_a_file_that_ships_is_told(tmp_path: Path) -> None:
    file = tmp_path / "scene.yaml"
    file.write_text("version: 1\nassets: {pot: {mesh: teapto.ply}}\nobjects: [{asset: pot}]\n")
    with pytest.raises(InputError, match=r"file 'teapto\.ply' not found; did you mean 'teapot\.ply'\?"):
        load_scene(file)


def test_a_report_in_place_of_a_scene(tmp_path: Path) -> None:
    (tmp_path / "court.html").write_text("<html></html>")
    with pytest.raises(InputError, match=r"court\.html: a web page, such as a report, no scene; a browser opens it$"):
        load_scene(tmp_path / "court.html")


@pytest.mark.parametrize(("name", "length"), [("studio.hdr", MAX_SCENE_BYTES), ("picture.PNG", 3)])
def test_a_picture_in_place_of_a_scene(tmp_path: Path, name: str, length: int) -> None:
    (tmp_path / name).write_bytes(b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR" + bytes(length))
    with pytest.raises(InputError, match=rf"{name}: a picture, no scene; --sky lights a scene or a model by it$"):
        load_scene(tmp_path / name)


def test_a_wrong_picture_is_told_all_right_ones_in_one_line(tiny_scene: Path) -> None:
    with pytest.raises(InputError) as error:
        load_scene(tiny_scene, overrides={"render.inspection.show": "cases"})
    assert len(error.value.lines) == 1
    assert "must be 'picture', " in str(error.value) and "or 'error', not 'cases'" in str(error.value)
