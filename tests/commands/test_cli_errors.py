"""Bad input: exit code 2, one exact line on stderr, nothing on stdout, nothing written."""

import re
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import pytest
from PIL import Image

# Arguments of `render SCENE`, with {d} for the folder of the scene; the message.
RENDER = {
    "no comma": (
        ["-o", "{d}/a.png", "--resolution", "96 64"],
        "--resolution 96 64: must be W,H or WxH, whole numbers of pixels",
    ),
    "one too many": (
        ["-o", "{d}/a.png", "--resolution", "96x64,32"],
        "--resolution 96x64,32: must be W,H or WxH, whole numbers of pixels",
    ),
    "zero": (["-o", "{d}/a.png", "--resolution", "0,64"], "--resolution 0,64: each side must be 1 to 16384 pixels"),
    "huge": (
        ["-o", "{d}/a.png", "--resolution", "96,99999999999"],
        "--resolution 96,99999999999: each side must be 1 to 16384 pixels",
    ),
    "many pixels": (
        ["-o", "{d}/a.png", "--resolution", "16384,4097"],
        "--resolution 16384,4097: 67125248 pixels, the limit is 67108864",
    ),
    "two numbers": (
        ["-o", "{d}/a.png", "--camera-position", "1,2"],
        "--camera-position 1,2: must be X,Y,Z, three numbers in metres",
    ),
    "nan": (
        ["-o", "{d}/a.png", "--camera-target", "nan,0,0"],
        "--camera-target nan,0,0: each coordinate must be within ±1e+06 m",
    ),
    "angle": (["-o", "{d}/a.png", "--camera-view-angle", "0"], "--camera-view-angle 0: must be 1 to 170 degrees"),
    "angle nan": (
        ["-o", "{d}/a.png", "--camera-view-angle", "nan"],
        "--camera-view-angle nan: must be 1 to 170 degrees",
    ),
    "direction of two": (
        ["-o", "{d}/a.png", "--camera-direction", "0,-1"],
        "--camera-direction 0,-1: must be X,Y,Z, three numbers",
    ),
    "no direction": (
        ["-o", "{d}/a.png", "--camera-direction", "0,0,0"],
        "--camera-direction 0,0,0: must not be zero",
    ),
    "direction and target": (
        ["-o", "{d}/a.png", "--camera-direction", "0,0,1", "--camera-target", "0,1,4"],
        "--camera-direction: places the camera; leave out --camera-position and --camera-target",
    ),
    "looks nowhere": (
        ["-o", "{d}/a.png", "--camera-position", "0,1,4", "--camera-target", "0,1,4"],
        "--camera-target: must differ from the camera's position",
    ),
    "no equals": (["-o", "{d}/a.png", "--set", "render.lod.bias"], "--set render.lod.bias: must be KEY=VALUE"),
    "unknown setting": (
        ["-o", "{d}/a.png", "--set", "render.lod.biass=1"],
        "--set render.lod.biass: unknown key; did you mean 'bias'?",
    ),
    "reuse": (
        ["-o", "{d}/a.png", "--set", "render.warp.reuse_error=1"],
        "--set render.warp.reuse_error: only `view` and `bench` reuse impostors of earlier frames",
    ),
    "asset root": (["-o", "{d}/a.png", "--asset-root", "{d}/none"], "--asset-root {d}/none: no such folder"),
    "a file for a folder": (["-o", "{d}/ball.ply/a.png"], "{d}/ball.ply/a.png: the folder '{d}/ball.ply' is a file"),
    "no folder": (["-o", "{d}/none/a.png"], "{d}/none/a.png: the folder '{d}/none' does not exist"),
    "no name for a file": (
        ["-o", "{d}/" + "a" * 300 + ".png"],
        "{d}/" + "a" * 300 + ".png: the name is too long",
    ),
    "folder": (["-o", "{d}/sub.png"], "{d}/sub.png: is a folder"),
    "suffix": (
        ["-o", "{d}/a.tif"],
        "{d}/a.tif: must end in .png, .jpg, .jpeg, .webp, .exr, .mp4, .gif, or be - for a PNG on standard output",
    ),
    "no name": (["-o", ""], "-o: must not be empty; name a file, or - for a PNG on standard output"),
    "clear jpeg": (
        ["-o", "{d}/a.JPG", "--no-background"],
        "{d}/a.JPG: --no-background: a JPEG has no alpha; write .png, .webp or .exr",
    ),
    "braces": (
        ["-o", "{d}/a{{number}}.png"],
        "{d}/a{{number}}.png: {{number}} is unknown; {{frame}} and {{frame:4}} stand for the frame's number",
    ),
    "still video": (["-o", "{d}/a.mp4"], "{d}/a.mp4: a video needs --path or --turntable"),
    "still gif": (["-o", "{d}/a.gif"], "{d}/a.gif: a GIF needs --path or --turntable"),
    "gifs": (
        ["-o", "{d}/a{{frame}}.gif", "--path", "{d}/walk.yaml"],
        "{d}/a{{frame}}.gif: a GIF is a single file; leave {{frame}} out of its name",
    ),
    "webp to a store": (
        ["-o", "memory://a.webp", "--path", "{d}/walk.yaml"],
        "memory://a.webp: a WebP animation can only be written to this machine; a URL is for pictures",
    ),
    "large webp": (
        ["-o", "{d}/a.webp", "--resolution", "16384x1"],
        "{d}/a.webp: the sides of a WebP file have at most 16383 pixels",
    ),
    "resumed webp": (
        ["-o", "{d}/a{{frame}}.webp", "--path", "{d}/walk.yaml", "--resume"],
        "{d}/a{{frame}}.webp: --resume and --cluster cannot tell which WebP files are whole; write .png",
    ),
    "clear video": (
        ["-o", "{d}/a.mp4", "--path", "{d}/walk.yaml", "--no-background"],
        "{d}/a.mp4: --no-background: a video has no alpha; write .png, .webp or .exr",
    ),
    "one name for three frames": (
        ["-o", "{d}/a.png", "--path", "{d}/walk.yaml"],
        "{d}/a.png: 3 frames do not fit into one picture; put {{frame:4}} into the name, or give --frames 1",
    ),
    "three frames to stdout": (
        ["-o", "-", "--path", "{d}/walk.yaml"],
        "-: 3 frames do not fit into one picture; put {{frame:4}} into the name, or give --frames 1",
    ),
    "frames of nothing": (["-o", "{d}/a.png", "--frames", "2"], "--frames: needs --path or --turntable"),
    "no frames": (
        ["-o", "{d}/a{{frame}}.png", "--path", "{d}/walk.yaml", "--frames", "0"],
        "--frames 0: must be N, a number of frames from 1 to 1000000, or A-B",
    ),
    "frames that are none": (
        ["-o", "{d}/a{{frame}}.png", "--path", "{d}/walk.yaml", "--frames", "1-"],
        "--frames 1-: must be N, a number of frames from 1 to 1000000, or A-B",
    ),
    "frames beyond the path": (
        ["-o", "{d}/a{{frame}}.png", "--path", "{d}/walk.yaml", "--frames", "1-3"],
        "--frames 1-3: the path has the frames 0-2",
    ),
    "frames in reverse": (
        ["-o", "{d}/a{{frame}}.png", "--path", "{d}/walk.yaml", "--frames", "2-1"],
        "--frames 2-1: the first frame comes after the last",
    ),
    "resumed video": (
        ["-o", "{d}/a.mp4", "--path", "{d}/walk.yaml", "--resume"],
        "{d}/a.mp4: --resume needs a file for each frame; put {{frame:4}} into the name",
    ),
    "video by a cluster": (
        ["-o", "{d}/a.mp4", "--path", "{d}/walk.yaml", "--cluster", "local"],
        "{d}/a.mp4: --cluster needs a file for each frame; put {{frame:4}} into the name",
    ),
    "turntable along a path": (
        ["-o", "{d}/a.mp4", "--turntable", "2", "--path", "{d}/walk.yaml"],
        "--turntable: places the camera; leave out --path",
    ),
    "turntable for ever": (
        ["-o", "{d}/a.mp4", "--turntable", "inf"],
        "--turntable inf: must be above 0 and at most 3600 seconds",
    ),
    "cluster for a still": (["-o", "{d}/a.png", "--cluster", "local"], "--cluster: needs --path"),
    "open cluster": (
        ["-o", "{d}/a.png", "--cluster", "tcp://farm:8786"],
        "--cluster tcp://farm:8786: is not encrypted, and anybody may use it; only tls://HOST:PORT is taken",
    ),
    "unknown store": (
        ["-o", "nowhere://b/a.png"],
        "nowhere://b/a.png: Protocol not known: nowhere",
    ),
    "video to a store": (
        ["-o", "memory://a.mp4", "--path", "{d}/walk.yaml"],
        "memory://a.mp4: a video can only be written to this machine; a URL is for pictures",
    ),
    "two cameras": (
        ["-o", "{d}/a{{frame}}.png", "--path", "{d}/walk.yaml", "--camera-position", "0,0,1"],
        "--path: already places the camera; leave out the --camera options",
    ),
    "no path file": (["-o", "{d}/a.mp4", "--path", "{d}/none.yaml"], "{d}/none.yaml: no such file"),
    "over depth images": (
        ["-o", "{d}/ball.dpci.exr"],
        "{d}/ball.dpci.exr: would overwrite an input file; choose another name",
    ),
    "over a texture": (
        ["-o", "{d}/ground.png", "--set", "environment.ground.texture=ground.png"],
        "{d}/ground.png: would overwrite an input file; choose another name",
    ),
}


