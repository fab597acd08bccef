"""What only a process of its own shows: start-up, Ctrl-C, a reader that goes away."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from signal import Signals

import pytest
from PIL import Image

PATIENCE = 120  # s, on a busy machine
COMMAND = [sys.executable, "-c", "from depthwalk.commands.cli import main; main()"]


@pytest.fixture
def environment(cache_home: Path) -> dict[str, str]:
    return os.environ | {"PYTHONPATH": os.pathsep.join(path for path in sys.path if path), "PYTHONUNBUFFERED": "1"}


@pytest.fixture
def long_walk(tiny_scene: Path) -> Path:
    """A path of 3001 frames, which take long enough for a test to interrupt them."""
    walk = tiny_scene.with_name("long.yaml")
    walk.write_text(tiny_scene.with_name("walk.yaml").read_text().replace("time: 2", "time: 3000"))
    return walk


@pytest.mark.slow
def test_a_command_imports_what_it_needs_and_no_other_command(environment: dict[str, str], tiny_scene: Path) -> None:
    code = (
        "import sys\nfrom depthwalk.commands.cli import SUMMARIES, app\n"
        "try:\n    app(sys.argv[1:])\nexcept SystemExit as end:\n    assert not end.code\n"
        "watched = {'moderngl_window', 'imgui_bundle', 'rich.progress', 'numpy', 'glfw'}\n"
        "watched |= {f'depthwalk.commands.{name}' for name in SUMMARIES}\n"
        "print(*sorted(watched & set(sys.modules)))\n"
    )
    for arguments, loaded in ((["--help"], ""), (["check", str(tiny_scene)], "depthwalk.commands.check numpy")):
        done = subprocess.run(
            [sys.executable, "-c", code, *arguments], env=environment, capture_output=True, text=True, check=True
        )
        assert done.stdout.splitlines()[-1] == loaded


@pytest.mark.gl
@pytest.mark.skipif(sys.platform == "win32", reason="no SIGINT to a single process")
def test_ctrl_c_ends_with_130_and_leaves_no_partial_file(
    environment: dict[str, str], tiny_scene: Path, long_walk: Path, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    out.mkdir()
    arguments: list[str | Path] = [
        "render",
        tiny_scene,
        "-o",
        out / "f{frame}.png",
        "--path",
        long_walk,
        "--resolution",
        "96,64",
        "--quiet",  # a machine that is busy bakes for long, which would be told
    ]
    with subprocess.Popen(
        [*COMMAND, *arguments], env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == f"{out / 'f0.png'}\n"
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=PATIENCE)
    assert (process.returncode, errors) == (130, "")
    assert all(path.name.startswith("f") for path in out.iterdir())


AT_IMPORT = """
import os, signal, sys

class Interrupting:
    def find_spec(self, name, path, target=None):
        if name == sys.argv[-1]:
            os.kill(os.getpid(), signal.SIGINT)

sys.meta_path.insert(0, Interrupting())
from depthwalk.__main__ import main
main()
"""


@pytest.mark.skipif(sys.platform == "win32", reason="no SIGINT to a single process")
@pytest.mark.parametrize("library", ["typer", "depthwalk.commands.program"])
def test_ctrl_c_while_libraries_are_imported_shows_no_traceback(environment: dict[str, str], library: str) -> None:
    done = subprocess.run(
        [sys.executable, "-c", AT_IMPORT, "--help", library], env=environment, capture_output=True, text=True
    )
    assert (done.returncode, done.stdout, done.stderr) == (-signal.SIGINT, "", "depthwalk: interrupted\n")


LOOP = """
for file in first second; do
    "$0" -c 'from depthwalk.__main__ import main; main()' render --quiet --resolution 96,64 --path "$2" -o "$3" "$1"
done
echo the loop goes on
"""


@pytest.mark.gl
@pytest.mark.skipif(sys.platform == "win32", reason="no such shell")
def test_ctrl_c_ends_a_shell_loop_over_the_command_too(
    environment: dict[str, str], tiny_scene: Path, long_walk: Path, tmp_path: Path
) -> None:
    with subprocess.Popen(
        ["bash", "-c", LOOP, sys.executable, tiny_scene, long_walk, tmp_path / "f{frame}.png"],
        env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True,
    ) as process:  # fmt: skip
        assert process.stdout is not None
        assert process.stdout.readline() == f"{tmp_path / 'f0.png'}\n"
        os.killpg(process.pid, signal.SIGINT)
        output, errors = process.communicate(timeout=PATIENCE)
    assert (process.returncode, errors) == (-signal.SIGINT, "")
    assert all(line.endswith(".png") for line in output.splitlines())  # the loop does not go on


DEMO = """
import sys
from pathlib import Path
from depthwalk.commands import view
root = Path(sys.argv.pop())
view.scene_root = lambda: root
from depthwalk.commands.cli import main
main()
"""


@pytest.mark.gl
@pytest.mark.skipif(sys.platform == "win32", reason="no such signals")
@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_an_interrupted_demo_leaves_whole_files_only(
    environment: dict[str, str], tiny_scene: Path, tmp_path: Path, number: Signals, code: int
) -> None:
    folder = tiny_scene.parent
    (folder / "paths").mkdir()
    tiny_scene.rename(folder / "garden.yaml")
    walk = (folder / "walk.yaml").read_text()
    (folder / "paths" / "garden.yaml").write_text(walk.replace("time: 2", "time: 9000"))
    hidden = {name: value for name, value in environment.items() if name not in ("DISPLAY", "WAYLAND_DISPLAY")}
    out = tmp_path / "depthwalk-demo"
    with subprocess.Popen(
        [sys.executable, "-c", DEMO, "demo", "--quiet", "--resolution", "96,64", folder],
        env=hidden, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    ) as process:  # fmt: skip
        assert process.stdout is not None
        stills = [process.stdout.readline().strip() for _ in range(6)]
        assert stills == [f"depthwalk-demo/garden-{k:02}.png" for k in range(6)]
        deadline = time.monotonic() + PATIENCE
        while not any(path.suffix == ".mp4" for path in out.iterdir()) and time.monotonic() < deadline:
            time.sleep(0.01)
        process.send_signal(number)
        rest, errors = process.communicate(timeout=PATIENCE)
    assert (process.returncode, rest, errors.count("\n")) == (code, "", 1)  # that there is no display
    assert sorted(path.name for path in out.iterdir()) == [f"garden-{k:02}.png" for k in range(6)]


LOST = """
import os, signal
from depthwalk.commands.program import as_program, guarded, without_garbage_collection
from depthwalk.commands.progress import asset_progress, frame_progress

