"""Read picture files into arrays safely, and define planar depth images."""

import io
import warnings
from collections.abc import Callable, Hashable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from depthwalk.budget import check_memory
from depthwalk.errors import InputError
from depthwalk.ingest.formats import IMAGE_SUFFIXES
from depthwalk.ingest.sources import read_bytes
from depthwalk.limits import MAX_JPEG_SCANS, MAX_TEXTURE_PIXELS, MAX_TEXTURE_SIDE, MAX_TILE_TEXELS

if TYPE_CHECKING:
    from PIL import Image

# Some of Pillow's other formats start programs (EPS) or open further files.
FORMATS = ("PNG", "JPEG", "WEBP", "TIFF", "BMP", "TGA", "GIF", "PPM", "DDS")

PIXEL_BYTES = 28  # most bytes while a picture is decoded: measured for WebP; PNG takes 16, JPEG and GIF 16, TIFF 19
_TILE_SIDES = 322, 323  # tags of TIFF files
_SCAN = b"\xff\xda"  # marker before each scan of a JPEG; coded pixels never contain it

# Reading damaged files raises nearly anything; these are the exceptions that Pillow documents and its plugins let
# through.
BROKEN = (OSError, ValueError, TypeError, SyntaxError, ArithmeticError, LookupError, EOFError, MemoryError)


@dataclass(frozen=True, kw_only=True)
class PlanarImage:
    """Hold a depth image over a rectangle, in its own frame: x right, y up, z toward the viewer.

    Attributes
    ----------
    depth : (H, W) float32
        Metres below the front plane z = 0 (positive is deeper), row 0 at the bottom; +inf where there is no surface.
    colour : (H, W, 3) uint8
        sRGB.
    normal : (H, W, 3) float32
        Unit length, in the image's frame.
    size : (float, float)
        Width and height of the rectangle, metres.
    """

    depth: NDArray[np.float32]
    colour: NDArray[np.uint8]
    normal: NDArray[np.float32]
    size: tuple[float, float]


def open_image(data: bytes, name: str) -> "Image.Image":
    """Open a picture: its header is read and its size checked, but no pixel is decoded yet.

    Parameters
    ----------
    data
        The bytes of the picture file.
    name
        The file's name in messages.

    Returns
    -------
    PIL.Image.Image
        The picture.

    Raises
    ------
    InputError
        If its format is unknown, or it is damaged or too large.
    """
    from PIL import Image

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # Pillow's bomb warning: `check_size` is stricter
            image = Image.open(io.BytesIO(data), formats=FORMATS)
    except Image.DecompressionBombError:
        raise InputError(f"{name}: image has more pixels than can be used safely") from None
    except (*BROKEN, NotImplementedError):  # DDS files raise the latter
        raise InputError(f"{name}: cannot be read as an image") from None
    check_size(image, name)
    return image


def check_picture(path: Path, data: bytes) -> None:
    """Raise InputError, as `open_image` does, if `data` is no picture, which the file `path` is by its name."""
    if path.suffix.lower() in IMAGE_SUFFIXES:
        open_image(data, str(path)).close()


def check_sides(path: Path, width: int, height: int) -> None:
    """Raise InputError unless each side of a picture that Pillow does not read has 1 to MAX_TEXTURE_SIDE pixels."""
    if not 0 < min(width, height) <= max(width, height) <= MAX_TEXTURE_SIDE:
        raise InputError(f"{path}: image of {width} × {height} pixels; each side must be 1 to {MAX_TEXTURE_SIDE}")


def check_size(image: "Image.Image", name: str) -> None:
    """Raise InputError if decoding `image`, which messages call `name`, would take more than is allowed."""
    width, height = image.size
    if max(width, height) > MAX_TEXTURE_SIDE or width * height > MAX_TEXTURE_PIXELS:
        raise InputError(f"{name}: image of {width} × {height} pixels is larger than {MAX_TEXTURE_SIDE} a side")
    check_memory(name, PIXEL_BYTES * width * height, f"an image of {width} × {height} pixels")
    tags = getattr(image, "tag_v2", {})  # of TIFF files
    sides = [tags.get(tag, 0) for tag in _TILE_SIDES]
    if all(isinstance(side, int) for side in sides) and sides[0] * sides[1] > MAX_TILE_TEXELS + width * height:
        raise InputError(f"{name}: tiles of {sides[0]} × {sides[1]} pixels for an image of {width} × {height}")
    if image.format == "JPEG" and "progressive" in image.info and (scans := _scans(image)) > MAX_JPEG_SCANS:
        raise InputError(f"{name}: a JPEG of {scans} scans; at most {MAX_JPEG_SCANS} are allowed")


def _scans(image: "Image.Image") -> int:
    """Return the number of scans of an open JPEG that is not decoded yet; 0 if it is decoded."""
    file = getattr(image, "fp", None)
    if file is None:
        return 0
    place = file.tell()
    file.seek(0)
    count = file.read().count(_SCAN)
    file.seek(place)
    return int(count)


