"""Turn one object of a scene in a window: python examples/moving_window.py scene.yaml NODE."""

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
    main(*sys.argv[1:]) if len(sys.argv) > 2 else sys.exit(__doc__)
