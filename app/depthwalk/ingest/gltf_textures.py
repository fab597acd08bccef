"""Decode KTX 2 pictures of glTF files (`KHR_texture_basisu`), and tell which textures have no picture that is read.

`trimesh`, which reads PNG, JPEG and WebP, leaves others out without a word.
"""

import io
import logging
import warnings
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthwalk.errors import InputError, quoted
from depthwalk.ingest import ktx2
from depthwalk.ingest.gltf import BASISU, object_under, objects_under, remedy
from depthwalk.ingest.gltf_accessors import Accessors

log = logging.getLogger(__name__)

_WEBP = "EXT_texture_webp"
KTX = "image/ktx2"
_NO_KTX = f"no support for {KTX}"
_READ = "baseColorTexture", "emissiveTexture", "normalTexture", "diffuseTexture", "metallicRoughnessTexture"
"""Keys of the textures of a material that are read."""

Header = dict[str, Any]


def textures_without_picture(header: Header) -> Counter[str]:
    """Count the textures of materials that have no picture of a kind that is read.

    Extensions as `KHR_texture_basisu` name a picture of another kind; a file may name one of the usual kinds besides,
    for programs that do not know the extension, which is then used. KTX 2 pictures count where the library is missing
    that decodes them.

    Parameters
    ----------
    header
        The JSON header; parts of it may be malformed, and such textures count, too.

    Returns
    -------
    Counter
        How many textures there are for each reason why their picture is not read, as "no support for image/ktx2".
    """
    images = _listed(header, "images")
    return Counter(reason for texture in _used_textures(header) if (reason := _why_not(texture, images)) is not None)


def warn_of_missing_textures(header: Header, accessors: Accessors, path: Path) -> None:
    """Log which textures a file will be drawn without.

    Parameters
    ----------
    header
        The JSON header.
    accessors
        Reads the file's buffers.
    path
        The file, for the messages: one for each reason, one for each picture in the file that is damaged.
    """
    for reason, count in textures_without_picture(header).items():
        missing = "1 texture is" if count == 1 else f"{count} textures are"
        found = f"{remedy()}, or " if reason == _NO_KTX else ""
        log.warning("%s: %s not shown: %s; %sexport it with PNG, JPEG or WebP", path, missing, reason, found)
    images = _listed(header, "images")
    sources = map(picture_number, _used_textures(header))
    for number in sorted({n for n in sources if isinstance(n, int) and n in range(len(images))}):
        if not _opens(images[number], accessors):
            log.warning("%s: images[%d] cannot be read as an image; ignored", path, number)


def shows_ktx2(header: Header) -> bool:
    """Return whether materials show KTX 2 pictures that can be decoded; the header may be malformed."""
    images = _listed(header, "images")
    is_shown = any(_ktx_source(texture, images) is not None for texture in _used_textures(header))
    return is_shown and ktx2.is_available()


def decode_pictures(header: Header, accessors: Accessors, path: Path) -> bool:
    """Replace KTX 2 pictures of textures that are drawn and have no picture of a usual kind beside it, by PNG.

    Parameters
    ----------
    header
        The JSON header, checked by `gltf.check_header`; changed in place.
    accessors
        Reads the file's data; holds the decoded pictures.
    path
        The file, for messages; pictures that cannot be decoded are logged, and their textures have none.

    Returns
    -------
    bool
        Whether any was replaced.

    Raises
    ------
    InputError
        `path: …` if the machine has too little memory, or the library is missing and the file requires it.
    ValueError, TypeError, LookupError
        For damaged data.
    """
    images, used = _listed(header, "images"), _used_textures(header)
    sources = [(texture, source) for texture in used if (source := _ktx_source(texture, images)) is not None]
    if not sources:
        return False
    if not ktx2.is_available():
        if BASISU in header.get("extensionsRequired", []):
            raise InputError(f"{path}: {_NO_KTX}; {remedy()}, or export it with PNG, JPEG or WebP")
        return False
    numbers = sorted({source for _, source in sources})
    made: dict[int, int] = {}
    decoded = ktx2.decode([_contents(images[number], accessors) for number in numbers], path)
    for number, pixels in zip(numbers, decoded, strict=True):
        if pixels is None:
            log.warning("%s: images[%d] cannot be read as an image; ignored", path, number)
        else:
            made[number] = len(images)
            images.append({"bufferView": accessors.add_view(_png(pixels)), "mimeType": "image/png"})
    for texture, source in sources:
        if source in made:
            texture.pop("extensions", None)
            texture["source"] = made[source]
    return bool(made)


