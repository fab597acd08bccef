"""Turn meshes by random rotations: `python -m tools.pose_models FOLDER MESH=SEED...`.

These are poses that no one would choose. Each mesh is scaled to fit into a cube of 1 m, loses its texture, and is
written to FOLDER as NAME-SEED.ply.
"""

import argparse
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation
from tools.make_models.model import Model, write_ply

from depthwalk.ingest.loader import load_mesh


def posed(mesh: Path, seed: int) -> Model:
    """Return the mesh of a file, turned by the rotation from `seed`, with its longest side 1 m."""
    loaded = load_mesh(mesh)
    rotation = Rotation.random(rng=np.random.default_rng(seed))
    positions, normals = rotation.apply(loaded.positions), rotation.apply(loaded.normals)
    model = Model(
        positions.astype(np.float32),
        loaded.faces,
        (loaded.colours[:, :3] / 255).astype(np.float32),
        normals.astype(np.float32),
    )
    return model.scaled(1 / float(np.ptp(positions, axis=0).max())).grounded()


def main() -> None:
    """Pose the meshes of the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("meshes", nargs="+", metavar="MESH=SEED")
    args = parser.parse_args()
    for text in args.meshes:
        name, _, seed = text.rpartition("=")
        if not name or not seed.isdecimal():
            parser.error(f"{text}: must be MESH=SEED, as in spot.obj=3")
        write_ply(args.folder / f"{Path(name).stem}-{seed}.ply", posed(Path(name), int(seed)))


if __name__ == "__main__":
    main()
