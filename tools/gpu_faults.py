"""Make the GPU fail at many points of a walk in a window, or of pictures without one, and test that they continue.

`python -m tools.gpu_faults SCENE --places 200` needs a display, unless `--no-window` is given. Each time, the n-th
creation of a GL object raises, like a driver that has no memory or rejects a shader; every tenth time the context
counts as lost. After each failure the picture at rest, the living GL objects and the camera must be the same as before.
Exits with code 1 if they are not.
"""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

import moderngl
import numpy as np
import typer
from numpy.typing import NDArray

from depthwalk.assets.library import SceneLibrary
from depthwalk.commands.exit_codes import FAILURE
from depthwalk.commands.options import SceneArgument
from depthwalk.commands.program import as_program, guarded
from depthwalk.gpu.failures import GPU_FAILURES
from depthwalk.render.headless import HeadlessRenderer
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera
from depthwalk.scene.loader import load_scene
from depthwalk.walk import app
from depthwalk.walk.screenshot import read_window
from depthwalk.walk.walk_options import WalkOptions
from depthwalk.walk.window import open_window

_CREATORS = (
    *("texture", "texture_array", "texture3d", "depth_texture", "buffer"),
    *("program", "framebuffer", "vertex_array", "query"),
)
_ROUNDS = 500  # of a window, within which it comes to rest
_RESET = 0x8255  # GL_UNKNOWN_CONTEXT_RESET
SIZE = 320, 240


class Fault:
    """Raise `moderngl.Error` once, when a GL object is created.

    Attributes
    ----------
    created
        Number of objects created since `after`, including the failed one.
    """

    def __init__(self) -> None:
        self.created, self._left = 0, -1

    def after(self, creations: int) -> None:
        """Make the creation after this many others raise; a negative number makes none raise."""
        self.created, self._left = 0, creations

    def note(self, name: str) -> None:
        """Count the creation of an object by the method `name`. Raises moderngl.Error for the chosen one."""
        self.created += 1
        self._left -= 1
        if self._left == -1:
            raise moderngl.Error(f"no memory for a {name}")


@contextmanager
def faulty_contexts() -> Iterator[Fault]:
    """Let all contexts create objects through a `Fault` within the `with` block."""
    fault, whole = Fault(), {name: getattr(moderngl.Context, name) for name in _CREATORS}

    def watched(name: str) -> object:
        def create(context: moderngl.Context, *values: Any, **named: Any) -> Any:
            fault.note(name)
            return whole[name](context, *values, **named)

        return create

    try:
        for name in _CREATORS:
            setattr(moderngl.Context, name, watched(name))
        yield fault
    finally:
        for name, method in whole.items():
            setattr(moderngl.Context, name, method)


class Walk:
    """A walk in a window that is inspected between its frames. Use it in a `with` block."""

    def __init__(self, file: Path) -> None:
        scene = load_scene(file)
        scene.render.reprojection.mode = "off"  # frames that depend on the clock are not reproducible
        self._walk = app.Walk(open_window("faults", SIZE), SceneLibrary(scene.assets), WalkOptions())
        self._walk.background.loads_kernels = True  # prevents loading them, as they round differently from NumPy
        self._scene = scene

    def __enter__(self) -> "Walk":
        self._walk.start(self._scene)
        self._walk.state.hud = False
        return self

    def __exit__(self, *error: object) -> None:
        self._walk.release()

    @property
    def camera(self) -> Camera:
        """The viewer's camera."""
        return self._walk.state.camera

    @property
    def live(self) -> dict[str, int]:
        """Number of living GL objects, by kind."""
        return dict(+self._walk.device.live)

    def fail(self, lost: bool) -> None:
        """Make the context be lost, or an object be rejected, before the next frame."""
        self._walk.recovery.forget()  # it is not the same failure again
        if lost:
            self._walk.device._status = lambda: _RESET
        else:
            self._walk.recover(moderngl.Error("no memory"))

    def at_rest(self) -> NDArray[np.uint8]:
        """The picture (H, W, 3) that the window shows when nothing changes any more."""
        for number in range(_ROUNDS):
            self._walk.state.tell("")
            if number > 2 and self._walk.frames.is_current:
                break
            self._round()
        return read_window(self._walk.window)

    def _round(self) -> None:
        try:
            self._walk.step()
        except GPU_FAILURES as error:
            self._walk.recover(error)


class Pictures:
    """Pictures of one camera without a window, as `render` draws them. Use it in a `with` block."""

    def __init__(self, file: Path) -> None:
        scene = load_scene(file)
        self._headless = HeadlessRenderer(scene, SceneLibrary(scene.assets), SIZE)
        self.camera = scene.camera or self._headless.frame_all()
        self._must_recreate = False

    def __enter__(self) -> "Pictures":
        return self

    def __exit__(self, *error: object) -> None:
        self._headless.release()

    @property
    def live(self) -> dict[str, int]:
        """Number of living GL objects, by kind."""
        return dict(+self._headless.device.live)

    def fail(self, lost: bool) -> None:
        """Make the context be lost, or an object be rejected, before the next picture."""
        self._must_recreate = not lost
        if lost:
            self._headless.device._status = lambda: _RESET

    def at_rest(self) -> NDArray[np.uint8]:
        """The picture (H, W, 4), drawn again until the GPU does not fail."""
        while True:
            try:
                if self._must_recreate:
                    self._headless.recreate()
                self._must_recreate = False
                self._headless.draw(View(self.camera, SIZE))
                return self._headless.pixels()
            except GPU_FAILURES:
                self._must_recreate = True


@guarded
def main(
    scene: SceneArgument,
    places: Annotated[int, typer.Option(metavar="N", min=1, help="Failures.")] = 200,
    window: Annotated[bool, typer.Option("--window/--no-window", help="Whether to walk in a window.")] = True,
) -> None:
    """Let the GPU fail at many places of a walk, and report whether it went on as before."""
    wrong, slowest = 0, 0.0
    with faulty_contexts() as fault, (Walk if window else Pictures)(scene) as walk:
        before, live, camera = walk.at_rest(), walk.live, walk.camera
        fault.after(-1)
        walk.fail(lost=False)
        walk.at_rest()
        creations = fault.created
        for place in range(places):
            start = time.process_time()
            fault.after(-1 if place % 10 == 9 else place * creations // places)
            walk.fail(lost=place % 10 == 9)
            after = walk.at_rest()
            slowest = max(slowest, time.process_time() - start)
            same = np.array_equal(before, after), walk.live == live, walk.camera == camera
            if not all(same):
                wrong += 1
                print(f"place {place}: picture, objects, camera as before: {same}")
    print(f"{places} failures, {wrong} of them noticed afterwards; at most {slowest:.2f} s of a processor to a picture")
    if wrong:
        raise typer.Exit(FAILURE)


if __name__ == "__main__":
    as_program(main)()
