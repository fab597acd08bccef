"""Translate a USD file to glTF in a process of its own, which `usd.translation` starts and watches.

It reads a JSON object from its standard input: `path`, the file, and `root`, the folder that holds all that it may
name, both without symbolic links. To its standard output it writes READY, once usd-core is imported, and two messages
(`watched_process.framed`): a JSON object with `warnings`, and the GLB file. Where the file is refused, it writes one: a
JSON object with the `error`. Less than this follows READY if the file is damaged in a way that ends the process.
"""

import json
import struct
import sys
from collections.abc import Iterable

from depthwalk.ingest.watched_process import READY, framed


def main() -> None:
    """Read a request from standard input and write the answer to standard output."""
    from pxr import Usd, UsdGeom, UsdLux, UsdShade  # noqa: F401  # so that READY says that they are there

    out = sys.stdout.buffer
    out.write(READY)
    out.flush()
    request = json.loads(sys.stdin.buffer.read())
    from pxr import Tf

    from depthwalk.ingest.usd.problems import UsdError, told
    from depthwalk.ingest.usd.scene import translate

    try:
        builder, warnings = translate(request["path"], request["root"])
        parts = list(builder.parts())
    except UsdError as error:
        _answer({"error": str(error)})
    except Tf.ErrorException as error:
        _answer({"error": told(error, request["root"])})
    else:
        _answer({"warnings": warnings}, parts)


def _answer(said: dict[str, object], file: Iterable[bytes] | None = None) -> None:
    """Write the answer: an object and, if there is one, a file in parts."""
    out = sys.stdout.buffer
    out.writelines(framed([json.dumps(said).encode()]))
    if file is not None:
        parts = list(file)
        out.write(struct.pack("<Q", sum(map(len, parts))))
        out.writelines(parts)
    out.flush()


if __name__ == "__main__":
    main()
