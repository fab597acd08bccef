"""Videos appear whole or not at all, behind encoders that fail, too."""

import errno
import os
import signal
from collections.abc import Callable
from pathlib import Path

import imageio_ffmpeg
import numpy as np
import pytest
from PIL import Image

from depthwalk.types import Picture
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


def discs(alpha: bool) -> list[Picture]:
    """Return five pictures (33, 47) of a bright disc that goes to the right before a gradient, or before nothing."""
    y, x = np.mgrid[:33, :47]
    pictures = []
    for frame in range(5):
        picture = np.stack([4 * y, 5 * x, 100 + 0 * x, 0 * x if alpha else 255 + 0 * x], -1)
        picture[(y - 16) ** 2 + (x - 8 - 8 * frame) ** 2 < 36] = (250, 240, 200, 255)
        pictures.append(picture.astype(np.uint8)[..., : 4 if alpha else 3])
    return pictures


@pytest.mark.parametrize("alpha", [False, True])
@pytest.mark.parametrize("name", ["a.gif", "a.WEBP"])
def test_animations_show_each_frame_for_its_time_and_repeat(tmp_path: Path, name: str, alpha: bool) -> None:
    pictures = discs(alpha)
    with video(tmp_path / name, (47, 33), 25, transparent=alpha) as film:
        for picture in pictures:
            film.send(picture)
    with Image.open(tmp_path / name) as shown:
        assert (shown.size, getattr(shown, "n_frames", 1), shown.info["loop"]) == ((47, 33), 5, 0)
        for number, picture in enumerate(pictures):
            shown.seek(number)
            found = np.asarray(shown.convert("RGBA" if alpha else "RGB"), int)
            assert shown.info["duration"] == 40
            seen = picture[..., 3] == 255 if alpha else np.ones((33, 47), bool)
            assert np.abs(found - picture)[seen].mean() < 4
            if alpha:  # nothing of earlier frames is left
                np.testing.assert_array_equal(found[..., 3], picture[..., 3])


def test_a_gif_has_at_most_50_frames_a_second(tmp_path: Path) -> None:
    """Browsers show frames of less than two hundredths of a second for a tenth."""
    with video(tmp_path / "a.gif", (47, 33), 100) as film:
        for _ in range(4):
            for picture in discs(False):
                film.send(picture)
    with Image.open(tmp_path / "a.gif") as shown:
        assert getattr(shown, "n_frames", 1) == 10 and shown.info["duration"] == 20
