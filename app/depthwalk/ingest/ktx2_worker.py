"""Decode pictures in KTX 2 files in a process of its own, which `ktx2` starts and watches.

It reads each file from its input, eight bytes with its length before it, and writes for each its width and height in
pixels, four bytes each, and then its pixels (height, width, 4) uint8, row 0 at the top. Nothing but zeros stands for a
file that is damaged. READY comes first, once the library is imported.
"""

import struct
import sys

from depthwalk.ingest.watched_process import READY

LENGTH, SIZE = struct.Struct("<Q"), struct.Struct("<II")


def main() -> None:
    """Decode what comes from standard input, until it ends, to standard output."""
    import opengl_basisu

    source, target = sys.stdin.buffer, sys.stdout.buffer
    target.write(READY)
    while head := source.read(LENGTH.size):
        try:
            pixels = opengl_basisu.open(source.read(LENGTH.unpack(head)[0])).transcode("rgba8").data
        except Exception:  # of kinds of its own, ValueError and MemoryError
            target.write(SIZE.pack(0, 0))
        else:
            target.write(SIZE.pack(pixels.shape[1], pixels.shape[0]) + pixels.tobytes())
        target.flush()


if __name__ == "__main__":
    main()
