"""Notice that a file of the scene has been saved, so that the window reloads it (`depthwalk view --watch`)."""

import queue
import threading
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from depthwalk.scene.scene import Scene

_SECONDS = 0.4  # between two looks
FileState = tuple[int, int] | None
"""Time of the last change, nanoseconds since 1970, and size of a file, bytes; None for one that cannot be looked at."""


@dataclass(frozen=True)
class OwnChange:
    """Describe a change that the program itself has made to a file, with the file's states before and after."""

    file: Path
    before: FileState
    after: FileState


class FileWatch:
    """Look at files from time to time.

    A change counts once the files have stayed the same from one look to the next: programs need a while to write a
    large mesh, and half of it cannot be read.
    """

    def __init__(self, files: Iterable[Path], since: int | None = None) -> None:
        """Begin to watch files as they are now.

        Parameters
        ----------
        files
            The files; one that does not exist may come into being.
        since
            When the scene began to be read, nanoseconds since 1970: what was saved from then until now is news. None:
            they have just been read.
        """
        self._files = tuple(files)
        self._last = self._states()
        now = time.time_ns()  # a file from the future, of a clock that is wrong, would be news for ever
        self._known = tuple(
            None if state and since is not None and since < state[0] <= now else state for state in self._last
        )
        self._due = 0.0

    def has_news(self, now: float) -> bool:
        """Return whether the files are other ones than when this was last true; `now` is a time, seconds."""
        if now < self._due:
            return False
        self._due = now + _SECONDS
        before, self._last = self._last, self._states()
        if self._last == self._known or self._last != before:
            return False
        self._known = self._last
        return True

    def accept(self, change: OwnChange) -> None:
        """Count a change of the program's own as known, unless the file had been changed by others before it."""
        own = change.file.resolve()
        self._known = tuple(
            change.after if known == change.before and file.resolve() == own else known
            for file, known in zip(self._files, self._known, strict=True)
        )

    def _states(self) -> tuple[FileState, ...]:
        return tuple(map(state_of, self._files))


class WatchThread:
    """Watch files in a thread, as disks may be slow.

    Parameters
    ----------
    files
        Finds the files, called in the thread: the scene's meshes are read for the textures that they name.
    since
        As of `FileWatch`.
    """

    def __init__(self, files: Callable[[], Iterable[Path]], since: int | None = None) -> None:
        self._ended, self._news = threading.Event(), threading.Event()
        self._own: queue.SimpleQueue[OwnChange] = queue.SimpleQueue()
        threading.Thread(target=self._run, args=(files, since), name="watch", daemon=True).start()

    def take_news(self) -> bool:
        """Return whether files have changed since this was last true."""
        if not self._news.is_set():
            return False
        self._news.clear()
        return True

    def accept(self, change: OwnChange) -> None:
        """Count a change of the program's own as known; call this as soon as it is made."""
        self._own.put(change)

    def end(self) -> None:
        """Stop watching."""
        self._ended.set()

    def _run(self, files: Callable[[], Iterable[Path]], since: int | None) -> None:
        watch = FileWatch(files(), since)
        while not self._ended.wait(_SECONDS):
            while not self._own.empty():
                watch.accept(self._own.get())
            if watch.has_news(time.monotonic()):
                self._news.set()


class SceneWatch:
    """Watch the files of the scene that a window shows, one scene after the other.

    Parameters
    ----------
    files
        Returns the files of a scene; None watches nothing.
    """

    def __init__(self, files: Callable[[Scene], Iterable[Path]] | None) -> None:
        self._files = files
        self._thread: WatchThread | None = None
        self.begin_reading()

    def begin_reading(self) -> None:
        """Note that a scene begins to be read now: changes since then count."""
        self._read_at = time.time_ns()

    def watch(self, scene: Scene) -> None:
        """Watch the files of `scene`, and no others."""
        self.end()
        if self._files is not None:
            self._thread = WatchThread(partial(self._files, scene), self._read_at)

    def take_news(self) -> bool:
        """Return whether files have changed since this was last true."""
        return self._thread is not None and self._thread.take_news()

    def accept(self, change: OwnChange) -> None:
        """Count a change of the program's own as known; call this as soon as it is made."""
        if self._thread is not None:
            self._thread.accept(change)

    def end(self) -> None:
        """Stop watching."""
        if self._thread is not None:
            self._thread.end()


def state_of(file: Path) -> FileState:
    """Return the state of a file, by which a change is noticed."""
    try:
        found = file.stat()
    except OSError:
        return None
    return found.st_mtime_ns, found.st_size