def _contents(image: Header, accessors: Accessors) -> bytes:
    """Return the bytes of an image; none if it is in a file that is missing, which is logged when it is looked for."""
    try:
        return accessors.picture(image)
    except FileNotFoundError:
        return b""


def _png(pixels: NDArray[np.uint8]) -> bytes:
    """Return a PNG file, not compressed, of pixels (H, W, 4)."""
    from PIL import Image

    file = io.BytesIO()
    Image.fromarray(pixels).save(file, "PNG", compress_level=0)
    return file.getvalue()


def _used_textures(header: Header) -> list[Any]:
    """Return the textures that materials read, each once; None for each that is not there."""
    textures, numbers = _listed(header, "textures"), set()
    for material in objects_under(header, "materials"):
        extensions = material.get("extensions")
        listed = list(extensions.values()) if isinstance(extensions, dict) else []
        for terms in (material, material.get("pbrMetallicRoughness"), *listed):
            named = [terms.get(key) for key in _READ] if isinstance(terms, dict) else []
            numbers |= {texture["index"] for texture in named if isinstance(texture, dict) and "index" in texture}
    whole = sorted(number for number in numbers if isinstance(number, int))
    return [textures[number] if number in range(len(textures)) else None for number in whole]


def _why_not(texture: Any, images: list[Any]) -> str | None:
    """Return why the picture of a texture is not read; None if it is."""
    if _ktx_source(texture, images) is not None:
        return None if ktx2.is_available() else _NO_KTX
    if _image(picture_number(texture), images) is not None:
        return None
    extensions = object_under(texture, "extensions") if isinstance(texture, dict) else {}
    if extensions:
        return f"no support for {', '.join(quoted(name) for name in sorted(extensions))}"
    return "no picture is named"


def _ktx_source(texture: Any, images: list[Any]) -> int | None:
    """Return the number of the KTX 2 picture of a texture that has no picture of a usual kind; None if it has none."""
    own = picture_number(texture)
    if isinstance(texture, dict) and own is None:
        own = object_under(object_under(texture, "extensions"), BASISU).get("source")
        return own if _image(own, images) is not None else None
    image = _image(own, images)
    return own if image is not None and _is_ktx(image) else None


def _image(number: Any, images: list[Any]) -> Header | None:
    image = images[number] if isinstance(number, int) and 0 <= number < len(images) else None
    return image if isinstance(image, dict) else None


def _is_ktx(image: Header) -> bool:
    return image.get("mimeType") == KTX or str(image.get("uri", "")).lower().endswith(".ktx2")


def picture_number(texture: Any) -> Any:
    """Return the number of the picture that `trimesh` takes for a texture; None if there is none."""
    if not isinstance(texture, dict):
        return None
    extensions = texture.get("extensions")
    webp = extensions.get(_WEBP) if isinstance(extensions, dict) else None
    own = webp.get("source") if isinstance(webp, dict) else None
    return texture.get("source") if own is None else own


def _opens(image: Any, accessors: Accessors) -> bool:
    """Return whether `trimesh` can open a picture that the file holds itself; True for others.

    Pictures in other files are checked when they are read, and kinds that are never read are reported once.
    """
    from PIL import Image

    try:
        if image.get("mimeType") == KTX or ("bufferView" not in image and not image["uri"].startswith("data:")):
            return True
        data = accessors.picture(image)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # about pictures of many pixels, whose size is checked later
            Image.open(io.BytesIO(data)).close()
    except Exception:  # Pillow's plugins raise nearly anything
        return False
    return True


def _listed(header: Header, key: str) -> list[Any]:
    found = header.get(key)
    return found if isinstance(found, list) else []
