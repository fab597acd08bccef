"""Decode Draco streams by DracoPy, in a process that may take only as much as the streams are said to hold.

The C++ library of DracoPy takes the sizes in a stream for what they are: one of 400 bytes has it allocate 9 GB, and one
of 500 bytes keeps it busy for half a minute, in which no thread of this process could do anything about it. A process
can be ended.
"""

import io
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthwalk.budget import check_memory
from depthwalk.errors import InputError
from depthwalk.ingest.gltf import without_library
from depthwalk.ingest.watched_process import framed, messages_in, run_watched

# What decoding may take: for a vertex with eight numbers and two triangles 1,080 bytes and 50 µs. Grids of 10⁶ such
# vertices take 170 to 290 bytes and 0.6 to 1.9 µs for each, by how they are compressed.
_BYTES, _BYTES_PER_TRIANGLE, _BYTES_PER_NUMBER = 256 << 20, 300, 60
_SECONDS, _SECONDS_PER_ITEM = 5.0, 5e-6
_WORKER = "depthwalk.ingest.draco.worker"


@dataclass(frozen=True, kw_only=True)
class DracoStream:
    """Hold a compressed mesh, and what the file says of it.

    Attributes
    ----------
    where
        What it is of, for messages: `a.glb: meshes[0].primitives[1]`.
    data
        The stream.
    triangles, vertices
        How many it should have.
    width
        How many numbers a vertex should have in all of its attributes.
    """

    where: str
    data: bytes
    triangles: int
    vertices: int
    width: int


@dataclass(frozen=True, kw_only=True)
class DracoMesh:
    """Hold a decoded mesh.

    Attributes
    ----------
    faces : (F, 3) uint32
        Vertices of the triangles, unchecked.
    attributes
        (V, width) uint8, uint32 or float32 by the attribute's unique ID. The library gives integers with a sign as
        float32, and those of 16 bits as uint32.
    """

    faces: NDArray[np.uint32]
    attributes: dict[int, NDArray[Any]]


def decode(streams: Sequence[DracoStream], path: Path) -> list[DracoMesh]:
    """Decode streams, in a process for all of them.

    Parameters
    ----------
    streams
        At least one stream.
    path
        Their file, for messages.

    Returns
    -------
    list
        The meshes; what a stream says of their numbers and types is not checked.

    Raises
    ------
    InputError
        `path: …` if DracoPy is not installed or the machine has too little memory; `path: meshes[0].primitives[1]: …`
        for a stream that is damaged, or takes more memory or time than the numbers of its vertices and triangles
        explain.
    """
    if find_spec("DracoPy") is None:
        raise without_library(path, "Draco")
    triangles = sum(stream.triangles for stream in streams)
    numbers = sum(stream.vertices * stream.width for stream in streams)
    most_bytes = _BYTES + _BYTES_PER_TRIANGLE * triangles + _BYTES_PER_NUMBER * numbers
    check_memory(path, most_bytes, f"Draco data of {triangles} triangles")
    request = framed(stream.data for stream in streams)
    most_seconds = _SECONDS + _SECONDS_PER_ITEM * (triangles + numbers)
    is_ready, answer, excess = run_watched(_WORKER, request, most_bytes=most_bytes, most_seconds=most_seconds)
    if not is_ready and not excess:
        raise InputError(f"{path}: is compressed by Draco, and DracoPy, which reads it, does not start")
    meshes = []
    packed = messages_in(answer)
    for stream in streams:
        archive = next(packed, None)
        if not archive:
            stopped = f"takes too much {excess} to decode" if excess else "cannot be decoded"
            raise InputError(f"{stream.where}: its Draco data {stopped if archive is None else 'is damaged'}")
        meshes.append(_unpacked(archive))
    return meshes


def _unpacked(archive: memoryview | bytes) -> DracoMesh:
    with np.load(io.BytesIO(archive), allow_pickle=False) as arrays:
        attributes = {int(name[1:]): arrays[name] for name in arrays.files if name != "faces"}
        return DracoMesh(faces=arrays["faces"], attributes=attributes)
