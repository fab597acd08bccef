"""The manners of every command, as far as they can be tried without a process of its own."""

import gc
import io

import pytest

from depthwalk.commands.program import guarded, without_garbage


def test_garbage_is_looked_for_again_after_the_start_even_if_that_fails() -> None:
    frozen = gc.get_freeze_count()
    with pytest.raises(ValueError, match="scene"), without_garbage():
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
