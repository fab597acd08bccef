"""Find what imgui-bundle holds without importing its Python part.

imgui-bundle is one native module with twenty libraries in it, of which depthwalk needs imgui and GLFW. Its Python part
sets up all of them, and imports asyncio and ssl for some; that would take a twentieth of the time until the first
picture.
"""

import os
from importlib.util import find_spec
from pathlib import Path

_GLFW = ("libglfw.so.3", "libglfw.3.dylib", "glfw3.dll")  # by system


def _folder() -> Path:
    """Return the folder of imgui-bundle. Raises ImportError where it is not installed."""
    spec = find_spec("imgui_bundle")
    if spec is None or spec.origin is None:
        raise ImportError("imgui_bundle is not installed")
    return Path(spec.origin).parent


FOLDER = _folder()


def name_glfw() -> None:
    """Tell the package glfw, before it is imported, to take the library that imgui-bundle is linked to.

    So there is only one, and glfw need not search the system for it. Whoever has named another gets that.
    """
    for file in map(FOLDER.joinpath, _GLFW):
        if file.is_file():
            os.environ.setdefault("PYGLFW_LIBRARY", str(file))
