"""`depthwalk check`, and what a file is taken for."""

import weakref
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from depthwalk.ingest.reader import read_soup
from depthwalk.ingest.soup import Soup


def test_check_counts_what_good_files_hold(run: Callable[..., Any], tiny_scene: Path) -> None:
    walk = tiny_scene.with_name("walk.yaml")
    result = run("check", tiny_scene, walk)
    assert result.exit_code == 0
    assert result.stdout == f"{tiny_scene}: ok, 1 object, 1 asset\n{walk}: ok, 3 keyframes, 3 frames\n"
    assert result.stderr == ""


@pytest.mark.gl
def test_a_mesh_is_a_scene_of_its_own(run: Callable[..., Any], tiny_scene: Path, tmp_path: Path) -> None:
    ball, out = tiny_scene.with_name("ball.ply"), tmp_path / "ball.png"
    assert run("check", ball).stdout == f"{ball}: ok, 1 object, 1 asset\n"
    coarse = "assets.model.dpci={resolution: 64, layers: 1}"
    result = run("render", ball, "-o", out, "--resolution", "96,64", "--no-background", "--set", coarse)
    assert (result.exit_code, result.stdout, result.stderr) == (0, f"{out}\n", "")
    alpha = np.asarray(Image.open(out))[..., 3]
    assert alpha[32, 48] == 255 and not alpha[[0, -1]].any() and not alpha[:, [0, -1]].any()
    height = np.flatnonzero(alpha.any(1)).size
    assert 56 <= height <= 58  # nine tenths of the picture


