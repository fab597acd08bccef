"""Makes the pictures in docs/images: `python docs/make_images.py [NAME...]`. hud needs Xvfb and xdotool."""

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from PIL import Image

from depthwalk.bake.baker import BakeParams, bake_object
from depthwalk.bake.images import DepthImage, Face
from depthwalk.colour import srgb8_from_linear
from depthwalk.ingest.loader import load_mesh
from depthwalk.pictures import png_bytes
from depthwalk.resources import asset_root, scene_root

IMAGES = Path(__file__).with_name("images")
_GAP = 8  # pixels between two pictures
_DEPTHWALK = (sys.executable, "-m", "depthwalk")
_SECONDS_TO_LOAD = 120


def garden() -> None:
    render("garden")


def room() -> None:
    """The head as depth images, as near as it is."""
    render("room", "--set", "render.lod.magnification=0")


def night() -> None:
    render("night")


def render(name: str, *options: str) -> None:
    """A shipped scene, seen by its own camera."""
    scene, out = scene_root() / f"{name}.yaml", IMAGES / f"{name}.png"
    command = [*_DEPTHWALK, "render", str(scene), "-o", str(out), "--resolution", "1024,576", *options]
    subprocess.run(command, check=True)
    shrink(out, out)


def shrink(picture: Path, out: Path) -> None:
    """The picture in fewer bytes: opaque, without its texts."""
    with Image.open(picture) as image:
        image.convert("RGB").save(out, optimize=True)


def dpci() -> None:
    """Colour, depth and normals of the side image of a bust, layer 0."""
    mesh = load_mesh(asset_root() / "head_venus.ply")
    baked = bake_object(mesh, BakeParams(resolution=400, layers=1), key="")
    side = next(image for image in baked.images if image.face is Face.SIDE)
    (IMAGES / "dpci.png").write_bytes(png_bytes(depth_image_picture(side)))


def depth_image_picture(image: DepthImage) -> np.ndarray:
    """Its parts side by side, (H, 3 W + gaps, 3) uint8, top row first: near is bright, empty is grey."""
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
    """The window on the room, with figures and panel, photographed by its own F12."""
    with tempfile.TemporaryDirectory() as name, virtual_display() as display:
        environment = os.environ | {"DISPLAY": display}
        environment.pop("WAYLAND_DISPLAY", None)
        command = [*_DEPTHWALK, "view", str(scene_root() / "room.yaml"), "--resolution", "1280,720"]
        walk = subprocess.Popen(command, cwd=name, env=environment)
        try:
            shrink(take_screenshot(Path(name), environment, walk), IMAGES / "hud.png")
        finally:
            walk.terminate()
            walk.wait(20)


def take_screenshot(folder: Path, environment: dict[str, str], walk: subprocess.Popen[bytes]) -> Path:
    """Opens the panel of the window and presses F12 until a picture lies in `folder`."""
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
            subprocess.run(["xdotool", "key", "Tab"], env=environment, check=True)
            time.sleep(12)  # until the message about the first picture is gone
            for picture in pictures:
                picture.unlink()
    raise TimeoutError("the window took no picture")


@contextmanager
def virtual_display() -> Iterator[str]:
    """The name of an X display without a screen."""
    read, write = os.pipe()
    server = subprocess.Popen(["Xvfb", "-displayfd", str(write), "-screen", "0", "1280x720x24"], pass_fds=[write])
    os.close(write)
    try:
        with os.fdopen(read) as pipe:
            yield f":{pipe.readline().strip()}"
    finally:
        server.terminate()
        server.wait(10)


MAKERS: dict[str, Callable[[], None]] = {"garden": garden, "room": room, "night": night, "dpci": dpci, "hud": hud}


def main() -> None:
    IMAGES.mkdir(exist_ok=True)
    for name in sys.argv[1:] or MAKERS:
        MAKERS[name]()


if __name__ == "__main__":
    main()