def rgba(image: "Image.Image", name: str) -> NDArray[np.uint8]:
    """Decode `image`, of any mode, to (H, W, 4) uint8, sRGB with alpha, row 0 at the top.

    Raises InputError if the image, which messages call `name`, is damaged, too large or of an unsupported format.
    """
    from PIL import Image

    check_size(image, name)
    if image.format is not None and image.format not in FORMATS:
        raise InputError(f"{name}: {image.format} images are not supported")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            image.load()
            if image.mode.startswith("I") or image.mode == "F":  # Pillow would clip these at 255, not scale them
                image = Image.fromarray(_eight_bit(np.asarray(image)))
            return np.array(image.convert("RGBA"))
    except BROKEN:
        raise InputError(f"{name}: image data is damaged or of an unsupported kind") from None


class TextureDecoder:
    """Decode the pictures of one mesh, each once, however many materials show it, and limit their total size."""

    def __init__(self) -> None:
        """Begin without any picture."""
        self._decoded: dict[Hashable, NDArray[np.uint8]] = {}
        self._images: list[Image.Image] = []
        self._solid: dict[int, NDArray[np.uint8]] = {}  # opaque copies, by the identity of pictures with alpha
        self._bytes = 0

    def decode(self, image: "Image.Image", name: str, key: Hashable = None) -> NDArray[np.uint8]:
        """Decode a picture, unless that has been done already.

        Parameters
        ----------
        image
            The picture.
        name
            Its name in messages.
        key
            Identifies it among the mesh's pictures; None: the object `image` itself does.

        Returns
        -------
        numpy.ndarray
            (H, W, 4) uint8, sRGB with alpha, row 0 at the top; the same array for the same picture.

        Raises
        ------
        InputError
            If it is damaged, too large or of an unsupported format, or if all pictures together are too large.
        """
        if key is None:
            key = id(image)
            self._images.append(image)  # keeps it alive, so that no other gets its ID
        if key not in self._decoded:
            width, height = image.size
            check_memory(name, self._bytes + PIXEL_BYTES * width * height, "the textures")
            self._decoded[key] = rgba(image, name)
            self._bytes += self._decoded[key].nbytes
        return self._decoded[key]

    def coarse(self, image: "Image.Image", name: str, side: int) -> NDArray[np.uint8]:
        """Decode a picture in fewer pixels, unless that has been done already.

        Parameters
        ----------
        image
            The picture; large ones that have not been decoded before are decoded in fewer pixels if they are JPEG.
        name
            Its name in messages.
        side
            Most pixels along either side.

        Returns
        -------
        numpy.ndarray
            (H, W, 4) uint8, means of the picture's pixels, row 0 at the top; the same array for the same picture.

        Raises
        ------
        InputError
            If it is damaged, too large or of an unsupported format.
        """
        from PIL import Image

        key = id(image), side
        if key not in self._decoded:
            self._images.append(image)
            check_size(image, name)
            image.draft(None, (side, side))  # of JPEG files: no fewer pixels than these
            pixels = rgba(image, name)
            factor = -(-max(pixels.shape[:2]) // side)
            self._decoded[key] = pixels if factor == 1 else np.array(Image.fromarray(pixels).reduce(factor))
            self._bytes += self._decoded[key].nbytes
        return self._decoded[key]

    def once(self, key: Hashable, make: Callable[[], NDArray[np.uint8]]) -> NDArray[np.uint8]:
        """Return what `make` returns for a `key` that no picture has; it is called only once."""
        if key not in self._decoded:
            self._decoded[key] = make()
            self._bytes += self._decoded[key].nbytes
        return self._decoded[key]

    def without_alpha(self, texture: NDArray[np.uint8], name: str) -> NDArray[np.uint8]:
        """Return a picture (H, W, 4) from `decode` with alpha 255 everywhere; each is made only once.

        name: its name in messages. Raises InputError if all pictures together are too large.
        """
        if texture[..., 3].min() == 255:
            return texture
        if id(texture) not in self._solid:
            check_memory(name, self._bytes + texture.nbytes, "the textures")
            solid = texture.copy()
            solid[..., 3] = 255
            self._solid[id(texture)] = solid
            self._bytes += solid.nbytes
        return self._solid[id(texture)]


def load_texture(path: Path) -> NDArray[np.uint8]:
    """Read the picture file `path` as (H, W, 4) uint8, sRGB with alpha, row 0 at the top.

    Raises InputError if the file cannot be read.
    """
    return decode_texture(read_bytes(path), path)


def decode_texture(data: bytes, path: Path) -> NDArray[np.uint8]:
    """Decode the bytes `data` of the picture file `path` to (H, W, 4) uint8, sRGB with alpha, row 0 at the top.

    Raises InputError if they are damaged, too large or of an unsupported format.
    """
    return rgba(open_image(data, str(path)), str(path))


def _eight_bit(values: NDArray[Any]) -> NDArray[np.uint8]:
    """Convert 16-bit integers, which Pillow widens to 32 bits, or floats from 0 to 1 to 8 bits."""
    unit = np.nan_to_num(values) if values.dtype.kind == "f" else values / 65535.0
    return np.round(np.clip(unit, 0.0, 1.0) * 255.0).astype(np.uint8)
