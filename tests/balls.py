"""A small scene on disk, for whoever uses the package as a library."""

from pathlib import Path

import shapes
from files import write_ply

SCENE = """
version: 1
assets:
  ball: {mesh: ball.ply, dpci: {resolution: 64, layers: 1}}
  stone: {mesh: ball.ply, height: 0.5}
objects:
  - {name: ball, asset: ball}
  - grid: {name: row, asset: ball, count: [3, 1], spacing: [2, 2], position: [0, 0, -4]}
  - {asset: stone, position: [1.2, 0, 1]}
environment: {ground: {}}
camera: {position: [0, 1.2, 5], target: [0, 1, 0], fov: 45}
"""


def write_balls(folder: Path) -> Path:
    """A ball of radius 1 that hides the middle one of a row of three behind it (objects 1 to 3), beside it a small one
    that is drawn as its mesh (object 4), on the ground."""
    write_ply(folder / "ball.ply", shapes.sphere(1.0, columns=64, rows=32))
    scene = folder / "scene.yaml"
    scene.write_text(SCENE)
    return scene
