"""Put a pass of one's own into the frame: python examples/own_pass.py scene.yaml sepia.png [WIDTH HEIGHT]."""

import sys
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


def main(scene_file: str, picture: str, width: str = "640", height: str = "480") -> None:
    """Render with the package's own passes, and `Sepia` before the last of them."""
    *passes, output = dw.default_passes()
    size = int(width), int(height)
    with dw.Renderer(dw.load_scene(scene_file), size, passes=[*passes, Sepia(), output]) as renderer:
        renderer.render().save(picture)


if __name__ == "__main__":
    main(*sys.argv[1:]) if len(sys.argv) > 2 else sys.exit(__doc__)
