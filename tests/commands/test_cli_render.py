"""`depthwalk render`: what it writes."""

import io
import math
import re
import subprocess
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import imageio_ffmpeg
import numpy as np
import OpenEXR
import pytest
from PIL import Image

from depthwalk.commands.frame_drawing import smooth, turntable_cameras
from depthwalk.errors import InputError
from depthwalk.pictures import png_bytes
from depthwalk.render.headless import HeadlessRenderer
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera
from depthwalk.scene.render_settings import RenderSettings
from depthwalk.scene.scene import Scene
from depthwalk.types import Array, Picture
from depthwalk.walk import orbit

SMALL = ("--resolution", "96,64")


def listing(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def read_png(path: Path) -> tuple[str, Picture]:
    with Image.open(path) as picture:
        return picture.mode, np.asarray(picture)


def ball_distance(width: int, height: int, fov: int, eye: float = 4.0) -> Array:
    """Distance along the view axis (H, W) of a unit ball `eye` metres ahead; +inf beside it."""
    tangent = np.tan(np.radians(fov) / 2)
    y, x = np.mgrid[0:height, 0:width] + 0.5
    u, v = (2 * x / width - 1) * tangent * width / height, (1 - 2 * y / height) * tangent
    a = 1 + u**2 + v**2  # |(u, v, 1) z − (0, 0, eye)| = 1
    root = eye**2 - a * (eye**2 - 1)
    return np.where(root >= 0, (eye - np.sqrt(np.maximum(root, 0))) / a, np.inf)


@pytest.mark.gl
def test_png_with_background_has_no_alpha(run: Callable[..., Any], tiny_scene: Path, tmp_path: Path) -> None:
    result = run("render", tiny_scene, "-o", tmp_path / "a.png", *SMALL)
    assert (result.exit_code, result.stdout, result.stderr) == (0, f"{tmp_path / 'a.png'}\n", "")
    mode, pixels = read_png(tmp_path / "a.png")
    assert (mode, pixels.shape) == ("RGB", (64, 96, 3))
    assert listing(tmp_path) == ["a.png", "scene"]


@pytest.mark.gl
@pytest.mark.parametrize("name", ["a.jpg", "a.JPEG"])
def test_a_jpeg_shows_the_same(run: Callable[..., Any], tiny_scene: Path, tmp_path: Path, name: str) -> None:
    for each in ("a.png", name):
        assert run("render", tiny_scene, "-o", tmp_path / each, "--resolution", "96x64").exit_code == 0
    with Image.open(tmp_path / name) as picture:
        assert (picture.format, picture.mode, picture.size) == ("JPEG", "RGB", (96, 64))
        off = np.asarray(picture, int) - read_png(tmp_path / "a.png")[1]
    assert np.sqrt((off**2).mean()) < 3


@pytest.mark.gl
def test_png_without_background_is_clear_where_nothing_is(
    run: Callable[..., Any], tiny_scene: Path, tmp_path: Path
) -> None:
    run("render", tiny_scene, "-o", tmp_path / "a.png", "--no-background", *SMALL)
    mode, pixels = read_png(tmp_path / "a.png")
    assert mode == "RGBA"
    alpha = pixels[..., 3]
    inside = np.isfinite(ball_distance(96, 64, 45))
    assert np.mean((alpha == 255) == inside) > 0.98
    assert alpha[0, 0] == 0 and alpha[32, 48] == 255


@pytest.mark.gl
@pytest.mark.parametrize("representation", ["mesh", "dpci", "dmesh"])
def test_exr_holds_distances_along_the_view_axis(
    run: Callable[..., Any], tiny_scene: Path, tmp_path: Path, representation: str
) -> None:
    out = tmp_path / "a.exr"
    exact = "--set", "render.lod.error=0"  # half a pixel of this picture is 3 cm
    result = run("render", tiny_scene, "-o", out, "--no-background", "--representation", representation, *exact, *SMALL)
    assert result.exit_code == 0, result.stderr
    with OpenEXR.File(str(out), separate_channels=True) as file:
        channel = {name: np.array(each.pixels) for name, each in file.parts[0].channels.items()}
    assert {name: pixels.dtype.name for name, pixels in channel.items()} == dict.fromkeys("RGBAZ", "float32")
    expected = ball_distance(96, 64, 45)
    z = channel["Z"]
    both = np.isfinite(z) & np.isfinite(expected)
    assert both.sum() > 0.97 * np.isfinite(expected).sum()
    assert np.quantile(np.abs(z[both] - expected[both]), 0.95) < 0.02
    assert z[0, 0] == np.inf and channel["A"][0, 0] == 0
    assert (np.isfinite(z) == (channel["A"] == 1)).all()
    assert channel["R"].max() > 0.05


@pytest.mark.gl
def test_row_0_of_the_exr_is_the_top(run: Callable[..., Any], tiny_scene: Path, tmp_path: Path) -> None:
    out = tmp_path / "a.exr"
    run("render", tiny_scene, "-o", out, "--camera-target", "0,3,0", *SMALL)  # the ball moves down
    with OpenEXR.File(str(out), separate_channels=True) as file:
        near = np.isfinite(file.parts[0].channels["Z"].pixels)
    assert near[32:].sum() > 10 * near[:32].sum()


@pytest.mark.gl
def test_camera_options_replace_the_scenes(run: Callable[..., Any], tiny_scene: Path, tmp_path: Path) -> None:
    out = tmp_path / "a.exr"
    options = ("--camera-position", "8,1,0", "--camera-target", "0,1,0", "--camera-view-angle", "20")
    run("render", tiny_scene, "-o", out, "--representation", "mesh", *options, *SMALL)
    with OpenEXR.File(str(out), separate_channels=True) as file:
        z = np.array(file.parts[0].channels["Z"].pixels)
    assert z[32, 48] == pytest.approx(7.0, abs=0.01)
    expected = np.isfinite(ball_distance(96, 64, 20, eye=8.0))
    assert np.mean(np.isfinite(z) == expected) > 0.98


@pytest.mark.gl
def test_a_moment_of_animations_is_shown(run: Callable[..., Any], tiny_scene: Path, tmp_path: Path) -> None:
    """The ball rises by 1 m in a second, so that after half of one it is seen half a metre higher."""
    moves = "{asset: ball, animation: {interpolation: linear, keyframes: [{time: 0}, {time: 1, position: [0, 1, 0]}]}}"
    tiny_scene.write_text(tiny_scene.read_text().replace("{asset: ball}", moves))
    assert moves in tiny_scene.read_text()
    middles = []
    for number, moment in enumerate(("0", "0.5", "2.5")):
        out = tmp_path / f"{number}.exr"
        run("render", tiny_scene, "-o", out, "--representation", "mesh", "--time", moment, *SMALL)
        with OpenEXR.File(str(out), separate_channels=True) as file:
            middles.append(np.argwhere(np.isfinite(file.parts[0].channels["Z"].pixels)).mean(0)[0])
    assert middles[0] - middles[1] == pytest.approx(0.5 * 64 / (2 * 4 * np.tan(np.radians(22.5))), rel=0.15)
    assert middles[2] == middles[1]  # it begins again


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--time", "nan"), "--time nan: must be a number of seconds up to 1000000"),
        (("--time", "1", "--path", "walk.yaml"), "--time: animations run along with --path; leave out one of the two"),
    ],
)
def test_moments_that_cannot_be_shown(
    run: Callable[..., Any], tiny_scene: Path, tmp_path: Path, options: tuple[str, ...], message: str
) -> None:
    given = [str(tiny_scene.parent / option) if option == "walk.yaml" else option for option in options]
    result = run("render", tiny_scene, "-o", tmp_path / "{frame}.png", *given)
    assert result.exit_code == 2 and message in result.stderr


