"""`depthwalk bake` and `info`."""

import errno
import os
import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import pytest
from PIL import Image

import depthwalk
import shapes
from depthwalk.bake.file import read_baked, read_header
from files import write_ply
from glb_files import Glb


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("court.html", "a web page, such as a report; a browser opens it"),
        ("court.png", "a picture; --sky lights a scene or a model by it"),
        (
            "court.advice.json",
            "advice or measurements, such as `advise` writes; a scene names advice by the key 'advice'",
        ),
        (
            "court.txt",
            "'.txt' is not a mesh format (use .obj, .ply, .stl, .off, .glb, .gltf, "
            ".usd, .usda, .usdc, .usdz, .las, .laz, .fbx, .dae, .3ds, .3mf)",
        ),
    ],
)
def test_info_says_what_other_files_are(run: Callable[..., Any], tmp_path: Path, name: str, message: str) -> None:
    assert run("info", tmp_path / name).stderr == f"{tmp_path / name}: no such file\n"
    (tmp_path / name).write_text("court")
    result = run("info", tmp_path / name)
    assert (result.exit_code, result.stderr) == (2, f"{tmp_path / name}: {message}\n")


def test_a_full_disk_is_no_mistake_in_the_mesh(
    run: Callable[..., Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*arguments: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr("depthwalk.assets.bake_job.write_baked", full)
    mesh = write_ply(tmp_path / "ball.ply", shapes.sphere(1.0, columns=32, rows=16))
    result = run("bake", mesh, "--dpci-resolution", 16, "--layers", 1)
    out = mesh.with_suffix(".dpci.exr")
    assert (result.exit_code, result.stderr) == (1, f"{out}: cannot be written: {os.strerror(errno.ENOSPC)}\n")


@pytest.fixture
def meshes(tmp_path: Path) -> tuple[Path, Path]:
    good = write_ply(tmp_path / "ball.ply", shapes.sphere(1.0, columns=32, rows=16))
    bad = tmp_path / "bad.ply"
    bad.write_bytes(b"ply\n")
    return good, bad


@pytest.mark.slow
def test_bake_goes_on_after_a_bad_mesh(run: Callable[..., Any], meshes: tuple[Path, Path], tmp_path: Path) -> None:
    good, bad = meshes
    other = write_ply(tmp_path / "box.ply", shapes.box(1.0, 2.0, 1.0))
    result = run("bake", bad, good, other, "--dpci-resolution", 64, "--layers", 1, "--jobs", 1)
    assert result.exit_code == 2
    assert result.stderr.startswith(f"{bad}: ") and result.stderr.count("\n") == 1
    lines = sorted(result.stdout.splitlines())
    line = r"{}: {} triangles, \d+ images of 64², \d+\.\d MB, 0\.\d\d % of the visible surface left out; "
    line += r"\d+\.\d\d s \(read .*, top image .*, side image .*, coverage .*, write \S+\)"
    assert re.fullmatch(line.format(re.escape(str(tmp_path / "ball.dpci.exr")), 960), lines[0])
    assert re.fullmatch(line.format(re.escape(str(tmp_path / "box.dpci.exr")), 12), lines[1])
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "bad.ply", "ball.dpci.exr", "ball.ply", "box.dpci.exr", "box.ply",
    ]  # fmt: skip
    assert read_baked(tmp_path / "ball.dpci.exr").parts[0].images[0].depth.shape == (64, 64)


def test_bake_says_what_helps_where_much_is_left_out(run: Callable[..., Any], tmp_path: Path) -> None:
    """Thin plates one behind the other, each seen past the others: one layer holds the outer ones."""
    plates = shapes.joined(*(shapes.box(1.0, 1.0, 0.02, (0, 0, 0.2 * number)) for number in range(6)))
    mesh = write_ply(tmp_path / "plates.ply", plates)
    poor = run("bake", mesh, "--dpci-resolution", 32, "--layers", 1)
    assert poor.exit_code == 0
    assert re.search(r"plates\.dpci\.exr: \d+\.\d % of the visible surface will be missing; --layers auto", poor.stderr)
    assert "missing" not in run("bake", mesh, "--dpci-resolution", 32, "--layers", "auto", "--force").stderr


@pytest.mark.gl
def test_a_scene_uses_what_bake_wrote_beside_the_mesh(
    run: Callable[..., Any], tiny_scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    mesh = tiny_scene.with_name("ball.ply")
    run("bake", mesh, "--dpci-resolution", 64, "--layers", 1)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "empty"))
    monkeypatch.setattr("depthwalk.bake.parts.bake_model", None)  # baking once more would fail
    result = run("render", tiny_scene, "-o", tmp_path / "a.png", "--resolution", "96,64")
    assert result.exit_code == 0, result.stderr


