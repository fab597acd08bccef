"""Pictures of the window as PNG files that know their camera."""

import json
import math
from datetime import datetime
from itertools import count
from pathlib import Path
from tempfile import TemporaryDirectory

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
    """The whole picture under a name that was free. A name is taken by an empty file, for a moment only: where there
    are no hard links, no move of a file refuses to overwrite."""
    stem = f"depthwalk-{datetime.now():%Y%m%d-%H%M%S}"
    with TemporaryDirectory(prefix=".depthwalk-", dir=folder) as temporary:
        whole = Path(temporary) / "picture.png"
        image.save(whole, "PNG", pnginfo=info)
        for number in count(1):
            path = folder / (f"{stem}.png" if number == 1 else f"{stem}-{number}.png")
            try:
                path.open("xb").close()
            except FileExistsError:
                continue
            try:
                return whole.replace(path)
            except BaseException:
                path.unlink()
                raise
    raise AssertionError("numbers do not end")


def _describe(scene: Path, camera: Camera) -> PngInfo:
    fov = math.degrees(camera.fov)
    place, target = (",".join(f"{value:.6g}" for value in point) for point in (camera.position, camera.target))
    info = PngInfo()
    info.add_text("Software", "depthwalk")
    info.add_itxt("Scene", str(scene))
    info.add_text("Camera", json.dumps({"position": camera.position, "target": camera.target, "fov": fov}))
    info.add_text("Options", f"--camera-position {place} --camera-target {target} --camera-view-angle {fov:.6g}")
    return info