@pytest.mark.gl
def test_a_picture_of_the_sky_lights_a_mesh(run: Callable[..., Any], tiny_scene: Path, tmp_path: Path) -> None:
    """Red light from everywhere, from a file that lies elsewhere; turned, it looks the same."""
    sky = tmp_path / "red.png"
    sky.write_bytes(png_bytes(np.tile(np.array([200, 0, 0], np.uint8), (8, 16, 1))))
    mesh, options = tiny_scene.with_name("ball.ply"), ("--sky", sky, *SMALL)
    for name, more in (("a.png", ()), ("b.png", ("--set", "environment.sky.turn=90"))):
        result = run("render", mesh, "-o", tmp_path / name, *options, *more)
        assert (result.exit_code, result.stderr) == (0, "")
    (_, pixels), (_, turned) = read_png(tmp_path / "a.png"), read_png(tmp_path / "b.png")
    assert pixels[0, 0].tolist() == [200, 0, 0] and pixels[32, 48, 0] > 100 and (pixels[..., 1:] == 0).all()
    assert np.abs(pixels.astype(int) - turned).max() <= 1


@pytest.mark.parametrize("setting", ["environment.sky.image=other.png", "environment.sky={}", "environment={}"])
def test_a_sky_is_named_once(run: Callable[..., Any], tiny_scene: Path, tmp_path: Path, setting: str) -> None:
    sky, picture = tmp_path / "red.png", tmp_path / "a.png"
    sky.write_bytes(png_bytes(np.tile(np.array([200, 0, 0], np.uint8), (8, 16, 1))))
    result = run("render", tiny_scene, "-o", picture, "--sky", sky, "--set", setting, *SMALL)
    assert result.exit_code == 2
    assert result.stderr == f"--set {setting.split('=')[0]}: cannot be given beside --sky\n"
    assert not picture.exists()


