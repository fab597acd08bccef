"""Write some meshes of a glTF file to GLB files of their own, with the materials and pictures that they use.

Each file holds what its meshes use and nothing else, so that its hash, by which its depth images are found, depends on
nothing else. Pictures lie beside the files, since several may use one.
"""

import logging
import re
from collections.abc import Callable, Iterator, Sequence
from copy import deepcopy
from pathlib import Path, PurePosixPath
from typing import Any
from urllib.parse import quote, unquote

import numpy as np
from numpy.typing import NDArray

import depthwalk
from depthwalk.errors import quoted
from depthwalk.ingest.gltf import glb_parts, object_under, placed_node, surfaces
from depthwalk.ingest.gltf_accessors import Accessors

log = logging.getLogger(__name__)

PICTURES = "textures"  # the folder of pictures, beside the mesh files
_KEPT = re.compile(r"POSITION|NORMAL|(TEXCOORD|COLOR)_\d+")  # attributes that are read
_SUFFIXES = {"image/png": ".png", "image/jpeg": ".jpg", "image/webp": ".webp", "image/ktx2": ".ktx2"}
_VERTICES, _INDICES = 34962, 34963  # targets of bufferViews

Header = dict[str, Any]


class SubsetWriter:
    """Write files of some meshes each.

    What is malformed in the header raises ValueError, TypeError or LookupError, as in `Accessors`.
    """

    def __init__(
        self,
        source: Path,
        header: Header,
        accessors: Accessors,
        folder: Path,
        external: Callable[[str], bytes | None],
    ) -> None:
        """Prepare to write files into a folder.

        Parameters
        ----------
        source
            The file that the header is of, for messages.
        header
            The JSON header.
        accessors
            Reads its accessors.
        folder
            An existing folder; pictures are written into the folder PICTURES in it.
        external
            Returns the contents of the picture file that a URI names; None if there is none.
        """
        self._source = source
        self._header, self._accessors, self._folder, self._external = header, accessors, folder, external
        self._pictures: dict[int, str | None] = {}  # URIs of the pictures that are written, by number

    def write(self, file: Path, meshes: Sequence[int], matrices: NDArray[np.float64]) -> None:
        """Write the GLB file `file`.

        Parameters
        ----------
        file
            The file, in the writer's folder.
        meshes
            (k,) numbers of the meshes in the header; a mesh that occurs more than once is stored once.
        matrices : (k, 4, 4) float64
            Where each stands in the file's scene, for column vectors.
        """
        subset = _Subset(self._header, self._accessors, self._picture)
        number = {mesh: subset.mesh(mesh) for mesh in dict.fromkeys(meshes)}
        nodes = [placed_node({"mesh": number[mesh]}, matrix) for mesh, matrix in zip(meshes, matrices, strict=True)]
        subset.write(file, nodes)

    def _picture(self, number: int) -> Header | None:
        """Return the entry of an image, whose file is written if it is not there yet; None if its data is missing."""
        if number not in self._pictures:
            image = self._header["images"][number]
            data = self._contents(image)
            self._pictures[number] = None
            if data is None:
                log.warning("%s: picture %s is missing; ignored", self._source, quoted(str(image.get("uri"))[:80]))
            else:
                name = f"{self._stem(image, number)}{_suffix(image, data)}"
                (self._folder / PICTURES).mkdir(exist_ok=True)
                (self._folder / PICTURES / name).write_bytes(data)
                self._pictures[number] = f"{PICTURES}/{quote(name)}"
        uri = self._pictures[number]
        return None if uri is None else {"uri": uri}

    def _contents(self, image: Header) -> bytes | None:
        is_file = "bufferView" not in image and not image["uri"].startswith("data:")
        return self._external(image["uri"]) if is_file else self._accessors.picture(image)

    def _stem(self, image: Header, number: int) -> str:
        """Return a name for a picture, without an ending, that no other picture of the file gets."""
        uri = str(image.get("uri", ""))
        name = image.get("name") or ("" if uri.startswith("data:") else PurePosixPath(unquote(uri)).stem)
        return f"{file_name(str(name), 'picture')}-{number}"


