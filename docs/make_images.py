"""Make the pictures in docs/images: `python docs/make_images.py [NAME...]`.

`hud` photographs the window and needs Xvfb and xdotool. The line figures come from docs/figures.py. `tables`
measures for minutes. `frame.svg` is not made here.
"""

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import figures
import numpy as np
from PIL import Image

from depthwalk.bake.baker import bake_object
from depthwalk.bake.images import DepthImage, Face
from depthwalk.bake.params import BakeParams
from depthwalk.colour import srgb8_from_linear
from depthwalk.ingest.loader import load_mesh
from depthwalk.quality.edges import SHAPES
from depthwalk.resources import asset_root, scene_root

IMAGES = Path(__file__).with_name("images")
_GAP = 8  # pixels between two pictures
_DEPTHWALK = (sys.executable, "-m", "depthwalk")
_BUST = 629, 281  # a place in the window that shows it
_SECONDS_TO_LOAD = 120
_TOUR = 100  # pictures
_STUDIO = """camera: {position: [0, 2.6, 9], target: [0, 0.45, 0], fov: 10}
environment: {sun: {direction: [-0.5, -0.7, -0.6], intensity: 0.9}, ambient: {intensity: 0.3}}
render: {gpaa: {samples: 1}}
"""


def garden() -> None:
    """Draw the garden."""
    render("garden")


def room() -> None:
    """Draw the room with its heads."""
    render("room")


def night() -> None:
    """Draw the court at night."""
    render("night")


def tour() -> None:
    """Record the beginning of the tour of the garden, ten small pictures a second."""
    path = (scene_root() / "paths/garden.yaml").read_text().replace("fps: 30", "fps: 10")
    with tempfile.TemporaryDirectory() as folder:
        slower, frames = Path(folder) / "path.yaml", Path(folder) / "{frame:3}.png"
        slower.write_text(path)
        scene, size = str(scene_root() / "garden.yaml"), ("--resolution", "960,540")
        command = *_DEPTHWALK, "render", scene, "--path", str(slower), "--frames", str(_TOUR), *size, "-o", str(frames)
        subprocess.run(command, check=True)
        drawn = [Image.open(file).reduce(2) for file in sorted(Path(folder).glob("*.png"))]
    first, *others = drawn
    settings = {"duration": 100, "loop": 0, "quality": 40, "method": 6}
    first.save(IMAGES / "tour.webp", save_all=True, append_images=others, **settings)


def render(name: str, *options: str) -> None:
    """Render a shipped scene through its own camera."""
    with tempfile.TemporaryDirectory() as folder:
        scene, out = scene_root() / f"{name}.yaml", Path(folder) / "view.png"
        command = [*_DEPTHWALK, "render", str(scene), "-o", str(out), "--resolution", "1024,576", *options]
        subprocess.run(command, check=True)
        shrink(out, name)


def shrink(picture: Path, name: str) -> None:
    """Write the picture of a file in fewer bytes, without its alpha."""
    with Image.open(picture) as image:
        write(name, np.asarray(image.convert("RGB")))


def write(name: str, pixels: np.ndarray) -> None:
    """Write a picture (H, W, 3) uint8, top row first, without loss and in few bytes."""
    Image.fromarray(pixels).save(IMAGES / f"{name}.webp", lossless=True, quality=100, method=6)


def panorama() -> None:
    """Draw figure 6 (a) of Liu et al.: the panorama; below it, what is seen from its pinhole, and from beside it."""
    folder = scene_root() / "paper"
    with Image.open(folder / "panorama" / "room_colour.jpg") as picture:
        whole = np.asarray(picture.convert("RGB"))
    width = (whole.shape[1] - _GAP) // 2
    views = []
    with tempfile.TemporaryDirectory() as name:
        out = Path(name) / "view.png"
        for options in ((), ("--camera-position", "-0.5,1.7,-0.3")):
            scene = str(folder / "figure-06a-panorama.yaml")
            command = [*_DEPTHWALK, "render", scene, "-o", str(out), "--resolution", f"{width},240", *options]
            subprocess.run(command, check=True)
            with Image.open(out) as picture:
                views.append(np.asarray(picture.convert("RGB")))
    upright = np.full((len(views[0]), _GAP, 3), 255, np.uint8)
    below = np.concatenate([views[0], upright, views[1]], axis=1)
    level = np.full((_GAP, whole.shape[1], 3), 255, np.uint8)
    write("panorama", np.concatenate([whole, level, below]))


