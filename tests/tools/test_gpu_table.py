"""Tables of frames on a GPU."""

import time
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from depthwalk.gpu.device import Device
from depthwalk.gpu.timers import PassTimers
from depthwalk.render.headless import HeadlessRenderer
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera
from tools import gpu_table


@pytest.mark.gl
@pytest.mark.slow
def test_tables_of_a_walk_and_of_its_picture_twice(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    command = ["--only", "room", "--size", "48", "32", "--frames", "9"]
    gpu_table.main([*command, "--software", "--pictures", str(tmp_path)])
    first = capsys.readouterr().out
    row = next(line for line in first.splitlines() if line.startswith("| room | "))
    frame, *others = row.split(" | ")[1:5]
    assert all(float(time) > 0 for time in (*frame.split(" · "), *others))
    assert "composite" in first
    gpu_table.main([*command, "--software", "--compare", str(tmp_path)])
    assert "FLIP 0.00000, 0.00% of the pixels differ" in capsys.readouterr().out
    (tmp_path / "room.png").write_bytes(b"no picture")
    gpu_table.main([*command, "--software", "--compare", str(tmp_path)])
    assert f"{tmp_path / 'room.png'}: " in capsys.readouterr().out


def test_a_driver_that_spins_until_the_gpu_is_done_is_no_part_of_python() -> None:
    """It does so in `draw` where frames are ahead of the GPU, and where depth is read back."""

    def spin() -> None:
        end = time.thread_time() + 0.01
        while time.thread_time() < end:
            pass

    def draw(view: View) -> None:
        unfinished.append(view)
        if len(unfinished) > 1:
            spin()
        with timers.waiting():
            spin()
        timers.end_frame()

    unfinished: list[View] = []
    timers = PassTimers(cast(Device, SimpleNamespace(context=None, software=False)))
    renderer = SimpleNamespace(timers=timers, remembers=False)
    pixels = np.zeros((8, 8, 4), np.uint8)
    headless = SimpleNamespace(
        draw=draw, finish=unfinished.clear, renderer=renderer, size=(8, 8), pixels=lambda: pixels
    )
    found = gpu_table.measure(cast(HeadlessRenderer, headless), [Camera((0, 1, 2), (0, 0, 0), 1.0)] * 5)
    assert len(found.python) == 5 and max(found.python) < 5 < 10 < min(found.frame)


def test_what_is_no_gpu_is_refused(capsys: pytest.CaptureFixture[str], gl_device: Device) -> None:
    if not gl_device.software:
        pytest.skip("a GPU draws here")
    with pytest.raises(SystemExit) as left:
        gpu_table.main(["--only", "room", "--size", "48", "32"])
    assert left.value.code == 2 and "--software measures it all the same" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("more", "said"),
    [(("--only", "attic"), "no walk attic; there are garden"), (("--frames", "0"), "at least 1")],
)
def test_wrong_words_are_told(more: tuple[str, ...], said: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as left:
        gpu_table.main(more)
    assert left.value.code == 2 and said in capsys.readouterr().err
