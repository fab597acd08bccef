"""Define `WalkOptions`: how a walk begins, and what the program does during it."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from depthwalk.scene.arrays import Camera, Representation
from depthwalk.scene.camera import FrameAll
from depthwalk.scene.models import load_files
from depthwalk.scene.path import CameraPath
from depthwalk.scene.scene import Scene


def _unchanged(camera: Camera, frame_all: FrameAll) -> Camera:
    return camera


def _nothing() -> None:
    return None


@dataclass(frozen=True, kw_only=True)
class WalkOptions:
    """Hold how a walk begins, and what the program does during it.

    Attributes
    ----------
    path
        A camera path for the key P to play; None for none.
    representation
        How to draw every object; None follows the scene.
    first_camera
        Called with the scene's own camera or, if it has none, with one that sees every object, and with a function that
        returns a camera that sees them for a field of view and a direction. Returns the camera to begin with.
    read
        Called with the files of the scene to read it again, and with a scene file or models that are dropped on the
        window. It may raise InputError.
    before_frame
        Called before each frame; what it raises ends the walk. A signal may raise while the window handles a key, where
        Python drops the exception; this is the place to raise it again.
    change
        Called before each frame, while none is being drawn: it may change the scene, and returns the runs of objects
        that it moved; what it raises ends the walk. None changes nothing.
    watched
        Returns the files of a scene, which is read again when one of them is saved; None watches none.
    """

    path: CameraPath | None = None
    representation: Representation | None = None
    first_camera: Callable[[Camera, FrameAll], Camera] = _unchanged
    read: Callable[[Sequence[Path]], Scene] = load_files
    before_frame: Callable[[], None] = _nothing
    change: Callable[[], Sequence[slice]] | None = None
    watched: Callable[[Scene], Sequence[Path]] | None = None
