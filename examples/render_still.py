"""Render a still: python examples/render_still.py scenes/garden.yaml garden.png [WIDTH HEIGHT]."""

import sys

import depthwalk as dw


def main(scene_file: str, picture: str, width: str = "1280", height: str = "720") -> None:
    """Render the scene by its own camera, or by one that sees all of it, and save the picture."""
    scene = dw.load_scene(scene_file)
    with dw.Renderer(scene, size=(int(width), int(height))) as renderer:
        renderer.render().save(picture)


if __name__ == "__main__":
    main(*sys.argv[1:]) if len(sys.argv) > 2 else sys.exit(__doc__)
