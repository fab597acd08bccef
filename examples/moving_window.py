"""Turn one object of a scene in a window: python examples/moving_window.py scene.yaml NODE."""

import argparse
import sys

import depthwalk as dw


def main(scene_file: str, node: str) -> None:
    """Open the window, in which the node with this name turns once in six seconds."""
    try:
        scene = dw.load_scene(scene_file)
        dw.view(scene, before_frame=lambda seconds: scene.move(node, yaw=1.05 * seconds))
    except (dw.InputError, dw.GpuError) as error:
        sys.exit(str(error))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scene_file")
    parser.add_argument("node")
    main(**vars(parser.parse_args()))
