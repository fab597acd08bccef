"""Walking through a scene in a window."""

from depthwalk.walk.app import run
from depthwalk.walk.window import NoDisplay

__all__ = ["NoDisplay", "run"]