def test_bake_writes_where_it_is_told(run: Callable[..., Any], meshes: tuple[Path, Path], tmp_path: Path) -> None:
    out = tmp_path / "baked"
    out.mkdir()
    arguments = ("bake", meshes[0], "--dpci-resolution", 16, "--layers", 1, "--height", 3, "-o")
    assert run(*arguments, out).exit_code == 0
    assert run(*arguments, tmp_path / "named.dpci.exr").exit_code == 0
    assert [path.name for path in out.iterdir()] == ["ball.dpci.exr"]
    baked = read_baked(tmp_path / "named.dpci.exr")
    assert baked.parts[0].cylinder.height * 14 / 16 == pytest.approx(3.0, abs=0.01)  # less the margins, a texel each
    assert baked.key == read_header(out / "ball.dpci.exr")["depthwalk.key"]


@pytest.mark.slow
def test_bake_writes_to_urls(run: Callable[..., Any], meshes: tuple[Path, Path]) -> None:
    """Of a folder and of a file, in the memory of this process."""
    from fsspec.implementations.memory import MemoryFileSystem

    arguments = ("bake", meshes[0], "--dpci-resolution", 16, "--layers", 1, "-o")
    for url, file in (("memory://baked/", "/baked/ball.dpci.exr"), ("memory://baked/a.dpci.npz", "/baked/a.dpci.npz")):
        result = run(*arguments, url)
        assert result.exit_code == 0 and result.stdout.startswith(f"memory:/{file}: 960 triangles"), result.stderr
        size = MemoryFileSystem().size(file)
        assert run(*arguments, url).stdout == f"memory:/{file}: is up to date; --force bakes it again\n"
        assert MemoryFileSystem().size(file) == size > 1000


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["{d}/ball.ply", "{d}/bad.ply", "-o", "{d}/x.exr"], "{d}/x.exr: several meshes need an existing folder"),
        (
            ["{d}/ball.ply", "-o", "{d}/x.png"],
            "{d}/x.png: must be an existing folder, or a file that ends in .dpci.exr or .dpci.npz",
        ),
        (["{d}/ball.ply", "-o", "file://{d}/x.png"], "file://{d}/x.png: must end in / or in .dpci.exr or .dpci.npz"),
        (
            ["{d}/ball.ply", "{d}/bad.ply", "-o", "file://{d}/x.exr"],
            "file://{d}/x.exr: several meshes need a folder, whose URL ends in /",
        ),
        (["{d}/ball.ply", "-o", "nowhere://x/"], "nowhere://x/: Protocol not known: nowhere"),
        (["{d}/ball.ply", "-o", "file://{d}/", "--verify"], "--verify needs files on this machine, but -o names a URL"),
        (["{d}/ball.ply", "-o", "{d}/no/x.exr"], "{d}/no/x.exr: the folder '{d}/no' does not exist"),
        (["{d}/ball.ply", "--height", "0"], "--height 0: must be above 0 and at most 1000000 metres"),
        (["{d}/ball.ply", "--height", "nan"], "--height nan: must be above 0 and at most 1000000 metres"),
        (
            ["{d}/ball.ply", "{d}/ball.obj"],
            "{d}/ball.dpci.exr: {d}/ball.ply and {d}/ball.obj would both be baked to it",
        ),
        (["{d}/none.ply"], "{d}/none.ply: no such file"),
        (["{d}/no/none.ply"], "{d}/no/none.ply: no such file"),
        (
            ["{d}/ball.ply", "{d}/none.ply", "{d}", "{d}/court.yaml"],
            "{d}/none.ply: no such file\n{d}: is a folder\n{d}/court.yaml: no such file",
        ),
        (["{d}/ball.ply", "--texture", "{d}/none.png"], "{d}/none.png: no such file"),
        (["teapot.ply"], "teapot.ply: ships with the program; choose a place to write to with -o"),
    ],
)
def test_bake_refuses(
    run: Callable[..., Any], meshes: tuple[Path, Path], tmp_path: Path, arguments: Sequence[str], message: str
) -> None:
    before = sorted(tmp_path.iterdir())
    result = run("bake", *(argument.format(d=tmp_path) for argument in arguments))
    assert (result.exit_code, result.stdout, result.stderr) == (2, "", message.format(d=tmp_path) + "\n")
    assert sorted(tmp_path.iterdir()) == before