def paper() -> None:
    """Draw figure 12 of Liu et al.: the side alone, the top alone, both; and what the defaults draw."""
    scene, defaults = scene_root() / "paper" / "figure-12-caps.yaml", "assets.venus.dpci={resolution: 512}"
    ways = ("render.lod.cases=side",), ("render.lod.cases=cap",), (), ("render.preset=default", defaults)
    with tempfile.TemporaryDirectory() as name:
        parts = []
        for number, settings in enumerate(ways):
            out = Path(name) / f"{number}.png"
            options = [option for setting in settings for option in ("--set", setting)]
            command = [*_DEPTHWALK, "render", str(scene), "-o", str(out), "--resolution", "320,360", *options]
            subprocess.run([*command, "--representation", "dpci"], check=True)
            with Image.open(out) as picture:
                parts.append(np.asarray(picture.convert("RGB")))
    gap = np.full((len(parts[0]), _GAP, 3), 255, np.uint8)
    joined = np.concatenate([parts[0], *(half for part in parts[1:] for half in (gap, part))], axis=1)
    write("paper", joined)


def gpaa() -> None:
    """Draw figures 3 to 6 of the paper on edge-optimised GPAA: without, by all edges, and by the chosen ones."""
    with tempfile.TemporaryDirectory() as name:
        scene = scene_of_solids(Path(name))
        rows = []
        for mode in ("none", "gpaa", "gpaa-edge"):
            out = Path(name) / f"{mode}.png"
            command = [*_DEPTHWALK, "render", str(scene), "-o", str(out), "--resolution", "480,120"]
            subprocess.run([*command, "--set", f"render.aa={mode}"], check=True)
            with Image.open(out) as picture:
                rows.append(np.asarray(picture.convert("RGB")).repeat(2, 0).repeat(2, 1))
    gap = np.full((_GAP, rows[0].shape[1], 3), 255, np.uint8)
    write("gpaa", np.concatenate([rows[0], gap, rows[1], gap, rows[2]]))


def scene_of_solids(folder: Path) -> Path:
    """Write the paper's models into a folder; return the scene with them side by side."""
    placed = (0.8, 12, 40), (1.1, 10, 40), (1.5, 55, 60), (1.3, 10, 45)  # longest side, metres; tilt and yaw, degrees
    assets, objects = [], []
    for number, (shape, (side, tilt, yaw)) in enumerate(zip(SHAPES.values(), placed, strict=True)):
        positions, triangles = shape()
        cos, sin = np.cos(np.radians(tilt)), np.sin(np.radians(tilt))
        tilted = positions @ np.array([[cos, sin, 0], [-sin, cos, 0], [0, 0, 1]]) * side / np.ptp(positions, 0).max()
        lines = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in tilted]
        lines += [f"f {a} {b} {c}" for a, b, c in (triangles + 1).tolist()]
        (folder / f"solid{number}.obj").write_text("\n".join(lines) + "\n", encoding="utf-8")
        assets.append(f"  solid{number}: {{mesh: solid{number}.obj}}")
        objects.append(f"  - {{asset: solid{number}, position: [{1.7 * number - 2.55:.2f}, 0, 0], yaw: {yaw}}}")
    scene = folder / "solids.yaml"
    scene.write_text("\n".join(["version: 1", "assets:", *assets, "objects:", *objects, _STUDIO]), encoding="utf-8")
    return scene


def false_colours() -> None:
    """Draw the lit garden, its levels and its cases, and the representations of the room, in false colours."""
    shown = ("garden", "picture"), ("garden", "level"), ("garden", "case"), ("room", "representation")
    with tempfile.TemporaryDirectory() as name:
        out, parts = Path(name) / "part.png", []
        for scene, show in shown:
            command = [*_DEPTHWALK, "render", str(scene_root() / f"{scene}.yaml"), "-o", str(out)]
            options = "--resolution", "512,288", "--set", f"render.inspection.show={show}"
            subprocess.run([*command, *options], check=True)
            with Image.open(out) as picture:
                parts.append(np.asarray(picture.convert("RGB")))
    upright = np.full((len(parts[0]), _GAP, 3), 255, np.uint8)
    above, below = (np.concatenate([parts[k], upright, parts[k + 1]], axis=1) for k in (0, 2))
    level = np.full((_GAP, above.shape[1], 3), 255, np.uint8)
    write("false_colours", np.concatenate([above, level, below]))


def dpci() -> None:
    """Draw colour, depth and normals of layer 0 of a figure's side image."""
    mesh = load_mesh(asset_root() / "dryad.ply")
    baked = bake_object(mesh, BakeParams(resolution=400, layers=1), key="")
    side = next(image for image in baked.images if image.face is Face.SIDE)
    write("dpci", depth_image_picture(side))


def depth_image_picture(image: DepthImage) -> np.ndarray:
    """Return colour, depth and normals side by side.

    The picture is (H, 3 W + gaps, 3) uint8 with its top row first. Near is bright; texels without surface are grey.
    """
    solid = np.isfinite(image.depth)
    low, high = image.depth[solid].min(), image.depth[solid].max()
    nearness = np.where(solid, 1 - 0.9 * (image.depth - low) / (high - low), 0)
    parts = [
        srgb8_from_linear(image.albedo[..., :3]),
        np.repeat(np.round(255 * nearness)[..., None], 3, 2).astype(np.uint8),
        np.round(255 * (0.5 + 0.5 * image.normal)).astype(np.uint8),
    ]
    gap = np.full((len(image.depth), _GAP, 3), 255, np.uint8)
    shown = [np.where(solid[..., None], part, np.uint8(90)) for part in parts]
    return np.concatenate([shown[0], gap, shown[1], gap, shown[2]], axis=1)[::-1]


