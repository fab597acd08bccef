"""Pictures of the window as PNG files that know their camera."""

import json
import math
from datetime import datetime
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from PIL.PngImagePlugin import PngInfo
from platformdirs import user_pictures_path

from depthwalk.scene.arrays import Camera


def save_screenshot(pixels: NDArray[np.uint8], scene: Path, camera: Camera, folder: Path | None = None) -> Path:
    """Write `pixels` (H, W, 3), top row first, to a new file; returns its path.

    folder: None means the working directory or, where that cannot be written to, the user's pictures. The file's texts:
    Scene; Camera, JSON with position, target and fov in degrees; Options, the same for the command line.
    Raises OSError when no folder takes it.
    """
    folders = [folder] if folder is not None else [Path.cwd(), user_pictures_path()]
    info = _describe(scene, camera)
    for candidate in folders:
        try:
            return _write_new(candidate, Image.fromarray(np.ascontiguousarray(pixels)), info)
        except OSError as error:
            failure = error
    raise failure


def _write_new(folder: Path, image: Image.Image, info: PngInfo) -> Path:
    stem = f"depthwalk-{datetime.now():%Y%m%d-%H%M%S}"
    number = 1
    while True:
        path = folder / (f"{stem}.png" if number == 1 else f"{stem}-{number}.png")
        try:
            with path.open("xb") as file:  # "x": an existing picture is never overwritten
                image.save(file, "PNG", pnginfo=info)
            return path
        except FileExistsError:
            number += 1


def _describe(scene: Path, camera: Camera) -> PngInfo:
    fov = math.degrees(camera.fov)
    place, target = (",".join(f"{value:.6g}" for value in point) for point in (camera.position, camera.target))
    info = PngInfo()
    info.add_text("Software", "depthwalk")
    info.add_itxt("Scene", str(scene))
    info.add_text("Camera", json.dumps({"position": camera.position, "target": camera.target, "fov": fov}))
    info.add_text("Options", f"--camera-position {place} --camera-target {target} --camera-view-angle {fov:.6g}")
    return info
