"""Find the files of imgui-bundle without importing its Python part, and point other packages to its libraries.

imgui-bundle is one native module with twenty libraries in it, of which depthwalk needs imgui and GLFW. Its Python part
sets up all of them, and imports asyncio and ssl for some; that would take a twentieth of the time until the first
picture.
"""

import os
import sys
from importlib.util import find_spec
from pathlib import Path

from pyglm import glm

_GLFW = ("libglfw.so.3", "libglfw.3.dylib", "glfw3.dll")  # by operating system


def _folder() -> Path:
    """Return the folder of imgui-bundle. Raises ImportError if it is not installed."""
    spec = find_spec("imgui_bundle")
    if spec is None or spec.origin is None:
        raise ImportError("imgui_bundle is not installed")
    return Path(spec.origin).parent


FOLDER = _folder()


def _name_libraries() -> None:
    """Set the libraries that glfw and moderngl-window would search for elsewhere; call this before importing them.

    glfw then uses the library that imgui-bundle is linked to, so that there is only one and no search; a choice made
    by the user is kept. moderngl-window imports PyGLM by an old name, which warns.
    """
    for file in map(FOLDER.joinpath, _GLFW):
        if file.is_file():
            os.environ.setdefault("PYGLFW_LIBRARY", str(file))
    sys.modules.setdefault("glm", glm)


_name_libraries()
