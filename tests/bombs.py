"""Small files that ask for much: each function writes one, of about `size` bytes, into a folder."""

import json
import struct
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from files import written

CORNERS = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 1 1\nvt 0 0\nvt 1 0\nvt 0 1\n"
FACET = (
    "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid a\n"
)


def zeros(row: int, rows: int) -> bytes:
    """As many zeros, deflated, and never all in memory."""
    packer = zlib.compressobj(9)
    return b"".join(packer.compress(bytes(row)) for _ in range(rows)) + packer.flush()


# Meshes of text --------------------------------------------------------------------------------------------------


def blank_library(folder: Path, size: int) -> Path:
    return written(folder / "blanks.obj", f"mtllib{' ' * size}\n{CORNERS}f 1 2 3\n")


def many_libraries(folder: Path, size: int) -> Path:
    """One line that names libraries that do not exist."""
    names = " ".join(f"{number:05}" for number in range(size // 6))
    return written(folder / "libraries.obj", f"mtllib {names}\n{CORNERS}f 1 2 3\n")


def many_materials(folder: Path, size: int) -> Path:
    uses = "".join(f"usemtl {number:05}\nf 1 2 3\n" for number in range(size // 21))
    return written(folder / "materials.obj", f"{CORNERS}{uses}")


def one_texture(folder: Path, size: int) -> Path:
    """Materials that all have the same picture, by other spellings of its name."""
    count = size // 40
    written(folder / "same.png", png(1024, 1024))
    written(folder / "same.mtl", "".join(f"newmtl m{n}\nmap_Kd {'./' * (n % 8)}same.png\n" for n in range(count)))
    uses = "".join(f"usemtl m{number}\nf 1/1 2/2 3/3\n" for number in range(count))
    return written(folder / "same.obj", f"mtllib same.mtl\n{CORNERS}{uses}")


def many_solids(folder: Path, size: int) -> Path:
    return written(folder / "solids.stl", FACET * (size // len(FACET)))


def great_ply(folder: Path, size: int) -> Path:
    """A header that announces more vertices than the file has bytes."""
    floats = "".join(f"property float {axis}\n" for axis in "xyz")
    face = "element face 1\nproperty list uchar int vertex_indices\n"
    text = f"ply\nformat binary_little_endian 1.0\nelement vertex 2000000000\n{floats}{face}end_header\n"
    return written(folder / "great.ply", text.encode() + bytes(size))


# glTF ------------------------------------------------------------------------------------------------------------


def glb(path: Path, corners: int = 3, **header: Any) -> Path:
    """A GLB file: a fan of triangles with so many corners, and a header that has `header` besides or instead."""
    turn = np.linspace(0, 6, corners)
    positions = np.stack([np.cos(turn), np.sin(turn), turn], 1).astype(np.float32)
    middle = np.arange(1, corners - 1)
    faces = np.stack([np.zeros_like(middle), middle, middle + 1], 1).astype(np.uint16)
    binary = positions.tobytes() + faces.tobytes()
    binary += bytes(-len(binary) % 4)
    content = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": corners, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5123, "count": faces.size, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": positions.nbytes},
            {"buffer": 0, "byteOffset": positions.nbytes, "byteLength": faces.nbytes},
        ],
        "buffers": [{"byteLength": len(binary)}],
    } | header
    text = json.dumps(content, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(binary), b"BIN\0") + binary
    return written(path, b"glTF" + struct.pack("<II", 2, 12 + len(chunks)) + chunks)


def many_nodes(folder: Path, size: int) -> Path:
    """Nodes beside each other."""
    count = size // 17
    return glb(folder / "nodes.glb", nodes=[{"mesh": 0}] * count, scenes=[{"nodes": list(range(count))}])


def deep_nodes(folder: Path, size: int) -> Path:
    """Nodes each within the one before."""
    count = size // 29
    nodes = [{"children": [number + 1], "mesh": 0} for number in range(count - 1)]
    return glb(folder / "deep.glb", nodes=[*nodes, {"mesh": 0}])


def many_copies(folder: Path, size: int) -> Path:
    """One mesh, placed so often that its triangles stay below the limit, and memory does not."""
    count = size // 30
    placed: dict[str, Any] = {"nodes": [{"mesh": 0}] * count, "scenes": [{"nodes": list(range(count))}]}
    return glb(folder / "copies.glb", corners=size // 40, **placed)


def many_primitives(folder: Path, size: int) -> Path:
    """A mesh whose primitives all use the same data."""
    primitives = [{"attributes": {"POSITION": 0}, "indices": 1}] * (size // 80)
    return glb(folder / "primitives.glb", corners=size // 40, meshes=[{"primitives": primitives}])


# Pictures --------------------------------------------------------------------------------------------------------


def png(width: int, height: int) -> bytes:
    """A picture of zeros with alpha."""

    def chunk(name: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))

    header = struct.pack(">2I5B", width, height, 8, 6, 0, 0, 0)
    pixels = zeros(1 + 4 * width, height)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", pixels) + chunk(b"IEND", b"")


def tiled_tiff(folder: Path, size: int) -> Path:
    """A picture of 32 × 24 pixels in one deflated tile that is as large as `size` bytes can make it."""
    side = 16 * int(np.sqrt(size))
    data = zeros(4 * side, side)
    tags = {256: 32, 257: 24, 258: 8, 259: 8, 262: 1, 277: 1, 322: side, 323: side, 324: 0, 325: len(data)}
    head = b"II*\0" + struct.pack("<I", 8) + _directory(tags)
    return written(folder / "tiled.tif", b"II*\0" + struct.pack("<I", 8) + _directory(tags | {324: len(head)}) + data)


def _directory(tags: Mapping[int, int]) -> bytes:
    """The directory of a TIFF file, with one number for each tag."""
    entries = b"".join(struct.pack("<HHII", tag, 4, 1, value) for tag, value in tags.items())
    return struct.pack("<H", len(tags)) + entries + bytes(4)


def many_scans(folder: Path, size: int) -> Path:
    """A progressive JPEG whose last scan is there again and again."""
    import io

    from PIL import Image

    stream = io.BytesIO()
    Image.new("L", (2048, 2048), 90).save(stream, "JPEG", progressive=True)
    data = stream.getvalue()
    scan = data[data.rindex(b"\xff\xda") : -2]
    return written(folder / "scans.jpg", data[:-2] + scan * (size // len(scan)) + data[-2:])


def equal_depths(folder: Path, side: int) -> Path:
    """An EXR file of `side`² equal depths, which takes a hundredth of a bit for each."""
    import OpenEXR

    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    path = folder / "equal.exr"
    OpenEXR.File(header, {"Z": np.ones((side, side), np.float16)}).write(str(path))
    return path


# Scenes ----------------------------------------------------------------------------------------------------------


def wrong_objects(folder: Path, size: int) -> Path:
    """A scene of which every object is wrong."""
    line = "- {asset: a, yaw: x}\n"
    return written(folder / "wrong.yaml", "version: 1\nassets: {}\nobjects:\n" + line * (size // len(line)))


def wrong_keys(folder: Path, size: int) -> Path:
    """A scene of keys that nobody knows, in one mapping."""
    return written(folder / "keys.yaml", "version: 1\n" + "".join(f"k{n:05}: 1\n" for n in range(size // 10)))


def empty_objects(folder: Path, size: int) -> Path:
    """A scene whose objects are empty mappings."""
    return written(folder / "empty.yaml", f"version: 1\nassets: {{}}\nobjects: [{'{},' * (size // 3)}]\n")


def crowded_csv(folder: Path, size: int) -> Path:
    """A file of places of which every line is wrong."""
    return written(folder / "crowded.csv", "x,y,z\n" + ",\n" * (size // 2))


def wide_csv(folder: Path, size: int) -> Path:
    """A file of places with one line of many columns."""
    return written(folder / "wide.csv", "x,y,z\n" + "1," * (size // 2) + "1\n")
