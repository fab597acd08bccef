"""Baked objects made ready for the GPU: their grids and pages, which take seconds to build and are kept in the user's
cache folder, so that an asset can come and go while somebody walks."""

import contextlib
import hashlib
import json
import os
import zipfile
from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from functools import cache, partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.cache import cache_folder, make_room
from depthwalk.bake.images import BakedObject, Cylinder, DepthImage, Face
from depthwalk.output import replacing
from depthwalk.render.cases import PIECES
from depthwalk.render.footprint import footprint
from depthwalk.render.grids import Grids
from depthwalk.render.pages import Pages, build_pages
from depthwalk.render.step_grids import build_grids
from depthwalk.render.surface_levels import build_levels

# Texels of images for whose grids surfaces by error take longer to build than a visitor of the garden should wait, and
# spare few triangles. Grids of more than `_DENSE` triangles per texel are those of foliage, all borders: surfaces have
# a quarter of that, and leaves where grids of step 2 and 4 have lost them.
_SMALL = 128
_DENSE = 10


class Form(NamedTuple):
    """What is built of an object. stepped: its levels are grids of step 1, 2, 4 …, not surfaces by error; paper_cases:
    they serve the paper's cases, too, which needs half as much again."""

    stepped: bool = False
    paper_cases: bool = False


@dataclass(frozen=True)
class Prepared:
    """outline: the object, its images of the right size but without pixels; footprint: (DIRECTIONS,), see
    `render.footprint`; first, count, horizon, error: see `Grids`; bytes: it takes on the GPU; load: its grids
    and pages. Raises OSError where the file that holds them has gone."""

    outline: BakedObject
    footprint: NDArray[np.floating]
    first: NDArray[np.int64]
    count: NDArray[np.int64]
    horizon: NDArray[np.float64]
    error: NDArray[np.floating]
    bytes: int
    load: Callable[[], tuple[Grids, Pages]]


def prepare(baked: BakedObject, form: Form) -> Prepared:
    """Builds the grids and pages of `baked`."""
    grids = _build(baked, form)
    pages = build_pages(baked, grids)
    size = grids.vertices.nbytes + grids.indices.nbytes + pages.table.nbytes + pages.bytes_with_mip_maps
    around = footprint(grids.positions) + (0 if baked.meso is None else baked.meso.height)
    return Prepared(_outline(baked), around, *_columns(grids), size, lambda: (grids, pages))


def _columns(grids: Grids) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any], NDArray[Any]]:
    return grids.first, grids.count, grids.horizon, grids.error


def _build(baked: BakedObject, form: Form) -> Grids:
    height, width = baked.images[0].depth.shape
    if form.stepped or max(height, width) <= _SMALL:
        grids = build_grids(baked, form.paper_cases)
        if form.stepped or grids.count[0, :PIECES].sum() <= 3 * _DENSE * height * width:
            return grids
    return build_levels(baked)


def find_prepared(key: str, form: Form) -> tuple[Prepared, ...] | None:
    """What `keep_prepared` kept of the model of `key`; None where there is nothing, or not all of it."""
    path = _file(key, form)
    try:
        with path.open("rb") as file, np.load(file) as stored:
            headers = json.loads(str(stored["objects"]))
            found = tuple(_from_file(path, number, header, stored) for number, header in enumerate(headers))
        os.utime(path)  # its age is that of its last use
    except (OSError, ValueError, KeyError, TypeError, zipfile.BadZipFile):
        return None
    return found


def keep_prepared(key: str, form: Form, objects: tuple[Prepared, ...]) -> tuple[Prepared, ...]:
    """Keeps what was prepared of the model of `key` in the cache folder. The same, which now reads the file.

    Raises OSError where that is not possible.
    """
    path = _file(key, form)
    arrays: dict[str, Any] = {"objects": json.dumps([_header(each) for each in objects])}
    for number, each in enumerate(objects):
        for part in each.load():
            arrays |= {_column(type(part), number, name): value for name, value in _values(part).items()}
    path.parent.mkdir(parents=True, exist_ok=True)
    with replacing(path) as temporary:
        np.savez(temporary, **arrays)
    make_room(path)
    return tuple(replace(each, load=partial(_read, path, number)) for number, each in enumerate(objects))


def _outline(baked: BakedObject) -> BakedObject:
    return replace(baked, images=tuple(map(_bare, baked.images)), borders=())


def _bare(image: DepthImage) -> DepthImage:
    return _bare_image(image.face, image.layer, image.depth.shape)


def _bare_image(face: Face, layer: int, shape: tuple[int, ...]) -> DepthImage:
    """An image of `shape` that takes no memory."""
    empty = np.broadcast_to(np.float32(np.inf), shape)
    none = np.broadcast_to(np.float32(0), (*shape, 4))
    return DepthImage(face, layer, empty, none[..., :3], none, (), np.broadcast_to(np.uint8(face), shape))


def _header(each: Prepared) -> dict[str, Any]:
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


def _from_file(path: Path, number: int, header: dict[str, Any], stored: Any) -> Prepared:
    outline = BakedObject(
        Cylinder(*header["cylinder"]),
        tuple(_bare_image(Face(face), layer, tuple(shape)) for face, layer, *shape in header["images"]),
        (),
        header["shininess"],
        header["steps"],
        header["key"],
        tuple(header["position"]),
        tuple(header["rotation"]),
    )
    names = "first", "count", "horizon", "error"
    first, count, horizon, error = (stored[_column(Grids, number, name)] for name in names)
    around = np.array(header["footprint"])
    return Prepared(outline, around, first, count, horizon, error, header["bytes"], partial(_read, path, number))


def _column(kind: type[Grids | Pages], number: int, name: str) -> str:
    """What a field of an object's grids or pages is called in the file."""
    return f"{number}.{kind.__name__}.{name}"


def _values(part: Grids | Pages) -> dict[str, NDArray[Any]]:
    """The fields as arrays."""
    values = {field.name: getattr(part, field.name) for field in fields(part)}
    return {name: np.asarray(value) for name, value in values.items()}


def _read(path: Path, number: int) -> tuple[Grids, Pages]:
    with path.open("rb") as file, np.load(file) as stored:
        grids, pages = (
            {field.name: stored[_column(kind, number, field.name)] for field in fields(kind)} for kind in (Grids, Pages)
        )
    pages |= {"first_rows": pages["first_rows"].tolist(), "last_segment": int(pages["last_segment"])}
    return Grids(**grids), Pages(**pages)


def _file(key: str, form: Form) -> Path:
    marks = "".join(f"-{name}" for name, is_so in form._asdict().items() if is_so)
    return cache_folder() / f"{key}-{_made_by()}{marks}.npz"


@cache
def _made_by() -> str:
    """What stands for the code that prepares: no version number has to be remembered when it changes."""
    package = Path(__file__).parents[1]
    digest = hashlib.sha256()
    for path in sorted([*(package / "bake").glob("*.py"), *(package / "render").glob("*.py")]):
        with contextlib.suppress(OSError):
            digest.update(path.read_bytes())
    return digest.hexdigest()[:12]