@pytest.mark.parametrize(
    ("sky", "defect"),
    [
        ("no.hdr", "no.hdr: no such file"),
        ("scene.yaml", "scene.yaml: '.yaml' is not a picture of a sky (use .hdr, .exr, .png, .jpg)"),
    ],
)
def test_what_is_no_sky(run: Callable[..., Any], tiny_scene: Path, tmp_path: Path, sky: str, defect: str) -> None:
    result = run("render", tiny_scene, "-o", tmp_path / "a.png", "--sky", tiny_scene.with_name(sky))
    assert result.exit_code == 2 and result.stderr.strip() == f"{tiny_scene.parent}/{defect}"


@pytest.mark.gl
def test_a_scene_without_camera_is_framed(run: Callable[..., Any], tiny_scene: Path, tmp_path: Path) -> None:
    text = tiny_scene.read_text()
    tiny_scene.write_text(text[: text.index("camera:")])
    result = run("render", tiny_scene, "-o", tmp_path / "a.png", "--no-background", *SMALL)
    assert result.exit_code == 0, (result.stderr, result.exception)
    alpha = read_png(tmp_path / "a.png")[1][..., 3]
    assert alpha[32, 48] == 255
    assert not alpha[[0, -1]].any() and not alpha[:, [0, -1]].any()


def test_a_turntable_goes_around_the_target_once_the_way_of_the_window() -> None:
    first = Camera((1.0, 2.0, 7.0), (1.0, 1.0, 5.0), 1.0)
    cameras = turntable_cameras(first, 4, 2.0)
    assert [camera.time for camera in cameras] == [0, 0.5, 1, 1.5]  # animations go on
    assert cameras[0] == first and {camera.target for camera in cameras} == {first.target}
    found = np.array([camera.position for camera in cameras[1:]])
    assert found == pytest.approx(np.array([(-1, 2, 5), (1, 2, 3), (3, 2, 5)]))
    seen = orbit.turn(first, math.pi / 2 / orbit.RADIANS_PER_PIXEL, 0.0)
    assert found[0] == pytest.approx(np.array(seen.position))


@pytest.mark.gl
def test_a_turntable_shows_the_model_in_every_frame(run: Callable[..., Any], tiny_scene: Path, tmp_path: Path) -> None:
    model = tiny_scene.with_name("ball.ply")
    out = tmp_path / "{frame}.png"
    options = ("--turntable", "0.1", "--frames", "1-2", "--camera-direction", "-1,0,-1", "--no-background")
    result = run("render", model, "-o", out, *options, *SMALL)
    assert result.stdout == "".join(f"{tmp_path}/{number}.png\n" for number in (1, 2)), result.stderr
    for number in (1, 2):
        alpha = read_png(tmp_path / f"{number}.png")[1][..., 3]
        assert alpha[32, 48] == 255 and not alpha[[0, -1]].any() and not alpha[:, [0, -1]].any()


@pytest.mark.gl
def test_stdout_takes_a_png_and_nothing_else(run: Callable[..., Any], tiny_scene: Path) -> None:
    result = run("render", tiny_scene, "-o", "-", *SMALL)
    assert result.exit_code == 0 and result.stderr == ""
    picture = Image.open(io.BytesIO(result.stdout_bytes))
    assert (picture.format, picture.size) == ("PNG", (96, 64))


@pytest.mark.gl
def test_a_path_gives_a_file_per_frame(run: Callable[..., Any], tiny_scene: Path, tmp_path: Path) -> None:
    walk = tiny_scene.with_name("walk.yaml")
    out = tmp_path / "out"
    out.mkdir()
    result = run("render", tiny_scene, "-o", out / "f{frame:4}.png", "--path", walk, *SMALL)
    names = ["f0000.png", "f0001.png", "f0002.png"]
    assert result.stdout.split() == [str(out / name) for name in names]
    assert listing(out) == names
    low, high = (read_png(out / name)[1].astype(int) for name in (names[0], names[2]))
    assert np.abs(low - high).max() > 20


