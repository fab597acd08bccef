"""Turn a baked model before the camera: python examples/turntable.py bust.obj frames [COUNT [RESOLUTION [W H]]]."""

import math
import sys
from pathlib import Path

import depthwalk as dw


def main(
    mesh: str, folder: str, count: str = "36", resolution: str = "512", width: str = "640", height: str = "480"
) -> None:
    """Bake the mesh to a file beside it, and save a picture for every step of a turn."""
    dw.bake_mesh(mesh, resolution=int(resolution), progress=print)
    # A mesh is a scene of its own, which finds the baked file where it asks for the same resolution.
    scene = dw.load_scene(mesh, overrides={"assets.model.dpci.resolution": resolution})
    Path(folder).mkdir(parents=True, exist_ok=True)
    with dw.Renderer(scene, size=(int(width), int(height)), reuse=True) as renderer:
        camera = renderer.frame_all()
        for frame in range(int(count)):
            scene.move(0, yaw=2 * math.pi * frame / int(count))
            renderer.render(camera).save(Path(folder) / f"{frame:04}.png")


if __name__ == "__main__":
    main(*sys.argv[1:]) if len(sys.argv) > 2 else sys.exit(__doc__)
