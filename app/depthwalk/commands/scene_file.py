"""Identify a scene and its options so that a worker of a cluster can open it, too."""

from dataclasses import dataclass, replace
from pathlib import Path

from depthwalk.commands.option_values import open_scene
from depthwalk.scene.scene import Scene


@dataclass(frozen=True, kw_only=True)
class SceneFile:
    """Describe which scene to open, by names that mean the same on every worker.

    Attributes
    ----------
    path
        The file.
    asset_roots
        Folders, besides the scene's own, in which to look for its files.
    settings
        The --set options.
    """

    path: Path
    asset_roots: tuple[Path, ...] = ()
    settings: tuple[str, ...] = ()

    def absolute(self) -> "SceneFile":
        """Return the same with absolute names."""
        roots = tuple(root.absolute() for root in self.asset_roots)
        return replace(self, path=self.path.absolute(), asset_roots=roots)

    def open(self) -> Scene:
        """Read the scene. Raises InputError if it cannot be used."""
        return open_scene(self.path, self.asset_roots, self.settings)
