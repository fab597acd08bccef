"""Finding the files that a scene names, inside the folders it may read."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath, PureWindowsPath

from depthwalk.errors import InputError
from depthwalk.resources import asset_root
from depthwalk.scene.document import Loc
from depthwalk.scene.validate import Source


@dataclass
class FileFinder:
    """Looks names up in the scene's folder, in the asset roots, and among the program's own assets.

    Collects complaints instead of raising them.
    """

    source: Source
    roots: tuple[Path, ...]  # absolute, symbolic links resolved
    errors: list[InputError] = field(default_factory=list)

    def find(self, loc: Loc, name: Path) -> Path:
        """The absolute path of the file that the scene names at `loc`; any path where it is none (see `errors`)."""
        if PurePosixPath(name).is_absolute() or PureWindowsPath(name).anchor:
            return self._complain(loc, name, "is absolute; paths are relative to the scene file")
        try:
            return self._find(loc, name)
        except (OSError, ValueError, RuntimeError):  # a name too long, a null character, a loop of links
            return self._complain(loc, name, "is not a usable path")

    def find_optional(self, loc: Loc, name: Path | None) -> Path | None:
        return None if name is None else self.find(loc, name)

    def _find(self, loc: Loc, name: Path) -> Path:
        candidates = [(root / name).resolve() for root in self.roots]
        inside = [path for path in candidates if any(path.is_relative_to(root) for root in self.roots)]
        shipped = (asset_root() / name).resolve()
        for path in [*inside, shipped] if shipped.is_relative_to(asset_root()) else inside:
            if path.is_file():
                return path
        if not inside:
            return self._complain(loc, name, "leaves the scene's folder and every asset root")
        is_folder = any(path.is_dir() for path in inside)
        return self._complain(loc, name, "is a folder, not a file" if is_folder else "not found")

    def _complain(self, loc: Loc, name: Path, problem: str) -> Path:
        self.errors.append(self.source.error(loc, f"file {str(name)!r} {problem}"))
        return name


def make_finder(scene: Path, asset_roots: Sequence[Path | str], source: Source) -> FileFinder:
    """A finder for the files of `scene`. Raises InputError for an asset root that is no folder."""
    for root in asset_roots:
        if not Path(root).is_dir():
            raise InputError(f"--asset-root {root}: no such folder")
    return FileFinder(source, tuple(Path(root).resolve() for root in (scene.parent, *asset_roots)))
