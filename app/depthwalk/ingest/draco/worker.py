"""Decode Draco streams in a process of its own, which `draco.decoder` starts and watches.

It reads each stream from its input, eight bytes with its length before it, and writes for each an NPZ archive in the
same way: the `faces` (F, 3) uint32, and under `a7` the values (V, width) of the attribute with the unique ID 7. Nothing
but the length 0 stands for a stream that is damaged. READY comes first, once the library is imported.
"""

import io
import struct
import sys
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from depthwalk.ingest.watched_process import READY

LENGTH = struct.Struct("<Q")


def main() -> None:
    """Decode what comes from standard input, until it ends, to standard output."""
    import DracoPy

    source, target = sys.stdin.buffer, sys.stdout.buffer
    target.write(READY)
    while head := source.read(LENGTH.size):
        stream = source.read(LENGTH.unpack(head)[0])
        try:
            mesh = DracoPy.decode(stream)
        except Exception:  # it raises one exception for whatever is wrong with a stream, and MemoryError
            _write(b"", target)
        else:
            _write(_packed(mesh), target)


def _packed(mesh: Any) -> bytes:
    """Return an archive of the faces and attributes of a `DracoMesh`, or of a `DracoPointCloud`, which has no faces."""
    arrays: dict[str, NDArray[Any]] = {"faces": getattr(mesh, "faces", np.zeros((0, 3), np.uint32))}
    arrays |= {f"a{each['unique_id']}": each["data"] for each in mesh.attributes if each["data"] is not None}
    packed = io.BytesIO()
    np.savez(packed, allow_pickle=False, **arrays)
    return packed.getvalue()


def _write(data: bytes, target: BinaryIO) -> None:
    target.write(LENGTH.pack(len(data)))
    target.write(data)
    target.flush()


if __name__ == "__main__":
    main()
