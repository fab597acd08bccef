"""The tools that kill commands find nothing wrong, and would find what is."""

import subprocess
import sys
from pathlib import Path

import pytest
from tools.faults import COMMANDS, left_behind, prepare, written

linux = pytest.mark.skipif(sys.platform == "win32", reason="processes are forked")


@linux
@pytest.mark.slow
def test_what_is_killed_leaves_nothing_torn() -> None:
    command = [sys.executable, "-m", "tools.faults", "kill", "--times", "2", "--only", "bake"]
    done = subprocess.run(command, cwd=Path(__file__).parents[2], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.strip() == "bake: 2 kills, 0 wrong"


def test_what_is_left_is_seen(tmp_path: Path) -> None:
    prepare(tmp_path)
    (tmp_path / "out" / ".4194309-abcdef-a.png").write_bytes(b"half")
    (tmp_path / "out" / "a.png").write_bytes(b"whole")
    assert [Path(file).name for file in left_behind(tmp_path)] == [".4194309-abcdef-a.png"]
    assert written(tmp_path, "pictures") == {"a.png": b"whole"} and "pictures" in COMMANDS
