"""Walk through a scene in a window: `run` opens it, and raises `NoDisplayError` where it cannot."""

from depthwalk.walk.app import run
from depthwalk.walk.window import NoDisplayError

__all__ = ["NoDisplayError", "run"]
