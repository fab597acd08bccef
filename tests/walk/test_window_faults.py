"""How a walk in a real window ends, and goes on where the GPU fails."""

import gc
import subprocess
import sys
import weakref
from pathlib import Path

import moderngl
import numpy as np
import pytest
from tools.gpu_faults import Walk, faulty_contexts

from depthwalk.assets.background import BackgroundLibrary
from depthwalk.gpu.failures import GpuError
from depthwalk.scene.loader import load_scene
from depthwalk.walk import app, panel
from depthwalk.walk.walk_options import WalkOptions
from depthwalk.walk.window import open_window
from window_program import PATIENCE, linux

pytestmark = [pytest.mark.gl, pytest.mark.window]


LOST = """
import os, signal, sys
from depthwalk.commands.cli import main
from depthwalk.walk.input import Input
import depthwalk.walk.app as app

draw, drawn = app.Walk._draw, []

class Dropped:
    def __del__(self):
        os.kill(os.getpid(), signal.SIGTERM)  # raises where Python drops it, as in the callback of a key

def draw_and_drop(walk, dt):
    draw(walk, dt)
    if not drawn:
        drawn.append(True)
        Dropped()

app.Walk._draw = draw_and_drop
sys.argv = ["depthwalk", "view", SCENE]
main()
"""


@linux
def test_a_signal_that_gets_lost_in_a_callback_closes_the_window(display: None, scene_file: Path) -> None:
    program = LOST.replace("SCENE", repr(str(scene_file)))
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=PATIENCE)
    assert done.returncode == 143, done.stderr
    assert "Traceback" not in done.stderr


@linux
def test_a_scene_that_was_left_does_not_stay_in_memory(display: None, scene_file: Path) -> None:
    """Even if what there was at the start is not searched for garbage."""
    scene = load_scene(scene_file)
    walk = app.Walk(open_window("scene", (96, 72)), BackgroundLibrary(scene.assets), WalkOptions())
    try:
        walk.start(scene)
        walk.step()
        left = weakref.ref(walk.renderer), weakref.ref(scene)
        del scene
        gc.freeze()
        walk.next_files = (scene_file,)
        walk.step()
        gc.collect()
        assert [reference() for reference in left] == [None, None]
    finally:
        walk.release()


@linux
@pytest.mark.slow
def test_a_walk_goes_on_where_the_gpu_fails(display: None, scene_file: Path) -> None:
    with faulty_contexts() as fault, Walk(scene_file) as walk:
        before, live, camera = walk.at_rest(), walk.live, walk.camera
        fault.after(-1)
        walk.fail(lost=False)
        assert np.array_equal(walk.at_rest(), before)
        creations = fault.created
        for place in (0, creations // 4, creations // 2, creations - 2):
            fault.after(place)
            walk.fail(lost=False)
            assert np.array_equal(walk.at_rest(), before), place
            assert (walk.live, walk.camera) == (live, camera)
        walk.fail(lost=True)
        assert np.array_equal(walk.at_rest(), before)
        assert (walk.live, walk.camera) == (live, camera)


@linux
def test_a_gpu_that_fails_again_and_again_ends_the_walk(display: None, scene_file: Path) -> None:
    with faulty_contexts() as fault, Walk(scene_file) as walk:
        walk.at_rest()
        fault.note = always_refused  # type: ignore[method-assign]
        with pytest.raises(moderngl.Error, match="no memory"):
            walk.fail(lost=False)


def always_refused(name: str) -> None:
    raise moderngl.Error(f"no memory for a {name}")


@linux
@pytest.mark.parametrize("error", [GpuError("no memory"), ValueError("a mistake"), SystemExit(143)])
def test_an_error_in_a_section_of_the_panel_is_told_as_it_is(
    display: None, scene_file: Path, monkeypatch: pytest.MonkeyPatch, error: BaseException
) -> None:
    """So that the walk goes on after one of the GPU, and a signal ends it as everywhere."""

    def broken(*_: object) -> None:
        raise error

    scene = load_scene(scene_file)
    walk = app.Walk(open_window("scene", (480, 360)), BackgroundLibrary(scene.assets), WalkOptions())
    try:
        walk.start(scene)
        walk.state.panel = True
        with monkeypatch.context() as patch:
            patch.setattr(panel, "_draw_environment", broken)
            with pytest.raises(type(error)) as caught:
                walk.step()
        assert caught.value is error
        if isinstance(error, GpuError):
            walk.recover(error)
            walk.step()
            assert walk.state.panel and walk.renderer.plan is not None
    finally:
        walk.release()
