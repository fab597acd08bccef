"""Live progress appears on a terminal only; without one, a line now and then says what is waited for."""

import io
import logging
import sys
from collections.abc import Callable

import pytest

from depthwalk.commands.progress import asset_progress, frame_progress, live_options, show_progress


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


def test_a_pipe_is_told_now_and_then_what_takes_long(plain_seconds: float, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("depthwalk.commands.progress.PLAIN_SECONDS", plain_seconds)
    monkeypatch.setattr(sys, "stderr", written := io.StringIO())
    monkeypatch.setattr(logging.getLogger("depthwalk"), "level", logging.WARNING)
    clock = iter([0.0, 1.0, 7.0, 8.0, 8.5, 14.0, 14.0])
    monkeypatch.setattr("depthwalk.commands.progress.time.monotonic", lambda: next(clock))
    with asset_progress() as report:
        for stage in ("reading", "side", "top", "owners"):
            report("bust", stage)
    assert written.getvalue() == "waiting for bust: side\nwaiting for bust: owners\n"


def test_a_pipe_is_told_now_and_then_how_many_frames_are_done(
    plain_seconds: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("depthwalk.commands.progress.PLAIN_SECONDS", plain_seconds)
    monkeypatch.setattr(sys, "stderr", written := io.StringIO())
    monkeypatch.setattr(logging.getLogger("depthwalk"), "level", logging.WARNING)
    clock = iter([0.0, 1.0, 7.0, 7.0, 8.0])
    monkeypatch.setattr("depthwalk.commands.progress.time.monotonic", lambda: next(clock))
    with frame_progress("rendering", 3) as advance:
        for _ in range(3):
            advance()
    assert written.getvalue() == "rendering: 2 of 3 frames\n"
