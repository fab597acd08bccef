"""Read the pictures that materials and lights name, and make pictures of channels of several."""

import io
import os
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pxr import Ar

from depthwalk.ingest.usd.glb import GlbBuilder
from depthwalk.ingest.usd.layers import file_in, is_inside
from depthwalk.ingest.usd.problems import UsdError
from depthwalk.limits import MAX_MESH_BYTES, MAX_TEXTURE_PIXELS

_MIME_TYPES = {"PNG": "image/png", "JPEG": "image/jpeg", "WEBP": "image/webp"}
_COARSE = 2048  # pixels along a side of roughness maps; of larger ones `gltf_reflection.MAP_SIDE` are kept anyway


class Channel(NamedTuple):
    """A channel of a picture: the picture's number, 0 to 3 for r, g, b, a, and a factor and an offset of its values."""

    picture: int
    channel: int
    scale: float = 1.0
    bias: float = 0.0


class Pictures:
    """Read pictures, each once, and write those that materials use into a GLB file.

    Attributes
    ----------
    files
        The files that were read, without symbolic links.
    """

    def __init__(self, builder: GlbBuilder, root: str, warnings: list[str]) -> None:
        """Prepare to read pictures in the folder `root`, without symbolic links."""
        self._builder, self._root, self._warnings = builder, root, warnings
        self.files: set[str] = set()
        self._numbers: dict[str, int | None] = {}
        self._contents: list[tuple[str, bytes, str]] = []  # name, bytes, type
        self._textures: dict[object, int] = {}

    def number(self, asset: Any, where: str) -> int | None:
        """Return the number of the picture of an asset path; None, with a warning, if it is missing or unreadable.

        Raises UsdError if it lies outside the folder.
        """
        place = self._place(asset, where)
        if place not in self._numbers:
            self._numbers[place] = self._read(place, asset.path, where)
        return self._numbers[place]

    def data(self, asset: Any, where: str) -> bytes | None:
        """Return the contents of any file that an asset path names, as `number` finds it; None if it is missing."""
        return self._bytes(self._place(asset, where))

    def texture(self, picture: int) -> int:
        """Return the number of a texture of the GLB file that shows a picture."""
        if picture not in self._textures:
            name, data, mime = self._contents[picture]
            self._textures[picture] = self._written(data, mime, os.path.splitext(os.path.basename(name))[0])
        return self._textures[picture]

    def combined(self, channels: tuple[Channel | float, ...], *, coarse: bool = False) -> int:
        """Return the number of a texture whose four channels are those of several pictures, or constants 0 to 1.

        coarse: whether few pixels do.
        """
        key = channels, coarse
        if key not in self._textures:
            numbers = dict.fromkeys(each.picture for each in channels if isinstance(each, Channel))
            opened = {number: self._opened(number) for number in numbers}
            width = max(image.width for image in opened.values())
            height = max(image.height for image in opened.values())
            if coarse:
                width, height = min(width, _COARSE), min(height, _COARSE)
            decoded = {number: self._pixels(number, image, width, height) for number, image in opened.items()}
            values = np.empty((height, width, 4), np.uint8)
            for place, each in enumerate(channels):
                values[..., place] = (
                    _scaled(decoded[each.picture][..., each.channel], each.scale, each.bias)
                    if isinstance(each, Channel)
                    else round(255 * each)
                )
            self._textures[key] = self._written(_png(values), "image/png", "combined")
        return self._textures[key]

    def _place(self, asset: Any, where: str) -> str:
        """Return where the file of an asset path is, or would be. Raises UsdError if that is outside the folder."""
        place: str = asset.resolvedPath or os.path.normpath(os.path.join(self._root, asset.path))
        if not is_inside(place, self._root):
            raise UsdError(f"{where}: refers to the picture @{asset.path[:200]}@, outside the folder of the file")
        return place

    def _read(self, resolved: str, name: str, where: str) -> int | None:
        data = self._bytes(resolved)
        if data is None:
            self._warnings.append(f"{where}: the picture @{name[:200]}@ is missing; ignored")
            return None
        try:
            kind = _image(data).format
            if kind not in _MIME_TYPES:
                data, kind = _png(np.asarray(_image(data).convert("RGBA"))), "PNG"
        except Exception:  # Pillow's plugins raise nearly anything
            self._warnings.append(f"{where}: the picture @{name[:200]}@ cannot be read as an image; ignored")
            return None
        self._contents.append((name, data, _MIME_TYPES[kind]))
        return len(self._contents) - 1

    def _bytes(self, resolved: str) -> bytes | None:
        """Return the contents of a file, also of one within a .usdz archive; None if there is none."""
        asset = Ar.GetResolver().OpenAsset(Ar.ResolvedPath(resolved))
        if asset is None or asset.GetSize() > MAX_MESH_BYTES:
            return None
        self.files.add(file_in(resolved))
        return bytes(asset.Read(asset.GetSize(), 0))

    def _opened(self, number: int) -> Any:
        return _image(self._contents[number][1])

    def _pixels(self, number: int, image: Any, width: int, height: int) -> NDArray[np.uint8]:
        """Return the pixels (height, width, 4) of a picture, resized. Raises UsdError if it is damaged."""
        try:
            image = image.convert("RGBA")
        except Exception:  # Pillow's plugins raise nearly anything
            raise UsdError(f"the picture @{self._contents[number][0][:200]}@ is damaged") from None
        return np.asarray(image if image.size == (width, height) else image.resize((width, height)), np.uint8)

    def _written(self, data: bytes, mime: str, name: str) -> int:
        image = self._builder.add(
            "images", {"bufferView": self._builder.view(data), "mimeType": mime, "name": name[:60]}
        )
        return self._builder.add("textures", {"source": image})


def _image(data: bytes) -> Any:
    """Return a picture, opened by Pillow. Raises ValueError if it has too many pixels, and what Pillow raises."""
    from PIL import Image

    Image.MAX_IMAGE_PIXELS = None  # checked here
    image = Image.open(io.BytesIO(data))
    if image.width * image.height > MAX_TEXTURE_PIXELS:
        raise ValueError("too many pixels")
    return image


def _scaled(values: NDArray[np.uint8], scale: float, bias: float) -> NDArray[np.uint8]:
    if (scale, bias) == (1.0, 0.0):
        return values
    changed = values * np.float32(scale) + np.float32(255 * bias)
    return np.asarray(np.clip(changed, 0, 255).round(), np.uint8)


def _png(pixels: NDArray[np.uint8]) -> bytes:
    from PIL import Image

    file = io.BytesIO()
    Image.fromarray(pixels).save(file, "PNG", compress_level=1)
    return file.getvalue()
