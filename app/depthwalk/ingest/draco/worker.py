"""Decode Draco streams in a process of its own, which `draco.decoder` starts and watches.

It reads each stream as a message from its input, and writes for each an NPZ archive as one: the `faces` (F, 3) uint32,
and under `a7` the values (V, width) of the attribute with the unique ID 7. An empty message stands for a stream that is
damaged.
"""

import io
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthwalk.ingest.watched_process import answer_messages


def main() -> None:
    """Decode what comes from standard input, until it ends, to standard output."""
    import DracoPy

    answer_messages(lambda stream: _packed(DracoPy.decode(stream)))


def _packed(mesh: Any) -> bytes:
    """Return an archive of the faces and attributes of a `DracoMesh`, or of a `DracoPointCloud`, which has no faces."""
    arrays: dict[str, NDArray[Any]] = {"faces": getattr(mesh, "faces", np.zeros((0, 3), np.uint32))}
    arrays |= {f"a{each['unique_id']}": each["data"] for each in mesh.attributes if each["data"] is not None}
    packed = io.BytesIO()
    np.savez(packed, allow_pickle=False, **arrays)
    return packed.getvalue()


if __name__ == "__main__":
    main()
