"""Kill commands at random moments, and let the disk fill up at every page that they write.

`python -m tools.faults kill --times 500` ends `bake`, cooking, `render` to pictures and to a video, and the saving of
a camera path, by SIGKILL; `python -m tools.faults full` gives each a disk a few pages larger than the last time, until
everything fits, and needs `unshare` and permission to mount. After each, every file must be the old one or the whole
new one; the next run must remove leftovers and make the same files. Exits with code 1 otherwise.
"""

import contextlib
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import typer

from depthwalk.commands.exit_codes import FAILURE
from depthwalk.commands.program import guarded

_PAGE = 4096  # bytes that a disk allocates at least
_PAGES = 48  # sizes of the disk that are tried, for one command
_MESH = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
_SCENE = """version: 1
assets: {tip: {mesh: tip.obj, dpci: {resolution: 32, layers: 1}}}
objects: [{asset: tip}]
camera: {position: [0, 1, 3], target: [0, 0.4, 0], fov: 50}
"""
_PATH = """version: 1
fps: 5
keyframes:
  - {time: 0, position: [0, 1, 3], target: [0, 0.4, 0], fov: 50}
  - {time: 0.8, position: [0.5, 1, 3], target: [0, 0.4, 0], fov: 50}
"""
_SMALL = "--resolution", "48,32", "--quiet"
COMMANDS: dict[str, tuple[str, ...]] = {
    "bake": ("bake", "in/tip.obj", "-o", "out/a.dpci.exr", "--dpci-resolution", "32", "--force", "--quiet"),
    "cook": ("bake", "in/tip.obj", "-o", "out/a.dpci.npz", "--dpci-resolution", "32", "--force", "--quiet"),
    "pictures": ("render", "in/scene.yaml", "--path", "in/path.yaml", "-o", "out/{frame}.exr", *_SMALL),
    "video": ("render", "in/scene.yaml", "--path", "in/path.yaml", "-o", "out/a.mp4", *_SMALL),
    "save": (),
}
"""What is tried, with the arguments of `depthwalk`; `save` saves a camera path as the window does."""


