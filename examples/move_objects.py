"""Let one object of a scene rise: python examples/move_objects.py scene.yaml NODE frames [COUNT [WIDTH HEIGHT]]."""

import sys
from pathlib import Path

import depthwalk as dw


def main(scene_file: str, node: str, folder: str, count: str = "10", width: str = "640", height: str = "480") -> None:
    """Move the node with this name upward, 10 cm a frame, and save a picture of every step."""
    scene = dw.load_scene(scene_file)
    Path(folder).mkdir(parents=True, exist_ok=True)
    x, y, z = scene.position_of(node)
    with dw.Renderer(scene, size=(int(width), int(height)), reuse=True) as renderer:
        for frame in range(int(count)):
            scene.move(node, position=(x, y + 0.1 * frame, z))
            renderer.render().save(Path(folder) / f"{frame:04}.png")


if __name__ == "__main__":
    main(*sys.argv[1:]) if len(sys.argv) > 3 else sys.exit(__doc__)
