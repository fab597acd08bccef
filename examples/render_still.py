"""Render a still: python examples/render_still.py scenes/garden.yaml garden.png [WIDTH HEIGHT]."""

import argparse

import depthwalk as dw


def main(scene_file: str, picture: str, width: int, height: int) -> None:
    """Render the scene by its own camera, or by one that sees all of it, and save the picture."""
    scene = dw.load_scene(scene_file)
    with dw.Renderer(scene, size=(width, height)) as renderer:
        renderer.render().save(picture)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scene_file")
    parser.add_argument("picture")
    parser.add_argument("width", nargs="?", type=int, default=1280)
    parser.add_argument("height", nargs="?", type=int, default=720)
    main(**vars(parser.parse_args()))
