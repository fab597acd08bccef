"""Files appear whole or not at all, on full disks too, and what killed processes left goes."""

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from depthwalk.errors import InputError
from depthwalk.files import check_folder, remove_leftovers, remove_staging, replacing, staging_folder, write_bytes

FULL = """
import resource, sys
from pathlib import Path
from types import SimpleNamespace
import numpy as np
from depthwalk.files import write_bytes
from depthwalk.pictures import write_exr
from depthwalk.video import video
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


@pytest.mark.gl
@pytest.mark.parametrize("name", ["a.mp4", "a.exr", "a.png"])
@pytest.mark.parametrize("room", [0, 60_000])
def test_a_full_disk_leaves_the_old_file(tmp_path: Path, name: str, room: int) -> None:
    pytest.importorskip("resource")
    path = tmp_path / name
    path.write_bytes(b"old")
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(entry for entry in sys.path if entry)}
    done = subprocess.run(
        [sys.executable, "-c", FULL, str(path), str(room)], env=environment, stderr=subprocess.PIPE, text=True
    )
    last = done.stderr.strip().splitlines()[-1]
    assert done.returncode == 1 and last.startswith("OSError: ") and str(path) in last, done.stderr
    assert path.read_bytes() == b"old" and list(tmp_path.iterdir()) == [path]


def test_a_failure_names_the_file_that_was_wanted(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError) as error:
        write_bytes(tmp_path / "no" / "a.png", b"picture")
    assert error.value.filename == str(tmp_path / "no" / "a.png")


def test_the_next_bake_removes_what_a_killed_one_left(tmp_path: Path) -> None:
    old, dead = time.time() - 2 * 86_400, (1 << 22) + 5  # above what Linux numbers processes to
    names = {f".bake-{dead}-x": old, f".bake-{os.getpid()}-x": old, f".bake-{dead}-y": time.time()}
    names |= {".bake-notes": old, f".{dead}-mine.png": old}
    for name, when in names.items():
        (tmp_path / name).mkdir()
        (tmp_path / name / "half.exr").write_bytes(b"half")
        os.utime(tmp_path / name, (when, when))
    remove_staging(tmp_path)
    with staging_folder(tmp_path) as folder:
        assert os.path.basename(folder).startswith(f".bake-{os.getpid()}-")
        assert not (tmp_path / f".bake-{dead}-x").exists()
    assert {path.name for path in tmp_path.iterdir()} == set(names) - {f".bake-{dead}-x"}


def test_a_file_is_replaced_at_the_end_of_the_block(tmp_path: Path) -> None:
    path = tmp_path / "a.png"
    path.write_bytes(b"old")
    with replacing(path) as temporary:
        temporary.write_bytes(b"new")
        assert path.read_bytes() == b"old" and temporary.parent == tmp_path and temporary.suffix == ".png"
    assert path.read_bytes() == b"new" and list(tmp_path.iterdir()) == [path]


def test_an_error_in_the_block_leaves_the_old_file_alone(tmp_path: Path) -> None:
    path = tmp_path / "a.png"
    path.write_bytes(b"old")
    with pytest.raises(RuntimeError, match="half way"), replacing(path) as temporary:
        temporary.write_bytes(b"half")
        raise RuntimeError("half way")
    assert path.read_bytes() == b"old" and list(tmp_path.iterdir()) == [path]


def test_a_writer_that_wrote_nothing_is_an_error_that_names_the_file(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError) as error, replacing(tmp_path / "a.png"):
        pass
    assert error.value.filename == str(tmp_path / "a.png")


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("no/a.png", "the folder '.*no' does not exist"),
        ("", "is a folder"),
        ("x" * 300, "the name is too long"),
        ("a\0.png", "no file can have that name"),
    ],
)
def test_a_file_that_cannot_be_written_is_named_before_work_begins(tmp_path: Path, name: str, reason: str) -> None:
    with pytest.raises(InputError, match=reason):
        check_folder(tmp_path / name)


def test_trying_a_folder_leaves_nothing_in_it(tmp_path: Path) -> None:
    check_folder(tmp_path / "a.png")
    assert not list(tmp_path.iterdir())


def test_only_old_files_of_dead_processes_are_leftovers(tmp_path: Path) -> None:
    old, dead = time.time() - 2 * 86_400, (1 << 22) + 5
    for name, when in ((f".{dead}-a", old), (f".{dead}-b", time.time()), (f".{os.getpid()}-c", old), (".d", old)):
        (tmp_path / name).write_bytes(b"")
        os.utime(tmp_path / name, (when, when))
    remove_leftovers(tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == {f".{dead}-b", f".{os.getpid()}-c", ".d"}
    remove_leftovers(tmp_path / "no such folder")
