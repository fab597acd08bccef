"""Make the colliders of assets in the background, when they are first asked for."""

import logging
from concurrent.futures import Future, ThreadPoolExecutor

from depthwalk.assets.library import SceneLibrary
from depthwalk.cook.cook import CookedObject, CookOptions
from depthwalk.errors import InputError
from depthwalk.walk.collision.collider import Collider

log = logging.getLogger(__name__)

_MOST_BYTES = 64e6  # of colliders in memory
Surface = tuple[int, int | None]  # number of an asset, and of a part of its depth images; None: its mesh


class ColliderStore:
    """Hold the colliders of a scene's assets.

    Parameters
    ----------
    library
        Provides the assets. What it has read in advance stays there, for who draws it.

    Attributes
    ----------
    arrived
        How many colliders have been made.
    """

    def __init__(self, library: SceneLibrary) -> None:
        self.arrived = 0
        self._library = library
        self._thread: ThreadPoolExecutor | None = None
        self._making: dict[Surface, Future[Collider | None]] = {}
        self._made: dict[Surface, Collider | None] = {}  # the least recently used first

    @property
    def is_busy(self) -> bool:
        """Return whether any collider that was asked for is still being made."""
        return bool(self._making)

    @property
    def nbytes(self) -> int:
        """Return how many bytes the colliders take."""
        return sum(made.nbytes for made in self._made.values() if made is not None)

    def poll(self) -> None:
        """Take over what the thread has made."""
        for surface in [surface for surface, future in self._making.items() if future.done()]:
            self._made[surface] = self._making.pop(surface).result()
            self.arrived += 1
            while self.nbytes > _MOST_BYTES and len(self._made) > 1:
                self._made.pop(next(iter(self._made)))

    def collider(self, surface: Surface, options: CookOptions, scale: float) -> Collider | None:
        """Return a collider; None while it is being made, and if that is impossible.

        Parameters
        ----------
        surface
            What it is made of.
        options
            How depth images are cooked.
        scale
            Size of the object that shows it, relative to the asset.
        """
        if surface in self._made:
            made = self._made.pop(surface)
            self._made[surface] = made
            return made
        if surface not in self._making:
            if self._thread is None:
                self._thread = ThreadPoolExecutor(1, "colliders")
            self._making[surface] = self._thread.submit(self._make, surface, options, scale)
        return None

    def close(self) -> None:
        """Stop making colliders, and forget all."""
        if self._thread is not None:
            self._thread.shutdown(wait=False, cancel_futures=True)
        self._thread = None
        self._making.clear()
        self._made.clear()

    def _make(self, surface: Surface, options: CookOptions, scale: float) -> Collider | None:
        """Read what a collider is made of, and make it; None where that fails, which whoever draws it reports."""
        from depthwalk.walk.collision.collider_builder import from_images, from_mesh  # here: no first picture needs it

        asset, part = surface
        try:
            if part is not None:
                return from_images(_stored(self._library, asset, part, options).load()[0], scale)
            mesh = self._library.mesh(asset)
            return None if mesh is None else from_mesh(mesh, scale)
        except (InputError, OSError, LookupError) as error:
            log.info("asset %d stops nobody: %s", asset, error)
            return None


def _stored(library: SceneLibrary, asset: int, part: int, options: CookOptions) -> CookedObject:
    """Return a part of an asset as it is stored, apart from what was read in advance; otherwise as it is in memory."""
    objects = library.stored(asset, options) or library.cooked(asset, options)
    return objects[min(part, len(objects) - 1)]
