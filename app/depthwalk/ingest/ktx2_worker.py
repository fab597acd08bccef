"""Decode pictures in KTX 2 files in a process of its own, which `ktx2` starts and watches.

It reads each file as a message from its input, and writes for each its width and height in pixels, four bytes each, and
then its pixels (height, width, 4) uint8, row 0 at the top. An empty message stands for a file that is damaged.
"""

import struct

from depthwalk.ingest.watched_process import answer_messages

SIZE = struct.Struct("<II")


def main() -> None:
    """Decode what comes from standard input, until it ends, to standard output."""
    import opengl_basisu

    def decoded(file: bytes) -> bytes:
        pixels = opengl_basisu.open(file).transcode("rgba8").data
        return SIZE.pack(pixels.shape[1], pixels.shape[0]) + bytes(pixels.tobytes())

    answer_messages(decoded)


if __name__ == "__main__":
    main()
