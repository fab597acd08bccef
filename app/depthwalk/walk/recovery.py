"""Recover from failures of the GPU, unless they keep recurring."""

import logging
import time
from collections import deque
from collections.abc import Callable

from depthwalk.gpu.failures import GPU_FAILURES

log = logging.getLogger(__name__)

_MOST_FAILURES, _FAILURE_SECONDS = 3, 10.0  # this many failures of the GPU within this time are too many


class GpuRecovery:
    """Recreate everything on the GPU after a failure, up to a number of failures.

    Parameters
    ----------
    restart
        Frees everything on the GPU and recreates it; it may fail as well.
    """

    def __init__(self, restart: Callable[[], None]) -> None:
        self._restart = restart
        self._failures: deque[float] = deque(maxlen=_MOST_FAILURES)  # times at which they happened

    def forget(self) -> None:
        """Restart the count: the next failure is unrelated to earlier ones."""
        self._failures.clear()

    def recover(self, error: Exception) -> Exception:
        """Restart until that succeeds.

        Parameters
        ----------
        error
            The exception, one of `GPU_FAILURES`; raised again after too many failures within a few seconds.

        Returns
        -------
        Exception
            The last failure before success.
        """
        while True:
            now = time.perf_counter()
            if len(self._failures) == _MOST_FAILURES and now - self._failures[0] < _FAILURE_SECONDS:
                raise error
            self._failures.append(now)
            log.warning("%s; recreating everything on the GPU", error)
            try:
                self._restart()
            except GPU_FAILURES as again:
                error = again
            else:
                return error
