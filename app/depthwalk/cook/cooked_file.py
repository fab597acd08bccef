"""Cooked assets in the user's cache folder, so that an asset can come and go while somebody walks."""

import json
from collections.abc import Callable
from dataclasses import fields, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.images import BakedObject, Cylinder, Face
from depthwalk.cache import Cache, read_arrays, write_arrays
from depthwalk.cook.cook import COOK_VERSION, CookedObject, CookOptions, bare_image
from depthwalk.cook.lod_geometry import LodGeometry
from depthwalk.cook.virtual_texture import VirtualTexture

COOKED = Cache(suffix=".npz", content="cooked depth images")

_SMALL = "first", "count", "horizon", "error"  # fields of grids that are needed before an object is drawn


def find_cooked(key: str, form: CookOptions) -> tuple[CookedObject, ...] | None:
    """Return what `keep_cooked` kept of the model of `key`; None where there is nothing, or only damaged files.

    Grids and pages are read, and checked, by each object's `load` only.
    """
    return COOKED.find(_name(key, form), _objects)


def keep_cooked(key: str, form: CookOptions, objects: tuple[CookedObject, ...]) -> tuple[CookedObject, ...]:
    """Keep what was prepared of the model of `key` in the cache folder; return the same, which now reads the file.

    Raises OSError where that is not possible.
    """
    arrays: dict[str, Any] = {"objects": json.dumps([_header(each) for each in objects])}
    for number, each in enumerate(objects):
        for part in each.load():
            arrays |= {_column(type(part), number, name): value for name, value in _values(part).items()}
    path = COOKED.keep(_name(key, form), lambda path: write_arrays(path, arrays))
    return tuple(replace(each, load=_loader(path, number)) for number, each in enumerate(objects))


def _name(key: str, form: CookOptions) -> str:
    """What stands before the suffix of the file of a model's key."""
    marks = "".join(f"-{name}" for name, is_so in form._asdict().items() if is_so)
    return f"{key}-cook{COOK_VERSION}{marks}"


def _objects(path: Path) -> tuple[CookedObject, ...]:
    """The objects in a file. Raises OSError, ValueError, KeyError or TypeError."""
    headers = json.loads(str(read_arrays(path, ["objects"])["objects"]))
    names = [_column(LodGeometry, number, name) for number in range(len(headers)) for name in _SMALL]
    stored = read_arrays(path, names)
    return tuple(_from_file(path, number, header, stored) for number, header in enumerate(headers))


def _header(each: CookedObject) -> dict[str, Any]:
    outline, cylinder = each.outline, each.outline.cylinder
    return {
        "cylinder": [float(getattr(cylinder, field.name)) for field in fields(Cylinder)],
        "images": [[int(image.face), image.layer, *image.depth.shape] for image in outline.images],
        "shininess": float(outline.shininess),
        "steps": outline.steps,
        "key": outline.key,
        "position": [float(x) for x in outline.position],
        "rotation": [float(x) for x in outline.rotation],
        "footprint": each.footprint.tolist(),
        "bytes": each.bytes,
    }


def _from_file(path: Path, number: int, header: dict[str, Any], stored: dict[str, NDArray[Any]]) -> CookedObject:
    outline = BakedObject(
        cylinder=Cylinder(**dict(zip((field.name for field in fields(Cylinder)), header["cylinder"], strict=True))),
        images=tuple(bare_image(Face(face), layer, tuple(shape)) for face, layer, *shape in header["images"]),
        borders=(),
        shininess=header["shininess"],
        steps=header["steps"],
        key=header["key"],
        position=tuple(header["position"]),
        rotation=tuple(header["rotation"]),
    )
    first, count, horizon, error = (stored[_column(LodGeometry, number, name)] for name in _SMALL)
    around = np.array(header["footprint"])
    return CookedObject(outline, around, first, count, horizon, error, header["bytes"], _loader(path, number))


def _column(kind: type[LodGeometry | VirtualTexture], number: int, name: str) -> str:
    """What a field of an object's grids or pages is called in the file."""
    return f"{number}.{kind.__name__}.{name}"


def _values(part: LodGeometry | VirtualTexture) -> dict[str, NDArray[Any]]:
    """The fields as arrays."""
    values = {field.name: getattr(part, field.name) for field in fields(part)}
    return {name: np.asarray(value) for name, value in values.items()}


def _loader(path: Path, number: int) -> Callable[[], tuple[LodGeometry, VirtualTexture]]:
    """What reads the grids and pages of an object from a file. Raises OSError where that has gone or is damaged."""
    return partial(COOKED.read, path, partial(_read, number=number))


def _read(path: Path, number: int) -> tuple[LodGeometry, VirtualTexture]:
    """The grids and pages of an object. Raises OSError, or ValueError where they are damaged."""
    names = {
        kind: {field.name: _column(kind, number, field.name) for field in fields(kind)}
        for kind in (LodGeometry, VirtualTexture)
    }
    stored = read_arrays(path, [name for columns in names.values() for name in columns.values()])
    grids, pages = (
        {field: stored[name] for field, name in names[kind].items()} for kind in (LodGeometry, VirtualTexture)
    )
    return LodGeometry(**grids), VirtualTexture(**_listed(pages))


def _listed(pages: dict[str, Any]) -> dict[str, Any]:
    """The fields of pages, those that are no arrays as what they are."""
    return pages | {"first_rows": pages["first_rows"].tolist(), "last_mip_tier": int(pages["last_mip_tier"])}