class Dropped:
    def __del__(self):
        os.kill(os.getpid(), NUMBER)  # Python drops what is raised here

def main() -> None:
    with asset_progress() as report, frame_progress("frames", 3) as advance:
        print("begun")
        Dropped()
        print("goes on")
        STEP
        print("nobody noticed")

as_program(guarded(main))()
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="no such signals")
@pytest.mark.parametrize(
    ("number", "code", "step"),
    [
        ("signal.SIGINT", 130, "advance()"),
        ("signal.SIGTERM", 143, "report('ball', 'side')"),
        ("signal.SIGTERM", 143, "1 / 0"),
        ("signal.SIGINT", 130, "with without_garbage_collection(): pass"),
    ],
)
def test_an_interruption_that_gets_lost_ends_the_command_at_its_next_step(
    environment: dict[str, str], number: str, code: int, step: str
) -> None:
    program = LOST.replace("NUMBER", number).replace("STEP", step)
    done = subprocess.run([sys.executable, "-c", program], env=environment, capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (code, "begun\ngoes on\n"), done.stderr
    assert "Traceback" not in done.stderr


WORKING = """
import os, signal, time
from depthwalk.commands.interruption import ended_by_its_signal
from depthwalk.commands.program import as_program, guarded
from depthwalk.parallel import thread_map

@guarded
def main() -> None:
    with thread_map(2) as parallel:
        try:
            list(parallel(lambda _: (os.kill(os.getpid(), NUMBER), time.sleep(PATIENCE)), range(5)))
        finally:
            print("cleaned up")

with ended_by_its_signal():
    as_program(main)()
"""


@pytest.mark.skipif(sys.platform == "win32", reason="no such signals")
@pytest.mark.parametrize(("number", "code"), [("signal.SIGINT", -2), ("signal.SIGTERM", 143)])
def test_an_interrupted_command_does_not_wait_for_threads_at_work(
    environment: dict[str, str], number: str, code: int
) -> None:
    program = WORKING.replace("NUMBER", number).replace("PATIENCE", str(4 * PATIENCE))
    command = [sys.executable, "-c", program]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=PATIENCE)
    assert (done.returncode, done.stdout, done.stderr) == (code, "cleaned up\n", "")


@pytest.mark.gl
@pytest.mark.skipif(sys.platform == "win32", reason="a POSIX shell")
@pytest.mark.parametrize("closed", [">&-", "2>&-", ">&- 2>&-"])
def test_closed_streams_are_no_error(
    environment: dict[str, str], tiny_scene: Path, tmp_path: Path, closed: str
) -> None:
    out = tmp_path / "out.png"
    arguments: list[str | Path] = ["render", tiny_scene, "-o", out, "--resolution", "96,64", "--quiet"]
    command = ["sh", "-c", f'exec "$@" {closed}', "sh", sys.executable, "-m", "depthwalk", *arguments]
    done = subprocess.run(command, env=environment, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    with Image.open(out) as picture:
        assert picture.size == (96, 64)


@pytest.mark.skipif(sys.platform != "linux", reason="/dev/full")
@pytest.mark.parametrize("unbuffered", ["", "1"])
@pytest.mark.parametrize("arguments", [["--help"], ["view", "-h"], ["--version"], ["check", "{scene}"]])
def test_a_full_disk_behind_stdout_is_told_in_one_line(
    environment: dict[str, str], tiny_scene: Path, arguments: list[str], unbuffered: str
) -> None:
    """Python itself would complain once more at exit, about what is still buffered."""
    with open("/dev/full", "w") as full:
        done = subprocess.run(
            [*COMMAND, *(part.format(scene=tiny_scene) for part in arguments)],
            env=environment | {"PYTHONUNBUFFERED": unbuffered},
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
        )
    assert (done.returncode, done.stderr) == (1, "depthwalk: No space left on device\n")


@pytest.mark.skipif(sys.platform != "linux", reason="/dev/full")
@pytest.mark.parametrize("arguments", [[], ["rendr"], ["check", "missing.yaml"], ["info", "missing.ply"]])
def test_mistakes_that_nobody_can_read_are_mistakes_still(environment: dict[str, str], arguments: list[str]) -> None:
    with open("/dev/full", "w") as full:
        assert subprocess.run([*COMMAND, *arguments], env=environment, stderr=full).returncode == 2


@pytest.mark.slow
def test_a_reader_that_goes_away_is_no_error_message(environment: dict[str, str], tiny_scene: Path) -> None:
    read, write = os.pipe()
    os.close(read)
    try:
        done = subprocess.run(
            [*COMMAND, "check", str(tiny_scene)], env=environment, stdout=write, stderr=subprocess.PIPE, text=True
        )
    finally:
        os.close(write)
    assert (done.returncode, done.stderr) == (1, "")