@pytest.mark.gl
def test_frames_limits_a_path(run: Callable[..., Any], tiny_scene: Path, tmp_path: Path) -> None:
    walk = tiny_scene.with_name("walk.yaml")
    run("render", tiny_scene, "-o", tmp_path / "f{frame}.png", "--path", walk, "--frames", 2, *SMALL)
    assert listing(tmp_path) == ["f0.png", "f1.png", "scene"]
    result = run("render", tiny_scene, "-o", tmp_path / "single.png", "--path", walk, "--frames", 1, *SMALL)
    assert result.exit_code == 0 and (tmp_path / "single.png").is_file()


@pytest.mark.gl
@pytest.mark.slow
@pytest.mark.parametrize("suffix", ["png", "jpg", "exr"])
def test_resume_draws_what_is_missing_or_was_drawn_of_something_else(
    run: Callable[..., Any], tiny_scene: Path, tmp_path: Path, suffix: str
) -> None:
    walk = tiny_scene.with_name("walk.yaml")
    base = "render", tiny_scene, "--path", walk, *SMALL
    run(*base, "-o", tmp_path / f"all{{frame}}.{suffix}")
    run(*base, "-o", tmp_path / f"f{{frame}}.{suffix}", "--frames", "1-1")
    assert run(*base, "-o", f"file://{tmp_path}/url{{frame}}.{suffix}").exit_code == 0
    files = [tmp_path / f"f{frame}.{suffix}" for frame in range(3)]
    (tmp_path / f"f0.{suffix}").write_bytes((tmp_path / f"all2.{suffix}").read_bytes())  # another frame
    before = files[1].stat().st_mtime_ns
    resumed = run(*base, "-o", tmp_path / f"f{{frame}}.{suffix}", "--resume")
    assert resumed.stdout.split() == [str(files[0]), str(files[2])] and files[1].stat().st_mtime_ns == before
    for name in ("f", "url"):
        found = [(tmp_path / f"{name}{frame}.{suffix}").read_bytes() for frame in range(3)]
        assert found == [(tmp_path / f"all{frame}.{suffix}").read_bytes() for frame in range(3)]
    coarser = run(*base, "-o", tmp_path / f"f{{frame}}.{suffix}", "--resume", "--set", "render.lod.bias=1")
    assert len(coarser.stdout.split()) == 3


@pytest.mark.gl
def test_mp4_holds_the_paths_frames(run: Callable[..., Any], tiny_scene: Path, tmp_path: Path) -> None:
    out = tmp_path / "a.mp4"
    result = run("render", tiny_scene, "-o", out, "--path", tiny_scene.with_name("walk.yaml"), *SMALL)
    assert (result.exit_code, result.stdout) == (0, f"{out}\n"), result.stderr
    decode = [imageio_ffmpeg.get_ffmpeg_exe(), "-i", str(out), "-f", "rawvideo", "-pix_fmt", "rgb24", "-"]
    done = subprocess.run(decode, capture_output=True, check=True)
    pictures = np.frombuffer(done.stdout, np.uint8).reshape(-1, 64, 96, 3)
    assert len(pictures) == 3
    assert pictures[0, 32, 48].mean() > pictures[0, 0, 0].mean() + 30
    assert re.search(rb"Video: h264 .* 96x64, .* 1 fps", done.stderr)
    assert listing(tmp_path) == ["a.mp4", "scene"]


@pytest.mark.gl
@pytest.mark.parametrize("name", ["a.webp", "a.gif"])
def test_animations_hold_the_paths_frames(run: Callable[..., Any], tiny_scene: Path, tmp_path: Path, name: str) -> None:
    out = tmp_path / name
    walk = tiny_scene.with_name("walk.yaml")
    result = run("render", tiny_scene, "-o", out, "--path", walk, "--no-background", *SMALL)
    assert (result.exit_code, result.stdout, result.stderr) == (0, f"{out}\n", "")
    with Image.open(out) as shown:
        assert (shown.size, getattr(shown, "n_frames", 1)) == ((96, 64), 3)
        alpha = np.asarray(shown.convert("RGBA"))[..., 3]
    assert alpha[0, 0] == 0 and alpha[32, 48] == 255
    assert listing(tmp_path) == [name, "scene"]


@pytest.mark.gl
def test_a_webp_file_of_one_frame_is_a_picture(run: Callable[..., Any], tiny_scene: Path, tmp_path: Path) -> None:
    walk = ("--path", tiny_scene.with_name("walk.yaml"))
    for name, options in ("a.webp", ()), ("b.webp", (*walk, "--frames", "1")), ("c{frame}.webp", walk):
        assert run("render", tiny_scene, "-o", tmp_path / name, *options, *SMALL).exit_code == 0
    assert listing(tmp_path) == ["a.webp", "b.webp", "c0.webp", "c1.webp", "c2.webp", "scene"]
    for file in tmp_path.glob("*.webp"):
        with Image.open(file) as shown:
            assert (shown.format, shown.mode, shown.size, getattr(shown, "n_frames", 1)) == ("WEBP", "RGB", (96, 64), 1)


