"""Store cooked assets: in the user's cache folder, or as separate files, `NAME.dpci.npz`, that scenes refer to.

Cooking takes seconds; reading the file, a fraction of a second. So an asset can leave the GPU's memory and return
during a walk, and a scene can ship without meshes. A file holds all objects of one model: their headers, which drawing
needs at once, and columns of arrays, which are read for one object at a time.
"""

import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import fields, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthwalk.array_file import SMALLEST, read_arrays, write_arrays
from depthwalk.bake.images import BakedObject, Cylinder, Face, checked_reflection, checked_triangles
from depthwalk.cache import Cache
from depthwalk.cook.array_packing import pack_picture, pack_words, unpack_picture, unpack_words
from depthwalk.cook.cook import COOK_VERSION, CookedObject, CookOptions, bare_image
from depthwalk.cook.cooked_check import check_geometry, check_texture
from depthwalk.cook.lod_geometry import LodGeometry
from depthwalk.cook.virtual_texture import VirtualTexture
from depthwalk.errors import InputError
from depthwalk.geometry.bounding_hull import padded_hull, prism_corners

COOKED = Cache(suffix=".npz", content="cooked depth images")

# Version of the arrays and of what they mean to the shaders. Raise it if older files would be drawn wrongly. Separate
# files stay readable when COOK_VERSION is raised because cooking became better or faster.
_LAYOUT = 4
_PAIRED_LAYOUT = 5  # of files with an object whose texels have two colour components; older readers draw these wrongly
_READABLE = 2, 3, _LAYOUT, _PAIRED_LAYOUT  # the first two, also paired, have extents around the axis in place of hulls

_WORDS = {"vertices": 2, "indices": 1}  # columns that are packed as words, with their dimensions
_OF_TEXTURED = "coordinates", "texture", "colour_level"  # fields that are stored only for objects with coordinates
_PICTURES = "normals", "texture"  # columns that are packed as pictures; colours are smaller unpacked

_NUMBERS = "first_rows", "last_mip_tier", "colour_level"  # fields of `VirtualTexture` that are not arrays

_SMALL = "first", "count", "horizon", "error"  # fields of `LodGeometry` that are needed before an object is drawn


def find_cooked(key: str, options: CookOptions) -> tuple[CookedObject, ...] | None:
    """Find the cooked objects of a model in the cache.

    Reads only what drawing needs at once; each object's `load` reads and checks geometry and textures.

    Parameters
    ----------
    key
        Key of the baked model.
    options
        The options that it was cooked with.

    Returns
    -------
    tuple | None
        The objects in the model's order; None if the cache has none, or a damaged file.
    """
    return COOKED.find(_name(key, options), _objects)


def keep_cooked(key: str, options: CookOptions, objects: tuple[CookedObject, ...]) -> tuple[CookedObject, ...]:
    """Store the cooked objects of a model in the cache folder.

    Parameters
    ----------
    key
        Key of the baked model.
    options
        The options that they were cooked with.
    objects
        The objects, in the model's order.

    Returns
    -------
    tuple
        The same objects, which from now on load geometry and textures from the file.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    arrays = _arrays(objects)
    path = COOKED.keep(_name(key, options), lambda path: write_arrays(path, arrays))
    return tuple(replace(cooked, load=_loader(path, number)) for number, cooked in enumerate(objects))


def write_cooked(path: Path, key: str, objects: tuple[CookedObject, ...], left_out: float | None = None) -> None:
    """Write cooked objects to a separate file, compressed and atomically.

    Parameters
    ----------
    path
        The file, whose name must end in `COOKED_SUFFIX`.
    key
        The key of the depth images that the objects were cooked from.
    objects
        All objects of a model, cooked with the default `CookOptions`.
    left_out
        See `BakedModel`.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    paired = any(cooked.load()[1].colours.shape[2] == 2 for cooked in objects)
    version = _PAIRED_LAYOUT if paired else _LAYOUT
    origin = {"key": key, "version": version, "cooked_by": COOK_VERSION, "packed": True, "left_out": left_out}
    columns = {name: _packed(name, values) for name, values in _arrays(objects).items()}
    write_arrays(path, {"made_of": json.dumps(origin)} | columns, SMALLEST)


def cooked_key(path: Path) -> str | None:
    """Return the key of the depth images from which the file `path` was cooked.

    Returns None for files not written by `write_cooked`, and for files of another COOK_VERSION.
    """
    try:
        made_of = _made_of(path)
        same = made_of["version"] in (_LAYOUT, _PAIRED_LAYOUT) and made_of.get("cooked_by", 2) == COOK_VERSION
        return made_of["key"] if same and isinstance(made_of["key"], str) else None
    except (OSError, ValueError, KeyError, TypeError):
        return None


