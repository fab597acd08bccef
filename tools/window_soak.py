"""Walk in a window for a long time, with reloads, resizes and scene changes, and test whether anything grows.

`python -m tools.window_soak SCENE [OTHER …] --minutes 60` needs a display, and Linux with glibc. A round walks at
random through each scene in turn; it resizes the window, reloads the scene, records the camera, saves a picture, shows
panel, atlas and HUD, and changes the representation. After each round the window is back at the first scene, in its
first size, at rest. Only then is anything measured, so that measurements are comparable. Exits with code 1 if anything
grows.
"""

import ctypes
import gc
import os
import time
from collections.abc import Iterator
from contextlib import ExitStack, chdir, closing
from itertools import islice
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated

import numpy as np
import typer
from numpy.typing import NDArray
from scipy.stats import theilslopes

from depthwalk.assets.background import BackgroundLibrary
from depthwalk.commands.exit_codes import FAILURE
from depthwalk.commands.program import as_program, guarded
from depthwalk.commands.soak import MAX_NEW_OBJECTS, random_walk, resident_bytes
from depthwalk.scene.arrays import Camera, Representation
from depthwalk.scene.loader import load_scene
from depthwalk.walk import app
from depthwalk.walk.key_actions import key_actions
from depthwalk.walk.walk_options import WalkOptions
from depthwalk.walk.window import open_window

Samples = NDArray[np.int64]
"""(n, 6) values of `Soak.sample`, one row for each round."""

MAX_KB = 1000.0  # growth of memory per 1,000 frames
_COUNTS = ["arena", "ordblks", "smblks", "hblks", "hblkhd", "usmblks", "fsmblks", "uordblks", "fordblks", "keepcost"]
_WARM_UP = 0.25  # of the rounds, which are not judged
_FEWEST = 8  # judged rounds
_FRAMES = 150  # of a walk
_SIZES = (320, 240), (417, 301), (200, 333), (640, 480)
_REPRESENTATIONS = None, Representation.DPCI, Representation.MESH
_TOGGLES = "panel", "atlas", "help", "hud"
_MOST_ROUNDS = 3000  # of a window, within which it comes to rest


class _AllocatorCounts(ctypes.Structure):
    """Hold the result of glibc's `mallinfo2`."""

    _fields_ = [(name, ctypes.c_size_t) for name in _COUNTS]


def allocated_bytes() -> int:
    """Return how many bytes are allocated in this process. Raises AttributeError if its C library is not glibc."""
    counts_of = ctypes.CDLL(None).mallinfo2
    counts_of.restype = _AllocatorCounts
    counts = counts_of()
    return int(counts.uordblks + counts.hblkhd)  # in heaps, and in separate mappings


class Soak:
    """A walk in a window whose frames are counted. Use it in a `with` block.

    Attributes
    ----------
    frames
        Number of rounds that the window has had.
    """

    def __init__(self, files: list[Path]) -> None:
        self._files, self.frames = files, 0
        scene = load_scene(files[0])
        with ExitStack() as made:
            library = made.enter_context(closing(BackgroundLibrary(scene.assets)))
            self._walk = app.Walk(open_window("soak", _SIZES[0]), library, WalkOptions())
            made.pop_all()
        self._walk.start(scene)
        self._home = self._walk.state.home

    def __enter__(self) -> "Soak":
        return self

    def __exit__(self, *error: object) -> None:
        self._walk.release()

    def round(self, number: int) -> None:
        """Walk through all scenes, do everything that a user can, and return to the beginning."""
        actions = key_actions(self._walk)
        for file in [*self._files[1:], self._files[0]]:
            state = self._walk.state
            self._resize(_SIZES[1:][number % 3])
            state.represent(_REPRESENTATIONS[number % 3])
            setattr(state, toggled := _TOGGLES[number % 4], not getattr(state, toggled))
            actions["K"]()
            self._walk_on(_FRAMES, number)
            actions["K"]()
            self._walk.want_screenshot()
            actions["R"]()
            self._walk_on(_FRAMES, number)
            setattr(state, toggled, not getattr(state, toggled))
            self._resize(_SIZES[0])
            self._go(self._home)
            state.represent(None)
            state.playback = None
            self._walk.next_files = (file,)
            self._come_to_rest()

    def sample(self) -> tuple[int, int, int, int, int, int]:
        """Return frames so far, bytes allocated and resident, open files, living GL objects, and objects of Python."""
        gc.collect()
        descriptors = len(os.listdir("/proc/self/fd")) - 1
        live = sum(self._walk.device.live.values())
        return self.frames, allocated_bytes(), resident_bytes(), descriptors, live, len(gc.get_objects())

    def _walk_on(self, frames: int, seed: int) -> None:
        cameras: Iterator[Camera] = random_walk(self._walk.renderer.world.bounds(), frames, seed)
        for camera in islice(cameras, frames):
            self._go(camera)
            self._step()

    def _go(self, camera: Camera) -> None:
        self._walk.state.orbit = None
        self._walk.state.walker.place(camera)

    def _resize(self, size: tuple[int, int]) -> None:
        self._walk.window.size = size
        self._step()

    def _come_to_rest(self) -> None:
        for number in range(_MOST_ROUNDS):
            self._walk.state.tell("")
            if number > 2 and self._walk.frames.is_current and self._walk.background.progress is None:
                return
            self._step()

    def _step(self) -> None:
        self._walk.step()
        self.frames += 1


def growth(samples: Samples) -> tuple[float, Samples]:
    """Return what was added to `samples` after the warm-up.

    That is kB allocated per 1,000 frames, by the median of the slopes between any two samples (Theil and Sen), and for
    each column the difference between the medians of the last and the first third of the samples.
    """
    judged = samples[int(len(samples) * _WARM_UP) :]
    third = -(-len(judged) // 3)
    first, last = (np.median(part, axis=0).astype(np.int64) for part in (judged[:third], judged[-third:]))
    slope = theilslopes(judged[:, 1], judged[:, 0]).slope  # temporary allocations do not count
    return float(slope), last - first


@guarded
def main(
    scenes: Annotated[list[Path], typer.Argument(metavar="SCENE [OTHER ...]", help="Scene files.")],
    minutes: Annotated[float, typer.Option(metavar="N", min=0.1, help="How long.")] = 60.0,
) -> None:
    """Walk in a window for a long time, and report whether memory, open files or GL objects grow."""
    end, samples = time.monotonic() + 60 * minutes, list[tuple[int, ...]]()
    files = [file.resolve() for file in scenes]
    with TemporaryDirectory() as folder, chdir(folder), Soak(files) as soak:  # screenshots and paths go there
        while time.monotonic() < end or len(samples) < _FEWEST:
            soak.round(len(samples))
            samples.append(soak.sample())
            frames, allocated, resident, descriptors, live, objects = samples[-1]
            kept = f"{descriptors} files, {live} GL objects, {objects} of Python"
            print(f"{frames} frames, {allocated / 1e6:.2f} MB of {resident / 1e6:.0f}, {kept}", flush=True)
    kilobytes, (*_, descriptors, live, objects) = growth(np.array(samples))
    grown = f"{descriptors:+d} files, {live:+d} GL objects, {objects:+d} of Python"
    print(f"after the warm-up {kilobytes:+.1f} kB in 1,000 frames, {grown}")
    if kilobytes > MAX_KB or descriptors > 0 or live > MAX_NEW_OBJECTS:
        raise typer.Exit(FAILURE)


if __name__ == "__main__":
    as_program(main)()
