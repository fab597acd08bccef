"""Change what lies inside containers, and write sizes and checksums anew, so that readers look at the change."""

import io
import json
import random
import struct
import tempfile
import zipfile
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fuzz.bytes_changes import change_bytes, change_text
from fuzz.dictionary import GLTF_KEYS, THREE_MF
from fuzz.tree_changes import change_json, changed_tree

_TYPES = ("<f4", "<f8", "<f2", ">f4", "u1", "<u2", "<u4", "<i4", "<i8", "i1", "?", "<c8", "<U4", "S3", "<M8[s]", ">u2")
_HEADERS = (
    "{'descr': 'O', 'fortran_order': False, 'shape': (2, 2), }",
    "{'descr': '<f4', 'fortran_order': False, 'shape': (99999, 99999), }",
    "{'descr': '<f4', 'fortran_order': True, 'shape': (-1, 2), }",
    "{'descr': [('x', '<f4')], 'fortran_order': False, 'shape': (4,), }",
    "{'descr': '<f4', 'fortran_order': False, 'shape': (2, 9223372036854775807), }",
    "(" * 90,
)


def changed_array(values: NDArray[Any], rng: random.Random) -> NDArray[Any]:
    """Return an array with other values, another shape or another type."""
    values = np.array(values)
    match rng.randrange(6):
        case 0 | 1 | 2 if values.size and values.dtype.kind in "fiub":
            flat = values.reshape(-1)
            at = rng.randrange(len(flat))
            with np.errstate(all="ignore"):
                extreme = [np.nan, np.inf, -np.inf, 1e30, -1.0, 0.0] if values.dtype.kind == "f" else [0, 1, 127]
                if values.dtype.kind in "iu":
                    extreme += [np.iinfo(values.dtype).max, np.iinfo(values.dtype).min, len(flat)]
                flat[at : at + rng.choice((1, 1, 4, len(flat)))] = np.array(rng.choice(extreme)).astype(values.dtype)
        case 3 if values.ndim:
            axis = rng.randrange(values.ndim)
            values = (
                np.take(values, range(rng.choice((0, 1, max(values.shape[axis] - 1, 0)))), axis)
                if len(values)
                else values
            )
        case 4:
            values = rng.choice((values.ravel(), values[None], values[..., None], values.T, values[:0]))
        case _:
            with np.errstate(all="ignore"):
                values = values.astype(rng.choice(_TYPES[:13]))
    return np.ascontiguousarray(values)


def change_npy(data: bytes, rng: random.Random) -> bytes:
    """Return an NPY file with another array, or another header before the same bytes."""
    values: NDArray[Any] = np.load(io.BytesIO(data), allow_pickle=False)
    file = io.BytesIO()
    if rng.random() < 0.7:
        np.save(file, changed_array(values, rng), allow_pickle=False)
        return file.getvalue()
    shape = rng.choice((values.shape, (0, 3), (1 << 40,), (), (3, 5)))
    own = repr({"descr": rng.choice(_TYPES), "fortran_order": rng.random() < 0.5, "shape": shape})
    header = rng.choice((*_HEADERS, own, own))
    text = header.encode() + b"\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text + values.tobytes()


def change_npz(data: bytes, rng: random.Random) -> bytes:
    """Return an archive of arrays with one of them changed, left out or stored under another's name."""
    members = _members(data)
    name = rng.choice(list(members))
    match rng.randrange(10):
        case 0:
            del members[name]
        case 1:
            members[name] = members[rng.choice(list(members))]
        case 2:
            members[name] = change_bytes(members[name], rng)
        case 3 if any(key.startswith(("objects", "made_of")) for key in members):
            name = rng.choice([key for key in members if key.startswith(("objects", "made_of"))])
            members[name] = _changed_document(members[name], rng)
        case _:
            members[name] = change_npy(members[name], rng)
    return _archive(members, rng)


def _members(data: bytes) -> dict[str, bytes]:
    """Return the files in an archive by their names."""
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def _archive(members: Mapping[str, bytes], rng: random.Random) -> bytes:
    """Return an archive of files, compressed or not."""
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", rng.choice((zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED))) as archive:
        for key, value in members.items():
            archive.writestr(key, value)
    return file.getvalue()


def _changed_document(member: bytes, rng: random.Random) -> bytes:
    """Return an NPY file of text, a JSON document, with the document changed."""
    text = str(np.load(io.BytesIO(member), allow_pickle=False))
    file = io.BytesIO()
    np.save(file, np.array(json.dumps(changed_tree(json.loads(text), rng, ("key", "version")))), allow_pickle=False)
    return file.getvalue()


def change_zip(data: bytes, rng: random.Random) -> bytes:
    """Return an archive with one of its files changed, left out or stored under another's name."""
    members = _members(data)
    name = rng.choice(list(members))
    match rng.randrange(12):
        case 0:
            del members[name]
        case 1:
            members[name] = members[rng.choice(list(members))]
        case 2 | 3:
            members[name] = change_bytes(members[name], rng)
        case _:
            members[name] = change_text(members[name], rng, THREE_MF)
    return _archive(members, rng)


