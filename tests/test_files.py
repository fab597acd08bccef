"""Files appear whole or not at all, on full disks too, and what killed processes left goes."""

import errno
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import pytest

from depthwalk.errors import InputError
from depthwalk.files import (
    _machine,
    check_folder,
    copy,
    reason,
    remove_leftovers,
    replacing,
    staging_folder,
    temporary_folder,
    write_bytes,
)

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


DEAD = (1 << 22) + 5  # above what Linux numbers processes to


def leave(folder: Path, name: str, days: float = 0.0) -> str:
    (folder / name).mkdir()
    (folder / name / "half.exr").write_bytes(b"half")
    when = time.time() - 86_400 * days
    os.utime(folder / name, (when, when))
    return name


def test_whoever_writes_next_removes_what_killed_processes_left(tmp_path: Path) -> None:
    here = _machine()
    for name in (f".bake-{DEAD}-{here}-x", f".{DEAD}-{here}-a.png"):
        leave(tmp_path, name)
    leave(tmp_path, f".bake-{DEAD}-old", days=2)  # of a version that did not name the machine
    leave(tmp_path, f".{DEAD}-abcdef-a.png", days=2)  # of another machine
    stay = {leave(tmp_path, f".{os.getpid()}-{here}-b.png", days=2), leave(tmp_path, f".{DEAD}-abcdef-b.png")}
    stay |= {leave(tmp_path, ".bake-notes", days=2), leave(tmp_path, f"{DEAD}-{here}-x", days=2)}
    write_bytes(tmp_path / "a.png", b"picture")
    assert {path.name for path in tmp_path.iterdir()} == stay | {"a.png"}


def test_folders_of_a_process_are_told_from_others(tmp_path: Path) -> None:
    gone = leave(tmp_path, f".bake-{DEAD}-{_machine()}-x")
    with staging_folder(tmp_path) as folder:
        assert os.path.basename(folder).startswith(f".bake-{os.getpid()}-{_machine()}-")
        assert not (tmp_path / gone).exists()
    with temporary_folder() as folder:
        assert Path(folder).parent == Path(tempfile.gettempdir())


def test_a_copy_is_whole(tmp_path: Path) -> None:
    (tmp_path / "a").write_bytes(b"contents")
    copy(tmp_path / "a", tmp_path / "b")
    assert (tmp_path / "b").read_bytes() == b"contents"
    with pytest.raises(FileNotFoundError):
        copy(tmp_path / "none", tmp_path / "b")
    assert (tmp_path / "b").read_bytes() == b"contents" and len(list(tmp_path.iterdir())) == 2


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


def test_a_full_disk_is_no_mistake_of_the_user(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(**options: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), "a name of its own")

    monkeypatch.setattr("tempfile.TemporaryFile", full)
    with pytest.raises(OSError) as error:
        check_folder(tmp_path / "a.png")
    assert (error.value.errno, error.value.filename) == (errno.ENOSPC, str(tmp_path / "a.png"))


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


@pytest.mark.parametrize(
    ("error", "expected"),
    [
        (OSError(errno.ENOSPC, "No space", "a.npz"), "a.npz: No space"),
        (OSError(errno.ENOSPC, "No space"), "No space"),
        (OSError("a.npz: cannot be written"), "a.npz: cannot be written"),
    ],
)
def test_a_reason_has_no_number(error: OSError, expected: str) -> None:
    assert reason(error) == expected
