"""Let a nanny outlive its scheduler, so that everything it has imported need not be imported again."""

from distributed import Worker
from distributed.comm.core import Comm


class LastingWorker(Worker):
    """A worker that ends when the scheduler is lost, like any other, but without ending its nanny.

    The nanny starts another one, which waits until a scheduler is available again. A scheduler that shuts down properly
    tells its workers, and they their nannies; only a broken connection is treated differently.
    """

    async def handle_scheduler(self, comm: Comm) -> None:
        """Do what the scheduler asks for until `comm`, the connection to it, breaks; then end."""
        try:
            await self.handle_stream(comm)
        finally:
            await self.close(nanny=False, reason="the scheduler is lost")
