"""Parse the option that names a cluster, without importing its libraries."""

import re
from dataclasses import dataclass

from depthwalk.errors import InputError
from depthwalk.limits import MAX_JOBS

DEFAULT_PORT = 8786  # where Dask's scheduler listens


@dataclass(frozen=True, kw_only=True)
class ClusterAddress:
    """Describe where tasks are done.

    Attributes
    ----------
    url
        The scheduler, `tls://HOST:PORT`; None for processes of this machine, started for one command.
    workers
        Number of processes to start on this machine; None: one per core.
    """

    url: str | None = None
    workers: int | None = None


def parse_cluster(text: str | None) -> ClusterAddress | None:
    """Parse the option --cluster.

    Parameters
    ----------
    text
        `local`, `local:N` for N processes, or `tls://HOST:PORT`; None if the option is not given.

    Returns
    -------
    ClusterAddress | None
        Where tasks are done; None for this process and its pool.

    Raises
    ------
    InputError
        If the text is none of these. Addresses without TLS are refused: anyone who can reach such a scheduler can run
        any program on its workers.
    """
    if text is None:
        return None
    if local := re.fullmatch(r"local(?::([0-9]{1,4}))?", text):
        if local[1] is not None and not 1 <= int(local[1]) <= MAX_JOBS:
            raise InputError(f"--cluster {text}: must start 1 to {MAX_JOBS} processes")
        return ClusterAddress(workers=int(local[1]) if local[1] else None)
    if remote := re.fullmatch(r"tls://([A-Za-z0-9.-]+|\[[0-9A-Fa-f:.]+\])(?::([0-9]{1,5}))?", text):
        port = int(remote[2] or DEFAULT_PORT)
        if not 1 <= port <= 65_535:
            raise InputError(f"--cluster {text}: a port is 1 to 65535")
        return ClusterAddress(url=f"tls://{remote[1]}:{port}")
    if text.startswith("tcp://"):
        raise InputError(f"--cluster {text}: is not encrypted, and anybody may use it; only tls://HOST:PORT is taken")
    raise InputError(f"--cluster {text}: must be local, local:N or tls://HOST:PORT")
