"""Find the files that a mesh names, and read each of them once.

A mesh names other files: material libraries, textures, buffers. Their bytes determine its appearance, so the key of its
bake is a hash over all of them; and they may only lie in the mesh's own folder.
"""

import hashlib
import logging
import re
from collections.abc import Iterable
from pathlib import Path
from urllib.parse import unquote

from depthwalk.errors import InputError, missing_file, quoted
from depthwalk.ingest.formats import USD_SUFFIXES
from depthwalk.limits import MAX_LOOKUPS, MAX_MESH_BYTES

log = logging.getLogger(__name__)


class Sources:
    """Keep the bytes of a mesh's files, so that all readers of a file get the same ones.

    A mesh and the hash by which its bake is found must come from the same bytes. If a file were replaced between two
    reads, the depth images of one mesh would be stored under the key of another for good. Keeping the bytes costs
    little: those of the mesh are needed while it is parsed, and textures are kept compressed. Drop the object as soon
    as the mesh is parsed.
    """

    def __init__(self) -> None:
        """Begin without any files."""
        self._data: dict[Path, bytes] = {}
        self._found: dict[tuple[Path, Path], bool] = {}

    def read(self, path: Path) -> bytes:
        """Return the contents of the file `path`, as they were when it was first read.

        Those of a USD file are a GLB file that shows the same, so that whatever reads glTF reads USD.

        Raises InputError as `read_bytes` does, and `usd.translation.translated`.
        """
        if path not in self._data:
            self._data[path] = _translated(path) if path.suffix.lower() in USD_SUFFIXES else read_bytes(path)
        return self._data[path]

    def is_inside(self, path: Path, root: Path) -> bool:
        """Return whether a file exists and lies inside a folder.

        Parameters
        ----------
        path
            The file.
        root
            The folder, in which the file may lie at any depth; a path without symbolic links.

        Returns
        -------
        bool
            True if it does, after following symbolic links; the first answer is kept.

        Raises
        ------
        InputError
            If too many other files were looked up before.
        """
        if (path, root) not in self._found:
            if len(self._found) == MAX_LOOKUPS:
                raise InputError(f"{path}: a mesh names too many files: {MAX_LOOKUPS} were looked for before this one")
            try:
                self._found[path, root] = path.is_file() and path.resolve().is_relative_to(root)
            except (OSError, ValueError):  # the name is too long, or has a zero byte
                self._found[path, root] = False
        return self._found[path, root]


def _translated(path: Path) -> bytes:
    """Return a USD file as a GLB file."""
    if not path.is_file():
        raise missing_file(path)
    from depthwalk.ingest.usd.translation import translated

    return translated(path)


def hash_files(files: Iterable[Path], sources: Sources) -> str:
    """Return a hash, SHA-256 in hex, of the contents (not the names or dates) of `files`, read through `sources`.

    Raises InputError if a file cannot be read.
    """
    whole = hashlib.sha256()
    for file in files:
        whole.update(hashlib.sha256(sources.read(file)).digest())  # digests have equal lengths: no ambiguous joins
    return whole.hexdigest()


def read_bytes(path: Path) -> bytes:
    """Return the contents of the file `path`.

    Raises InputError if it is missing, unreadable or larger than the limit.
    """
    try:
        if not path.is_file():
            raise missing_file(path)
        if (length := path.stat().st_size) > MAX_MESH_BYTES:
            raise InputError(f"{path}: too large: {length} bytes, the limit is {MAX_MESH_BYTES}")
        return path.read_bytes()
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: cannot be read: {getattr(error, 'strerror', None) or error}") from None


def find_all(names: Iterable[str], folders: list[Path], sources: Sources, mesh: Path | None = None) -> list[Path]:
    """Return the files that a mesh names, skipping those that `find` does not find.

    Parameters
    ----------
    names
        The names, as written in the mesh file.
    folders
        Where to look, in this order; the first must be the mesh's own.
    sources
        Reads files and keeps their bytes.
    mesh
        The mesh, for a warning in the log about each file that is not found; None logs none.

    Returns
    -------
    list
        The files that were found, in the order of `names`.
    """
    return [path for path in (find(name, folders, sources, mesh) for name in names) if path is not None]


def read_named(name: str, mesh: Path, sources: Sources) -> tuple[Path, bytes]:
    """Return a file that the file `mesh` names, and its contents.

    Raises FileNotFoundError if it is missing, which is logged, and InputError as `Sources.read` does.
    """
    if (path := find(texture_name(name), [mesh.parent], sources, mesh)) is None:
        raise FileNotFoundError(name)
    return path, sources.read(path)


def find(name: str, folders: list[Path], sources: Sources, mesh: Path | None = None) -> Path | None:
    """Return the file that a mesh names, from the first folder that has it.

    Exporters write paths of their own machine: if no folder has the whole path, the last component of the name is
    looked up.

    Parameters
    ----------
    name
        The name, as written in the mesh file.
    folders
        Where to look, in this order; the first must be the mesh's own.
    sources
        Reads files and keeps their bytes.
    mesh
        The mesh, for a warning in the log if the file is not found; None logs none.

    Returns
    -------
    Path | None
        The file; None if none exists, or only one outside the tree of the first folder.
    """
    root = folders[0].resolve()
    name = name.strip().replace("\\", "/")  # for Windows exporters
    spellings = dict.fromkeys([name, unquote(name), name.rsplit("/", 1)[-1]])
    for path in (folder / spelling for spelling in spellings for folder in folders):
        if sources.is_inside(path, root):
            return path
    if mesh is not None:
        log.warning("%s: %s is missing or outside the folder; ignored", mesh, quoted(name))
    return None


def text(raw: bytes) -> str:
    """Return the bytes `raw` of a name as text, with a replacement character for each byte that is not UTF-8."""
    return raw.decode("utf-8", "replace")


def as_utf8(data: bytes) -> bytes:
    """Return the text `data` in UTF-8; text that is not UTF-8 is read as Latin-1, which old exporters write."""
    try:
        data.decode("utf-8")
    except UnicodeDecodeError:
        return data.decode("latin-1").encode("utf-8")
    return data


def texture_name(argument: str) -> str:
    """Return the file name in the `argument` of `map_Kd`, such as `-s 1 1 1 name`.

    Names may contain blanks unless options precede them.
    """
    return argument.split()[-1] if argument.startswith("-") else argument


def arguments(data: bytes, keyword: bytes) -> list[bytes]:
    """Return the stripped text after the regular expression `keyword` on each line that begins with it.

    Blanks are stripped afterwards: an expression that finds the last word's end would try each blank before it.
    """
    data = data.replace(b"\r", b"\n") if b"\r" in data else data
    found = re.findall(rb"^[ \t]*%b[ \t]([^\n]*)" % keyword, data, re.MULTILINE | re.IGNORECASE)
    return [stripped for argument in found if (stripped := argument.strip())]