class _Subset:
    """Collect what some meshes of a file need, numbered anew."""

    def __init__(self, header: Header, accessors: Accessors, picture: Callable[[int], Header | None]) -> None:
        self._from, self._accessors, self._picture = header, accessors, picture
        self._made: dict[tuple[str, int], int] = {}  # new numbers, by list and former number
        self._chunks: list[bytes] = []
        self._length = 0
        self.header: Header = {"asset": {"version": "2.0", "generator": f"depthwalk {depthwalk.__version__}"}}

    def write(self, file: Path, nodes: list[Header]) -> None:
        """Write the file with a scene of these nodes."""
        header = self.header | {"scene": 0, "scenes": [{"nodes": list(range(len(nodes)))}], "nodes": nodes}
        header["buffers"] = [{"byteLength": self._length}]
        if used := sorted(set(_extensions(self.header))):
            header["extensionsUsed"] = used
        required = [
            name for name in self._from.get("extensionsRequired", []) if name in used or name == "KHR_mesh_quantization"
        ]
        if required:
            header |= {"extensionsRequired": required, "extensionsUsed": sorted({*used, *required})}
        with file.open("wb") as out:
            out.writelines(glb_parts(header, self._chunks, self._length))

    def mesh(self, number: int) -> int:
        """Add a mesh, and return its number."""
        source = self._from["meshes"][number]
        primitives = [self._primitive(each) for each in surfaces(source)]
        return self._add("meshes", _named(source) | {"primitives": primitives})

    def _primitive(self, source: Header) -> Header:
        kept = {name: at for name, at in source["attributes"].items() if _KEPT.fullmatch(name)}
        primitive: Header = {"attributes": {name: self._vertices(at, name) for name, at in kept.items()}}
        if "indices" in source:
            primitive["indices"] = self._once(
                "accessors", source["indices"], lambda _: self._stored(source["indices"], _INDICES)
            )
        if "material" in source:
            primitive["material"] = self._once("materials", source["material"], self._material)
        if "mode" in source:
            primitive["mode"] = source["mode"]
        return primitive

    def _vertices(self, number: int, attribute: str) -> int:
        """Return the new number of an accessor for an attribute; glTF wants the bounds of positions."""
        made = self._once("accessors", number, lambda _: self._stored(number, _VERTICES))
        if attribute == "POSITION" and "min" not in (accessor := self.header["accessors"][made]):
            values = self._accessors.stored(number)
            accessor |= {"min": values.min(axis=0).tolist(), "max": values.max(axis=0).tolist()}
        return made

    def _stored(self, number: int, target: int) -> Header:
        """Add the values of an accessor, vertices in steps of four bytes as glTF wants them, and return its entry."""
        source, values = self._from["accessors"][number], self._accessors.stored(number)
        made = {key: source[key] for key in ("componentType", "count", "type", "normalized") if key in source}
        view: Header = {"buffer": 0, "target": target}
        rows = np.ascontiguousarray(values).view(np.uint8).reshape(len(values), -1)
        if target == _VERTICES and (short := -rows.shape[1] % 4):
            rows = np.pad(rows, ((0, 0), (0, short)))
            view["byteStride"] = rows.shape[1]
        data = rows.tobytes()
        made["bufferView"] = self._add("bufferViews", view | {"byteOffset": self._length, "byteLength": len(data)})
        data += b"\0" * (-len(data) % 4)
        self._chunks.append(data)
        self._length += len(data)
        return made

    def _material(self, source: Header) -> Header:
        material = deepcopy(source)
        for parent, key in list(_textures(material)):
            texture = self._once("textures", parent[key]["index"], self._texture)
            if texture < 0:
                del parent[key]
            else:
                parent[key]["index"] = texture
        return material

    def _texture(self, source: Header) -> Header | None:
        """Return the entry of a texture; None if no picture of it is there."""
        texture = {"sampler": self._once("samplers", source["sampler"], dict)} if "sampler" in source else {}
        found: Header = {}
        if "source" in source and (image := self._once("images", source["source"], self._image(source["source"]))) >= 0:
            texture["source"] = image
        for name, extension in object_under(source, "extensions").items():
            if "source" in extension:
                image = self._once("images", extension["source"], self._image(extension["source"]))
                found |= {name: extension | {"source": image}} if image >= 0 else {}
        if not found and "source" not in texture:
            return None
        return _named(source) | texture | ({"extensions": found} if found else {})

    def _image(self, number: int) -> Callable[[Header], Header | None]:
        return lambda source: self._picture(number)

    def _once(self, key: str, number: int, make: Callable[[Header], Header | None]) -> int:
        """Return the new number of an item of the header; −1 if there is nothing to make of it."""
        if (key, number) not in self._made:
            source = self._from[key][number]
            made = make(source)
            self._made[key, number] = -1 if made is None else self._add(key, made)
        return self._made[key, number]

    def _add(self, key: str, item: Header) -> int:
        self.header.setdefault(key, []).append(item)
        return len(self.header[key]) - 1


def file_name(name: str, otherwise: str) -> str:
    """Return a name for a file on any system, of at most 48 characters of `name`; `otherwise` if none is left."""
    plain = re.sub(r"[^A-Za-z0-9_-]+", "-", name).strip("-_")[:48].strip("-_")
    return plain or otherwise


def _named(source: Header) -> Header:
    return {"name": source["name"]} if isinstance(source.get("name"), str) else {}


def _suffix(image: Header, data: bytes) -> str:
    """Return the ending of a picture's file by its type, or by how its data begins."""
    if (suffix := _SUFFIXES.get(str(image.get("mimeType")))) is not None:
        return suffix
    if data.startswith(b"\xff\xd8\xff"):
        return ".jpg"
    if data[:4] == b"RIFF":
        return ".webp"
    return ".ktx2" if data.startswith(b"\xabKTX") else ".png"


def _textures(value: Any) -> Iterator[tuple[Header, str]]:
    """Yield each object and key below a material under which it names a texture."""
    if isinstance(value, dict):
        for key, child in value.items():
            if key.endswith("Texture") and isinstance(child, dict) and "index" in child:
                yield value, key
            yield from _textures(child)


def _extensions(value: Any) -> Iterator[str]:
    """Yield the names of the extensions that a header uses."""
    if isinstance(value, dict):
        yield from object_under(value, "extensions")
        for child in value.values():
            yield from _extensions(child)
    elif isinstance(value, list):
        for child in value:
            yield from _extensions(child)
