"""Whole files appear whole or not at all, on full disks and behind encoders that fail, too."""

import os
import signal
import subprocess
import sys
import time

import imageio_ffmpeg
import numpy as np
import pytest

from depthwalk.files import staging_folder, write_bytes
from depthwalk.video import video

pytestmark = pytest.mark.skipif(os.name == "nt", reason="fake encoders are shell scripts")

FRAME = np.zeros((48, 64, 3), np.uint8)


@pytest.fixture
def film(tmp_path):
    path = tmp_path / "a.mp4"
    path.write_bytes(b"old film")
    return path


@pytest.fixture
def encoder(tmp_path, monkeypatch):
    """Replaces the encoder by a shell script, in which $out is the file to write."""

    def install(script):
        program = tmp_path / "bin" / "encoder"
        program.parent.mkdir()
        program.write_text(f"#!/bin/sh\nfor out; do :; done\n{script}\n")
        program.chmod(0o755)
        monkeypatch.setattr(imageio_ffmpeg, "get_ffmpeg_exe", lambda: str(program))

    return install


def record(path, frames=3):
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
def test_an_encoder_that_fails_leaves_the_old_film(film, encoder, script, complaint):
    encoder(script)
    with pytest.raises(OSError) as error:
        record(film, frames=200)  # more than a pipe holds
    assert str(error.value) == f"{film}: the video encoder {complaint.format(film=film)}"
    assert film.read_bytes() == b"old film"
    assert sorted(path.name for path in film.parent.iterdir()) == ["a.mp4", "bin"]


def test_an_encoder_that_is_killed_meanwhile_is_an_error(film):
    with pytest.raises(OSError, match="ended by signal 9"), video(film, (64, 48), 25) as encoder:
        encoder.send(FRAME)
        os.kill(encoder._process.pid, signal.SIGKILL)
        for _ in range(1000):
            encoder.send(FRAME)
    assert film.read_bytes() == b"old film"


def test_who_leaves_early_leaves_no_encoder(film, encoder):
    encoder('cat > "$out"; exec sleep 60')
    with pytest.raises(RuntimeError, match="driver"), video(film, (64, 48), 25) as running:
        running.send(FRAME)
        raise RuntimeError("the driver fell over")
    assert running._process.poll() is not None
    assert film.read_bytes() == b"old film" and len(list(film.parent.iterdir())) == 2


def test_a_good_film_replaces_the_old_one(film):
    record(film)
    assert film.read_bytes()[4:8] == b"ftyp"
    assert list(film.parent.iterdir()) == [film]


FULL = """
import resource, sys
from pathlib import Path
from types import SimpleNamespace
import numpy as np
from depthwalk.output import video, write_bytes, write_exr
path, room = Path(sys.argv[1]), int(sys.argv[2])
resource.setrlimit(resource.RLIMIT_FSIZE, (room, resource.RLIM_INFINITY))
random = np.random.default_rng(0)
if path.suffix == ".mp4":
    with video(path, (256, 256), 25) as film:
        for _ in range(20):
            film.send(random.integers(0, 255, (256, 256, 3), dtype=np.uint8))
elif path.suffix == ".exr":
    picture = SimpleNamespace(colour=random.random((64, 64, 4), np.float32), distance=np.ones((64, 64), np.float32))
    write_exr(path, picture)
else:
    write_bytes(path, random.bytes(100_000))
"""


@pytest.mark.parametrize("name", ["a.mp4", "a.exr", "a.png"])
@pytest.mark.parametrize("room", [0, 60_000])
def test_a_full_disk_leaves_the_old_file(tmp_path, name, room):
    pytest.importorskip("resource")
    path = tmp_path / name
    path.write_bytes(b"old")
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(each for each in sys.path if each)}
    done = subprocess.run(
        [sys.executable, "-c", FULL, str(path), str(room)], env=environment, stderr=subprocess.PIPE, text=True
    )
    last = done.stderr.strip().splitlines()[-1]
    assert done.returncode == 1 and last.startswith("OSError: ") and str(path) in last, done.stderr
    assert path.read_bytes() == b"old" and list(tmp_path.iterdir()) == [path]


def test_a_failure_names_the_file_that_was_wanted(tmp_path):
    with pytest.raises(FileNotFoundError) as error:
        write_bytes(tmp_path / "no" / "a.png", b"picture")
    assert error.value.filename == str(tmp_path / "no" / "a.png")


def test_the_next_bake_removes_what_a_killed_one_left(tmp_path):
    old, dead = time.time() - 2 * 86_400, (1 << 22) + 5  # above what Linux numbers processes to
    names = {f".bake-{dead}-x": old, f".bake-{os.getpid()}-x": old, f".bake-{dead}-y": time.time()}
    names |= {".bake-notes": old, f".{dead}-mine.png": old}
    for name, when in names.items():
        (tmp_path / name).mkdir()
        (tmp_path / name / "half.exr").write_bytes(b"half")
        os.utime(tmp_path / name, (when, when))
    with staging_folder(tmp_path) as folder:
        assert os.path.basename(folder).startswith(f".bake-{os.getpid()}-")
        assert not (tmp_path / f".bake-{dead}-x").exists()
    assert {path.name for path in tmp_path.iterdir()} == set(names) - {f".bake-{dead}-x"}