def begin(name: str, folder: Path) -> int:
    """Begin one of COMMANDS in a separate process, in `folder`, and return the number of the process."""
    if process := os.fork():
        return process
    code = 1
    try:
        os.setsid()
        os.chdir(folder)
        os.environ |= {"XDG_CACHE_HOME": str(folder / "cache"), "TMPDIR": str(folder / "tmp")}
        tempfile.tempdir = None
        output = os.open("output", os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        os.dup2(output, 1)
        os.dup2(output, 2)
        code = _run(name)
    finally:
        os._exit(code)


def _run(name: str) -> int:
    """Do one of COMMANDS in this process, and return its exit code."""
    if name == "save":
        from depthwalk.scene.path import load_path
        from depthwalk.walk.recorder import save_path

        try:
            save_path(load_path(Path("in/path.yaml")), Path("out"))
        except OSError as error:
            print(error, flush=True)
            return 1
        return 0
    from depthwalk.commands.cli import main

    sys.argv = ["depthwalk", *COMMANDS[name]]
    try:
        main()
    except SystemExit as end:
        return end.code if isinstance(end.code, int) else 0
    finally:
        sys.stdout.flush()
    return 0


def finish(process: int) -> int:
    """Wait for a process; return its exit code, negative if a signal ended it."""
    return os.waitstatus_to_exitcode(os.waitpid(process, 0)[1])


def prepare(folder: Path) -> None:
    """Create the inputs of COMMANDS in `folder`, and the folders that they write into."""
    for name in ("in", "out", "cache", "tmp"):
        (folder / name).mkdir()
    for name, text in {"tip.obj": _MESH, "scene.yaml": _SCENE, "path.yaml": _PATH}.items():
        (folder / "in" / name).write_text(text)


def written(folder: Path, name: str) -> dict[str, bytes]:
    """Return the results by name; saved paths, which are named by the time, get one name per content."""
    files = {path.name: path.read_bytes() for path in (folder / "out").iterdir() if path.name[0] != "."}
    return {f"path {hash(data)}": data for data in files.values()} if name == "save" else files


def left_behind(folder: Path) -> list[str]:
    """Return the unfinished files in the folders of the results, of the cache and of temporary files."""
    places = [folder / "out", folder / "tmp", *(path for path in (folder / "cache").rglob("*") if path.is_dir())]
    return [str(path) for place in places for path in place.glob(".*")]


class Trial:
    """Try one of COMMANDS in a folder; `wrong` collects errors."""

    def __init__(self, name: str, folder: Path) -> None:
        prepare(folder)
        self.name, self.folder = name, folder
        start = time.perf_counter()
        code = finish(begin(name, folder))
        self.seconds = time.perf_counter() - start
        self.whole, self.wrong = written(folder, name), list[str]()
        if code or not self.whole:
            raise RuntimeError(f"{name}: {(folder / 'output').read_text()}")

    def kill(self, delay: float) -> None:
        """Run the command, kill it after `delay` seconds with all its children, and run it again to the end."""
        process = begin(self.name, self.folder)
        time.sleep(delay)
        for end in (os.killpg, os.kill):
            with contextlib.suppress(ProcessLookupError):  # it had not yet a group of its own, or has ended
                end(process, signal.SIGKILL)
        finish(process)
        self.check(f"killed after {delay:.3f} s")
        if code := finish(begin(self.name, self.folder)):
            self.wrong.append(f"the run after one killed after {delay:.3f} s: {code}: {self.output}")
        self.check("run again")
        if left := left_behind(self.folder):
            self.wrong.append(f"left behind: {left}")

    @property
    def output(self) -> str:
        """What the last run printed."""
        return (self.folder / "output").read_text(errors="replace")

    def check(self, when: str) -> None:
        """Record results that differ from those of an undisturbed run."""
        for name, data in written(self.folder, self.name).items():
            if data != self.whole.get(name):
                self.wrong.append(f"{when}: {name} is another, {len(data)} bytes")


def full_disk(name: str, folder: Path) -> tuple[int, list[str]]:
    """Run one of COMMANDS on full disks; return their number, and the errors."""
    trial = Trial(name, folder)
    most = sum((len(data) + _PAGE - 1) // _PAGE for data in trial.whole.values()) + 3
    out, wrong = folder / "out", trial.wrong
    for path in out.iterdir():
        path.unlink()
    subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={_PAGE * (most + 8)}", "tmpfs", out], check=True)
    tried = 0
    for free in range(0, most, max(1, most // _PAGES)):
        for path in out.iterdir():
            path.unlink()
        for result in trial.whole if name != "save" else ():
            (out / result).write_bytes(b"old")
        room = os.statvfs(out)
        with (out / "ballast").open("wb") as ballast:
            ballast.write(bytes(max(0, room.f_bavail - free) * room.f_bsize))
        code = finish(begin(name, folder))
        tried += 1
        for path in out.iterdir():
            if path.name != "ballast" and path.read_bytes() not in (b"old", *trial.whole.values()):
                wrong.append(f"{free} pages: {path.name} is torn")
        is_done = name != "save" and all((out / name).read_bytes() == data for name, data in trial.whole.items())
        if code == 0 and not is_done and not (name == "save" and len(list(out.iterdir())) > 1):
            wrong.append(f"{free} pages: exit code 0, but not written: {trial.output}")
        if code and "out" not in trial.output:
            wrong.append(f"{free} pages: the error names no file: {trial.output}")
        wrong += [f"{free} pages: left behind {path}" for path in out.glob(".*")]
    return tried, wrong


app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)


@app.command()
@guarded
def kill(
    times: Annotated[int, typer.Option(metavar="N", min=1, help="Kills.")] = 500,
    only: Annotated[str, typer.Option(metavar="NAME", help=", ".join(COMMANDS))] = "",
    seed: Annotated[int, typer.Option(metavar="N", help="Of the moments.")] = 0,
) -> None:
    """End commands by SIGKILL at random moments."""
    _load()
    chance = random.Random(seed)
    names = [only] if only else list(COMMANDS)

    def try_one(name: str, folder: Path) -> tuple[int, list[str]]:
        trial, share = Trial(name, folder), -(-times // len(names))
        for _ in range(share):
            trial.kill(chance.random() * trial.seconds)
        return share, trial.wrong

    _report(names, try_one, "kills")


@app.command()
@guarded
def full(only: Annotated[str, typer.Option(metavar="NAME", help=", ".join(COMMANDS))] = "") -> None:
    """Let the disk be full at every page."""
    if os.environ.get("_DEPTHWALK_MAY_MOUNT") is None:
        os.environ["_DEPTHWALK_MAY_MOUNT"] = "1"
        os.execvp("unshare", ["unshare", "-rm", sys.executable, "-m", "tools.faults", *sys.argv[1:]])
    _load()
    _report([only] if only else list(COMMANDS), full_disk, "full disks")


def _load() -> None:
    """Import everything that commands need now, so that kills hit the actual work."""
    os.environ["OPENBLAS_NUM_THREADS"] = "1"  # threads would not live in the processes that are forked
    import depthwalk.commands.bake
    import depthwalk.commands.baking
    import depthwalk.commands.frame_drawing
    import depthwalk.commands.render
    import depthwalk.walk.recorder  # noqa: F401


def _report(names: list[str], try_one: Callable[[str, Path], tuple[int, list[str]]], what: str) -> None:
    """Try commands, each in a separate folder, and print the errors."""
    failed = False
    for name in names:
        with tempfile.TemporaryDirectory() as folder:
            tried, wrong = try_one(name, Path(folder).resolve())
            if what == "full disks":
                subprocess.run(["umount", Path(folder) / "out"], check=True)
        failed |= bool(wrong)
        print(f"{name}: {tried} {what}, {len(wrong)} wrong", *wrong[:10], sep="\n  ", flush=True)
    if failed:
        raise typer.Exit(FAILURE)


if __name__ == "__main__":
    app()
