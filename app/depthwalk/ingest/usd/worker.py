"""Translate a USD file to glTF in a process of its own, which `usd.translation` starts and watches.

It reads a JSON object from its standard input: `path`, the file, and `root`, the folder that holds all that it may
name, both without symbolic links. To its standard output it writes READY, once usd-core is imported, and two messages
(`watched_process.framed`): a JSON object with `warnings` and the `files` that the translation is made of, and the GLB
file. Where the file is refused, it writes one: a JSON object with the `error`. Less than this follows READY if the file
is damaged in a way that ends the process.
"""

import json
import sys
from collections.abc import Iterator

from depthwalk.ingest.watched_process import READY, framed


def main() -> None:
    """Read a request from standard input and write the answer to standard output."""
    from pxr import Usd, UsdGeom, UsdLux, UsdShade  # noqa: F401  # so that READY says that they are there

    out = sys.stdout.buffer
    out.write(READY)
    out.flush()
    out.writelines(framed(answer(sys.stdin.buffer.read())))


def answer(request: bytes) -> Iterator[bytes]:
    """Yield the messages that answer a request. Raises exceptions of any kind for some damaged files."""
    from pxr import Tf

    from depthwalk.ingest.usd.problems import UsdError, told
    from depthwalk.ingest.usd.scene import translate

    said = json.loads(request)
    path, root = said["path"], said["root"]
    try:
        made = translate(path, root)
        file = b"".join(made.builder.parts())
    except UsdError as error:
        yield json.dumps({"error": str(error)}).encode()
    except Tf.ErrorException as error:
        yield json.dumps({"error": told(error, path, root)}).encode()
    except RecursionError:
        yield json.dumps({"error": "a shader reads what it makes itself, in a circle"}).encode()
    else:
        yield json.dumps({"warnings": made.warnings, "files": made.files}).encode()
        yield file


if __name__ == "__main__":
    main()
