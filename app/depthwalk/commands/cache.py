"""Declare `depthwalk cache`, which shows or clears stored results that take long to compute."""

import contextlib
from datetime import datetime
from enum import StrEnum
from typing import TYPE_CHECKING, Annotated

import typer

from depthwalk import budget
from depthwalk.commands.options import CacheLimit, Quiet, Verbose
from depthwalk.commands.program import guarded
from depthwalk.errors import printable

if TYPE_CHECKING:
    from depthwalk.cache import CachedFile


class Action(StrEnum):
    """Name the actions on the cache."""

    INFO = "info"
    CLEAR = "clear"


@guarded
def main(
    action: Annotated[
        Action, typer.Argument(metavar="ACTION", help="Show what it holds (info), or remove all of it (clear).")
    ] = Action.INFO,
    cache_limit: CacheLimit = None,
    verbose: Verbose = False,
    quiet: Quiet = False,
) -> None:
    """Show what the cache of depth images holds, or clear it.

    Its contents are recreated when they are needed. With --cache-limit, `info` removes what exceeds the limit.
    """
    if action is Action.CLEAR:
        _clear()
    else:
        _show(trim=cache_limit is not None)


def _show(trim: bool) -> None:
    """Print a line for each kind of file, and one for the limit. trim: whether to remove the excess first."""
    from depthwalk.cache import cache_folder, make_room

    if trim and cache_folder().is_dir():
        make_room()
    rows = [("folder", str(cache_folder()))]
    total = 0
    for content, files in _kinds().items():
        size = sum(file.bytes for file in files)
        total += size
        last = f", last used {datetime.fromtimestamp(files[-1].used):%Y-%m-%d}" if files else ""
        rows.append((content, f"{len(files)} files, {size / 1e6:.1f} MB{last}"))
    rows.append(("in all", f"{total / 1e6:.1f} MB of {budget.cache_limit() / 1e6:.0f} MB"))
    print("\n".join(printable(f"{name:<24} {value}") for name, value in rows))


def _clear() -> None:
    """Remove all files, including those left by killed processes, and print how much that was."""
    from depthwalk.cache import cache_folder
    from depthwalk.files import remove_leftovers

    count = size = 0
    for file in (file for files in _kinds().values() for file in files):
        with contextlib.suppress(FileNotFoundError):  # another process removed it
            file.path.unlink()
            count, size = count + 1, size + file.bytes
    remove_leftovers(cache_folder())
    print(printable(f"{cache_folder()}: removed {count} files, {size / 1e6:.1f} MB"))


def _kinds() -> "dict[str, list[CachedFile]]":
    """Return the files of the cache by their kind."""
    from depthwalk.bake.cache import BAKED
    from depthwalk.bake.capture_file import CAPTURES
    from depthwalk.bake.level_file import LEVELS
    from depthwalk.cache import cached_files
    from depthwalk.commands.journal import MEASURED
    from depthwalk.cook.cluster_file import CLUSTERS
    from depthwalk.cook.cooked_file import COOKED

    kinds = {cache.content: cached_files(cache.suffix) for cache in (BAKED, LEVELS, CLUSTERS, CAPTURES, MEASURED)}
    others = {file.path for files in kinds.values() for file in files}  # their names end like those of cooked ones
    return kinds | {COOKED.content: [file for file in cached_files(COOKED.suffix) if file.path not in others]}
