"""The manners of every command, as far as they can be tried without a process of its own."""

import errno
import gc
import io
import logging
import os
import signal
import sys
from contextlib import suppress
from pathlib import Path

import pytest
import typer

from depthwalk.commands.program import guarded, without_garbage_collection
from depthwalk.errors import InputError


def test_garbage_is_looked_for_again_after_the_start_even_if_that_fails() -> None:
    frozen = gc.get_freeze_count()
    with pytest.raises(ValueError, match="scene"), without_garbage_collection():
        assert not gc.isenabled()
        raise ValueError("scene")
    assert gc.isenabled() and gc.get_freeze_count() > frozen
    gc.unfreeze()


@pytest.mark.parametrize(("encoding", "written"), [("ascii", b"2 \\xd7 3\n"), ("utf-8", "2 × 3\n".encode())])
def test_a_stream_that_lacks_a_character_gets_an_escape(
    monkeypatch: pytest.MonkeyPatch, encoding: str, written: bytes
) -> None:
    stream = io.BytesIO()
    monkeypatch.setattr("sys.stdout", io.TextIOWrapper(stream, encoding, newline="\n"))
    guarded(lambda: print("2 × 3"))()
    assert stream.getvalue() == written


@pytest.mark.parametrize("quiet", [False, True])
def test_a_warning_that_ends_the_command_is_printed_once(capsys: pytest.CaptureFixture[str], quiet: bool) -> None:
    """Even with --quiet, which hides the warning. What an earlier command said does not count."""

    def command(*, quiet: bool) -> None:
        for _ in range(2):
            logging.getLogger("depthwalk.render").warning("%s", InputError("a: broken"))
        raise InputError("a: broken", "b: gone")

    for _ in range(2):
        with pytest.raises(typer.Exit) as ended:
            guarded(command)(quiet=quiet)
        assert ended.value.exit_code == 2
        assert capsys.readouterr().err == "a: broken\nb: gone\n"


def test_files_below_the_current_folder_are_named_as_seen_from_there(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def command() -> None:
        logging.getLogger("depthwalk.ingest").warning("%s: no texture", tmp_path / "a" / "b.obj")
        raise InputError(f"{tmp_path / 'a' / 'b.obj'}: truncated", f"{tmp_path / 'c.obj'}: empty", "--set x: unknown")

    (tmp_path / "a").mkdir()
    monkeypatch.chdir(tmp_path / "a")
    with pytest.raises(typer.Exit):
        guarded(command)()
    assert capsys.readouterr().err.splitlines() == [
        "b.obj: no texture", "b.obj: truncated", f"{tmp_path / 'c.obj'}: empty", "--set x: unknown",
    ]  # fmt: skip


@pytest.mark.skipif(sys.platform == "win32", reason="no SIGINT to a single process")
def test_a_ctrl_c_that_a_library_swallows_still_ends_the_command_with_130() -> None:
    def command() -> None:
        with suppress(KeyboardInterrupt):
            os.kill(os.getpid(), signal.SIGINT)

    with pytest.raises(typer.Exit) as ended:
        guarded(command)()
    assert ended.value.exit_code == 130


@pytest.mark.parametrize(("names", "where"), [(("a.png",), "a.png"), ((), "depthwalk")])
def test_a_full_disk_is_told_in_one_line(
    capsys: pytest.CaptureFixture[str], names: tuple[str, ...], where: str
) -> None:
    """The program is not to blame, so that no traceback is offered; standard output has no name."""

    def command() -> None:
        raise OSError(errno.ENOSPC, "No space left on device", *names)

    with pytest.raises(typer.Exit) as ended:
        guarded(command)()
    assert ended.value.exit_code == 1
    assert capsys.readouterr().err == f"{where}: No space left on device\n"
