"""Videos appear whole or not at all, behind encoders that fail, too."""

import errno
import os
import signal
from collections.abc import Callable
from pathlib import Path

import imageio_ffmpeg
import numpy as np
import pytest

from depthwalk.video import video

pytestmark = pytest.mark.skipif(os.name == "nt", reason="fake encoders are shell scripts")

FRAME = np.zeros((48, 64, 3), np.uint8)


@pytest.fixture
def film(tmp_path: Path) -> Path:
    path = tmp_path / "a.mp4"
    path.write_bytes(b"old film")
    return path


@pytest.fixture
def encoder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., object]:
    """Replaces the encoder by a shell script, in which $out is the file to write."""

    def install(script: str) -> None:
        program = tmp_path / "bin" / "encoder"
        program.parent.mkdir()
        program.write_text(f"#!/bin/sh\nfor out; do :; done\n{script}\n")
        program.chmod(0o755)
        monkeypatch.setattr(imageio_ffmpeg, "get_ffmpeg_exe", lambda: str(program))

    return install


def record(path: Path, frames: int = 3) -> None:
    with video(path, (64, 48), 25) as film:
        for _ in range(frames):
            film.send(FRAME)


@pytest.mark.parametrize(
    ("script", "complaint"),
    [
        ('cat > "$out"; echo first >&2; echo "$out: no room" >&2; exit 3', "failed with status 3: {film}: no room"),
        ('cat > "$out"; kill -9 $$', "was ended by signal 9"),
        ("cat > /dev/null", "wrote nothing"),
        ("echo cannot start >&2; exit 1", "failed with status 1: cannot start"),
    ],
)
def test_an_encoder_that_fails_leaves_the_old_film(
    film: Path, encoder: Callable[..., object], script: str, complaint: str
) -> None:
    encoder(script)
    with pytest.raises(OSError) as error:
        record(film, frames=200)  # more than a pipe holds
    assert str(error.value) == f"{film}: the video encoder {complaint.format(film=film)}"
    assert film.read_bytes() == b"old film"
    assert sorted(path.name for path in film.parent.iterdir()) == ["a.mp4", "bin"]


@pytest.mark.parametrize("read", ["cat > /dev/null; ", ""])
def test_a_full_disk_is_told_as_such(film: Path, encoder: Callable[..., object], read: str) -> None:
    """Whether the encoder notices at the end or before the last frame; it returns the number with a minus."""
    encoder(f"{read}echo Nothing was written >&2; exit {256 - errno.ENOSPC}")
    with pytest.raises(OSError) as error:
        record(film, frames=200)
    assert (error.value.errno, error.value.filename) == (errno.ENOSPC, str(film))
    assert film.read_bytes() == b"old film"


def test_an_encoder_that_is_killed_meanwhile_is_an_error(film: Path) -> None:
    with pytest.raises(OSError, match="ended by signal 9"), video(film, (64, 48), 25) as encoder:
        encoder.send(FRAME)
        os.kill(encoder._process.pid, signal.SIGKILL)
        for _ in range(1000):
            encoder.send(FRAME)
    assert film.read_bytes() == b"old film"


def test_who_leaves_early_leaves_no_encoder(film: Path, encoder: Callable[..., object]) -> None:
    encoder('cat > "$out"; exec sleep 60')
    with pytest.raises(RuntimeError, match="driver"), video(film, (64, 48), 25) as running:
        running.send(FRAME)
        raise RuntimeError("the driver fell over")
    assert running._process.poll() is not None
    assert film.read_bytes() == b"old film" and len(list(film.parent.iterdir())) == 2


def test_a_good_film_replaces_the_old_one(film: Path) -> None:
    record(film)
    assert film.read_bytes()[4:8] == b"ftyp"
    assert list(film.parent.iterdir()) == [film]


def test_odd_sides_are_scaled_to_even_ones_with_a_warning(film: Path, caplog: pytest.LogCaptureFixture) -> None:
    with video(film, (63, 47), 25) as encoder:
        encoder.send(FRAME[:47, :63])
    assert "scaled to 64,48" in caplog.text and film.read_bytes()[4:8] == b"ftyp"
