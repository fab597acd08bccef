"""Turn a baked model before the camera: python examples/turntable.py bust.obj frames [COUNT [RESOLUTION [W H]]]."""

import argparse
import math
from pathlib import Path

import depthwalk as dw


def main(mesh: str, folder: str, count: int, resolution: int, width: int, height: int) -> None:
    """Bake the mesh to a file beside it, and save a picture for every step of a turn."""
    dw.bake_mesh(mesh, resolution=resolution, progress=print)
    # A mesh is a scene of its own, which finds the baked file where it asks for the same resolution.
    scene = dw.load_scene(mesh, overrides={"assets.model.dpci.resolution": str(resolution)})
    Path(folder).mkdir(parents=True, exist_ok=True)
    with dw.Renderer(scene, size=(width, height), reuse=True) as renderer:
        camera = renderer.frame_all()
        for frame in range(count):
            scene.move(0, yaw=2 * math.pi * frame / count)
            renderer.render(camera).save(Path(folder) / f"{frame:04}.png")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("mesh")
    parser.add_argument("folder")
    parser.add_argument("count", nargs="?", type=int, default=36)
    parser.add_argument("resolution", nargs="?", type=int, default=512)
    parser.add_argument("width", nargs="?", type=int, default=640)
    parser.add_argument("height", nargs="?", type=int, default=480)
    main(**vars(parser.parse_args()))
