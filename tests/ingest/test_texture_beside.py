"""A picture beside a mesh that may be its texture is told of; no other one is."""

from pathlib import Path

import pytest

from depthwalk.ingest.texture_beside import texture_hint

TEXTURED = "v 0 0 0\nv 1 0 0\nv 0 1 1\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n"


def hint(folder: Path, *pictures: str, text: str = TEXTURED, name: str = "cow.obj") -> str:
    for picture in pictures:
        (folder / picture).touch()
    (folder / name).write_text(text)
    return texture_hint(folder / name, "--set assets.model.texture=")


@pytest.mark.parametrize(
    "picture", ["cow.png", "Cow_Texture.JPG", "cow-diffuse.jpeg", "cow_base_color.png", "cow albedo.tga", "cow_0.png"]
)
def test_one_picture_named_after_the_mesh_is_told(tmp_path: Path, picture: str) -> None:
    told = hint(tmp_path, picture, "other.png", "cow_normal.png", "coward.png", "cow.obj.txt")
    assert told.startswith(f"names no texture; if {picture} is its texture: --set assets.model.texture=")


def test_the_option_can_be_pasted_into_a_shell(tmp_path: Path) -> None:
    assert hint(tmp_path, "cow.png").endswith("--set assets.model.texture=cow.png")
    (tmp_path / "cow.png").rename(tmp_path / "cow tex.png")
    assert hint(tmp_path).endswith("""--set assets.model.texture='"cow tex.png"'""")
    assert texture_hint(tmp_path / "cow.obj", "--texture ").endswith(f"--texture '{tmp_path / 'cow tex.png'}'")


@pytest.mark.parametrize("pictures", [[], ["cow.png", "cow_texture.png"], ["cow_normal.png"], ["spot.png"]])
def test_nothing_is_guessed_from_other_pictures(tmp_path: Path, pictures: list[str]) -> None:
    assert hint(tmp_path, *pictures) == ""


def test_only_files_that_await_a_texture_have_a_hint(tmp_path: Path) -> None:
    pictures = ["cow.png"]
    assert hint(tmp_path, *pictures, text=TEXTURED.replace("vt ", "# vt ").replace("/1 2/2 3/3", " 2 3")) == ""
    assert hint(tmp_path, *pictures, name="cow.ply") == ""
    (tmp_path / "cow.mtl").write_text("newmtl a\nKd 1 0 0\n")
    assert hint(tmp_path, *pictures, text="mtllib cow.mtl\n" + TEXTURED) == ""
    assert hint(tmp_path, *pictures, text="mtllib gone.mtl\n" + TEXTURED)
    assert texture_hint(tmp_path / "cow2.obj", "") == ""


@pytest.mark.parametrize("offset", range(-5, 2))
def test_coordinates_are_found_wherever_they_begin(tmp_path: Path, offset: int) -> None:
    """Also across the border between two blocks that are read."""
    start = (1 << 20) + offset
    text = "v 0 0 0\nv 1 0 0\nv 0 1 1\n"
    text += "#" * (start - len(text) - 1) + "\n"
    assert hint(tmp_path, "cow.png", text=text + "vt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n")
    assert not hint(tmp_path, text=text[:-1] + "vt 0 0\nf 1 2 3\n")
