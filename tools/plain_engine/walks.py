"""Walk about an object, so that it stays whole in the picture."""

from dataclasses import replace

import numpy as np

from depthwalk.scene.arrays import Camera

_STEP = 0.15  # degrees from frame to frame: 1.4 m/s at 18 m, 0.25 m/s at 3 m


def walk_about(camera: Camera, distance: float, frames: int) -> list[Camera]:
    """Return cameras that walk about the target of `camera`, as high as it stands, at so many metres."""
    target, place = np.array(camera.target), np.array(camera.position)
    start = np.arctan2(place[0] - target[0], place[2] - target[2])
    turns = start + np.radians(_STEP) * np.arange(frames)
    level = np.full(frames, place[1] - target[1])
    places = target + np.stack([distance * np.sin(turns), level, distance * np.cos(turns)], -1)
    return [replace(camera, position=tuple(place)) for place in places.tolist()]
