"""Hold the library of the scene that a walk shows, and what is made ready of it beside the frames."""

from depthwalk.assets.background import BackgroundLibrary
from depthwalk.assets.library import SceneLibrary
from depthwalk.assets.progress import Progress
from depthwalk.render import kernels


class BesideFrames:
    """Own the library of the scene that is shown, which may read, bake and cook beside the frames.

    Parameters
    ----------
    library
        The library of the first scene; `close` ends what it does, too.

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

    @property
    def _background(self) -> BackgroundLibrary | None:
        """The library, where it makes assets ready beside the frames."""
        return self.library if isinstance(self.library, BackgroundLibrary) else None

    @property
    def progress(self) -> Progress | None:
        """How far assets are baked and cooked beside the frames; None where none is."""
        return None if self._background is None else self._background.progress

    @property
    def failures(self) -> list[str]:
        """Complaints about what could not be made ready, oldest first; the caller may clear the list."""
        return [] if self._background is None else self._background.failures

    def begin_what_waited(self) -> None:
        """Begin what would have held up the first picture, which is there."""
        if self._background is not None:
            self._background.baking_waits = False
        if not self.loads_kernels:
            self.loads_kernels = True
            kernels.load_behind()

    def stop_baking(self) -> str:
        """Stop what is baked now, and return what the user is told."""
        if self._background is None or self._background.progress is None:
            return "Nothing is baked now"
        self._background.cancel()
        return "Stopped; what has no depth images yet stays a mesh. R begins again"

    def replace(self, library: SceneLibrary) -> None:
        """Let `library` take the place of the present one, whose work ends."""
        self.close()
        self.library = library

    def close(self) -> None:
        """End what the library does beside the frames."""
        if self._background is not None:
            self._background.close()
