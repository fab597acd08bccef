"""Walk through a scene in a window: python examples/open_window.py scene.yaml."""

import sys

import depthwalk as dw


def main(scene_file: str) -> None:
    """Open the window, and say why where there is none."""
    try:
        dw.view(dw.load_scene(scene_file))
    except (dw.InputError, dw.GpuError) as error:
        sys.exit(str(error))


if __name__ == "__main__":
    main(*sys.argv[1:]) if len(sys.argv) > 1 else sys.exit(__doc__)
