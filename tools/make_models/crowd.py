"""Make a scene of thousands of thin figures, and a walk through it: `python -m tools.make_models FOLDER crowd`.

Arms, fingers and legs stand apart, so that little of a figure hides what is behind it: neither occlusion culling nor
large triangles help those who draw it.
"""

from pathlib import Path

from tools.make_models.model import write_ply
from tools.make_models.specimens import figure

from depthwalk.files import write_bytes

_SCENE = """version: 1
assets:
  figure: {mesh: figure.ply, dpci: {resolution: 512, layers: auto}}
objects:
  - {scatter: {asset: figure, count: 10000, area: [200, 200], spacing: 1.3, scale: [0.9, 1.1]}}
camera: {position: [0, 1.7, 95], target: [0, 1, 0], fov: 60}
"""
_PATH = """version: 1
fps: 30
interpolation: smooth
keyframes:
  - {time: 0, position: [0, 1.7, 95], target: [0, 1.2, 40], fov: 60}
  - {time: 5, position: [0, 1.7, 88], target: [-12, 1.2, 60], fov: 60}
  - {time: 10, position: [0, 1.7, 81], target: [14, 1.2, 60], fov: 60}
  - {time: 15, position: [1, 1.7, 74], target: [0, 1.0, 20], fov: 60}
"""


def write_crowd(folder: Path) -> None:
    """Write `figure.ply`, `crowd.yaml` and the walk `crowd_walk.yaml` to an existing folder."""
    write_ply(folder / "figure.ply", figure())
    write_bytes(folder / "crowd.yaml", _SCENE.encode())
    write_bytes(folder / "crowd_walk.yaml", _PATH.encode())
