"""Walk through a scene in a window: `run` opens the window, and raises `NoDisplayError` where it cannot.

This is what `depthwalk view` and the function `depthwalk.view` show. It stands on the renderer and on `assets`, which
load in threads beside the frames.
"""

from depthwalk.walk.app import run
from depthwalk.walk.window import NoDisplayError

__all__ = ["NoDisplayError", "run"]
