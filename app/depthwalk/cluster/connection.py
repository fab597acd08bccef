"""Connect to a Dask cluster, or start one on this machine; submit tasks in the style of `concurrent.futures`."""

import logging
import secrets
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import ExitStack, contextmanager, suppress
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import depthwalk
from depthwalk.cluster.address import ClusterAddress
from depthwalk.cluster.nanny import preload, worker_config
from depthwalk.cluster.worker import call, close
from depthwalk.errors import InputError
from depthwalk.extras import install_command
from depthwalk.files import remove_unfinished
from depthwalk.parallel import default_workers, usable_cores

if TYPE_CHECKING:
    from distributed import Client, Security

log = logging.getLogger(__name__)

LOOPBACK = "127.0.0.1"
PATIENCE = 300.0  # seconds within which a lost scheduler may come back
_CONNECT_SECONDS = 10.0
_CLOSE_SECONDS = 5.0
_WORKERS_SECONDS = 5.0  # between checks of the number of workers
_PER_THREAD = 3  # tasks submitted for each thread of the workers: one in progress, the others waiting there

_CERTIFICATES = ("ca-file", "client.cert", "client.key")  # below distributed.comm.tls


class ClusterError(RuntimeError):
    """Report that a cluster cannot be reached or was lost; results are on the disk, and the same command continues."""


class Cluster:
    """Submit tasks to the workers of a cluster.

    `open_cluster` creates one and closes it.

    Attributes
    ----------
    name
        The address of the scheduler.
    dashboard
        Address of Dask's dashboard, which shows in a browser what the workers do; "" if there is none.
    run
        Identifies this use of the cluster, eight hex digits; see `files.remove_unfinished`.
    folders
        Folders in which tasks write files: unfinished files of lost workers are removed there at the end.
    threads_per_task
        Number of threads that a task should use; None: the worker decides.
    """

    def __init__(self, connect: Callable[[], "Client"], threads_per_task: int | None) -> None:
        """Connect. connect: creates a client, or raises OSError; threads_per_task: see the class."""
        self._connect, self.threads_per_task = connect, threads_per_task
        self.run = secrets.token_hex(4)
        self.folders: set[Path] = set()
        self._workers, self._threads, self._asked = 0, 0, -_WORKERS_SECONDS
        self._begin(connect())

    def _begin(self, client: "Client") -> None:
        self._client, self._comm = client, client.scheduler_comm
        self._executor: Any = client.get_executor(pure=False)
        self.name = str(client.scheduler.address) if client.scheduler else ""
        self.dashboard = client.dashboard_link if find_spec("bokeh") else ""

    def submit(self, key: str, function: Callable[..., object], *arguments: object) -> "Future[object]":
        """Have a worker call a function.

        Parameters
        ----------
        key
            Identifies the task: one with the same key whose future is still held is not done twice.
        function, arguments
            The function and its arguments, which are pickled.

        Returns
        -------
        Future
            The outcome; cancelled if the scheduler was lost.

        Raises
        ------
        ClusterError
            If the connection is closed.
        """
        from distributed.client import ClosedClientError

        try:
            future: Future[object] = self._executor.submit(
                call, depthwalk.__version__, self.run, function, *arguments, key=key
            )
        except ClosedClientError as error:
            raise ClusterError(f"{self.name}: the connection is closed") from error
        return future

    def workers(self) -> int:
        """Return the number of workers, as of a few seconds ago."""
        self._count()
        return self._workers

    def room(self) -> int:
        """Return how many tasks the workers should have at a time, including those in progress.

        More would fill the scheduler's memory without speeding anything up.
        """
        self._count()
        return max(_PER_THREAD * self._threads, 1)

    def is_connected(self) -> bool:
        """Return whether the connection is still the one through which tasks were submitted; see `reconnect`."""
        return self._client.scheduler_comm is self._comm

    def _count(self) -> None:
        if time.monotonic() - self._asked < (_WORKERS_SECONDS if self._workers else 0.2):
            return
        with suppress(Exception):  # a lost scheduler is noticed through its tasks
            scheduler: Any = self._client.scheduler
            threads = self._client.sync(scheduler.ncores, callback_timeout=_CONNECT_SECONDS)
            self._workers, self._threads = len(threads), sum(threads.values())
        self._asked = time.monotonic()

    def reconnect(self, check_interrupt: Callable[[], None]) -> None:
        """Wait for a lost scheduler, and connect to it again.

        Parameters
        ----------
        check_interrupt
            Called while waiting; it may raise to end it.

        Raises
        ------
        ClusterError
            If the scheduler has not come back after `PATIENCE` seconds.
        """
        log.warning("%s: the scheduler is lost; waiting for it", self.name)
        with suppress(Exception):
            self._client.close(timeout=1)
        last, pause = time.monotonic() + PATIENCE, 0.5
        while True:
            try:
                self._begin(self._connect())
                break
            except OSError as error:
                if time.monotonic() > last:
                    raise ClusterError(f"{self.name}: the scheduler was lost and has not come back") from error
            until = time.monotonic() + pause
            while time.monotonic() < until:
                check_interrupt()
                time.sleep(0.1)
            pause = min(2 * pause, 15.0)
        self._workers, self._asked = 0, -_WORKERS_SECONDS
        log.warning("%s: connected again", self.name)

    def close(self, orderly: bool) -> None:
        """Close the connection.

        Parameters
        ----------
        orderly
            Whether all tasks have ended: workers then close what they kept. Otherwise waiting tasks are cancelled;
            those in progress finish, and their files are complete.
        """
        with suppress(Exception):
            if orderly:
                self._client.sync(self._client._run, close, callback_timeout=_CLOSE_SECONDS)
            else:
                self._executor.shutdown(wait=False)
        with suppress(Exception):
            self._client.close(timeout=_CLOSE_SECONDS)