def hud() -> None:
    """Photograph the window on the room, with figures, panel and an inspected bust, by its own F12."""
    with tempfile.TemporaryDirectory() as name, virtual_display() as display:
        environment = os.environ | {"DISPLAY": display}
        environment.pop("WAYLAND_DISPLAY", None)
        command = [*_DEPTHWALK, "view", str(scene_root() / "room.yaml"), "--resolution", "1280,720"]
        walk = subprocess.Popen(command, cwd=name, env=environment)
        try:
            shrink(take_screenshot(Path(name), environment, walk), "hud")
        finally:
            walk.terminate()
            walk.wait(20)


def take_screenshot(folder: Path, environment: dict[str, str], walk: subprocess.Popen[bytes]) -> Path:
    """Open the panel, inspect the bust, and press F12 until a picture lies in `folder`; return its path."""
    end = time.monotonic() + _SECONDS_TO_LOAD
    opened = False
    while time.monotonic() < end and walk.poll() is None:
        time.sleep(1)
        search = subprocess.run(
            ["xdotool", "search", "--name", "depthwalk"], env=environment, capture_output=True, text=True
        )
        if not search.stdout:
            continue
        window = search.stdout.split()[0]
        subprocess.run(["xdotool", "windowfocus", window, "key", "F12"], env=environment, check=False)
        time.sleep(3)
        pictures = sorted(folder.glob("*.png"))
        if pictures and opened:
            return pictures[-1]
        if pictures:  # the scene is loaded: the keys are heard
            opened = True
            bust = [str(coordinate) for coordinate in _BUST]
            subprocess.run(["xdotool", "key", "Tab", "mousemove", *bust, "key", "i"], env=environment, check=True)
            time.sleep(12)  # until the message about the first picture is gone
            for picture in pictures:
                picture.unlink()
    raise TimeoutError("the window took no picture")


@contextmanager
def virtual_display() -> Iterator[str]:
    """Run an X server without a screen and yield the name of its display."""
    read, write = os.pipe()
    server = subprocess.Popen(["Xvfb", "-displayfd", str(write), "-screen", "0", "1280x720x24"], pass_fds=[write])
    os.close(write)
    try:
        with os.fdopen(read) as pipe:
            yield f":{pipe.readline().strip()}"
    finally:
        server.terminate()
        server.wait(10)


def tables() -> None:
    """Measure the papers' tables again, which takes minutes: docs/tables.md, and its curves."""
    with tempfile.TemporaryDirectory() as folder:
        report = Path(folder) / "tables.json"
        page = IMAGES.parent / "tables.md"
        subprocess.run([*_DEPTHWALK, "tables", "--json", str(report), "--markdown", str(page)], check=True)
        show_curves(json.loads(report.read_text(encoding="utf-8"))["tables"], page)


def show_curves(measured: list[dict[str, Any]], page: Path) -> None:
    """Write the curves of measured tables as SVG, and show each under the heading of its table on a page."""
    shown = page.read_text(encoding="utf-8")
    for table in measured:
        if table["curves"]:
            name, heading = f"tables-{table['name']}", f"## {table['title']}\n"
            draw(name, partial(figures.curves, table["title"], table["curves"]))
            shown = shown.replace(heading, f"{heading}\n![{table['title']}](images/{name}.svg)\n")
    page.write_text(shown, encoding="utf-8", newline="\n")


def draw(name: str, figure: Callable[[], str]) -> None:
    """Write a line figure as SVG."""
    (IMAGES / f"{name}.svg").write_text(figure(), encoding="utf-8", newline="\n")


FIGURES: dict[str, Callable[[], str]] = {
    "cylinder": figures.cylinder,
    "shift": figures.shift,
    "impostor": figures.impostor,
    "cases": figures.cases,
}
MAKERS: dict[str, Callable[[], None]] = {
    "garden": garden,
    "tour": tour,
    "room": room,
    "night": night,
    "paper": paper,
    "panorama": panorama,
    "gpaa": gpaa,
    "false_colours": false_colours,
    "dpci": dpci,
    "hud": hud,
    "tables": tables,
    **{name: partial(draw, name, figure) for name, figure in FIGURES.items()},
}


def main() -> None:
    """Make the named pictures, or all."""
    IMAGES.mkdir(exist_ok=True)
    for name in sys.argv[1:] or MAKERS:
        MAKERS[name]()


if __name__ == "__main__":
    main()
