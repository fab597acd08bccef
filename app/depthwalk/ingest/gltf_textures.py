"""Find the textures of glTF files that `trimesh` leaves out without a word, since it cannot read their pictures."""

import base64
import io
import logging
import warnings
from collections import Counter
from pathlib import Path
from typing import Any

from depthwalk.errors import quoted
from depthwalk.ingest.gltf import objects_under
from depthwalk.ingest.gltf_accessors import Accessors

log = logging.getLogger(__name__)

_WEBP = "EXT_texture_webp"
_KTX = "image/ktx2"
_READ = "baseColorTexture", "emissiveTexture", "normalTexture", "diffuseTexture"
"""Keys of the textures of a material that are drawn."""

Header = dict[str, Any]


def textures_without_picture(header: Header) -> Counter[str]:
    """Count the textures of materials that have no picture of a kind that is read.

    Extensions as `KHR_texture_basisu` name a picture of another kind; a file may name one of the usual kinds besides,
    for programs that do not know the extension, which is then used.

    Parameters
    ----------
    header
        The JSON header; parts of it may be malformed, and such textures count, too.

    Returns
    -------
    Counter
        How many textures there are for each reason why their picture is not read, as "no support for image/ktx2".
    """
    textures, images = _listed(header, "textures"), _listed(header, "images")
    used = [textures[n] if n in range(len(textures)) else None for n in _used_textures(header)]
    return Counter(reason for texture in used if (reason := _why_not(texture, images)) is not None)


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
        log.warning("%s: %s not shown: %s; export it with PNG, JPEG or WebP", path, missing, reason)
    textures, images = _listed(header, "textures"), _listed(header, "images")
    sources = [_source(textures[n]) for n in _used_textures(header) if n in range(len(textures))]
    for number in sorted({n for n in sources if isinstance(n, int) and n in range(len(images))}):
        if not _opens(images[number], accessors):
            log.warning("%s: images[%d] cannot be read as an image; ignored", path, number)


def _used_textures(header: Header) -> list[int]:
    """Return the numbers of the textures that materials draw, each once, in ascending order."""
    numbers = set()
    for material in objects_under(header, "materials"):
        extensions = material.get("extensions")
        listed = list(extensions.values()) if isinstance(extensions, dict) else []
        for terms in (material, material.get("pbrMetallicRoughness"), *listed):
            named = [terms.get(key) for key in _READ] if isinstance(terms, dict) else []
            numbers |= {texture["index"] for texture in named if isinstance(texture, dict) and "index" in texture}
    return sorted(number for number in numbers if isinstance(number, int))


def _why_not(texture: Any, images: list[Any]) -> str | None:
    """Return why the picture of a texture is not read; None if it is."""
    number = _source(texture)
    image = images[number] if isinstance(number, int) and 0 <= number < len(images) else None
    if isinstance(image, dict):
        is_ktx = image.get("mimeType") == _KTX or str(image.get("uri", "")).lower().endswith(".ktx2")
        return f"no support for {_KTX}" if is_ktx else None
    extensions = texture.get("extensions") if isinstance(texture, dict) else None
    if isinstance(extensions, dict) and extensions:
        return f"no support for {', '.join(quoted(name) for name in sorted(extensions))}"
    return "no picture is named"


def _source(texture: Any) -> Any:
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
        if image.get("mimeType") == _KTX:
            return True
        if "bufferView" in image:
            data = accessors.view(image["bufferView"])
        elif (uri := image["uri"]).startswith("data:"):
            data = base64.b64decode(uri.partition("base64,")[2])
        else:
            return True
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # about pictures of many pixels, whose size is checked later
            Image.open(io.BytesIO(data)).close()
    except Exception:  # Pillow's plugins raise nearly anything
        return False
    return True


def _listed(header: Header, key: str) -> list[Any]:
    found = header.get(key)
    return found if isinstance(found, list) else []