@pytest.mark.gl
def test_an_existing_file_is_replaced(run: Callable[..., Any], tiny_scene: Path, tmp_path: Path) -> None:
    (tmp_path / "a.png").write_bytes(b"old")
    run("render", tiny_scene, "-o", tmp_path / "a.png", *SMALL)
    assert read_png(tmp_path / "a.png")[1].shape == (64, 96, 3)


@pytest.mark.gl
def test_mp4_of_odd_sides_says_what_it_is_scaled_to(run: Callable[..., Any], tiny_scene: Path, tmp_path: Path) -> None:
    out = tmp_path / "a.mp4"
    walk = tiny_scene.with_name("walk.yaml")
    result = run("render", tiny_scene, "-o", out, "--path", walk, "--resolution", "63,47")
    assert (result.exit_code, result.stdout) == (0, f"{out}\n"), result.stderr
    assert result.stderr == f"{out}: the sides of a video are even; scaled to 64,48\n"
    shown = subprocess.run([imageio_ffmpeg.get_ffmpeg_exe(), "-i", str(out)], capture_output=True)
    assert re.search(rb"Video: h264 .* 64x48, .* 1 fps", shown.stderr)


@pytest.mark.gl
@pytest.mark.parametrize("name", ["a.mp4", "a{frame}.png"])
def test_an_error_on_the_way_leaves_no_partial_file(
    run: Callable[..., Any], tiny_scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    drawn = []

    def draw(self: HeadlessRenderer, view: View, transparent: bool = False, linear: bool = False) -> None:
        drawn.append(view)
        if len(drawn) == 2:
            raise RuntimeError("the driver fell over\nand more")

    monkeypatch.setattr(HeadlessRenderer, "draw", draw)
    result = run("render", tiny_scene, "-o", tmp_path / name, "--path", tiny_scene.with_name("walk.yaml"), *SMALL)
    assert result.exit_code == 1
    assert result.stderr == ("depthwalk: RuntimeError: the driver fell over\nrun with --verbose for the traceback\n")
    assert listing(tmp_path) == (["scene"] if name == "a.mp4" else ["a0.png", "scene"])


@pytest.mark.slow
def test_verbose_shows_the_traceback(
    run: Callable[..., Any], tiny_scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def draw(self: HeadlessRenderer, view: View, transparent: bool = False, linear: bool = False) -> None:
        raise RuntimeError("the driver fell over")

    monkeypatch.setattr(HeadlessRenderer, "draw", draw)
    result = run("render", tiny_scene, "-o", tmp_path / "a.png", "--verbose", *SMALL)
    assert result.exit_code == 1
    assert "Traceback (most recent call last):" in result.stderr


@pytest.mark.gl
def test_pictures_are_supersampled_unless_the_scene_says_otherwise(
    run: Callable[..., Any], tiny_scene: Path, tmp_path: Path
) -> None:
    def rendered(name: str, *options: str) -> Picture:
        assert run("render", tiny_scene, "-o", tmp_path / name, *SMALL, *options).exit_code == 0
        return read_png(tmp_path / name)[1]

    default, none = rendered("a.png"), rendered("b.png", "--set", "render.aa=none")
    np.testing.assert_array_equal(default, rendered("c.png", "--set", "render.aa=ssaa"))
    assert (default != none).any()


@pytest.mark.parametrize(
    ("render", "size", "expected"),
    [
        ({}, (3840, 2160), "ssaa"),
        ({}, (8192, 4096), "smaa"),
        ({"aa": "none"}, (640, 480), "none"),
        ({"preset": "paper"}, (640, 480), "none"),
        ({"dof": {"mode": "accumulate"}}, (640, 480), "none"),
    ],
)
def test_what_smooths_pictures_by_default(render: dict[str, Any], size: tuple[int, int], expected: str) -> None:
    scene = SimpleNamespace(render=RenderSettings.model_validate(render))
    smooth(cast(Scene, scene), size)
    assert scene.render.aa == expected


def test_a_turntable_seen_from_straight_above_is_refused() -> None:
    with pytest.raises(InputError, match="straight up or down"):
        turntable_cameras(Camera((1.0, 5.0, 2.0), (1.0, 0.0, 2.0)), 4, 30.0)
