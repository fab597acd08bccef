"""Reports are written where they harm nothing that was read."""

from pathlib import Path

import pytest

from depthwalk.commands.reports import asset_files, check_report_files, input_files, write_report
from depthwalk.errors import InputError
from depthwalk.scene.advice import advice_text
from depthwalk.scene.loader import load_scene


def test_all_files_of_a_scene_are_inputs(tiny_scene: Path) -> None:
    """Its mesh, the depth images that may lie beside, the path, pictures of ground and sky, places and advice."""
    folder = tiny_scene.parent
    for name in ("grass.png", "sky.hdr"):
        (folder / name).touch()
    around = "environment: {ground: {texture: grass.png}, sky: {model: image, image: sky.hdr}}\n"
    for name in ("here.csv", "there.csv"):
        (folder / name).write_text("x,y,z\n1,0,0\n")
    (folder / "advice.json").write_text(advice_text("a GPU", 0.1, {}))
    listed = [f"{{places: {{asset: ball, file: {name}.csv}}}}" for name in ("here", "there", "here")]
    placed = tiny_scene.read_text().replace("{asset: ball}", "\n  - ".join(listed), 1)
    tiny_scene.write_text(f"{placed}\n{around}advice: advice.json\n")
    found = input_files(load_scene(tiny_scene), folder / "walk.yaml")
    pictures = {"grass.png", "sky.hdr"}
    texts = {"scene.yaml", "walk.yaml", "here.csv", "there.csv", "advice.json"}
    assert sorted(file.name for file in found) == sorted({"ball.ply", "ball.dpci.exr"} | pictures | texts)
    assert folder / "walk.yaml" not in input_files(load_scene(tiny_scene), None)


def test_materials_and_reliefs_of_an_asset_are_its_files(tiny_scene: Path) -> None:
    folder = tiny_scene.parent
    (folder / "ball.obj").write_text("mtllib look.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    (folder / "look.mtl").write_text("newmtl a\n")
    (folder / "bark.png").touch()
    meso = "layers: 1, meso: {depth: bark.png, height: 0.01, tile: [1, 1]}"
    tiny_scene.write_text(tiny_scene.read_text().replace("ball.ply", "ball.obj").replace("layers: 1", meso))
    (asset,) = load_scene(tiny_scene).assets
    assert {file.name for file in asset_files(asset)} == {"ball.obj", "look.mtl", "ball.dpci.exr", "bark.png"}


def test_a_range_image_is_a_file_of_its_asset(tiny_scene: Path) -> None:
    image = "{depth: d.png, colour: c.png, unit: 0.001, intrinsics: {fx: 50, fy: 50, cx: 20, cy: 15}}"
    for name in ("d.png", "c.png"):
        tiny_scene.with_name(name).touch()
    tiny_scene.write_text(f"version: 1\nassets: {{a: {{depth_image: {image}}}}}\n")
    (asset,) = load_scene(tiny_scene).assets
    assert {file.name for file in asset_files(asset)} == {"d.png", "c.png", "d.dpci.exr"}


def test_reports_may_go_anywhere_else(tmp_path: Path) -> None:
    check_report_files([tmp_path / "a.json", None, tmp_path / "a.html"], [tmp_path / "scene.yaml"], "measured")


@pytest.mark.parametrize(
    ("reports", "message"),
    [
        (["scene.yaml"], "scene.yaml: would overwrite a file that is measured, or the other report"),
        (["sub/../scene.yaml"], "would overwrite a file that is measured"),  # the same file by another name
        (["a.json", "a.json"], "a.json: would overwrite a file that is measured, or the other report"),
        (["gone/a.json"], "does not exist"),
    ],
)
def test_reports_that_would_do_harm_are_refused(tmp_path: Path, reports: list[str], message: str) -> None:
    (tmp_path / "sub").mkdir()
    with pytest.raises(InputError, match=message):
        check_report_files([tmp_path / name for name in reports], [tmp_path / "scene.yaml"], "measured")
    assert [path.name for path in tmp_path.iterdir()] == ["sub"]


def test_a_report_is_written_where_one_is_wanted(tmp_path: Path) -> None:
    write_report(None, "nothing")
    write_report(tmp_path / "a.txt", "PSNR – 30 dB\n")
    assert [path.name for path in tmp_path.iterdir()] == ["a.txt"]
    assert (tmp_path / "a.txt").read_bytes() == "PSNR – 30 dB\n".encode()
