"""Put a pass of one's own into the frame: python examples/own_pass.py scene.yaml sepia.png [WIDTH HEIGHT]."""

import sys
from pathlib import Path

import depthwalk as dw


class Sepia(dw.Pass[dw.Params]):
    """Tint the lit picture, before it is encoded for the screen."""

    name = "sepia"
    reads = ("lit",)
    writes = ("lit",)

    def setup(self, gl):
        """Compile the shader that lies beside this file."""
        self.program = dw.Program(gl, "common/fullscreen.vert", Path(__file__).with_name("sepia.frag"))

    def draw(self, frame, params):
        """Draw into the light what a copy of it gives."""
        frame.targets.lit_before().use(0)
        self.program.set(lit_texture=0)
        with self.gl.state(into=frame.targets.lit):
            self.program.fill()


def main(scene_file: str, picture: str, width: str = "640", height: str = "480") -> None:
    """Render with the package's own passes, and `Sepia` before the last of them."""
    *passes, output = dw.default_passes()
    size = int(width), int(height)
    with dw.Renderer(dw.load_scene(scene_file), size, passes=[*passes, Sepia(), output]) as renderer:
        renderer.render().save(picture)


if __name__ == "__main__":
    main(*sys.argv[1:])