@pytest.mark.gl
@pytest.mark.parametrize("case", RENDER)
def test_render_refuses(run: Callable[..., Any], tiny_scene: Path, case: str) -> None:
    folder = tiny_scene.parent
    (folder / "sub.png").mkdir()
    (folder / "ground.png").write_bytes(b"")
    before = sorted(folder.iterdir())
    arguments, message = RENDER[case]
    result = run("render", tiny_scene, *(argument.format(d=folder) for argument in arguments))
    assert (result.exit_code, result.stdout, result.stderr) == (2, "", message.format(d=folder) + "\n")
    assert sorted(folder.iterdir()) == before


def test_the_scene_itself_is_not_overwritten(run: Callable[..., Any], tiny_scene: Path) -> None:
    scene = tiny_scene.rename(tiny_scene.with_name("scene.png"))
    text = scene.read_text()
    result = run("render", scene, "-o", scene)
    assert (result.exit_code, result.stderr) == (2, f"{scene}: would overwrite an input file; choose another name\n")
    assert scene.read_text() == text


@pytest.fixture
def linked(tiny_scene: Path) -> Path:
    """The tiny scene with a relief on the ball and a box whose material library names a texture, which are there."""
    folder = tiny_scene.parent
    faces = "f 1/1 2/1 3/1\nf 1/1 3/1 4/1\nf 1/1 4/1 2/1\nf 2/1 4/1 3/1\n"
    vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvt 0 0\n"
    (folder / "box.obj").write_text(f"mtllib box.mtl\n{vertices}usemtl m\n{faces}")
    (folder / "box.mtl").write_text("newmtl m\nmap_Kd bark.png\n")
    for name in ("bark.png", "bumps.png", "bends.png"):
        Image.new("RGB" if name != "bumps.png" else "L", (4, 4), 255).save(folder / name)
    meso = "meso: {depth: bumps.png, normal: bends.png, height: 0.01, tile: [0.5, 0.5]}"
    text = tiny_scene.read_text().replace("layers: 1}}", f"layers: 1, {meso}}}}}\n  box: {{mesh: box.obj}}")
    tiny_scene.write_text(text)
    return tiny_scene


