"""Bad input: exit code 2, one exact line on stderr, nothing on stdout, nothing written."""

import pytest

# Arguments of `render SCENE`, with {d} for the folder of the scene; the message.
RENDER = {
    "no comma": (
        ["-o", "{d}/a.png", "--resolution", "96x64"],
        "--resolution 96x64: must be W,H, two whole numbers of pixels",
    ),
    "zero": (["-o", "{d}/a.png", "--resolution", "0,64"], "--resolution 0,64: each side must be 1 to 16384 pixels"),
    "huge": (
        ["-o", "{d}/a.png", "--resolution", "96,99999999999"],
        "--resolution 96,99999999999: each side must be 1 to 16384 pixels",
    ),
    "two numbers": (
        ["-o", "{d}/a.png", "--camera-position", "1,2"],
        "--camera-position 1,2: must be X,Y,Z, three numbers of metres",
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
    "no equals": (["-o", "{d}/a.png", "--set", "render.lod.bias"], "--set render.lod.bias: must be KEY=VALUE"),
    "unknown setting": (
        ["-o", "{d}/a.png", "--set", "render.lod.biass=1"],
        "--set render.lod.biass: unknown key; did you mean 'bias'?",
    ),
    "asset root": (["-o", "{d}/a.png", "--asset-root", "{d}/none"], "--asset-root {d}/none: no such folder"),
    "no folder": (["-o", "{d}/none/a.png"], "{d}/none/a.png: the folder '{d}/none' does not exist"),
    "folder": (["-o", "{d}/sub.png"], "{d}/sub.png: is a folder"),
    "suffix": (["-o", "{d}/a.jpg"], "{d}/a.jpg: must end in .png, .exr, .mp4, or be - for a PNG on standard output"),
    "braces": (
        ["-o", "{d}/a{{number}}.png"],
        "{d}/a{{number}}.png: {{number}} is unknown; {{frame}} and {{frame:4}} stand for the frame's number",
    ),
    "still video": (["-o", "{d}/a.mp4"], "{d}/a.mp4: a video needs --path"),
    "clear video": (
        ["-o", "{d}/a.mp4", "--path", "{d}/walk.yaml", "--no-background"],
        "{d}/a.mp4: --no-background: a video has no alpha; write .png or .exr",
    ),
    "one name for three frames": (
        ["-o", "{d}/a.png", "--path", "{d}/walk.yaml"],
        "{d}/a.png: the path has 3 frames; put {{frame:4}} into the name, or give --frames 1",
    ),
    "three frames to stdout": (
        ["-o", "-", "--path", "{d}/walk.yaml"],
        "-: the path has 3 frames; put {{frame:4}} into the name, or give --frames 1",
    ),
    "frames of nothing": (["-o", "{d}/a.png", "--frames", "2"], "--frames: needs --path"),
    "two cameras": (
        ["-o", "{d}/a{{frame}}.png", "--path", "{d}/walk.yaml", "--camera-position", "0,0,1"],
        "--path: already says where the camera is; leave out the --camera options",
    ),
    "no path file": (["-o", "{d}/a.mp4", "--path", "{d}/none.yaml"], "{d}/none.yaml: No such file or directory"),
    "over a texture": (
        ["-o", "{d}/ground.png", "--set", "environment.ground.texture=ground.png"],
        "{d}/ground.png: would overwrite what is rendered; choose another name",
    ),
}


@pytest.mark.parametrize("case", RENDER)
def test_render_refuses(run, tiny_scene, case):
    folder = tiny_scene.parent
    (folder / "sub.png").mkdir()
    (folder / "ground.png").write_bytes(b"")
    before = sorted(folder.iterdir())
    arguments, message = RENDER[case]
    result = run("render", tiny_scene, *(argument.format(d=folder) for argument in arguments))
    assert (result.exit_code, result.stdout, result.stderr) == (2, "", message.format(d=folder) + "\n")
    assert sorted(folder.iterdir()) == before


def test_the_scene_itself_is_not_overwritten(run, tiny_scene):
    scene = tiny_scene.rename(tiny_scene.with_name("scene.png"))
    text = scene.read_text()
    result = run("render", scene, "-o", scene)
    assert (result.exit_code, result.stderr) == (2, f"{scene}: would overwrite what is rendered; choose another name\n")
    assert scene.read_text() == text


def test_a_broken_mesh_is_the_users_input(run, tiny_scene, tmp_path):
    mesh = tiny_scene.with_name("ball.ply")
    mesh.write_bytes(b"no mesh")
    result = run("render", tiny_scene, "-o", tmp_path / "a.png", "--resolution", "96,64")
    assert result.exit_code == 2
    assert result.stderr.startswith(f"{mesh}: ") and result.stderr.count("\n") == 1
    assert not (tmp_path / "a.png").exists()


@pytest.mark.parametrize(
    "arguments",
    [
        ["render"],
        ["render", "s.yaml"],
        ["rendr"],
        ["check"],
        ["render", "s.yaml", "-o", "a.png", "--representation", "x"],
        ["render", "s.yaml", "-o", "a.png", "--frames", "0"],
        ["bake", "m.obj", "--dpci-resolution", "8"],
        ["bake", "m.obj", "--method", "guess"],
    ],
)
def test_wrong_usage_exits_with_2(run, arguments):
    result = run(*arguments)
    assert result.exit_code == 2
    assert "Error: " in result.stderr and result.stdout == ""
    assert "Traceback" not in result.stderr
