"""Walk through a scene at random for a long time, to test whether memory or GL objects leak.

`python -m depthwalk.commands.soak SCENE` exits with code 1 if they do.
"""

import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from numpy.typing import NDArray

from depthwalk.commands.exit_codes import FAILURE
from depthwalk.commands.frame_drawing import open_headless
from depthwalk.commands.option_values import open_scene, parse_resolution, representation
from depthwalk.commands.options import (
    AssetRoots,
    Quiet,
    RepresentationName,
    RepresentationOption,
    Resolution,
    SceneArgument,
    Settings,
    Verbose,
)
from depthwalk.commands.program import as_program, guarded
from depthwalk.commands.progress import frame_progress
from depthwalk.limits import MAX_FRAMES
from depthwalk.render.view.bounds import Bounds
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera

# Allowed growth over the second half of a walk. An asset first seen late adds GL objects, a program and a vertex array
# for each pass that draws it, and the allocator keeps some memory.
MAX_NEW_OBJECTS, MAX_GROWTH = 16, 4 << 20  # count, bytes
_SAMPLES = 1000  # most measurements per walk
_STEP = 0.05  # metres: walking pace at 30 frames per second
_TURN = 0.02  # radians, standard deviation of the change of heading per frame
_JUMP = 1 / 500  # probability per frame of a jump to another place
_EYE = 1.7  # metres above y = 0
_STATM = Path("/proc/self/statm")


@dataclass(frozen=True, kw_only=True)
class Growth:
    """Hold the measurements over the second half of a walk, at n of its frames.

    Attributes
    ----------
    frame
        (n,) int64, numbers of the frames.
    gl_objects
        (n,) int64, GL objects that exist in this process.
    memory
        (n,) int64, resident bytes of this process.
    """

    frame: NDArray[np.int64]
    gl_objects: NDArray[np.int64]
    memory: NDArray[np.int64]

    @property
    def bytes_per_frame(self) -> float:
        """Return the slope of the straight line that best fits the memory, bytes per frame."""
        return float(np.polyfit(self.frame, self.memory, 1)[0])

    @property
    def grows(self) -> bool:
        """Return whether GL objects or memory grew by more than is allowed."""
        grown = self.bytes_per_frame * (self.frame[-1] - self.frame[0])
        return bool(self.gl_objects[-1] - self.gl_objects[0] > MAX_NEW_OBJECTS or grown > MAX_GROWTH)


def random_walk(bounds: Bounds, frames: int, seed: int = 0) -> Iterator[Camera]:
    """Yield the cameras of a walk among objects at eye height, with a jump to another place from time to time.

    Parameters
    ----------
    bounds
        The bounding spheres of the objects, metres, world.
    frames
        Number of cameras.
    seed
        Seed of the random numbers; the same seed gives the same cameras.

    Yields
    ------
    Camera
        The camera of the next frame.
    """
    random = np.random.default_rng(seed)
    low, high = (np.array([f(bounds.centre[:, axis]) for axis in (0, 2)]) for f in (np.min, np.max))
    extent = high - low + 2 * float(bounds.bounding_radius.max())
    heading = np.cumsum(random.normal(0, _TURN, frames))
    forward = np.stack([np.sin(heading), np.cos(heading)], -1)
    jump = (random.random((frames, 1)) < _JUMP) * random.random((frames, 2)) * extent
    walked = np.cumsum(_STEP * forward + jump, axis=0)
    folded = np.abs(walked % (2 * extent) - extent) + low - (extent - (high - low)) / 2  # reflected at the edges
    for (x, z), (right, ahead) in zip(folded.tolist(), forward.tolist(), strict=True):
        yield Camera((x, _EYE, z), (x + right, _EYE - 0.1, z + ahead), np.pi / 3)


def resident_bytes() -> int:
    """Return how many bytes of this process are in RAM. Raises OSError on systems without Linux's /proc."""
    return int(_STATM.read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


@guarded
def main(
    scene: SceneArgument,
    frames: Annotated[int, typer.Option(metavar="N", min=8, max=MAX_FRAMES, help="Frames to draw.")] = 50_000,
    resolution: Resolution = "160,120",
    representation_name: RepresentationOption = RepresentationName.SCENE,
    asset_root: AssetRoots = None,
    settings: Settings = None,
    verbose: Verbose = False,
    quiet: Quiet = False,
) -> None:
    """Walk at random for a long time and report whether memory or GL objects grow; exit with 1 if they do."""
    loaded, size = open_scene(scene, asset_root, settings), parse_resolution(resolution)
    interval = max(1, frames // _SAMPLES)
    samples: list[tuple[int, int, int]] = []
    with open_headless(loaded, size, representation(representation_name)) as headless:
        headless.renderer.remembers = True
        walk = random_walk(headless.renderer.world.bounds(), frames)
        with frame_progress("walking", frames) as advance:
            for number, camera in enumerate(walk):
                headless.draw(View(camera, size))
                if number % interval == 0:
                    headless.finish()
                    samples.append((number, sum(headless.device.live.values()), resident_bytes()))
                advance()
    frame, gl_objects, memory = np.array(samples[len(samples) // 2 :]).T
    growth = Growth(frame=frame, gl_objects=gl_objects, memory=memory)
    print(f"{frames} frames of {scene} at {size[0]} × {size[1]}, the second half of them:")
    print(f"GL objects {growth.gl_objects[0]} to {growth.gl_objects[-1]}")
    print(f"memory {memory[0] / 1e6:.1f} to {memory[-1] / 1e6:.1f} MB, {growth.bytes_per_frame:+.1f} bytes a frame")
    if growth.grows:
        print("memory or the number of GL objects grows")
        raise typer.Exit(FAILURE)


if __name__ == "__main__":
    as_program(main)()