@pytest.mark.parametrize("name", ["bark.png", "bumps.png", "bends.png"])
def test_no_output_overwrites_what_assets_name(run: Callable[..., Any], linked: Path, name: str) -> None:
    file = linked.with_name(name)
    before = file.read_bytes()
    small = ("--resolution", "96,64")
    rendered = run("render", linked, "-o", file, *small)
    assert (rendered.exit_code, rendered.stderr) == (
        2,
        f"{file}: would overwrite an input file; choose another name\n",
    )
    measured = run("bench", linked, "--html", file, *small)
    assert (measured.exit_code, measured.stderr) == (
        2, f"{file}: would overwrite a file that is measured, or the other report\n",
    )  # fmt: skip
    assert file.read_bytes() == before


@pytest.mark.parametrize("name", ["box.mtl", "bark.png", "box.dpci.exr"])
def test_compare_overwrites_nothing_of_the_mesh(run: Callable[..., Any], linked: Path, name: str) -> None:
    file = linked.with_name(name)
    result = run("compare", linked.with_name("box.obj"), "--json", file)
    message = f"{file}: would overwrite a file that is compared, or the other report\n"
    assert (result.exit_code, result.stderr) == (2, message)


@pytest.mark.gl
def test_a_missing_texture_is_warned_of_once(run: Callable[..., Any], linked: Path, tmp_path: Path) -> None:
    linked.with_name("bark.png").unlink()
    result = run("render", linked, "-o", tmp_path / "a.png", "--resolution", "96,64")
    assert result.exit_code == 0
    assert result.stderr.count("'bark.png' is missing") == 1


