"""Walk through a scene in a window: `run` opens the window, and raises `NoDisplayError` where it cannot.

This is what `depthwalk view` and the function `depthwalk.view` show. It stands on `render`, and on `assets`, which
makes depth images ready beside the frames.
"""

from depthwalk.walk.app import run
from depthwalk.walk.window import NoDisplayError

__all__ = ["NoDisplayError", "run"]