@contextmanager
def open_cluster(address: ClusterAddress) -> Iterator[Cluster]:
    """Provide a cluster for a `with` block.

    Parameters
    ----------
    address
        The address. A local cluster is started for the block: a scheduler in this process and workers in separate
        processes, all of which listen only on the loopback device, with TLS by certificates created for the purpose, so
        that other users of the machine cannot submit tasks.

    Yields
    ------
    Cluster
        The cluster, which need not have any workers yet.

    Raises
    ------
    InputError
        If the libraries are missing or no certificates are configured.
    ClusterError
        If the scheduler cannot be reached.
    """
    _check_libraries()
    with ExitStack() as stack:
        threads, count = None, 0
        if address.url is None:
            count = address.workers or usable_cores()
            threads = default_workers(count)
        try:
            cluster = Cluster(_remote(address.url) if address.url else _local(count, stack), threads)
        except OSError as error:
            raise ClusterError(f"--cluster {address.url or 'local'}: cannot be reached: {_reason(error)}") from error
        try:
            yield cluster
        except BaseException:
            cluster.close(orderly=False)
            raise
        else:
            cluster.close(orderly=True)
        finally:
            stack.close()  # no worker of this machine writes any more
            for folder in cluster.folders:
                remove_unfinished(folder, cluster.run)


def _check_libraries() -> None:
    missing = [name for name in ("dask", "distributed", "cryptography") if find_spec(name) is None]
    if missing:
        raise InputError(f"--cluster: {missing[0]} is not installed; `{install_command('cluster')}` brings it")


def _reason(error: OSError) -> str:
    """Return the innermost cause in one line, since Dask wraps the system's message several times."""
    cause: BaseException = error
    while cause.__cause__ is not None:
        cause = cause.__cause__
    return " ".join(str(cause).split())[:200] or type(cause).__name__


def _local(workers: int, stack: ExitStack) -> Callable[[], "Client"]:
    """Start a cluster on this machine, which `stack` ends; return a function that connects to it."""
    import dask
    from distributed import Client, LocalCluster, Security

    stack.enter_context(dask.config.set(worker_config()))
    preload()
    _silence()
    cluster = LocalCluster(
        n_workers=workers,
        threads_per_worker=1,
        processes=True,
        host=LOOPBACK,
        protocol="tls",
        security=Security.temporary(),
        dashboard_address=f"{LOOPBACK}:0",
        worker_dashboard_address=f"{LOOPBACK}:0",
        memory_limit=0,  # none, as in the pool: meshes differ too much
        silence_logs=logging.CRITICAL,
        preload=["depthwalk.cluster.worker"],
    )
    stack.callback(_end, cluster)
    return lambda: Client(cluster, timeout=_CONNECT_SECONDS)


def _end(cluster: Any) -> None:
    with suppress(Exception):  # a worker killed meanwhile cannot be told to end
        cluster.close(timeout=_CLOSE_SECONDS)


def _remote(url: str) -> Callable[[], "Client"]:
    from distributed import Client

    security = _security()
    _silence()
    return lambda: Client(url, security=security, timeout=_CONNECT_SECONDS, set_as_default=False)


def _security() -> "Security":
    """Return the certificates in Dask's configuration. Raises InputError if it names none."""
    import dask
    from distributed import Security

    for key in _CERTIFICATES:
        name = f"distributed.comm.tls.{key}"
        if not dask.config.get(name, None):
            variable = "DASK_" + name.upper().replace(".", "__").replace("-", "_")
            raise InputError(f"--cluster: Dask's configuration lacks {name}; set it there, or by {variable}")
    return Security(require_encryption=True)


def _silence() -> None:
    """Show Dask's own messages only with --verbose: a lost worker does not concern the user, since others continue."""
    level = logging.INFO if log.isEnabledFor(logging.DEBUG) else logging.CRITICAL
    names = ("distributed", "tornado", "asyncio")
    # Dask has set levels of some loggers below these, which hide that of the one above.
    for name in [*names, *(name for name in logging.root.manager.loggerDict if name.partition(".")[0] in names)]:
        logging.getLogger(name).setLevel(level)
