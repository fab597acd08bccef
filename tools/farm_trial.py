"""Test a cluster that loses its workers: it must produce the same files as one process, however many are killed.

    python -m tools.farm_trial --models 200 --frames 1000 --workers 2 --kill-every 5

starts a scheduler and workers on the loopback device, with TLS, and does the same work in one process, on the cluster,
and on the cluster while a worker is killed every few seconds, and the scheduler once. Killed workers are restarted by
their nanny, and other services that end as a service manager would do. Prints a table in Markdown.

If other work keeps the machine busy, `--busy` counts seconds by the processor time that the cluster has used, divided
by the number of its workers: about what a clock shows if every worker has a core.
"""

import argparse
import contextlib
import filecmp
import os
import random
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import psutil

from depthwalk.resources import scene_root

PROGRAM = [sys.executable, "-c", "from depthwalk.commands.cli import main; main()"]
SMALL = ["--resolution", "128,96"]
SEGMENTS, RINGS = 24, 12  # of a model
RESTART_SECONDS = 0.5  # before a service that ended is started again


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
    """Write a walk through the room with this many frames."""
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
    return variables | {f"{prefix}REQUIRE_ENCRYPTION": "true"}


class Service:
    """Run a program, and restart it whenever it ends, as a service manager does."""

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

    def processes(self) -> "list[psutil.Process]":
        """Return the process that runs now, and all its descendants."""
        with contextlib.suppress(psutil.NoSuchProcess):
            process = psutil.Process(self._process.pid)
            return [process, *process.children(recursive=True)]
        return []

    def workers(self) -> "list[psutil.Process]":
        """Return the processes that a nanny's fork server has forked."""
        with contextlib.suppress(psutil.NoSuchProcess):
            return [worker for own in psutil.Process(self._process.pid).children() for worker in own.children()]
        return []

    def kill(self) -> None:
        """Kill the program, which cannot clean up."""
        with contextlib.suppress(ProcessLookupError):
            self._process.send_signal(signal.SIGKILL)

    def stop(self) -> None:
        """End the program for good."""
        self._stopped.set()
        self.kill()
        self._thread.join()


@dataclass
class Farm:
    """Hold a scheduler and workers.

    Attributes
    ----------
    address
        The scheduler's.
    environment
        The variables for clients.
    scheduler, nanny
        The services; the nanny keeps all workers.
    count
        Number of workers.
    """

    address: str
    environment: dict[str, str]
    scheduler: Service
    nanny: Service
    count: int
    _gone: float = 0.0
    _last: float = 0.0

    def cpu(self) -> float:
        """Return the processor seconds used by all; call it often, since those of ended processes are lost."""
        now = 0.0
        for process in [*self.scheduler.processes(), *self.nanny.processes()]:
            with contextlib.suppress(psutil.NoSuchProcess):
                times = process.cpu_times()
                now += times.user + times.system + times.children_user + times.children_system
        if now < self._last:  # a service has ended
            self._gone += self._last - now
        self._last = now
        return self._gone + now


