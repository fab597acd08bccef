"""Let one object of a scene rise: python examples/move_objects.py scene.yaml NODE frames [COUNT [WIDTH HEIGHT]]."""

import argparse
from pathlib import Path

import depthwalk as dw


def main(scene_file: str, node: str, folder: str, count: int, width: int, height: int) -> None:
    """Move the node with this name upward, 10 cm a frame, and save a picture of every step."""
    scene = dw.load_scene(scene_file)
    Path(folder).mkdir(parents=True, exist_ok=True)
    x, y, z = scene.position_of(node)
    with dw.Renderer(scene, size=(width, height), reuse=True) as renderer:
        for frame in range(count):
            scene.move(node, position=(x, y + 0.1 * frame, z))
            renderer.render().save(Path(folder) / f"{frame:04}.png")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scene_file")
    parser.add_argument("node")
    parser.add_argument("folder")
    parser.add_argument("count", nargs="?", type=int, default=10)
    parser.add_argument("width", nargs="?", type=int, default=640)
    parser.add_argument("height", nargs="?", type=int, default=480)
    main(**vars(parser.parse_args()))
