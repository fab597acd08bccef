"""Pictures of the window as PNG files that know their camera."""

import io
import json
import math
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from PIL.PngImagePlugin import PngInfo
from platformdirs import user_pictures_path

from depthwalk.files import write_bytes
from depthwalk.scene.arrays import Camera
from depthwalk.walk.files import save_new
from depthwalk.walk.window import Window


def save_screenshot(pixels: NDArray[np.uint8], scene: Path, camera: Camera, folder: Path | None = None) -> Path:
    """Write `pixels` (H, W, 3), top row first, to a new file; returns its path.

    folder: None means the working directory or, where that cannot be written to, the user's pictures. The file's texts:
    Scene; Camera, JSON with position, target and fov in degrees; Options, the same for the command line.
    Raises OSError when no folder takes it.
    """
    folders = [folder] if folder is not None else [Path.cwd(), user_pictures_path()]
    info = _describe(scene, camera)
    image = Image.fromarray(np.ascontiguousarray(pixels))
    stream = io.BytesIO()
    image.save(stream, "PNG", pnginfo=info)
    return save_new(".png", lambda file: write_bytes(file, stream.getvalue()), folders)


def read_window(window: Window) -> NDArray[np.uint8]:
    """What the window shows, (H, W, 3), top row first. The screen's own size is that of its making."""
    width, height = window.buffer_size
    data = window.fbo.read(viewport=(0, 0, width, height), components=3, alignment=1)
    _ = window.ctx.error  # moderngl also asks for an attachment, which a window's buffer has not
    return np.frombuffer(data, np.uint8).reshape(height, width, 3)[::-1]


def _describe(scene: Path, camera: Camera) -> PngInfo:
    fov = math.degrees(camera.fov)
    place, target = (",".join(f"{value:.6g}" for value in point) for point in (camera.position, camera.target))
    info = PngInfo()
    info.add_text("Software", "depthwalk")
    info.add_itxt("Scene", str(scene))
    info.add_text("Camera", json.dumps({"position": camera.position, "target": camera.target, "fov": fov}))
    info.add_text("Options", f"--camera-position {place} --camera-target {target} --camera-view-angle {fov:.6g}")
    return info
