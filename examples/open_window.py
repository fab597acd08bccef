"""Walk through a scene in a window: python examples/open_window.py scene.yaml."""

import argparse
import sys

import depthwalk as dw


def main(scene_file: str) -> None:
    """Open the window, and say why where there is none."""
    try:
        dw.view(dw.load_scene(scene_file))
    except (dw.InputError, dw.GpuError) as error:
        sys.exit(str(error))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scene_file")
    main(**vars(parser.parse_args()))