def change_png(data: bytes, rng: random.Random) -> bytes:
    """Return a PNG file with one of its chunks changed, and the checksum that fits."""
    chunks, at = [], 8
    while at + 12 <= len(data):
        (length,) = struct.unpack_from(">I", data, at)
        chunks.append((data[at + 4 : at + 8], data[at + 8 : at + 8 + length]))
        at += 12 + length
    number = rng.randrange(len(chunks))
    kind, body = chunks[number]
    match rng.randrange(5):
        case 0:
            del chunks[number]
        case 1:
            chunks.insert(rng.randrange(len(chunks)), chunks[number])
        case 2:
            kinds = (b"tRNS", b"PLTE", b"iCCP", b"zTXt", b"eXIf", b"gAMA", b"acTL", b"fcTL", b"sBIT", b"pHYs")
            chunks.insert(1, (rng.choice(kinds), rng.randbytes(rng.randrange(40))))
        case 3 if kind == b"IDAT":
            chunks[number] = kind, zlib.compress(change_bytes(zlib.decompress(body), rng))
        case _:
            chunks[number] = kind, change_bytes(body, rng)
    sealed = (struct.pack(">I", len(b)) + k + b + struct.pack(">I", zlib.crc32(k + b)) for k, b in chunks)
    return data[:8] + b"".join(sealed)


def change_glb(data: bytes, rng: random.Random) -> bytes:
    """Return a GLB file with its JSON or its buffer changed, and lengths that fit."""
    (length,) = struct.unpack_from("<I", data, 12)
    header, rest = data[20 : 20 + length], data[28 + length :]
    if rng.random() < 0.7:
        header = change_json(header, rng, GLTF_KEYS)
    else:
        rest = change_bytes(rest, rng)
    return glb(header, rest)


def glb(header: bytes, buffer: bytes) -> bytes:
    """Return a GLB file of a JSON header and a buffer."""
    header += b" " * (-len(header) % 4)
    buffer += b"\0" * (-len(buffer) % 4)
    total = struct.pack("<4sII", b"glTF", 2, 28 + len(header) + len(buffer))
    return (
        total + struct.pack("<I4s", len(header), b"JSON") + header + struct.pack("<I4s", len(buffer), b"BIN\0") + buffer
    )


def change_exr(data: bytes, rng: random.Random) -> bytes:
    """Return an OpenEXR file with channels or attributes of a part changed; baked ones get the checksum that fits."""
    import OpenEXR

    from depthwalk.bake.file import channel_checksum
    from depthwalk.bake.file_layout import ATTRIBUTE

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "x.exr"
        path.write_bytes(data)
        with OpenEXR.File(str(path), separate_channels=True) as file:
            parts = [(dict(p.header), {k: np.array(c.pixels) for k, c in p.channels.items()}) for p in file.parts]
        header, channels = rng.choice(parts)
        match rng.randrange(8):
            case 0:
                own = [key for key in header if key.startswith(ATTRIBUTE)]
                key = rng.choice(own or list(header))
                header[key] = rng.choice(
                    (0, 1, -1, 99, 1.5, -1.0, float("nan"), float("inf"), 1e30, "", "x\x1b\n", "0" * 99)
                )
            case 1:
                del channels[rng.choice(list(channels))]
            case 2:
                parts.remove(rng.choice(parts))
            case 3:
                other = rng.choice(parts)
                header["name"] = rng.choice((other[0].get("name", ""), "part2.side.0", "border.side.0", "texture", "x"))
            case _:
                for _ in range(rng.choice((1, 1, 3))):
                    name = rng.choice(list(channels))
                    channels[name] = _changed_pixels(channels[name], rng)
        if any(ATTRIBUTE + "checksum" in header for header, _ in parts) and rng.random() < 0.9:
            checksum = channel_checksum([channels for _, channels in parts])
            for header, _ in parts:
                header[ATTRIBUTE + "checksum"] = checksum
        kept = [OpenEXR.Part({k: v for k, v in h.items() if k != "channels"}, c, h.get("name", "")) for h, c in parts]
        OpenEXR.File(kept).write(str(path))
        return path.read_bytes()


def _changed_pixels(pixels: NDArray[Any], rng: random.Random) -> NDArray[Any]:
    """Return a channel of the same shape and type with other values in a run of texels."""
    pixels = pixels.copy()
    flat = pixels.reshape(-1)
    start = rng.randrange(len(flat))
    run = flat[start : start + rng.choice((1, 1, 7, len(flat)))]
    if pixels.dtype.kind == "f":
        run[:] = rng.choice((np.nan, np.inf, -np.inf, -1.0, 0.0, 60000.0))
    else:
        run[:] = np.uint32(rng.choice((0, 1, 2, 3, 255, 0xFFFF, 0x7FFFFFFF, 0xFFFFFFFF, rng.randrange(1 << 32))))
    return pixels