@pytest.mark.gl
def test_a_broken_mesh_is_the_users_input(run: Callable[..., Any], tiny_scene: Path, tmp_path: Path) -> None:
    mesh = tiny_scene.with_name("ball.ply")
    mesh.write_bytes(b"no mesh")
    result = run("render", tiny_scene, "-o", tmp_path / "a.png", "--resolution", "96,64")
    assert result.exit_code == 2
    assert result.stderr.startswith(f"{tiny_scene}:3:9: assets.ball: {mesh}: ") and result.stderr.count("\n") == 1
    assert not (tmp_path / "a.png").exists()


@pytest.mark.parametrize(
    "arguments",
    [
        ["render"],
        ["render", "s.yaml"],
        ["render", "s.yaml", "-o"],
        ["rendr"],
        ["check"],
        ["render", "s.yaml", "-o", "a.png", "--representation", "x"],
        ["bake", "m.obj", "--method", "guess"],
    ],
)
def test_wrong_usage_exits_with_2(run: Callable[..., Any], arguments: Sequence[str]) -> None:
    result = run(*arguments)
    assert result.exit_code == 2
    assert result.stderr.count("\n") == 1 and result.stdout == ""
    program = "depthwalk" if arguments[0] == "rendr" else f"depthwalk {arguments[0]}"  # no command of this name
    assert re.fullmatch(rf"{program}: .* \({program} --help tells more\)\n", result.stderr)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["bench", "s.yaml", "--frames", "0"], "--frames 0: must be at least 1"),
        (["bench", "s.yaml", "--tolerance", "1001"], "--tolerance 1001: must be at most 1000"),
        *(([command, folder], f"{folder}: is a folder") for command in ("bake", "convert") for folder in (".", "..")),
        (["bake", "m.obj", "--dpci-resolution", "8"], "--dpci-resolution 8: must be at least 16"),
        (["bake", "m.obj", "--dpci-resolution", "1.5"], "--dpci-resolution 1.5: must be a whole number"),
        (["bench", "s.yaml", "--tolerance", "x\n"], "--tolerance x\\n: must be a number"),
    ],
)
def test_a_wrong_number_is_told_with_what_is_allowed(
    run: Callable[..., Any], arguments: Sequence[str], message: str
) -> None:
    result = run(*arguments)
    assert (result.exit_code, result.stdout, result.stderr) == (2, "", f"{message}\n")


@pytest.mark.skipif(sys.platform != "linux", reason="/proc")
@pytest.mark.parametrize("command", [("render", "{scene}", "-o"), ("bake", "{mesh}", "-o")])
def test_a_folder_that_takes_no_file_whoever_asks(
    run: Callable[..., Any], tiny_scene: Path, command: tuple[str, str, str]
) -> None:
    mesh = next(tiny_scene.parent.glob("*.ply"))
    name = "/proc/a.png" if command[0] == "render" else "/proc/a.dpci.exr"
    result = run(*(part.format(scene=tiny_scene, mesh=mesh) for part in command), name)
    assert (result.exit_code, result.stderr) == (2, f"{name}: the folder '/proc' is not writable\n")


@pytest.mark.parametrize(
    ("command", "name", "meant"),
    [
        ("render", "garden", "garden.yaml"),
        ("info", "teapot", "teapot.ply"),
        ("check", "gardn.yaml", "garden.yaml"),
        ("view", "paths/garden", "garden.yaml"),
    ],
)
def test_a_file_that_ships_is_suggested(
    run: Callable[..., Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, command: str, name: str, meant: str
) -> None:
    """Also in a folder that does not hold it, and without its ending."""
    monkeypatch.chdir(tmp_path)
    output = ["-o", "x.png"] if command == "render" else []
    result = run(command, name, *output)
    assert (result.exit_code, result.stderr) == (2, f"{name}: no such file; did you mean {meant!r}?\n")


@pytest.mark.parametrize("rest", [[], ["court.png"]])
def test_a_picture_without_its_option(run: Callable[..., Any], rest: list[str]) -> None:
    expected = "depthwalk render: name the file to write by -o FILE (depthwalk render --help tells more)\n"
    assert run("render", "court.yaml", *rest).stderr == expected


def test_an_option_of_other_programs_is_told_by_its_name_here(run: Callable[..., Any]) -> None:
    """Each command names its own option, and none that it lacks."""
    assert "(Possible options: --resolution)" in run("render", "a.yaml", "--size", "640x480").stderr
    assert "(Possible options: --camera-view-angle)" in run("view", "a.yaml", "--fov", "60").stderr
    assert "(Possible options: --dpci-resolution)" in run("bake", "a.ply", "--width", "256").stderr
    assert "--resolution" not in run("check", "a.yaml", "--size", "640x480").stderr
