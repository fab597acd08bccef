"""What small files may cost that ask for much: seconds of a processor and bytes of memory for each byte of input."""

from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import bombs
from depthwalk import budget
from depthwalk.errors import InputError
from depthwalk.ingest import depth_file, image, soup
from depthwalk.ingest.image import load_texture
from depthwalk.ingest.loader import load_mesh
from depthwalk.ingest.range_image import load_depth_image
from depthwalk.scene.loader import load_scene
from depthwalk.scene.places import read_places
from files import written

costs = pytest.importorskip("costs", exc_type=ImportError)  # Windows limits and measures no processes in this way

KB, MB = 1_000, 1_000_000
FREE_SECONDS, SECONDS_PER_BYTE = 0.1, 20e-6
FREE_BYTES, BYTES_PER_BYTE = 20 * MB, 1_000

Case = tuple[Callable[[Path, int], Path], int, Callable[[Path], object], str]

# What writes the file, of how many bytes, what reads it, and the end of the message; "" where the file is in order.
CASES: dict[str, Case] = {
    "blank library": (bombs.blank_library, 60 * KB, load_mesh, ""),
    "many libraries": (bombs.many_libraries, 60 * KB, load_mesh, "10000 were looked for before this one"),
    "many materials": (bombs.many_materials, 30 * KB, load_mesh, ""),
    "one texture": (bombs.one_texture, 30 * KB, load_mesh, ""),
    "many solids": (bombs.many_solids, 30 * KB, load_mesh, ""),
    "great PLY": (bombs.great_ply, 1 * KB, load_mesh, "PLY is unexpected length!)"),
    "many nodes": (bombs.many_nodes, 30 * KB, load_mesh, ""),
    "deep nodes": (bombs.deep_nodes, 30 * KB, load_mesh, ""),
    "many copies": (
        bombs.many_copies,
        100 * KB,
        load_mesh,
        "scene file, as `depthwalk convert` makes one",
    ),
    "many primitives": (
        bombs.many_primitives,
        200 * KB,
        load_mesh,
        "scene file, as `depthwalk convert` makes one",
    ),
    "tiled TIFF": (bombs.tiled_tiff, 50 * KB, load_texture, "for an image of 32 × 24"),
    "many scans": (bombs.many_scans, 1000 * KB, load_texture, "at most 100 are allowed"),
    "wrong objects": (bombs.wrong_objects, 20 * KB, load_scene, "... and 932 more"),
    "wrong keys": (bombs.wrong_keys, 20 * KB, load_scene, "... and 1980 more"),
    "empty objects": (bombs.empty_objects, 20 * KB, load_scene, "... and 6646 more"),
    "crowded places": (bombs.crowded_csv, 300 * KB, read_places, "has 2 columns, the first line 3"),
    "wide places": (bombs.wide_csv, 300 * KB, read_places, "has 150001 columns, the first line 3"),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
def test_a_small_file_costs_little(tmp_path: Path, name: str) -> None:
    write, size, read, message = CASES[name]
    path = write(tmp_path, size)
    written = sum(file.stat().st_size for file in tmp_path.iterdir())
    cost = costs.cost(read, path)
    assert cost.message.endswith(message) and bool(cost.message) == bool(message)
    assert cost.seconds < FREE_SECONDS + SECONDS_PER_BYTE * written
    assert cost.bytes < FREE_BYTES + BYTES_PER_BYTE * written


@pytest.mark.slow
def test_meshes_and_depth_images_take_no_more_than_is_counted(tmp_path: Path) -> None:
    path = bombs.glb(tmp_path / "fan.glb", corners=60_000)
    taken = costs.cost(load_mesh, path).bytes
    assert taken < soup.mesh_bytes(60_000, 60_000) + path.stat().st_size + 4 * MB
    depths = written(tmp_path / "a.npy", b"")
    np.save(depths, np.random.default_rng(0).random((512, 512), np.float32))
    taken = costs.cost(partial(load_depth_image, size=(1.0, 1.0)), depths).bytes
    assert taken < depth_file.depth_bytes(512, 512, 1) + 4 * MB


@pytest.mark.slow
@pytest.mark.parametrize("suffix", [".png", ".webp", ".jpg", ".tif", ".gif"])
def test_pictures_take_no_more_than_is_counted(tmp_path: Path, suffix: str) -> None:
    Image.new("RGB", (1024, 1024), (9, 99, 199)).save(path := tmp_path / f"a{suffix}")
    assert costs.cost(load_texture, path).bytes < image.PIXEL_BYTES * 1024**2 + 8 * MB


def refusal(read: Callable[[Path], object], path: Path) -> str:
    with pytest.raises(InputError) as caught:
        read(path)
    return str(caught.value).removeprefix(f"{path}: ")


@pytest.fixture
def small_machine(monkeypatch: pytest.MonkeyPatch) -> None:
    """A machine of which reading a file may take 30 MB."""
    monkeypatch.setattr(budget, "machine_memory", lambda: 40 * MB)
    monkeypatch.setattr(budget, "_SMALL", MB)


@pytest.mark.usefixtures("small_machine")
def test_what_the_machine_cannot_hold_is_refused(tmp_path: Path) -> None:
    depths = bombs.equal_depths(tmp_path, 512)
    assert depths.stat().st_size < 6 * KB
    load_depth = partial(load_depth_image, size=(1.0, 1.0))
    assert refusal(load_depth, depths) == (
        "a depth image of 512 × 512 pixels would take 48 MB of memory; 30 MB are allowed here"
    )
    assert refusal(load_texture, written(tmp_path / "a.png", bombs.png(2048, 1024))) == (
        "an image of 2048 × 1024 pixels would take 59 MB of memory; 30 MB are allowed here"
    )
    text = written(tmp_path / "a.obj", f"{bombs.CORNERS}f 1 2 3\n" + "#\n" * 1_500_000)
    assert refusal(load_mesh, text) == "3000061 bytes of OBJ text would take 36 MB of memory; 30 MB are allowed here"
    copies = [{"mesh": 0}] * 30
    path = bombs.glb(tmp_path / "a.glb", corners=3000, nodes=copies, scenes=[{"nodes": list(range(30))}])
    assert refusal(load_mesh, path) == (
        "a mesh of 90000 vertices and 89940 triangles would take 61 MB of memory; 30 MB are allowed here"
    )


@pytest.mark.usefixtures("small_machine")
def test_the_pictures_of_a_mesh_count_together(tmp_path: Path) -> None:
    """A picture takes 7 MB while it is decoded and 1 MB after that; the materials are made in their reversed order."""
    count = 26
    picture = bombs.png(512, 512)
    for number in range(count):
        written(tmp_path / f"{number}.png", picture)
    written(tmp_path / "a.mtl", "".join(f"newmtl m{n}\nmap_Kd {n}.png\n" for n in range(count)))
    uses = "".join(f"usemtl m{number}\nf 1/1 2/2 3/3\n" for number in range(count))
    path = written(tmp_path / "a.obj", f"mtllib a.mtl\n{bombs.CORNERS}{uses}")
    assert refusal(load_mesh, path).endswith("3.png: the textures would take 30 MB of memory; 30 MB are allowed here")


def test_materials_of_one_picture_share_its_pixels(tmp_path: Path) -> None:
    mesh = load_mesh(bombs.one_texture(tmp_path, 400))
    assert len(mesh.materials) == 10 and len({id(material.texture) for material in mesh.materials}) == 1


def test_solids_of_a_text_file_are_one_mesh(tmp_path: Path) -> None:
    moved = bombs.FACET.replace("1 0 0", "2 0 0").replace("solid a", "Solid the second")
    one = load_mesh(written(tmp_path / "a.stl", bombs.FACET))
    both = load_mesh(written(tmp_path / "b.stl", bombs.FACET + "\n \n" + moved))
    assert (len(one.faces), len(both.faces)) == (1, 2) and both.positions[:, 0].max() == 1
    cut = (bombs.FACET + moved).replace("endsolid the", "")
    assert len(load_mesh(written(tmp_path / "c.stl", cut)).faces) == 2
