"""Save pictures of the window as PNG files that record their scene and camera."""

import io
import json
import math
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from platformdirs import user_pictures_path

from depthwalk.files import write_bytes
from depthwalk.scene.arrays import Camera
from depthwalk.walk.camera_text import camera_options
from depthwalk.walk.files import save_new
from depthwalk.walk.window import Window

if TYPE_CHECKING:
    from PIL.PngImagePlugin import PngInfo


def save_screenshot(pixels: NDArray[np.uint8], scene: Path, camera: Camera, folder: Path | None = None) -> Path:
    """Write a picture to a new PNG file.

    The file holds three texts. "Scene" is the scene's file. "Camera" is JSON with position and target in metres and fov
    in degrees. "Options" holds the same camera as options of the command line.

    Parameters
    ----------
    pixels
        (H, W, 3) uint8, sRGB, top row first.
    scene
        The scene's file.
    camera
        The camera of the picture.
    folder
        The folder to write to; None is the working directory or, if that cannot be written to, the user's pictures.

    Returns
    -------
    Path
        The new file.

    Raises
    ------
    OSError
        If no folder can be written to.
    """
    from PIL import Image  # here, since most walks save none

    folders = [folder] if folder is not None else [Path.cwd(), user_pictures_path()]
    info = _describe(scene, camera)
    image = Image.fromarray(np.ascontiguousarray(pixels))
    stream = io.BytesIO()
    image.save(stream, "PNG", pnginfo=info)
    return save_new(".png", lambda file: write_bytes(file, stream.getvalue()), folders)


def read_window(window: Window) -> NDArray[np.uint8]:
    """Return the picture (H, W, 3) uint8, sRGB, that was last drawn to `window`, top row first."""
    width, height = window.buffer_size  # `fbo.size` remains that of the first frame
    data = window.fbo.read(viewport=(0, 0, width, height), components=3, alignment=1)
    _ = window.ctx.error  # clears it: moderngl queries an attachment that a window's buffer lacks
    return np.frombuffer(data, np.uint8).reshape(height, width, 3)[::-1]


def _describe(scene: Path, camera: Camera) -> "PngInfo":
    from PIL.PngImagePlugin import PngInfo

    fov = math.degrees(camera.fov)
    info = PngInfo()
    info.add_text("Software", "depthwalk")
    info.add_itxt("Scene", str(scene))
    info.add_text("Camera", json.dumps({"position": camera.position, "target": camera.target, "fov": fov}))
    info.add_text("Options", camera_options(camera))
    return info