def cooked_left_out(path: Path) -> float | None:
    """Return `BakedModel.left_out` of the depth images from which the file `path` was cooked; None if it is unknown.

    Raises InputError if the file cannot be read or is damaged.
    """
    with _complaints(path):
        left_out = _made_of(path).get("left_out")
        return None if left_out is None else float(left_out)


def read_cooked(path: Path) -> tuple[CookedObject, ...]:
    """Return the cooked objects in a file.

    Each object's `load` reads geometry and textures when it is called.

    Parameters
    ----------
    path
        The file, written by `write_cooked`.

    Returns
    -------
    tuple
        The objects in the model's order.

    Raises
    ------
    InputError
        If the file cannot be read, is damaged, or has another layout; `load` raises it, too.
    """
    with _complaints(path):
        made_of = _made_of(path)
        if made_of["version"] not in _READABLE:
            readable = f"{min(_READABLE)} to {max(_READABLE)}"
            problem = f"a file of layout {made_of['version']!s:.20}, not {readable}; bake it again"
            raise InputError(f"{path}: {problem}")
        objects = _objects(path)
    packed = made_of.get("packed", False)
    return tuple(replace(cooked, load=partial(_load_user_file, path, i, packed)) for i, cooked in enumerate(objects))


def _made_of(path: Path) -> dict[str, Any]:
    """Return what a file of `write_cooked` records of its origin. Raises OSError or ValueError if nothing."""
    made_of: dict[str, Any] = _document(path, "made_of")
    return made_of


def _document(path: Path, name: str) -> Any:
    """Return the JSON document `name` of a file. Raises OSError or ValueError if it cannot be read."""
    try:
        return json.loads(str(read_arrays(path, [name])[name]))
    except RecursionError:
        raise ValueError(f"{name} is nested too deeply") from None


def _load_user_file(path: Path, number: int, packed: bool) -> tuple[LodGeometry, VirtualTexture]:
    """Return geometry and texture of an object of a file that is not the cache's. Raises InputError."""
    with _complaints(path):
        return _read(path, number, packed)


@contextmanager
def _complaints(path: Path) -> Iterator[None]:
    """Turn errors from reading `path` in the `with` block into an InputError."""
    try:
        yield
    except OSError as error:
        raise InputError(f"{path}: {error.strerror or error}") from None
    except (ValueError, KeyError, TypeError, RecursionError) as error:  # the last for a layout nested a thousand deep
        raise InputError(f"{path}: damaged cooked depth images: {error!s:.200}") from None


def _packed(name: str, values: Any) -> Any:
    """Return a column as it is stored in a compressed file; `_unpacked` is the inverse."""
    field = name.rpartition(".")[2]
    if field in _WORDS and values.dtype == np.uint16:
        return pack_words(values.reshape(len(values), -1))
    return pack_picture(values) if field in _PICTURES else values


def _unpacked(field: str, values: NDArray[Any]) -> NDArray[Any]:
    """Return a column of a compressed file. Raises ValueError if it is damaged."""
    if field in _WORDS and values.dtype == np.uint8:
        words = unpack_words(values)
        return words if _WORDS[field] == 2 else words.ravel()
    return unpack_picture(values) if field in _PICTURES else values


def _arrays(objects: tuple[CookedObject, ...]) -> dict[str, Any]:
    """Return the stored arrays of a model's objects, by the names of the columns."""
    arrays: dict[str, Any] = {"objects": json.dumps([_header(cooked) for cooked in objects])}
    for number, cooked in enumerate(objects):
        for part in cooked.load():
            arrays |= {_column(type(part), number, name): value for name, value in _values(part).items()}
    return arrays


def _name(key: str, options: CookOptions) -> str:
    """Return the name, without suffix, of the file of the model of `key`."""
    marks = "".join(f"-{name}" for name, chosen in options._asdict().items() if chosen)
    return f"{key}-cook{COOK_VERSION}{marks}"


def _objects(path: Path) -> tuple[CookedObject, ...]:
    """Return the objects in a file. Raises OSError, ValueError, KeyError or TypeError if it is damaged."""
    headers = _document(path, "objects")
    names = [_column(LodGeometry, number, name) for number in range(len(headers)) for name in _SMALL]
    stored = read_arrays(path, names)
    return tuple(_from_file(path, number, header, stored) for number, header in enumerate(headers))


def _header(cooked: CookedObject) -> dict[str, Any]:
    """Return the part of an object that is stored as JSON; `_from_file` is the inverse."""
    outline, cylinder = cooked.outline, cooked.outline.cylinder
    return {
        "cylinder": [float(getattr(cylinder, field.name)) for field in fields(Cylinder)],
        "images": [[int(image.face), image.layer, *image.depth.shape] for image in outline.images],
        "shininess": float(outline.shininess),
        "steps": outline.steps,
        "key": outline.key,
        "position": [float(x) for x in outline.position],
        "rotation": [float(x) for x in outline.rotation],
        "hull": np.unique(cooked.hull, axis=0).tolist(),
        "bytes": cooked.bytes,
        "mesh_triangles": outline.mesh_triangles,
        # Left out where they are false, so that other files are unchanged.
        **{name: True for name in ("has_interior", "keeps_normals", "tells_roughness") if getattr(outline, name)},
        **({} if outline.reflection is None else {"reflection": [float(number) for number in outline.reflection]}),
    }


