"""Let a nanny outlive its scheduler, so that it need not be started again with all that it has imported."""

from distributed import Worker
from distributed.comm.core import Comm


class LastingWorker(Worker):
    """A worker that ends where the scheduler is lost, as any, but does not take its nanny along.

    The nanny starts another one, which waits until a scheduler is there again. A scheduler that ends in good order
    tells workers so, and they their nannies; only a connection that breaks is another matter.
    """

    async def handle_scheduler(self, comm: Comm) -> None:
        """Do what the scheduler asks for until `comm`, the connection to it, breaks; then end."""
        try:
            await self.handle_stream(comm)
        finally:
            await self.close(nanny=False, reason="the scheduler is lost")