@pytest.mark.gl
def test_a_still_of_a_mesh_bakes_nothing(
    run: Callable[..., Any], tiny_scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Unless depth images are asked for; the picture is the one that --representation mesh draws."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    ball, small = tiny_scene.with_name("ball.ply"), ("--resolution", "96,64")
    still, polygons, images = (tmp_path / f"{name}.png" for name in ("still", "polygons", "images"))
    assert run("render", ball, "-o", still, *small).exit_code == 0
    assert not list((tmp_path / "cache").rglob("*.npz"))
    assert run("render", ball, "-o", polygons, *small, "--representation", "mesh").exit_code == 0
    assert still.read_bytes() == polygons.read_bytes()
    coarse = "assets.model.dpci={resolution: 32, layers: 1}"
    assert run("render", ball, "-o", images, *small, "--set", coarse).exit_code == 0
    assert list((tmp_path / "cache").rglob("*.npz"))


@pytest.mark.gl
def test_what_lies_level_is_drawn_as_polygons(run: Callable[..., Any], tmp_path: Path) -> None:
    """And baked nowhere; what is flat and stands has depth images."""
    floor, out = tmp_path / "floor.obj", tmp_path / "floor.png"
    floor.write_text("v 0 0 0\nv 1 0 0\nv 1 0 1\nv 0 0 1\nf 1 4 3 2\n")
    refusal = f"{floor}: is flat and horizontal; draw it as polygons, without 'dpci' or by --representation mesh\n"
    drawn = "render", floor, "-o", out, "--resolution", "96,64", "--no-background"
    images = *drawn, "--representation", "dpci"
    for arguments in (("check", floor), ("bake", floor), ("compare", floor), images):
        result = run(*arguments)
        assert (result.exit_code, result.stderr) == (2, refusal)
    wall = "--set", "assets.model.up=z", "--set", "assets.model.dpci={resolution: 32, layers: 1}"
    for options in (), ("--representation", "mesh"), wall:
        assert run(*drawn, *options).exit_code == 0
        assert (np.asarray(Image.open(out))[..., 3] == 255).mean() > 0.05


def test_scenes_and_paths_are_told_apart(run: Callable[..., Any], tiny_scene: Path) -> None:
    walk = tiny_scene.with_name("walk.yaml")
    for arguments, message in (
        ([walk], f"{walk}: is a camera path, not a scene; give it as --path\n"),
        ([tiny_scene, "--path", tiny_scene], f"{tiny_scene}: is a scene file, not a camera path\n"),
    ):
        result = run("render", *arguments, "-o", "-")
        assert (result.exit_code, result.stdout, result.stderr) == (2, "", message)


def test_check_lists_every_error_of_every_file(run: Callable[..., Any], tiny_scene: Path, tmp_path: Path) -> None:
    bad = tmp_path / "bad.yaml"
    bad.write_text("version: 1\nobjects:\n  - {asset: none}\nrender: {lood: {}}\n")
    walk = tmp_path / "bad-walk.yaml"
    walk.write_text("version: 1\nkeyframes: [{time: 0, position: [0, 0], target: [0, 0, 0]}]\n")
    result = run("check", bad, tiny_scene, walk, tmp_path / "none.yaml")
    assert result.exit_code == 2
    assert result.stdout == f"{tiny_scene}: ok, 1 object, 1 asset\n"
    assert result.stderr.splitlines() == [
        f"{bad}:4:10: render.lood: unknown key; did you mean 'lod'?",
        f"{walk}:2:33: keyframes[0].position: must be [x, y, z]",
        f"{tmp_path / 'none.yaml'}: no such file",
    ]


def test_check_reads_the_meshes(run: Callable[..., Any], tiny_scene: Path) -> None:
    mesh = tiny_scene.with_name("ball.ply")
    mesh.write_text("ply\nformat ascii 1.0\nelement vertex 0\nend_header\n")
    result = run("check", tiny_scene)
    assert (result.exit_code, result.stdout) == (2, "")
    assert result.stderr.startswith(f"{tiny_scene}:3:9: assets.ball: {mesh}: ")
    assert run("info", tiny_scene).stderr == result.stderr


def test_files_are_told_with_the_first_place_that_names_them(
    run: Callable[..., Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    mesh, scene, other = (tmp_path / name for name in ("a.ply", "scene.yaml", "other.ply"))
    mesh.write_bytes(b"no mesh")
    other.write_bytes(b"none either")
    scene.write_text('version: 1\nassets:\n  one: {mesh: a.ply}\n  two: {mesh: a.ply}\n  "3":\n    mesh: other.ply\n')
    first, third = f"{scene}:3:8: assets.one: {mesh}: not a PLY file", f"{other}: not a PLY file\n"
    assert run("check", scene).stderr == f"{first}\n{scene}:6:5: assets.3: {third}"
    # What an option names is not in the file.
    assert run("check", scene, "--set", "assets.one.mesh=other.ply").stderr.startswith(f"{other}: not a PLY file\n")
    assert run("check", other).stderr == third
    monkeypatch.chdir(tmp_path)
    assert run("check", "scene.yaml").stderr.startswith("scene.yaml:3:8: assets.one: a.ply: not a PLY file\n")


def test_lists_of_places_and_advice_are_told_with_their_place(run: Callable[..., Any], tiny_scene: Path) -> None:
    (tiny_scene.parent / "trees.csv").write_text("hi\n")
    (tiny_scene.parent / "advice.json").write_text("{")
    text = tiny_scene.read_text()
    tiny_scene.write_text("advice: advice.json\n" + text)
    begins = f"{tiny_scene}:1:9: advice: {tiny_scene.parent / 'advice.json'}"
    assert run("check", tiny_scene).stderr.startswith(begins)
    tiny_scene.write_text(text.replace("objects:\n", "objects:\n  - places: {asset: ball, file: trees.csv}\n"))
    named = f"objects[0].places.file: {tiny_scene.parent / 'trees.csv'}:1: unknown column 'hi'"
    assert named in run("check", tiny_scene).stderr


@pytest.mark.gl
def test_check_reads_the_relief_of_an_asset(run: Callable[..., Any], tiny_scene: Path) -> None:
    relief = tiny_scene.with_name("bumps.png")
    relief.write_bytes(b"no picture")
    meso = "layers: 1, meso: {depth: bumps.png, height: 0.01, tile: [0.5, 0.5]}"
    tiny_scene.write_text(tiny_scene.read_text().replace("layers: 1", meso))
    result = run("check", tiny_scene)
    assert (result.exit_code, result.stdout) == (2, "")
    assert result.stderr.startswith(f"{tiny_scene}:3:9: assets.ball: {relief}: ") and result.stderr.count("\n") == 1
    assert run("render", tiny_scene, "-o", "-").stderr == result.stderr


def test_check_refuses_a_range_image_without_surface(run: Callable[..., Any], tmp_path: Path) -> None:
    lonely = np.zeros((30, 40), np.uint16)
    lonely[::3, ::3] = 900
    Image.fromarray(lonely).save(tmp_path / "d.png")
    lens = "{fx: 50, fy: 50, cx: 20, cy: 15}"
    scene = tmp_path / "scene.yaml"
    scene.write_text(f"version: 1\nassets:\n  a: {{depth_image: {{depth: d.png, unit: 0.001, intrinsics: {lens}}}}}\n")
    result = run("check", scene)
    defect = "the range image holds no surface: no pixel continues its neighbours"
    assert (result.exit_code, result.stderr) == (2, f"{scene}:3:6: assets.a: {tmp_path / 'd.png'}: {defect}\n")


def test_check_bakes_nothing_and_keeps_no_mesh(
    run: Callable[..., Any], tiny_scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    cache = tmp_path / "cache"
    monkeypatch.setenv("XDG_CACHE_HOME", str(cache))
    text = tiny_scene.read_text()
    again = "\n".join(f"  ball{k}: {{mesh: ball.ply, height: {k + 1}, dpci: {{resolution: 64}}}}" for k in range(3))
    depth = np.linspace(1, 1.2, 40 * 30, dtype=np.float32).reshape(30, 40)
    np.save(tiny_scene.with_name("d.npy"), depth)
    seen = "  seen: {depth_image: {depth: d.npy, intrinsics: {fx: 50, fy: 50, cx: 20, cy: 15}}}"
    tiny_scene.write_text(text.replace("objects:", f"{again}\n{seen}\nobjects:"))
    alive: list[Any] = []

    def watched(*arguments: Any, **options: Any) -> Soup:
        assert not [mesh for mesh in alive if mesh() is not None]
        mesh = read_soup(*arguments, **options)
        alive.append(weakref.ref(mesh))
        return mesh

    monkeypatch.setattr("depthwalk.ingest.loader.read_soup", watched)
    result = run("check", tiny_scene)
    assert (result.exit_code, len(alive)) == (0, 4), result.stderr
    assert not cache.exists()


def test_pictures_of_sky_and_ground_are_told_where_they_are_named(run: Callable[..., Any], tiny_scene: Path) -> None:
    for name in ("sky.hdr", "ground.png"):
        tiny_scene.with_name(name).write_text("no picture")
    text = tiny_scene.read_text()
    assert "environment" not in text
    pictures = "environment:\n  sky: {model: image, image: sky.hdr}\n  ground: {texture: ground.png}\n"
    tiny_scene.write_text(f"{pictures}{text}")
    ground, sky = run("check", tiny_scene).stderr.splitlines()
    folder = tiny_scene.parent
    assert ground == (
        f"{tiny_scene}:3:21: environment.ground.texture: {folder / 'ground.png'}: cannot be read as an image"
    )
    assert sky.startswith(f"{tiny_scene}:2:30: environment.sky.image: {folder / 'sky.hdr'}: not a Radiance picture")
    tiny_scene.write_text(text)
    by_option = run("check", tiny_scene, "--set", "environment.sky={model: image, image: sky.hdr}")
    assert by_option.stderr.startswith(f"--set environment.sky: image: {folder / 'sky.hdr'}: not a Radiance picture")
