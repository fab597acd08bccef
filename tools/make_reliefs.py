"""Make the reliefs of scenes/paper: depth and colour of shipped models, in parallel projection from the front.

`python -m tools.make_reliefs [FOLDER]` writes a depth image, 16 bits, white in front, and a colour image for each.
Where a model does not fill its square, a wall is placed behind it, at the depth where the picture is black.
"""

import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
from PIL import Image

from depthwalk.bake.raycast import RayCaster
from depthwalk.bake.surface import surface_at
from depthwalk.colour import srgb8_from_linear
from depthwalk.ingest.loader import load_mesh
from depthwalk.resources import asset_root, scene_root

SIDE = 256  # texels
DEEP = 0.5  # part of a model's depth that its relief keeps: how far behind the nearest point the wall is
_WALL = (0.42, 0.40, 0.37)  # linear


class Relief(NamedTuple):
    """Define what a relief shows: a square part of a model, seen along −z.

    Attributes
    ----------
    mesh
        Name of the model's file in assets/.
    middle
        x and y of the square's centre, metres, in the model's frame.
    size
        Width and height of the square, metres.
    """

    mesh: str
    middle: tuple[float, float]
    size: float


RELIEFS = {
    "man": Relief("man_of_the_paper.ply", (0.0, 0.29), 0.32),
    "venus": Relief("venus_of_the_paper.ply", (0.0, 0.27), 0.36),
    "teapot": Relief("teapot.ply", (0.0, 0.10), 0.38),
}


def make_relief(relief: Relief, side: int = SIDE) -> tuple[Image.Image, Image.Image]:
    """Sample a model by parallel rays, and return depth and colour of the relief.

    Parameters
    ----------
    relief
        What the relief shows.
    side
        Width and height of both images, texels.

    Returns
    -------
    tuple[Image.Image, Image.Image]
        Depth, 16 bits, white in front; and colour, sRGB.
    """
    mesh = load_mesh(asset_root() / relief.mesh)
    low, high = mesh.bounds
    at = (np.arange(side) + 0.5) / side - 0.5
    x, y = np.meshgrid(relief.middle[0] + at * relief.size, relief.middle[1] - at * relief.size)
    origin = np.column_stack([x.ravel(), y.ravel(), np.full(x.size, high[2])]).astype(np.float32)
    deep = DEEP * float(high[2] - low[2])
    hits = RayCaster(mesh).peel(origin, np.tile(np.array([0, 0, -1], np.float32), (x.size, 1)), 1, deep)
    _, albedo = surface_at(mesh, hits)
    distance, missed = hits.distance[0], hits.face[0] < 0
    height = np.where(missed, 0.0, 1 - np.minimum(distance, deep) / deep).reshape(x.shape)
    colour = np.where(missed[:, None], _WALL, albedo[0, :, :3]).reshape(*x.shape, 3)
    return Image.fromarray((height * 65535 + 0.5).astype(np.uint16)), Image.fromarray(srgb8_from_linear(colour))


def main() -> None:
    """Write all reliefs to the folder that the command line names, else to the folder of the shipped ones."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else scene_root() / "paper" / "reliefs"
    for name, relief in RELIEFS.items():
        for kind, picture in zip(("depth", "colour"), make_relief(relief), strict=True):
            picture.save(folder / f"{name}_{kind}.png", optimize=True)


if __name__ == "__main__":
    main()
