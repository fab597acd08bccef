"""Save pictures of the window as PNG files that record their scene and camera."""

import io
import json
import math
from concurrent.futures import Future, ThreadPoolExecutor
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


class Screenshots:
    """Write screenshots in a thread: compressing one takes longer than a frame, and a disk may take any time."""

    def __init__(self) -> None:
        """Begin with nothing to write."""
        self._thread = ThreadPoolExecutor(1, "screenshot")
        self._files: list[Future[Path]] = []

    def save(self, pixels: NDArray[np.uint8], scene: Path, camera: Camera) -> None:
        """Begin to write a picture, after those that are still being written; see `save_screenshot`."""
        self._files.append(self._thread.submit(save_screenshot, pixels, scene, camera))

    def news(self) -> str:
        """Return what became of those that are done since it was last asked, a line each; "" if none is."""
        done = [file for file in self._files if file.done()]
        self._files = [file for file in self._files if file not in done]
        return "\n".join(map(_outcome, done))

    def close(self) -> None:
        """Wait for what is still being written."""
        self._thread.shutdown()


def _outcome(file: "Future[Path]") -> str:
    try:
        return f"Saved {file.result()}"
    except OSError as error:
        return f"Screenshot failed: {error}"


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
