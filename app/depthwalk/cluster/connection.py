"""Connect to a Dask cluster, or start one on this machine; hand it tasks as `concurrent.futures` does."""

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
from depthwalk.files import remove_unfinished
from depthwalk.parallel import default_workers, usable_cores

if TYPE_CHECKING:
    from distributed import Client, Security

log = logging.getLogger(__name__)

LOOPBACK = "127.0.0.1"
PATIENCE = 300.0  # seconds in which a scheduler that was lost may come back
_CONNECT_SECONDS = 10.0
_CLOSE_SECONDS = 5.0
_WORKERS_SECONDS = 5.0  # between two looks at how many workers there are
_PER_THREAD = 3  # tasks handed over for each thread of the workers: one is done, the others wait beside it

_CERTIFICATES = ("ca-file", "client.cert", "client.key")  # below distributed.comm.tls


class ClusterError(RuntimeError):
    """Report that a cluster cannot be had or was lost; what is done is on the disk, and the same command goes on."""


class Cluster:
    """Hand tasks to the workers of a cluster.

    `open_cluster` makes one and closes it.

    Attributes
    ----------
    name
        The address of the scheduler.
    dashboard
        Where Dask shows in a browser what its workers do; "" where it does not.
    run
        Names this use of the cluster, eight hex digits; see `files.remove_unfinished`.
    folders
        Where tasks write files: what lost workers left there unfinished is removed in the end.
    threads_per_task
        How many threads a task should use; None: as many as its worker finds right.
    """

    def __init__(self, connect: Callable[[], "Client"], threads_per_task: int | None) -> None:
        """Connect. connect: makes a client, or raises OSError; threads_per_task: see the class."""
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
            Names the task: one of the same key whose future is held is not done twice.
        function, arguments
            What to call; all of it is pickled.

        Returns
        -------
        Future
            What came of it; cancelled where the scheduler was lost.

        Raises
        ------
        ClusterError
            Where the connection is closed.
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
        """Return how many workers there are, as of a few seconds ago."""
        self._count()
        return self._workers

    def room(self) -> int:
        """Return how many tasks the workers should have at a time, those that they are at included.

        More would fill the scheduler's memory and speed nothing up.
        """
        self._count()
        return max(_PER_THREAD * self._threads, 1)

    def is_connected(self) -> bool:
        """Return whether the connection still is the one by which tasks were handed over; see `reconnect`."""
        return self._client.scheduler_comm is self._comm

    def _count(self) -> None:
        if time.monotonic() - self._asked < (_WORKERS_SECONDS if self._workers else 0.2):
            return
        with suppress(Exception):  # a scheduler that is lost is told of by its tasks
            scheduler: Any = self._client.scheduler
            threads = self._client.sync(scheduler.ncores, callback_timeout=_CONNECT_SECONDS)
            self._workers, self._threads = len(threads), sum(threads.values())
        self._asked = time.monotonic()

    def reconnect(self, heed: Callable[[], None]) -> None:
        """Wait for a scheduler that was lost, and connect to it again.

        Parameters
        ----------
        heed
            Called while waiting; it may raise to end it.

        Raises
        ------
        ClusterError
            Where the scheduler has not come back after `PATIENCE` seconds.
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
                heed()
                time.sleep(0.1)
            pause = min(2 * pause, 15.0)
        self._workers, self._asked = 0, -_WORKERS_SECONDS
        log.warning("%s: connected again", self.name)

    def close(self, orderly: bool) -> None:
        """Close the connection.

        Parameters
        ----------
        orderly
            Whether all tasks have ended: workers then close what they kept. Else tasks that wait are given up; those
            that are being done end by themselves, and what they write is whole.
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
        Where it is. A local one is started for the block: a scheduler in this process and workers in processes of
        their own, all of which listen on the loopback device only, with TLS by certificates made for the purpose, so
        that other users of the machine cannot hand in tasks.

    Yields
    ------
    Cluster
        The cluster, which need not have a worker yet.

    Raises
    ------
    InputError
        Where the libraries are missing or no certificates are configured.
    ClusterError
        Where the scheduler cannot be reached.
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
        raise InputError(f"--cluster: {missing[0]} is not installed; pip install 'depthwalk[cluster]' brings it")


def _reason(error: OSError) -> str:
    """Return the innermost cause in one line: Dask wraps what the system says several times."""
    cause: BaseException = error
    while cause.__cause__ is not None:
        cause = cause.__cause__
    return " ".join(str(cause).split())[:200] or type(cause).__name__


def _local(workers: int, stack: ExitStack) -> Callable[[], "Client"]:
    """Start a cluster on this machine, which `stack` ends; return what connects to it."""
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
        memory_limit=0,  # a mesh takes what it takes, as in the pool
        silence_logs=logging.CRITICAL,
        preload=["depthwalk.cluster.worker"],
    )
    stack.callback(_end, cluster)
    return lambda: Client(cluster, timeout=_CONNECT_SECONDS)


def _end(cluster: Any) -> None:
    with suppress(Exception):  # a worker that was killed meanwhile cannot be told to end
        cluster.close(timeout=_CLOSE_SECONDS)


def _remote(url: str) -> Callable[[], "Client"]:
    from distributed import Client

    security = _security()
    _silence()
    return lambda: Client(url, security=security, timeout=_CONNECT_SECONDS, set_as_default=False)


def _security() -> "Security":
    """Return the certificates that Dask's configuration names. Raises InputError where it names none."""
    import dask
    from distributed import Security

    for key in _CERTIFICATES:
        name = f"distributed.comm.tls.{key}"
        if not dask.config.get(name, None):
            variable = "DASK_" + name.upper().replace(".", "__").replace("-", "_")
            raise InputError(f"--cluster: Dask's configuration lacks {name}; set it there, or by {variable}")
    return Security(require_encryption=True)


def _silence() -> None:
    """Keep Dask's own messages for --verbose: a lost worker is none of the user's business, since others go on."""
    level = logging.INFO if log.isEnabledFor(logging.DEBUG) else logging.CRITICAL
    ours = ("distributed", "tornado", "asyncio")
    # Dask has set levels of some loggers below these, which hide that of the one above.
    for name in [*ours, *(name for name in logging.root.manager.loggerDict if name.partition(".")[0] in ours)]:
        logging.getLogger(name).setLevel(level)
