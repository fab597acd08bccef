"""Live progress appears on a terminal only; without one, a line now and then says what is waited for."""

import io
import logging
import re
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import shapes
from depthwalk.commands.progress import asset_progress, frame_progress, live_options, show_progress
from files import write_ply


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


@pytest.fixture
def terminal(monkeypatch: pytest.MonkeyPatch) -> Callable[[], Terminal]:
    """Makes stderr a terminal, from within the test: before it pytest sets its own. Returns what is written there."""

    def begin() -> Terminal:
        monkeypatch.setattr(sys, "stderr", written := Terminal())
        monkeypatch.setenv("TERM", "xterm")
        return written

    return begin


def test_progress_is_for_terminals_that_are_not_told_to_be_quiet(
    terminal: Callable[[], Terminal], monkeypatch: pytest.MonkeyPatch
) -> None:
    terminal()
    assert show_progress()
    monkeypatch.setenv("TERM", "dumb")
    assert not show_progress()
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setattr(logging.getLogger("depthwalk"), "level", logging.ERROR)
    assert not show_progress()
    monkeypatch.setattr(sys, "stderr", io.StringIO())
    assert not show_progress()


def test_without_a_terminal_stages_are_logged(
    caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "stderr", written := io.StringIO())
    with caplog.at_level(logging.INFO, "depthwalk"), asset_progress() as report, frame_progress("frames", 9) as advance:
        report("bust", "reading")
        advance()
    assert caplog.messages == ["bust: reading"] and not written.getvalue()


def test_on_a_terminal_names_are_shown_as_they_are(terminal: Callable[[], Terminal]) -> None:
    """Rich takes brackets for markup."""
    written = terminal()
    with asset_progress() as report:
        report("bust [red]", "side")
    assert "bust [red]: side" in written.getvalue()


def test_frames_are_counted_on_a_terminal(terminal: Callable[[], Terminal]) -> None:
    written = terminal()
    with frame_progress("frames", 3) as advance:
        for _ in range(3):
            advance()
    assert "frames" in written.getvalue() and "3/3" in written.getvalue()


def test_a_single_frame_has_no_bar(terminal: Callable[[], Terminal]) -> None:
    written = terminal()
    with frame_progress("frames", 1) as advance:
        advance()
    assert not written.getvalue()


def test_displays_leave_standard_output_alone(terminal: Callable[[], Terminal]) -> None:
    terminal()
    options = live_options()
    assert options["console"].stderr and options["transient"] and not options["redirect_stdout"]


def test_a_pipe_is_told_what_takes_long_while_it_lasts(
    caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Once, however long it takes; what is over soon is not told."""
    monkeypatch.setattr("depthwalk.commands.progress.PLAIN_SECONDS", 0.05)
    monkeypatch.setattr(sys, "stderr", written := io.StringIO())
    caplog.set_level(logging.WARNING, "depthwalk")
    with asset_progress() as report:
        for stage in ("reading", "side"):
            report("bust", stage)
        wait_for("bust: side\n", written)
        time.sleep(0.2)
        report("bust", "top")
        wait_for("bust: side\nbust: top\n", written)
    assert written.getvalue() == "bust: side\nbust: top\n"


def wait_for(expected: str, written: io.StringIO) -> None:
    until = time.monotonic() + 30
    while written.getvalue() != expected and time.monotonic() < until:
        time.sleep(0.01)
    assert written.getvalue() == expected


@pytest.mark.parametrize("level", [logging.ERROR, logging.INFO])
def test_nobody_is_told_who_wants_quiet_or_gets_every_step(
    caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch, level: int
) -> None:
    monkeypatch.setattr("depthwalk.commands.progress.PLAIN_SECONDS", 0.001)
    monkeypatch.setattr(sys, "stderr", written := io.StringIO())
    caplog.set_level(level, "depthwalk")
    with asset_progress() as report:
        report("bust", "side")
        time.sleep(0.1)
    assert not written.getvalue()


def test_a_pipe_is_told_how_many_frames_are_done(
    caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("depthwalk.commands.progress.PLAIN_SECONDS", 0.05)
    monkeypatch.setattr(sys, "stderr", written := io.StringIO())
    caplog.set_level(logging.WARNING, "depthwalk")
    with frame_progress("rendering", 3) as advance:
        advance()
        advance()
        wait_for("rendering: 2 of 3 frames\n", written)


def test_bake_tells_a_pipe_which_mesh_it_is_at(
    run: Callable[..., Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("depthwalk.commands.progress.PLAIN_SECONDS", 0.01)
    meshes = [write_ply(tmp_path / f"{name}.ply", shapes.sphere(1.0, columns=32, rows=16)) for name in ("a", "b")]
    result = run("bake", *meshes, "--dpci-resolution", 128, "--jobs", 1)
    assert re.search(r"^a.ply: \w[\w ]* \(0 of 2 baked\)$", result.stderr, re.MULTILINE)
    assert re.search(r"^b.ply: \w[\w ]* \(1 of 2 baked\)$", result.stderr, re.MULTILINE)
    assert "baked)" not in result.stdout
