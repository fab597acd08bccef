"""Find the files that make up a mesh without decoding any geometry, and read each of them once.

A mesh names other files: material libraries, textures, buffers. Their bytes decide how it looks, so the key of its bake
is a hash over all of them; and they may only lie in the mesh's own folder.
"""

import hashlib
import logging
import re
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from urllib.parse import unquote

from depthwalk.errors import InputError, missing_file
from depthwalk.ingest import gltf
from depthwalk.limits import MAX_LOOKUPS, MAX_MESH_BYTES

log = logging.getLogger(__name__)


class Sources:
    """Keep the bytes of a mesh's files, so that all who read a file get the same ones.

    A mesh and the hash by which its bake is found must come from the same bytes. If a file were replaced between two
    readings, the depth images of one mesh would be kept under the key of another for good. Holding the bytes costs
    little: those of the mesh are needed while it is parsed, and textures are held compressed. Drop the object as soon
    as the mesh is parsed.
    """

    def __init__(self) -> None:
        """Begin without any file."""
        self._data: dict[Path, bytes] = {}
        self._found: dict[tuple[Path, Path], bool] = {}

    def read(self, path: Path) -> bytes:
        """Return the contents of the file `path`, as they were when it was first read.

        Raises InputError as `read_bytes` does.
        """
        if path not in self._data:
            self._data[path] = read_bytes(path)
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
            True where it does, after symbolic links are followed; the first answer is kept.

        Raises
        ------
        InputError
            Where too many other files were asked for before.
        """
        if (path, root) not in self._found:
            if len(self._found) == MAX_LOOKUPS:
                raise InputError(f"{path}: a mesh names too many files: {MAX_LOOKUPS} were looked for before this one")
            try:
                self._found[path, root] = path.is_file() and path.resolve().is_relative_to(root)
            except (OSError, ValueError):  # a name too long, or with a zero byte
                self._found[path, root] = False
        return self._found[path, root]


def source_files(path: Path, texture: Path | None = None, sources: Sources | None = None) -> tuple[Path, ...]:
    """Return every file that determines how a mesh looks: the mesh file, those that it names, and `texture`.

    An OBJ file names material libraries, and these name colour textures; a glTF or GLB file names buffers and images; a
    PLY file names its texture. Names of files that do not exist, or lie outside the mesh's folder, are left out.

    Parameters
    ----------
    path
        The mesh file.
    texture
        A picture that replaces the file's own textures; None keeps these.
    sources
        Reads files and keeps their bytes; None reads them from the disk.

    Returns
    -------
    tuple
        The files; `texture` comes last.

    Raises
    ------
    InputError
        Where `path` is missing or its header damaged.
    """
    sources = sources or Sources()
    data = sources.read(path)
    match path.suffix.lower():
        case ".obj":
            libraries = material_libraries(data, path.parent, sources)
            folders = list(dict.fromkeys([path.parent, *(library.parent for library in libraries)]))
            named = [*libraries, *find_all(_textures_of(libraries, sources, b"map_k[de]"), folders, sources, path)]
        case ".gltf" | ".glb":
            buffers, images = _uris(data, path)
            named = find_all(buffers, [path.parent], sources)  # without one the file is refused when it is read
            named += find_all(images, [path.parent], sources, path)
        case ".ply":
            header = data[: data.find(b"end_header")]
            named = find_all(
                (text(name) for name in _arguments(header, rb"comment[ \t]+TextureFile")), [path.parent], sources
            )
        case _:
            named = []
    explicit = [] if texture is None else [texture]
    return tuple(dict.fromkeys([path, *named, *explicit]))


def source_hash(path: Path, texture: Path | None = None, sources: Sources | None = None) -> str:
    """Return a hash of the contents (not the names or dates) of all files that `source_files` finds.

    Parameters
    ----------
    path
        The mesh file.
    texture
        A picture that replaces the file's own textures; None keeps these.
    sources
        Reads files and keeps their bytes; None reads them from the disk.

    Returns
    -------
    str
        SHA-256 in hex.

    Raises
    ------
    InputError
        Where a file cannot be read.
    """
    sources = sources or Sources()
    whole = hashlib.sha256()
    for source in source_files(path, texture, sources):
        whole.update(hashlib.sha256(sources.read(source)).digest())  # digests are of one length: no ambiguous joins
    return whole.hexdigest()


def names_texture(path: Path, texture: Path | None = None, sources: Sources | None = None) -> bool:
    """Return whether a mesh may be textured, without decoding any geometry.

    Parameters
    ----------
    path
        The mesh file.
    texture
        A picture that replaces the file's own textures; None keeps these.
    sources
        Reads files and keeps their bytes; None reads them from the disk.

    Returns
    -------
    bool
        Whether there is a `texture`, or the file names a texture or holds one.

    Raises
    ------
    InputError
        Where `path` is missing or its header damaged.
    """
    if texture is not None:
        return True
    sources = sources or Sources()
    data = sources.read(path)
    match path.suffix.lower():
        case ".obj":
            return bool(_textures_of(material_libraries(data, path.parent, sources), sources))
        case ".gltf" | ".glb":
            return bool(gltf.read_header(data, path).get("images"))
        case ".ply":
            return bool(_arguments(data[: data.find(b"end_header")], rb"comment[ \t]+TextureFile"))
        case _:
            return False


def names_cut_outs(path: Path, sources: Sources) -> bool:
    """Return whether the materials of the mesh file `path` may cut out parts of its surface; see `names_texture`."""
    match path.suffix.lower():
        case ".obj":
            libraries = material_libraries(sources.read(path), path.parent, sources)
            return bool(libraries) and b"map_d" in read_libraries(libraries, sources).lower()
        case ".gltf" | ".glb":
            return gltf.has_cut_outs(gltf.read_header(sources.read(path), path))
        case _:
            return False


def names_translucency(path: Path, sources: Sources) -> bool:
    """Return whether materials of the mesh file `path` may let light through; see `names_texture`."""
    match path.suffix.lower():
        case ".obj":
            solid, clear = (_numbers_of(path, sources, keyword) for keyword in (b"d", b"tr"))
            return any(number < 1 for number in solid) or any(number > 0 for number in clear)
        case ".gltf" | ".glb":
            return gltf.has_translucency(gltf.read_header(sources.read(path), path))
        case _:
            return False


def is_all_translucent(path: Path) -> bool:
    """Return whether the head of a mesh file says that nothing of it is opaque; False where it cannot be read.

    Of an OBJ file the material libraries are asked, whether or not it uses all of them.
    """
    sources = Sources()
    try:
        match path.suffix.lower():
            case ".obj":
                solid, clear = (_numbers_of(path, sources, keyword) for keyword in (b"d", b"tr"))
                through = [*(number < 1 for number in solid), *(number > 0 for number in clear)]
                return len(through) == len(_terms_of(path, sources, b"newmtl")) > 0 and all(through)
            case ".gltf" | ".glb":
                return gltf.is_all_translucent(gltf.read_header(sources.read(path), path))
    except (InputError, AttributeError, TypeError, LookupError):  # who reads the mesh complains
        pass
    return False


def names_glow(path: Path, sources: Sources) -> bool:
    """Return whether materials of the mesh file `path` may send out light; see `names_texture`."""
    match path.suffix.lower():
        case ".obj":
            return any(_numbers_of(path, sources, b"ke")) or bool(_terms_of(path, sources, b"map_ke"))
        case ".gltf" | ".glb":
            return gltf.has_glow(gltf.read_header(sources.read(path), path))
        case _:
            return False


def _numbers_of(path: Path, sources: Sources, keyword: bytes) -> list[float]:
    """Return all numbers that follow the regular expression `keyword` in the libraries of the OBJ file `path`."""
    numbers = []
    for word in b" ".join(_terms_of(path, sources, keyword)).split():
        with suppress(ValueError):
            numbers.append(float(word))
    return numbers


def _terms_of(path: Path, sources: Sources, keyword: bytes) -> list[bytes]:
    """Return what follows the regular expression `keyword` on lines of the libraries of the OBJ file `path`."""
    libraries = material_libraries(sources.read(path), path.parent, sources)
    return _arguments(read_libraries(libraries, sources), keyword)


def read_bytes(path: Path) -> bytes:
    """Return the contents of the file `path`.

    Raises InputError where it is missing, unreadable or larger than the limit.
    """
    try:
        if not path.is_file():
            raise missing_file(path)
        if (length := path.stat().st_size) > MAX_MESH_BYTES:
            raise InputError(f"{path}: too large: {length} bytes, the limit is {MAX_MESH_BYTES}")
        return path.read_bytes()
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: cannot be read: {getattr(error, 'strerror', None) or error}") from None


def material_libraries(data: bytes, folder: Path, sources: Sources) -> list[Path]:
    """Return the material libraries that an OBJ file names, as far as they exist in its folder.

    Parameters
    ----------
    data
        The text of the OBJ file; names in it may hold blanks.
    folder
        The folder of the OBJ file.
    sources
        Reads files and keeps their bytes.

    Returns
    -------
    list
        The MTL files, in the order of their names in the file.
    """
    libraries: list[Path] = []
    if not (b"b" in data or b"B" in data) or b"mtllib" not in data.lower():  # no need to look at a million lines
        return libraries
    data = as_utf8(data)
    for line in _arguments(data, b"mtllib"):
        whole = find(text(line), [folder], sources)
        libraries += [whole] if whole else find_all(text(line).split(), [folder], sources)
    return list(dict.fromkeys(libraries))


def read_libraries(libraries: list[Path], sources: Sources) -> bytes:
    """Return the texts of the MTL files `libraries`, read through `sources`, one after the other, in UTF-8."""
    return b"\n".join(as_utf8(sources.read(library)) for library in libraries)


def find_all(names: Iterable[str], folders: list[Path], sources: Sources, mesh: Path | None = None) -> list[Path]:
    """Return the files that a mesh names, leaving out those that `find` does not find.

    Parameters
    ----------
    names
        The names, as the mesh file has them.
    folders
        Where to look, in this order; the first is the mesh's own.
    sources
        Reads files and keeps their bytes.
    mesh
        The mesh, about which a warning is logged for each file that is not found; None logs none.

    Returns
    -------
    list
        The files that were found, in the order of `names`.
    """
    return [path for path in (find(name, folders, sources, mesh) for name in names) if path is not None]


def find(name: str, folders: list[Path], sources: Sources, mesh: Path | None = None) -> Path | None:
    """Return the file that a mesh names, from the first folder that has it.

    Exporters write paths of their own machine: where no folder has the whole path, the last component of the name is
    looked for.

    Parameters
    ----------
    name
        The name, as the mesh file has it.
    folders
        Where to look, in this order; the first is the mesh's own.
    sources
        Reads files and keeps their bytes.
    mesh
        The mesh, about which a warning is logged where the file is not found; None logs none.

    Returns
    -------
    Path | None
        The file; None where none exists, or only one outside the tree of the first folder.
    """
    root = folders[0].resolve()
    name = name.strip().replace("\\", "/")  # Windows exporters
    spellings = dict.fromkeys([name, unquote(name), name.rsplit("/", 1)[-1]])
    for path in (folder / spelling for spelling in spellings for folder in folders):
        if sources.is_inside(path, root):
            return path
    if mesh is not None:
        log.warning("%s: %r is missing or outside the folder; ignored", mesh, name)
    return None


def text(raw: bytes) -> str:
    """Return the bytes `raw` of a name as text, with a replacement character for each byte that is not UTF-8."""
    return raw.decode("utf-8", "replace")


def as_utf8(data: bytes) -> bytes:
    """Return the text `data` in UTF-8; text that is not UTF-8 is taken for Latin-1, which old exporters write."""
    try:
        data.decode("utf-8")
    except UnicodeDecodeError:
        return data.decode("latin-1").encode("utf-8")
    return data


def texture_name(argument: str) -> str:
    """Return the file name in the `argument` of `map_Kd`, such as `-s 1 1 1 name`.

    Names may hold blanks unless options precede them.
    """
    return argument.split()[-1] if argument.startswith("-") else argument


def _textures_of(libraries: list[Path], sources: Sources, keyword: bytes = b"map_kd") -> list[str]:
    lines = read_libraries(libraries, sources)
    return [texture_name(text(name)) for name in _arguments(lines, keyword)]


def _arguments(data: bytes, keyword: bytes) -> list[bytes]:
    """Return what follows the regular expression `keyword` on each line that begins with it, without blanks around.

    Blanks are stripped afterwards: an expression that finds the last word's end tries each blank before it.
    """
    data = data.replace(b"\r", b"\n") if b"\r" in data else data
    found = re.findall(rb"^[ \t]*%b[ \t]([^\n]*)" % keyword, data, re.MULTILINE | re.IGNORECASE)
    return [stripped for argument in found if (stripped := argument.strip())]


def _uris(data: bytes, path: Path) -> tuple[list[str], list[str]]:
    """Return the buffers and the images that a glTF file names."""
    try:
        header = gltf.read_header(data, path)
        return gltf.external_uris(header, "buffers"), gltf.external_uris(header, "images")
    except (AttributeError, TypeError):
        raise InputError(f"{path}: its glTF header is malformed") from None