@contextlib.contextmanager
def farm(folder: Path, workers: int) -> Iterator[Farm]:
    """Start a scheduler and workers for a `with` block."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    address = f"tls://127.0.0.1:{port}"
    environment = os.environ | certificates(folder) | cache(folder)  # no run reads the user's cache
    dask = [sys.executable, "-m", "distributed.cli.dask_{}"]
    common = ["--host", "127.0.0.1", "--dashboard-address", "127.0.0.1:0"]
    scheduler = [dask[0], dask[1], dask[2].format("scheduler"), *common, "--port", str(port), "--protocol", "tls"]
    nanny = [dask[0], dask[1], dask[2].format("worker"), address, *common, "--nthreads", "1"]
    nanny += ["--nworkers", str(workers), "--local-directory", str(folder / "dask"), "--memory-limit", "0"]
    nanny += ["--preload", "depthwalk.cluster.worker", "--preload-nanny", "depthwalk.cluster.nanny"]
    with contextlib.ExitStack() as stack:
        services = []
        for command in (scheduler, nanny):
            services.append(Service(command, environment))
            stack.callback(services[-1].stop)
        yield Farm(address, environment, services[0], services[1], workers)


@contextlib.contextmanager
def trouble(farm: Farm, every: float, after: float, busy: bool) -> Iterator[list[str]]:
    """Kill a worker at intervals, and the scheduler once, until the block ends; yield what has been killed so far.

    `every` and `after` are seconds, of the workers' processors if `busy` is set; 0 kills nothing.
    """
    killed: list[str] = []
    ended = threading.Event()

    def clock() -> float:
        used = farm.cpu()
        return used / farm.count if busy else time.monotonic()

    def work() -> None:
        choose, began, last = random.Random(1), clock(), clock()
        while not ended.wait(0.1):
            now = clock()
            if not every or now - last < every or not (workers := farm.nanny.workers()):
                continue
            with contextlib.suppress(psutil.NoSuchProcess):
                choose.choice(workers).kill()
                killed.append("worker")
            if "scheduler" not in killed and now - began > after:
                farm.scheduler.kill()
                killed.append("scheduler")
            last += every

    thread = threading.Thread(target=work)
    thread.start()
    try:
        yield killed
    finally:
        ended.set()
        thread.join()


def run(*arguments: object, environment: dict[str, str] | None = None) -> tuple[float, float]:
    """Run a command of depthwalk; return the seconds that it took, and those of a processor, its children's too.

    The system is asked about this one process: a scheduler that is killed meanwhile is a child of the trial, too, and
    `Farm.cpu` has counted it already.
    """
    began = time.monotonic()
    process = subprocess.Popen([*PROGRAM, *map(str, arguments)], env=environment, stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise subprocess.CalledProcessError(process.returncode, process.args)
    return time.monotonic() - began, usage.ru_utime + usage.ru_stime


def listening(farm: Farm) -> str:
    """Return the addresses on which services listen, according to the system, without their ports."""
    hosts = set()
    for process in [*farm.scheduler.processes(), *farm.nanny.processes()]:
        with contextlib.suppress(psutil.NoSuchProcess):
            sockets = process.net_connections("inet")
            hosts |= {socket.laddr.ip for socket in sockets if socket.status == psutil.CONN_LISTEN}
    return ", ".join(sorted(hosts))


def differences(first: Path, second: Path) -> int:
    """Return in how many files two folders differ, byte for byte."""
    names = {path.name for folder in (first, second) for path in folder.iterdir()}
    same, _, _ = filecmp.cmpfiles(first, second, names, shallow=False)
    return len(names) - len(same)


def on_farm(
    options: argparse.Namespace, folder: Path, after: float, kills: bool, command: Sequence[object]
) -> tuple[float, float, list[str], str]:
    """Run a command on a new cluster; return its seconds, those of a processor, what was killed, and who listens."""
    every = options.kill_every if kills else 0.0
    with farm(folder, options.workers) as cluster:
        while len(cluster.nanny.workers()) < options.workers:
            time.sleep(0.1)
        time.sleep(options.settle)
        before = cluster.cpu()
        with trouble(cluster, every, after, options.busy) as killed:
            took, own = run(*command, "--cluster", cluster.address, environment=cluster.environment | cache(folder))
        return took, own + cluster.cpu() - before, killed, listening(cluster)


def cache(folder: Path) -> dict[str, str]:
    """Return the variables by which all runs share a separate cache."""
    return {"XDG_CACHE_HOME": str(folder / "cache")}


def tried(
    what: str, count: int, options: argparse.Namespace, folder: Path, command: Callable[[Path], list[object]]
) -> str:
    """Do the same work by one process, by a cluster, and by one in trouble; return a row of the table."""
    places = [folder / f"{what}-{name}" for name in ("one", "whole", "killed")]
    for place in places:
        place.mkdir()
    alone = run(*command(places[0]), environment=os.environ | cache(folder))
    print(f"{what}, one process: {alone[0]:.0f} s, processor {alone[1]:.0f} s", file=sys.stderr, flush=True)
    whole = on_farm(options, folder, 0.0, False, command(places[1]))
    print(f"{what}, cluster: {whole[0]:.0f} s, processor {whole[1]:.0f} s", file=sys.stderr, flush=True)
    half = (whole[1] / options.workers if options.busy else whole[0]) / 2
    took, cpu, killed, hosts = on_farm(options, folder, half, True, command(places[2]))
    losses = killed.count("worker") + options.workers * killed.count("scheduler")
    differ = max(differences(places[0], place) for place in places[1:])
    return (
        f"| {what} | {count} | {alone[0]:.0f} ({alone[1]:.0f}) | {whole[0]:.0f} ({whole[1]:.0f}) | "
        f"{took:.0f} ({cpu:.0f}) | {killed.count('worker')}, {killed.count('scheduler')} | "
        f"{100 * losses / count:.1f} % | {100 * (took / whole[0] - 1):.1f} % ({100 * (cpu / whole[1] - 1):.1f} %) | "
        f"{differ} | {hosts} |"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--models", type=int, default=200)
    parser.add_argument("--frames", type=int, default=1000)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--kill-every", type=float, default=5.0, metavar="SECONDS", help="0 kills nothing")
    parser.add_argument("--busy", action="store_true", help="count seconds by the processor time of the workers")
    parser.add_argument("--settle", type=float, default=2.0, metavar="SECONDS", help="before the first task")
    options = parser.parse_args()
    columns = ["what", "how many", "one process", "cluster", "with kills", "killed: workers, schedulers"]
    columns += ["redone at most", "slower", "files that differ", "listens on"]
    print("|", " | ".join(columns), "|")
    print("|---" * len(columns) + "|", flush=True)
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
