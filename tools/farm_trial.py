"""Try a cluster that loses its workers: the same files as one process makes, however many are killed.

    python -m tools.farm_trial --models 200 --frames 1000 --workers 2 --kill-every 5

starts a scheduler and workers on the loopback device, with TLS, kills a worker every few seconds, and the scheduler
once. What is killed is started again, as a service manager would. Prints a table in Markdown.
"""

import argparse
import contextlib
import filecmp
import os
import random
import resource
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np

from depthwalk.resources import scene_root

PROGRAM = [sys.executable, "-c", "from depthwalk.commands.cli import main; main()"]
SMALL = ["--resolution", "128,96"]
SEGMENTS, RINGS = 24, 12  # of a model
RESTART_SECONDS = 0.5


def write_models(folder: Path, count: int) -> list[Path]:
    """Write spheres with a wave on each, no two alike, as OBJ files."""
    theta, phi = np.meshgrid(np.linspace(0, 2 * np.pi, SEGMENTS), np.linspace(0, np.pi, RINGS), indexing="ij")
    corner = np.arange(SEGMENTS * RINGS).reshape(SEGMENTS, RINGS) + 1
    quads = np.stack([corner[:-1, :-1], corner[:-1, 1:], corner[1:, 1:], corner[1:, :-1]], axis=-1).reshape(-1, 4)
    faces = "".join(f"f {a} {d} {c} {b}\n" for a, b, c, d in quads)
    files = []
    for number in range(count):
        radius = 1 + 0.2 * np.sin(3 * theta + number) * np.sin(phi) ** 2
        points = radius[..., None] * np.stack(
            [np.cos(theta) * np.sin(phi), np.cos(phi), np.sin(theta) * np.sin(phi)], axis=-1
        )
        lines = "".join(f"v {x:.6f} {y:.6f} {z:.6f}\n" for x, y, z in points.reshape(-1, 3))
        files.append(folder / f"model{number:05}.obj")
        files[-1].write_text(lines + faces)
    return files


def write_path(file: Path, frames: int) -> None:
    """Write a walk through the room of so many frames."""
    last = (frames - 1) / 30
    file.write_text(
        "version: 1\nfps: 30\nkeyframes:\n"
        "  - {time: 0, position: [2, 1.6, 4.5], target: [0, 0.9, -1], fov: 50}\n"
        f"  - {{time: {last / 2:.9g}, position: [3, 1.6, 2.5], target: [0, 0.9, -1], fov: 50}}\n"
        f"  - {{time: {last:.9g}, position: [-3, 2.6, 3.5], target: [0, 0.9, -1], fov: 50}}\n"
    )


def certificates(folder: Path) -> dict[str, str]:
    """Write a certificate for this trial; return the variables by which Dask finds it."""
    from distributed import Security

    made = Security.temporary()
    (folder / "ca.pem").write_text(made.tls_ca_file)
    (folder / "key.pem").write_text(made.tls_client_key)
    (folder / "cert.pem").write_text(made.tls_client_cert)
    names = {"ca-file": "ca.pem"}
    for role in ("client", "scheduler", "worker"):
        names |= {f"{role}.key": "key.pem", f"{role}.cert": "cert.pem"}
    prefix = "DASK_DISTRIBUTED__COMM__"
    variables = {
        f"{prefix}TLS__{key.upper().replace('.', '__').replace('-', '_')}": str(folder / name)
        for key, name in names.items()
    }
    return variables | {f"{prefix}REQUIRE_ENCRYPTION": "true", "DASK_DISTRIBUTED__WORKER__DAEMON": "false"}


class Service:
    """Run a program, and start it again whenever it ends, as a service manager does."""

    def __init__(self, command: Sequence[str], environment: dict[str, str]) -> None:
        self._command, self._environment = command, environment
        self._stopped = threading.Event()
        self._process = self._start()
        self._thread = threading.Thread(target=self._keep)
        self._thread.start()

    def _start(self) -> "subprocess.Popen[bytes]":
        null = subprocess.DEVNULL
        return subprocess.Popen(self._command, env=self._environment, stdout=null, stderr=null)

    def _keep(self) -> None:
        while not self._stopped.is_set():
            self._process.wait()
            if not self._stopped.wait(RESTART_SECONDS):
                self._process = self._start()

    @property
    def process(self) -> int:
        """Return the number of the process that runs now."""
        return self._process.pid

    def kill(self) -> None:
        """Kill the program, which cannot clean up."""
        with contextlib.suppress(ProcessLookupError):
            self._process.send_signal(signal.SIGKILL)

    def stop(self) -> None:
        """End the program for good."""
        self._stopped.set()
        self.kill()
        self._thread.join()