def _from_file(path: Path, number: int, header: dict[str, Any], stored: dict[str, NDArray[Any]]) -> CookedObject:
    """Return object `number` of a file from its header and the small columns of all objects."""
    outline = BakedObject(
        cylinder=_cylinder(header),
        images=tuple(bare_image(Face(face), layer, tuple(shape)) for face, layer, *shape in header["images"]),
        boundary_strips=(),
        shininess=header["shininess"],
        steps=header["steps"],
        key=header["key"],
        position=tuple(header["position"]),
        rotation=tuple(header["rotation"]),
        mesh_triangles=checked_triangles(header.get("mesh_triangles")),
        has_interior=header.get("has_interior") is True,
        keeps_normals=header.get("keeps_normals") is True,
        reflection=checked_reflection(*header.get("reflection", (None, None))),
        tells_roughness=header.get("tells_roughness") is True,
    )
    return CookedObject(
        outline=outline,
        hull=_hull(header),
        **{name: stored[_column(LodGeometry, number, name)] for name in _SMALL},
        bytes=header["bytes"],
        load=_loader(path, number),
    )


def _hull(header: dict[str, Any]) -> NDArray[np.float64]:
    """Return `CookedObject.hull` from an object's header. Raises ValueError, KeyError or TypeError if it is damaged."""
    if "hull" in header:
        return padded_hull(_numbers(header, "hull"))
    extents, cylinder = _numbers(header, "footprint"), _cylinder(header)
    if extents.ndim != 1 or len(extents) < 3:
        raise ValueError("extents must be in at least 3 directions")
    return padded_hull(prism_corners(extents, cylinder.bottom, cylinder.top))


def _cylinder(header: dict[str, Any]) -> Cylinder:
    """Return the cylinder from an object's header. Raises ValueError, KeyError or TypeError if it is damaged."""
    names = [field.name for field in fields(Cylinder)]
    return Cylinder(**dict(zip(names, _numbers(header, "cylinder").tolist(), strict=True)))


def _numbers(header: dict[str, Any], name: str) -> NDArray[np.float64]:
    """Return finite numbers from an object's header. Raises ValueError, KeyError or TypeError if they are none."""
    try:
        values = np.array(header[name], np.float64)
    except OverflowError:  # JSON has integers of any length
        values = np.array(np.inf)
    if not np.isfinite(values).all():
        raise ValueError(f"{name} must be finite numbers")
    return values


def _column(kind: type[LodGeometry | VirtualTexture], number: int, name: str) -> str:
    """Return the name that a field of an object's geometry or texture has in the file."""
    return f"{number}.{kind.__name__}.{name}"


def _values(part: LodGeometry | VirtualTexture) -> dict[str, NDArray[Any]]:
    """Return the fields of geometry or texture, as arrays."""
    without = () if isinstance(part, VirtualTexture) and part.has_coordinates else _OF_TEXTURED
    names = (field.name for field in fields(part))
    return {name: np.asarray(getattr(part, name)) for name in names if name not in without}


def _loader(path: Path, number: int) -> Callable[[], tuple[LodGeometry, VirtualTexture]]:
    """Return a function that loads an object from a file. It raises OSError if the file is gone or damaged."""
    return partial(COOKED.read, path, partial(_read, number=number))


def _read(path: Path, number: int, packed: bool = False) -> tuple[LodGeometry, VirtualTexture]:
    """Return geometry and texture of an object. Raises OSError, or ValueError if they are damaged.

    packed: whether columns are stored as `_packed` returns them.
    """
    names = {
        kind: {field.name: _column(kind, number, field.name) for field in fields(kind)}
        for kind in (LodGeometry, VirtualTexture)
    }
    optional = [names[VirtualTexture][field] for field in _OF_TEXTURED]
    needed = [name for columns in names.values() for name in columns.values() if name not in optional]
    stored = read_arrays(path, needed, optional)
    geometry, texture = (
        {
            field: _unpacked(field, stored[name]) if packed else stored[name]
            for field, name in names[kind].items()
            if name in stored
        }
        for kind in (LodGeometry, VirtualTexture)
    )
    values: dict[str, Any] = texture | {name: texture[name].tolist() for name in _NUMBERS if name in texture}
    made = LodGeometry(**geometry), VirtualTexture(**values)
    check_geometry(made[0])
    check_texture(made[1])
    return made
