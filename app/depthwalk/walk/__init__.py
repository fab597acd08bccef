"""Walk through a scene in a window: `run` opens it, and raises `NoDisplay` where it cannot."""

from depthwalk.walk.app import run
from depthwalk.walk.window import NoDisplay

__all__ = ["NoDisplay", "run"]