@contextlib.contextmanager
def farm(folder: Path, workers: int) -> Iterator[tuple[str, dict[str, str], Service, list[Service]]]:
    """Start a scheduler and workers; yield the address, the variables for clients, and the services."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    address = f"tls://127.0.0.1:{port}"
    environment = os.environ | certificates(folder)
    dask = [sys.executable, "-m", "distributed.cli.dask_{}"]
    common = ["--host", "127.0.0.1", "--dashboard-address", "127.0.0.1:0"]
    scheduler = [dask[0], dask[1], dask[2].format("scheduler"), *common, "--port", str(port), "--protocol", "tls"]
    worker = [dask[0], dask[1], dask[2].format("worker"), address, *common, "--nthreads", "1", "--no-nanny"]
    worker += ["--local-directory", str(folder / "dask"), "--preload", "depthwalk.cluster.worker"]
    with contextlib.ExitStack() as stack:
        services = [Service(scheduler, environment)]
        stack.callback(services[0].stop)
        for _ in range(workers):
            services.append(Service(worker, environment))
            stack.callback(services[-1].stop)
        yield address, environment, services[0], services[1:]


@contextlib.contextmanager
def trouble(scheduler: Service, workers: list[Service], every: float, after: float) -> Iterator[list[str]]:
    """Kill a worker every so often, and the scheduler once, until the block ends; yield what was killed so far."""
    killed: list[str] = []
    ended = threading.Event()

    def work() -> None:
        began, choose = time.monotonic(), random.Random(1)
        while every and not ended.wait(every):
            choose.choice(workers).kill()
            killed.append("worker")
            if "scheduler" not in killed and time.monotonic() - began > after:
                scheduler.kill()
                killed.append("scheduler")

    thread = threading.Thread(target=work)
    thread.start()
    try:
        yield killed
    finally:
        ended.set()
        thread.join()


def run(*arguments: object, environment: dict[str, str] | None = None) -> tuple[float, float]:
    """Run a command of depthwalk; return the seconds that it took, and those of a processor here and in children."""
    before, began = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
    subprocess.run([*PROGRAM, *map(str, arguments)], env=environment, stdout=subprocess.DEVNULL, check=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return time.monotonic() - began, cpu


def listening(services: Sequence[Service]) -> str:
    """Return the addresses on which services listen, as `ss` tells them, without their ports."""
    lines = subprocess.run(["ss", "-ltnpH"], capture_output=True, text=True, check=True).stdout.splitlines()
    ours = [f"pid={service.process}," for service in services]
    hosts = {line.split()[3].rpartition(":")[0] for line in lines if any(process in line for process in ours)}
    return ", ".join(sorted(hosts))


def differences(first: Path, second: Path) -> int:
    """Return how many files two folders do not share, byte for byte."""
    names = {path.name for folder in (first, second) for path in folder.iterdir()}
    same, _, _ = filecmp.cmpfiles(first, second, names, shallow=False)
    return len(names) - len(same)


def tried(
    what: str, count: int, options: argparse.Namespace, folder: Path, command: Callable[[Path], list[object]]
) -> str:
    """Do the same work by one process and by a cluster in trouble; return a row of the table."""
    one, many = folder / f"{what}-one", folder / f"{what}-many"
    one.mkdir()
    many.mkdir()
    cache = {"XDG_CACHE_HOME": str(folder / "cache")}
    alone, _ = run(*command(one), environment=os.environ | cache)
    with farm(folder, options.workers) as (address, environment, scheduler, workers):
        time.sleep(options.settle)
        with trouble(scheduler, workers, options.kill_every, alone / 2) as killed:
            took, _ = run(*command(many), "--cluster", address, environment=environment | cache)
        hosts = listening([scheduler, *workers])
    losses = killed.count("worker") + options.workers * killed.count("scheduler")
    return (
        f"| {what} | {count} | {alone:.0f} s | {took:.0f} s | {killed.count('worker')} and "
        f"{killed.count('scheduler')} | {100 * losses / count:.1f} % | {differences(one, many)} | {hosts} |"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--models", type=int, default=200)
    parser.add_argument("--frames", type=int, default=1000)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--kill-every", type=float, default=5.0, metavar="SECONDS", help="0 kills nothing")
    parser.add_argument("--settle", type=float, default=8.0, metavar="SECONDS", help="for the workers to start")
    options = parser.parse_args()
    columns = "what", "how many", "one process", "cluster", "workers and schedulers killed", "redone at most"
    print("|", " | ".join([*columns, "files that differ", "listens on"]), "|")
    print("|---" * (len(columns) + 2) + "|", flush=True)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "models").mkdir()
        models = write_models(folder / "models", options.models)
        bake = ["bake", *models, "--dpci-resolution", "32", "--layers", "1"]
        if models:
            print(tried("bake", len(models), options, folder, lambda out: [*bake, "-o", out]), flush=True)
        walk = folder / "walk.yaml"
        write_path(walk, max(options.frames, 2))
        render = ["render", scene_root() / "room.yaml", "--path", walk, *SMALL]
        if options.frames:
            row = tried("render", options.frames, options, folder, lambda out: [*render, "-o", out / "f{frame:5}.png"])
            print(row, flush=True)


if __name__ == "__main__":
    main()
