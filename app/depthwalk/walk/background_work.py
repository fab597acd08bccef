"""Manage the library of the scene that the window shows, and its work in the background."""

from depthwalk.assets.background import BackgroundLibrary
from depthwalk.assets.library import SceneLibrary
from depthwalk.assets.progress import Progress
from depthwalk.render import kernels
from depthwalk.render.renderer import Renderer
from depthwalk.walk.collision.collider_store import ColliderStore
from depthwalk.walk.collision.near_objects import NearObjects
from depthwalk.walk.collision.obstacles import Obstacles


class BackgroundWork:
    """Own the library of the scene that is shown, which may read, bake and cook in the background.

    Parameters
    ----------
    library
        The library of the first scene; `close` also ends its work.

    Attributes
    ----------
    library
        The library of the scene that is shown.
    loads_kernels
        Whether the compiled loops of `render.kernels` are loaded, or being loaded.
    """

    def __init__(self, library: SceneLibrary) -> None:
        self.library = library
        self.loads_kernels = False
        self._colliders = ColliderStore(library)

    @property
    def _background(self) -> BackgroundLibrary | None:
        """The library, if it prepares assets in the background."""
        return self.library if isinstance(self.library, BackgroundLibrary) else None

    @property
    def progress(self) -> Progress | None:
        """Progress of background baking and cooking; None if there is none."""
        return None if self._background is None else self._background.progress

    @property
    def failures(self) -> list[str]:
        """Messages about assets that could not be prepared, oldest first; the caller may clear the list."""
        return [] if self._background is None else self._background.failures

    def begin_deferred(self) -> None:
        """Start the work that would have delayed the first picture, now that this is shown."""
        if self._background is not None:
            self._background.baking_waits = False
        if not self.loads_kernels:
            self.loads_kernels = True
            kernels.load_behind()

    def obstacles(self, renderer: Renderer) -> Obstacles:
        """Return what stops a viewer who walks through the scene that `renderer` draws."""
        return Obstacles(NearObjects(renderer, self._colliders), renderer.world.ground_height)

    def stop_baking(self) -> str:
        """Stop the current baking, and return a message for the user."""
        if self._background is None or self._background.progress is None:
            return "Nothing is being baked"
        self._background.cancel()
        return "Stopped baking; objects without depth images are drawn as meshes. R starts again"

    def replace(self, library: SceneLibrary) -> None:
        """Replace the present library, whose work ends, by `library`."""
        self.close()
        self.library, self._colliders = library, ColliderStore(library)

    def close(self) -> None:
        """End the library's background work, and that of its colliders."""
        self._colliders.close()
        if self._background is not None:
            self._background.close()