@pytest.mark.slow
def test_bake_takes_files_that_ship(run: Callable[..., Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    result = run("bake", "teapot.ply", "-o", "a.dpci.exr", "--dpci-resolution", 16, "--layers", 1)
    assert result.exit_code == 0 and result.stdout.startswith("a.dpci.exr: 5776 triangles"), result.stderr


def rows(text: str) -> dict[str, str]:
    """The table that `info` prints, by its first column of 24 characters."""
    return {line[:24].rstrip(): line[25:] for line in text.splitlines()}


@pytest.mark.gl
def test_info_names_versions_and_renderer(run: Callable[..., Any]) -> None:
    result = run("info")
    assert result.exit_code == 0
    table = rows(result.stdout)
    assert table["depthwalk"] == depthwalk.__version__
    assert table["most objects"] == "4000000"
    assert "OpenGL renderer" in table


def test_info_says_so_where_there_is_no_opengl(run: Callable[..., Any], monkeypatch: pytest.MonkeyPatch) -> None:
    from depthwalk.gpu.failures import GpuError

    def no_device() -> None:
        raise GpuError("no OpenGL 3.3 context: none")

    monkeypatch.setattr("depthwalk.gpu.headless_device.headless_device", no_device)
    result = run("info")
    assert result.exit_code == 0
    assert rows(result.stdout)["OpenGL"] == "no OpenGL 3.3 context: none"


@pytest.mark.slow
def test_info_describes_files(
    run: Callable[..., Any], meshes: tuple[Path, Path], tiny_scene: Path, tmp_path: Path
) -> None:
    mesh = rows(run("info", meshes[0]).stdout)
    assert (mesh["kind"], mesh["triangles"], mesh["size"]) == ("mesh", "960", "2 × 2 × 2 m")
    scene = rows(run("info", tiny_scene).stdout)
    assert (scene["objects"], scene["drawn as"], scene["made of"]) == ("1", "auto 1", "3,968 triangles")
    assert scene["asset ball"] == "ball.ply, 1 object of 3,968 triangles"
    walk = rows(run("info", tiny_scene.with_name("walk.yaml")).stdout)
    assert (walk["keyframes"], walk["frames"], walk["duration"]) == ("3", "3 at 1 a second, step", "2 s")
    run("bake", meshes[0], "--dpci-resolution", 64, "--layers", 1)
    baked = rows(run("info", tmp_path / "ball.dpci.exr").stdout)
    assert (baked["kind"], baked["made of"]) == ("depth images", "960 triangles")
    assert re.fullmatch(r"0\.\d\d % of the visible surface", baked["left out"])
    assert re.fullmatch(
        r"radius 1\.000\d* m, y from -0\.032\d* to 2\.032\d* m; about \(.*\) along \(0, 1, 0\)", baked["cylinder"]
    )
    assert re.fullmatch(r"64 × 64, \d\d\.\d % covered, depths \S+ to \S+ m", baked["part top.0"])


def test_info_describes_several_files_and_tells_which_cannot_be_read(run: Callable[..., Any], tmp_path: Path) -> None:
    (tmp_path / "empty.obj").touch()
    (tmp_path / "flat.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    result = run("info", *(tmp_path / name for name in ("empty.obj", "flat.obj", "gone.obj", "flat.obj")))
    assert result.exit_code == 2
    assert result.stderr == f"{tmp_path / 'empty.obj'}: empty file\n{tmp_path / 'gone.obj'}: no such file\n"
    one, other = result.stdout.split("\n\n")
    assert one + "\n" == other and rows(one)["triangles"] == "1"


def test_info_tells_of_colours(run: Callable[..., Any], tmp_path: Path) -> None:
    mesh = tmp_path / "a.obj"
    for colour, said, surface in ("", None, "colour #"), (" 1 0 0", "one for each vertex", "no texture"):
        mesh.write_text("".join(f"v {place}{colour}\n" for place in ("0 0 0", "1 0 0", "0 1 0")) + "f 1 2 3\n")
        described = rows(run("info", mesh).stdout)
        assert described.get("colours") == said and surface in described["material 0"]


def test_info_lists_the_largest_of_many_materials(run: Callable[..., Any], tmp_path: Path) -> None:
    """And of many assets; --verbose lists all of them."""
    mesh = tmp_path / "a.obj"
    faces = [f"usemtl m{number}\n" + "f 1 2 3\n" * (2 if number % 2 else 1) for number in range(30)]
    (tmp_path / "a.mtl").write_text("".join(f"newmtl m{number}\nKd 0 0 {number / 30}\n" for number in range(30)))
    mesh.write_text("mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\n" + "".join(faces))
    found = rows(run("info", mesh).stdout)
    listed = [value.split(",")[0] for name, value in found.items() if name.startswith("material ")]
    assert sorted(listed) == ["1 triangle"] * 5 + ["2 triangles"] * 15
    assert found["other materials"] == "10, 10 triangles; --verbose lists them"
    every = rows(run("info", mesh, "--verbose").stdout)
    assert {f"material {number}" for number in range(30)} < set(every) and "other materials" not in every

    scene = tmp_path / "scene.yaml"
    assets = ", ".join(f"a{number}: {{mesh: a.obj}}" for number in range(25))
    objects = ", ".join(f"{{asset: a{number}}}" for number in (*range(25), 24, 23))
    scene.write_text(f"version: 1\nassets: {{{assets}}}\nobjects: [{objects}]\n")
    found = rows(run("info", scene).stdout)
    assert "asset a24" in found and "asset a17" in found and "asset a18" not in found
    assert found["other assets"] == "5, 5 objects; --verbose lists them"


def test_info_tells_what_reflects(run: Callable[..., Any], tmp_path: Path) -> None:
    for terms, told in (({"roughnessFactor": 0.25}, "roughness 0.25, metalness 1"), ({"metallicFactor": 0}, "#ffffff")):
        glb = Glb()
        glb.header["materials"] = [{"pbrMetallicRoughness": terms}]
        glb.mesh({}, material=0)
        mesh = glb.write(tmp_path / "a.glb", {"mesh": 0})
        assert rows(run("info", mesh).stdout)["material 0"].endswith(told)


def test_info_tells_what_of_a_gltf_file_is_not_read(run: Callable[..., Any], tmp_path: Path) -> None:
    glb = Glb()
    glb.mesh({})
    assert "not read" not in rows(run("info", glb.write(tmp_path / "a.glb")).stdout)
    glb.header["animations"] = [{"channels": [], "samplers": []}]
    assert rows(run("info", glb.write(tmp_path / "b.glb")).stdout)["not read"] == "1 animation"


def test_info_tells_of_normal_maps(run: Callable[..., Any], tmp_path: Path) -> None:
    Image.new("RGB", (4, 2), (128, 128, 255)).save(tmp_path / "n.png")
    (tmp_path / "a.mtl").write_text("newmtl m\nnorm n.png\n")
    mesh = tmp_path / "a.obj"
    mesh.write_text("mtllib a.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    assert "normal map 4 × 2" in rows(run("info", mesh).stdout)["material 0"]


def test_info_tells_of_unlit_materials(run: Callable[..., Any], tmp_path: Path) -> None:
    """Of those that are shown so, and of those that are not since others beside them are lit."""
    glb = Glb()
    glb.header["materials"] = [{"extensions": {"KHR_materials_unlit": {}}}, {}]
    glb.mesh({}, material=0)
    found = rows(run("info", glb.write(tmp_path / "a.glb")).stdout)
    assert found["material 0"].endswith(", unlit") and "not read" not in found
    glb.mesh({}, material=1)
    found = rows(run("info", glb.write(tmp_path / "b.glb", {"mesh": 0}, {"mesh": 1})).stdout)
    assert "unlit" not in found["material 0"] and found["not read"] == "1 unlit material among others"


@pytest.mark.parametrize("name", ["none.ply", "none.exr", "none"])
def test_info_of_a_missing_file(run: Callable[..., Any], tmp_path: Path, name: str) -> None:
    result = run("info", tmp_path / name)
    assert (result.exit_code, result.stdout, result.stderr) == (2, "", f"{tmp_path / name}: no such file\n")
