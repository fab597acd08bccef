"""Make the panorama of scenes/paper: colour and depth of a room with two tables, seen all round from one point.

`python -m tools.make_panorama [FOLDER]` writes a colour image and a depth image, 16 bits, in counts of `UNIT` metres,
as `depth_image: {panorama: …}` of a scene file takes them. Through the window nothing is measured.
"""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
from PIL import Image

from depthwalk.bake.raycast import RayCaster
from depthwalk.bake.surface import surface_at
from depthwalk.colour import srgb8_from_linear
from depthwalk.ingest.loader import load_mesh
from depthwalk.ingest.mesh import Mesh
from depthwalk.ingest.range_image import PanoramaLens
from depthwalk.resources import asset_root, scene_root

WIDTH, HEIGHT = 768, 272  # pixels
HORIZON = 119.5  # row, from the top: more of the floor is visible than of the ceiling
EYE = (0.0, 1.4, 0.2)  # metres, world
UNIT = 0.0005  # metres
# Name of the model's file in assets/, its position in metres, its turn about +Y in degrees, and its scale.
PLACED = (
    ("room.ply", (0.0, 0.0, 0.0), 0.0, 1.0),
    ("table.ply", (0.9, 0.0, -1.2), 20.0, 1.0),
    ("teapot.ply", (0.6, 0.75, -1.0), 215.0, 1.3),
    ("man_of_the_paper.ply", (1.05, 0.75, -1.3), -40.0, 1.2),
    ("table.ply", (-1.6, 0.0, 1.3), 100.0, 1.0),
    ("venus_of_the_paper.ply", (-1.5, 0.75, 1.2), 130.0, 1.4),
)


def placed_meshes() -> list[Mesh]:
    """Return the meshes that the panorama shows, world, metres."""
    meshes = []
    for name, position, turn, scale in PLACED:
        mesh = load_mesh(asset_root() / name)
        cosine, sine = np.cos(np.radians(turn)), np.sin(np.radians(turn))
        rotation = np.array([[cosine, 0, sine], [0, 1, 0], [-sine, 0, cosine]])
        low, high = mesh.bounds
        base = np.array([(low[0] + high[0]) / 2, low[1], (low[2] + high[2]) / 2])
        positions = scale * (mesh.positions - base) @ rotation.T + position
        meshes.append(
            replace(
                mesh,
                positions=positions.astype(np.float32),
                normals=(mesh.normals @ rotation.T).astype(np.float32),
            )
        )
    return meshes


def make_panorama() -> tuple[Image.Image, Image.Image]:
    """Cast a ray through each pixel, and return depth, in counts of `UNIT`, and colour, sRGB."""
    lens = PanoramaLens(width=WIDTH, horizon=HORIZON)
    rays = lens.rays((HEIGHT, WIDTH)) * [1, -1, 1]  # rows from the top down
    length = np.linalg.norm(rays, axis=-1).ravel()
    direction = (rays.reshape(-1, 3) / length[:, None]).astype(np.float32)
    origin = np.tile(np.array(EYE, np.float32), (len(direction), 1))
    depth, colour = np.full(len(direction), np.inf), np.zeros((len(direction), 3))
    for mesh in placed_meshes():
        hits = RayCaster(mesh, two_sided=True).peel(origin, direction, 1, np.inf)
        nearer = hits.distance[0] / length < depth
        _, albedo = surface_at(mesh, hits)
        depth[nearer], colour[nearer] = (hits.distance[0] / length)[nearer], albedo[0, nearer, :3]
    counts = np.where(np.isfinite(depth), np.round(depth / UNIT), 0).astype(np.uint16)
    shape = HEIGHT, WIDTH
    picture = srgb8_from_linear(colour).reshape(*shape, 3)
    return Image.fromarray(counts.reshape(shape)), Image.fromarray(picture)


def main() -> None:
    """Write both pictures to the folder given on the command line, otherwise to that of the shipped ones."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else scene_root() / "paper" / "panorama"
    depth, colour = make_panorama()
    depth.save(folder / "room_depth.png", optimize=True)
    colour.save(folder / "room_colour.jpg", quality=92, optimize=True)


if __name__ == "__main__":
    main()
