"""Decode Draco streams by DracoPy, in a process that may take only as much as the streams are said to hold.

The C++ library of DracoPy takes the sizes in a stream for what they are: one of 400 bytes has it allocate 9 GB, and one
of 500 bytes keeps it busy for half a minute, in which no thread of this process could do anything about it. A process
can be ended.
"""

import io
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthwalk.budget import check_memory
from depthwalk.errors import InputError
from depthwalk.ingest.draco.worker import LENGTH, READY

# What decoding takes, measured with grids of 10⁴ to 10⁶ vertices: at most 85 bytes and 0.2 µs per triangle and 20 bytes
# and 0.15 µs per number at a vertex. What it may take is several times that.
_BYTES, _BYTES_PER_TRIANGLE, _BYTES_PER_NUMBER = 256 << 20, 300, 60
_SECONDS, _SECONDS_PER_ITEM = 5.0, 5e-6
_WORKER = "depthwalk.ingest.draco.worker"
_INTERVAL = 0.05  # s between two looks at the process, in which it allocates some 100 MB at most


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
        raise InputError(
            f'{path}: is compressed by Draco; `pip install "depthwalk[draco]"` installs what reads it, and '
            "`gltf-transform copy` makes a file without compression"
        )
    triangles = sum(stream.triangles for stream in streams)
    numbers = sum(stream.vertices * stream.width for stream in streams)
    most_bytes = _BYTES + _BYTES_PER_TRIANGLE * triangles + _BYTES_PER_NUMBER * numbers
    check_memory(path, most_bytes, f"Draco data of {triangles} triangles")
    answer, excess = _answer(streams, most_bytes, _SECONDS + _SECONDS_PER_ITEM * (triangles + numbers))
    if not answer and not excess:
        raise InputError(f"{path}: is compressed by Draco, and DracoPy, which reads it, does not start")
    meshes = []
    packed = _packed(memoryview(answer)[len(READY) :])
    for stream in streams:
        archive = next(packed, None)
        if not archive:
            reason = f"takes too much {excess} to decode" if archive is None and excess else "is damaged"
            raise InputError(f"{stream.where}: its Draco data {reason}")
        meshes.append(_unpacked(archive))
    return meshes


def _answer(streams: Sequence[DracoStream], most_bytes: int, most_seconds: float) -> tuple[bytes, str]:
    """Return what the worker writes for streams, and which it took too much of, "memory" or "time"; "" if neither."""
    paths = os.pathsep.join(path for path in sys.path if path)
    with tempfile.TemporaryFile() as request:  # not a pipe: `communicate` may stop writing to it at a timeout
        for stream in streams:
            request.write(LENGTH.pack(len(stream.data)) + stream.data)
        request.seek(0)
        process = subprocess.Popen(
            [sys.executable, "-P", "-m", _WORKER],  # -P: nothing is imported from the current folder
            env=os.environ | {"PYTHONPATH": paths},
            stdin=request,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
        )
        excess = ""
        try:
            while True:
                try:
                    return process.communicate(timeout=_INTERVAL)[0], excess
                except subprocess.TimeoutExpired:
                    excess = excess or _excess(process.pid, most_bytes, most_seconds)
                    if excess:
                        process.kill()
        except BaseException:
            process.kill()
            process.communicate()
            raise


def _excess(number: int, most_bytes: int, most_seconds: float) -> str:
    """Return which a process with this number has taken too much of; "" if neither or if it has ended."""
    import psutil  # takes 20 ms to import

    try:
        process = psutil.Process(number)
        # On Windows, an environment's python starts another, which does the work.
        every = [process, *(process.children(recursive=True) if sys.platform == "win32" else [])]
        if sum(each.memory_info().rss for each in every) > most_bytes:
            return "memory"
        return "time" if sum(sum(each.cpu_times()[:2]) for each in every) > most_seconds else ""
    except psutil.Error:
        return ""


def _packed(answer: memoryview) -> Iterator[memoryview]:
    """Yield the archives in what the worker wrote, which may end anywhere."""
    while len(answer) >= LENGTH.size:
        (length,) = LENGTH.unpack(answer[: LENGTH.size])
        if len(answer) < LENGTH.size + length:
            return
        yield answer[LENGTH.size : LENGTH.size + length]
        answer = answer[LENGTH.size + length :]


def _unpacked(archive: memoryview | bytes) -> DracoMesh:
    with np.load(io.BytesIO(archive), allow_pickle=False) as arrays:
        attributes = {int(name[1:]): arrays[name] for name in arrays.files if name != "faces"}
        return DracoMesh(faces=arrays["faces"], attributes=attributes)
