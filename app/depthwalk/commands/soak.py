"""`python -m depthwalk.commands.soak SCENE`: a long random walk, to see whether anything grows. Exit code 1 if it does."""

import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from numpy.typing import NDArray

from depthwalk.commands.console import FAILURE, frame_progress, guarded
from depthwalk.commands.options import (
    AssetRoots,
    Quiet,
    RepresentationName,
    RepresentationOption,
    Resolution,
    SceneArgument,
    Settings,
    Verbose,
    open_scene,
    parse_resolution,
    representation,
)
from depthwalk.commands.render import open_headless
from depthwalk.limits import MAX_FRAMES
from depthwalk.render.view.bounds import Bounds
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera

# Over the second half of a walk: some GL objects are made when first needed, some memory the allocator keeps.
MOST_NEW_OBJECTS, MOST_GROWTH = 8, 4 << 20
_SAMPLES = 1000  # of a walk
_STEP = 0.05  # metres: walking pace at 30 frames per second
_TURN = 0.02  # radians, standard deviation of the change of heading per frame
_JUMP = 1 / 500  # chance per frame of being somewhere else
_EYE = 1.7  # metres
_STATM = Path("/proc/self/statm")


@dataclass(frozen=True)
class Growth:
    """Samples (n,) over the second half of a walk. frame; gl_objects: alive in this process; memory: resident bytes."""

    frame: NDArray[np.int64]
    gl_objects: NDArray[np.int64]
    memory: NDArray[np.int64]

    @property
    def bytes_per_frame(self) -> float:
        """Slope of the straight line that fits the memory best."""
        return float(np.polyfit(self.frame, self.memory, 1)[0])

    @property
    def grows(self) -> bool:
        grown = self.bytes_per_frame * (self.frame[-1] - self.frame[0])
        return bool(self.gl_objects[-1] - self.gl_objects[0] > MOST_NEW_OBJECTS or grown > MOST_GROWTH)


def random_walk(bounds: Bounds, frames: int, seed: int = 0) -> Iterator[Camera]:
    """The same cameras for the same seed: a walk among the objects at eye height, with a jump now and then."""
    random = np.random.default_rng(seed)
    low, high = (np.array([f(bounds.centre[:, axis]) for axis in (0, 2)]) for f in (np.min, np.max))
    extent = high - low + 2 * float(bounds.bounding_radius.max())
    heading = np.cumsum(random.normal(0, _TURN, frames))
    forward = np.stack([np.sin(heading), np.cos(heading)], -1)
    jump = (random.random((frames, 1)) < _JUMP) * random.random((frames, 2)) * extent
    walked = np.cumsum(_STEP * forward + jump, axis=0)
    folded = np.abs(walked % (2 * extent) - extent) + low - (extent - (high - low)) / 2  # turned back at the edges
    for (x, z), (right, ahead) in zip(folded.tolist(), forward.tolist(), strict=True):
        yield Camera((x, _EYE, z), (x + right, _EYE - 0.1, z + ahead), np.pi / 3)


def resident_bytes() -> int:
    """Memory of this process that is in RAM. Raises OSError where the system does not tell as Linux does."""
    return int(_STATM.read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


@guarded
def main(
    scene: SceneArgument,
    frames: Annotated[int, typer.Option(metavar="N", min=8, max=MAX_FRAMES, help="Length of the walk.")] = 50_000,
    resolution: Resolution = "160,120",
    representation_name: RepresentationOption = RepresentationName.SCENE,
    asset_root: AssetRoots = None,
    settings: Settings = None,
    verbose: Verbose = False,
    quiet: Quiet = False,
) -> None:
    """Walk at random for a long time and report what grew."""
    loaded, size = open_scene(scene, asset_root, settings), parse_resolution(resolution)
    every = max(1, frames // _SAMPLES)
    samples: list[tuple[int, int, int]] = []
    with open_headless(loaded, size, representation(representation_name)) as headless:
        headless.renderer.remembers = True
        walk = random_walk(headless.renderer.world.bounds(), frames)
        with frame_progress("walking", frames) as advance:
            for number, camera in enumerate(walk):
                headless.draw(View(camera, size))
                if number % every == 0:
                    headless.device.context.finish()
                    samples.append((number, sum(headless.device.live.values()), resident_bytes()))
                advance()
    frame, gl_objects, memory = np.array(samples[len(samples) // 2 :]).T
    growth = Growth(frame, gl_objects, memory)
    print(f"{frames} frames of {scene} at {size[0]} × {size[1]}, the second half of them:")
    print(f"GL objects {growth.gl_objects[0]} to {growth.gl_objects[-1]}")
    print(f"memory {memory[0] / 1e6:.1f} to {memory[-1] / 1e6:.1f} MB, {growth.bytes_per_frame:+.1f} bytes a frame")
    if growth.grows:
        print("it grows")
        raise typer.Exit(FAILURE)


if __name__ == "__main__":
    typer.run(main)
