"""Put a pass of one's own into the frame: python examples/own_pass.py scene.yaml sepia.png [WIDTH HEIGHT]."""

import argparse
from pathlib import Path

import depthwalk as dw
from depthwalk.render.pixel_pass import PixelInputs, PixelPass


class Sepia(PixelPass[dw.Params]):
    """Tint the lit picture, before it is encoded for the screen."""

    name = "sepia"
    reads = ("lit",)
    writes = ("lit",)
    shader = Path(__file__).with_name("sepia.glsl")

    def inputs(self, frame, params):
        """Give its function in the shader what it needs besides the pixel: one uniform."""
        return PixelInputs(uniforms={"tint": (1.25, 0.95, 0.65)})


def main(scene_file: str, picture: str, width: int, height: int) -> None:
    """Render with the package's own passes, and `Sepia` before the last of them."""
    *passes, output = dw.default_passes()
    size = width, height
    with dw.Renderer(dw.load_scene(scene_file), size, passes=[*passes, Sepia(), output]) as renderer:
        renderer.render().save(picture)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scene_file")
    parser.add_argument("picture")
    parser.add_argument("width", nargs="?", type=int, default=640)
    parser.add_argument("height", nargs="?", type=int, default=480)
    main(**vars(parser.parse_args()))
