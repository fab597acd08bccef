"""Assets on the GPU: depth images as grids and pages, meshes as vertex buffers. Loaded when first drawn; depth images
that are not seen give way to others within a budget of memory."""

import logging
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import moderngl
import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.images import BakedObject, Cylinder, Face, square_texel, texel_size
from depthwalk.bake.meso import Meso
from depthwalk.bake.model import BakedModel
from depthwalk.gpu.device import R8_SNORM, Device, Scope
from depthwalk.gpu.instances import AssetArrays
from depthwalk.gpu.program import Program
from depthwalk.render.chunks import Chunks, chunk_runs, vertex_numbers
from depthwalk.render.edges import Shape
from depthwalk.render.grids import GRID_LAYOUT, VERTEX_BYTES, Grids
from depthwalk.render.lod import LodParams
from depthwalk.render.mesh_store import MeshLibrary, MeshStore
from depthwalk.render.pages import LEVELS, Pages
from depthwalk.render.polygons import WHITE
from depthwalk.render.prepared import Form, Prepared, as_drawn, find_prepared, keep_prepared, prepare

log = logging.getLogger(__name__)


class Library(MeshLibrary, Protocol):
    """Where the renderer gets assets from, by number; it never reads files itself."""

    def __len__(self) -> int: ...
    def has_baked(self, asset: int) -> bool: ...
    def has_mesh(self, asset: int) -> bool: ...
    def prepare(self, assets: Sequence[int]) -> None: ...
    def key(self, asset: int) -> str: ...  # of its depth images, by which what is made of them is kept; "": nowhere
    def baked(self, asset: int) -> BakedModel | None: ...
    def texture(self, path: Path) -> NDArray[np.uint8]: ...


@dataclass
class DepthObject:
    """A baked object on the GPU."""

    vertices: moderngl.Buffer
    indices: moderngl.Buffer
    index_type: np.dtype[np.unsignedinteger]
    chunks: Chunks
    normals: moderngl.Texture
    colours: moderngl.Texture
    tints: moderngl.Texture
    page_table: moderngl.TextureArray
    meso: moderngl.Texture
    geometry: dict[str, Any]  # uniforms of the vertex stage
    colour_defines: tuple[str, ...]  # of common/pages.glsl
    surface: dict[str, Any]  # uniforms of common/depth_images.glsl and common/pages.glsl
    relief: dict[str, Any]  # uniforms of common/meso.glsl and common/faces.glsl

    @property
    def defines(self) -> tuple[str, ...]:
        """What the shaders that draw it are told."""
        return ("MESO",) if self.relief["meso_height"] > 0 else ()

    @property
    def surface_defines(self) -> tuple[str, ...]:
        """What the shader that looks its surface up is told."""
        return *self.defines, *self.colour_defines

    def shape(self, runs: Sequence[tuple[int, int]]) -> Shape:
        """Positions (v, 3), metres, and triangles (t, 3) of runs of indices, first and count each, read back."""
        low, size = (np.array(self.geometry[name], np.float32) for name in ("box_low", "box_size"))
        samples = np.frombuffer(self.vertices.read(), np.uint16).reshape(-1, 4)
        indices = np.frombuffer(self.indices.read(), self.index_type)
        numbers = [vertex_numbers(indices, self.chunks, first, count) for first, count in runs]
        corners, triangles = np.unique(np.concatenate(numbers), return_inverse=True)
        positions = low + samples[corners, :3] * (size / np.float32(65535))
        return positions, triangles.reshape(-1, 3).astype(np.uint32)

    def array(self, arrays: AssetArrays, number: int) -> moderngl.VertexArray:
        """The one of `arrays` that draws it; number: of this depth object."""
        return arrays.get(number, self.vertices, self.indices, self.index_type.itemsize)

    def draw(self, array: moderngl.VertexArray, runs: Sequence[tuple[int, int]], instances: int) -> None:
        """Draws runs of indices, first and count each, so many times."""
        layout, name = GRID_LAYOUT
        attribute: Any = array.program[name]
        for run in runs:
            for first, count, base in chunk_runs(self.chunks, *run):
                # In place of a base vertex, which moderngl cannot give.
                array.bind(attribute.location, "i", self.vertices, layout, base * VERTEX_BYTES, VERTEX_BYTES)
                array.render(vertices=count, first=first, instances=instances)

    def use_geometry(self, program: Program, unit: int, lod: LodParams, pixel_angle: float) -> None:
        """Binds relief and uniforms that the vertex stage reads, to a texture unit. pixel_angle: metres that a pixel
        covers at one metre."""
        self.meso.use(unit)
        program.set(meso_relief=unit, meso_fade=lod.meso_fade, pixel_angle=pixel_angle, **self.geometry, **self.relief)

    def use_surface(self, program: Program, first_unit: int) -> None:
        """Binds images and uniforms that `surface_at` reads, to five texture units from `first_unit` on."""
        images: dict[str, moderngl.Texture | moderngl.TextureArray] = {
            "page_normals": self.normals,
            "page_colours": self.colours,
            "page_tints": self.tints,
            "page_table": self.page_table,
            "meso_relief": self.meso,
        }
        for unit, (name, image) in enumerate(images.items(), first_unit):
            image.use(unit)
            program.set(**{name: unit})
        program.set(**self.surface, **self.relief)


class AssetStore:
    """Uploads assets and owns their GL objects. Several passes draw from it.

    Meshes go by the number of their asset. Depth objects, of which an asset may have several, are numbered from there
    on, in the order in which they are asked for, and keep their numbers when all is released.

    budget: bytes of GPU memory for depth objects and the meshes that stand in for them, which `stream` keeps to;
    before_release: called before GL objects of some go; form: of what is uploaded; to be set while it is empty.
    """

    def __init__(self, device: Device, library: Library) -> None:
        self.gl = device.scope("assets")
        self.budget = DEFAULT_BUDGET
        self.before_release: Callable[[], None] = lambda: None
        self.form = Form()
        self._library = library
        self._assets: list[int] = []  # of each depth object
        self._numbers: dict[int, range] = {}
        self._prepared: dict[int, Prepared] = {}
        self._depth: dict[int, DepthObject] = {}  # the last used last
        self._warned = False
        self.meshes = MeshStore(self.gl, library)

    def __len__(self) -> int:
        """One more than the largest number given."""
        return len(self._library) + len(self._assets)

    @property
    def first_depth(self) -> int:
        """The number from which on depth objects are numbered."""
        return len(self._library)

    def knows(self, asset: int) -> bool:
        """Whether `depth_numbers` need not read the depth images of `asset`."""
        return asset in self._numbers

    def depth_numbers(self, asset: int) -> range:
        """The numbers of the depth objects that show `asset`; its depth images are read for it."""
        if asset not in self._numbers:
            objects, first = self._prepare(asset), len(self)
            self._assets += [asset] * len(objects)
            self._numbers[asset] = range(first, len(self))
            self._prepared.update(zip(self._numbers[asset], objects, strict=True))
        return self._numbers[asset]

    def prepared(self, number: int) -> Prepared:
        """What depth object `number` is, without its pixels."""
        if number not in self._prepared:
            asset = self.asset_of(number)
            self._prepared.update(zip(self._numbers[asset], self._prepare(asset), strict=True))
        return self._prepared[number]

    def baked(self, number: int) -> BakedObject:
        """What depth object `number` is made of; read for it."""
        asset = self.asset_of(number)
        return as_drawn(self._model(asset).parts[number - self._numbers[asset].start])

    def depth_object(self, number: int) -> DepthObject:
        if number not in self._depth:
            prepared = self.prepared(number)
            try:
                grids, pages = prepared.load()
            except OSError:  # removed from the cache meanwhile
                del self._prepared[number]
                prepared = self.prepared(number)
                grids, pages = prepared.load()
            self._depth[number] = _upload_depth(self.gl, prepared.outline, grids, pages)
        return self._depth[number]

    def stream(self, needed: Sequence[int], seconds: float | None) -> NDArray[np.bool_]:
        """Uploads the depth objects `needed`, in that order, and lets go of those not used for longest where the budget
        would not hold both. Which of all numbers are there (numbers,); meshes always are.

        seconds: after which no further upload begins, so that frames stay even; None: all that is needed comes. What a
        frame needs is never let go of: where that is more than the budget, a warning says so once.
        """
        start = time.perf_counter()
        for number in needed:
            if number in self._depth:
                self._depth[number] = self._depth.pop(number)
        for number in needed:
            if number in self._depth:
                continue
            if seconds is not None and time.perf_counter() - start > seconds:
                break
            self._make_room(self.prepared(number).bytes, set(needed))
            self.depth_object(number)
        self._make_room(0, set(needed))  # for what a frame before needed that was too much
        there = np.ones(len(self), bool)
        there[len(self._library) :] = [number in self._depth for number in range(len(self._library), len(self))]
        return there

    @property
    def gpu_bytes(self) -> int:
        """What depth objects, and meshes that stand in for them, take on the GPU."""
        return sum(self._prepared[number].bytes for number in self._depth) + self.meshes.stand_in_bytes

    @property
    def depth_count(self) -> int:
        """How many depth objects are on the GPU."""
        return len(self._depth)

    def _make_room(self, size: int, needed: set[int]) -> None:
        if self.gpu_bytes + size <= self.budget:
            return
        unused, unwanted = [number for number in self._depth if number not in needed], self.meshes.unwanted
        if unused or unwanted:
            self.before_release()
        self.meshes.let_go(unwanted)
        excess = self.gpu_bytes + size - self.budget
        for number in unused:
            if excess <= 0:
                return
            drawn = self._depth.pop(number)
            self.gl.free(
                drawn.vertices, drawn.indices, drawn.normals, drawn.colours, drawn.tints, drawn.page_table, drawn.meso
            )
            excess -= self._prepared[number].bytes
        if excess > 0 and not self._warned:
            self._warned = True
            log.warning("what is in sight takes more GPU memory than render.gpu_memory: %d MB", self.budget / 1e6)

    def asset_of(self, number: int) -> int:
        """The asset that depth object `number` shows, or a part of which."""
        return self._assets[number - len(self._library)]

    def _model(self, asset: int) -> BakedModel:
        model = self._library.baked(asset)
        if model is None:
            raise LookupError(f"asset {asset} has no depth images")
        return model

    def _prepare(self, asset: int) -> tuple[Prepared, ...]:
        """From the cache; else it is built and the cache keeps it."""
        key = self._library.key(asset)
        objects = find_prepared(key, self.form) if key else None
        if objects is None:
            objects = tuple(prepare(part, self.form) for part in self._model(asset).parts)
            if key:
                try:
                    return keep_prepared(key, self.form, objects)
                except OSError as error:  # they stay in memory
                    log.warning("cannot keep what was prepared of depth images: %s", error)
        return objects

    def texture(self, path: Path | None) -> NDArray[np.uint8]:
        """Texels (H, W, 4) of an image file, sRGB; one white texel for None."""
        return WHITE if path is None else self._library.texture(path)

    def release(self) -> None:
        self.before_release()
        self.gl.release()
        self._depth.clear()
        self._prepared.clear()
        self.meshes.forget()


def _upload_depth(gl: Scope, baked: BakedObject, grids: Grids, pages: Pages) -> DepthObject:
    """baked: without pixels, see `Prepared`."""
    images, cylinder = baked.images, baked.cylinder
    height, width = shape = images[0].depth.shape
    faces = np.array([image.face for image in images])
    pictures = {"COLOURED": pages.colours, "TINTED": pages.tints}
    return DepthObject(
        gl.buffer(grids.vertices),
        gl.buffer(grids.indices),
        grids.indices.dtype,
        grids.chunks,
        _upload_picture(gl, pages.normals, LEVELS),
        _upload_picture(gl, pages.colours, LEVELS),
        _upload_picture(gl, pages.tints, LEVELS - 1),
        gl.number_array((*pages.table.shape[2:0:-1], len(images)), 2, pages.table.tobytes(), "i2"),
        _upload_meso(gl, baked.meso),
        geometry={
            "box_low": tuple(grids.box_low.tolist()),
            "box_size": tuple(grids.box_size.tolist()),
            "setback": _SETBACK * square_texel(baked),
            "meso_spacing": max(max(texel_size(cylinder, image.face, shape)) for image in images),
        },
        colour_defines=tuple(name for name, picture in pictures.items() if picture.size),
        surface={
            "texels": [1 / max(texel_size(cylinder, face, shape)) for face in Face],
            "shininess": baked.shininess,
            "first_colour": tuple(pages.palette[0].tolist()),
            "colour_axes": tuple(pages.palette[1:].ravel().tolist()),
            "image_size": (width, height),
            "first_rows": pages.first_rows,
            "last_segment": pages.last_segment,
        },
        relief=_relief(baked.meso, cylinder)
        | {
            "cylinder": (cylinder.radius, cylinder.bottom, cylinder.half_width, cylinder.half_depth),
            "cylinder_height": cylinder.height,
            "first_images": [int((faces < face).sum()) for face in Face],
        },
    )


def _upload_picture(gl: Scope, texels: NDArray[np.int8] | NDArray[np.uint8], levels: int) -> moderngl.Texture:
    """texels: (H, W, k); those that are signed have one component."""
    if not texels.size:
        texels = np.zeros((1, 1, 1), np.uint8)  # nothing looks it up
    height, width, components = texels.shape
    layout: dict[str, Any] = {"dtype": "ni1", "internal_format": R8_SNORM} if texels.dtype == np.int8 else {}
    return gl.mipmapped_texture((width, height), components, texels.tobytes(), levels, **layout)


def _upload_meso(gl: Scope, meso: Meso | None) -> moderngl.Texture:
    relief = np.zeros((1, 1, 3), np.float32) if meso is None else meso.relief
    texels = np.concatenate([relief, np.zeros_like(relief[..., :1])], -1).astype(np.float16)
    return gl.tiling_texture((texels.shape[1], texels.shape[0]), 4, texels.tobytes(), dtype="f2")


def _relief(meso: Meso | None, cylinder: Cylinder) -> dict[str, Any]:
    """Uniforms of common/meso.glsl; without meso-structure only its height of 0 is read."""
    if meso is None:
        return {"meso_height": 0.0}
    height, width = meso.relief.shape[:2]
    return {
        "meso_height": meso.height,
        "meso_tile": meso.tile,
        "meso_turn": float(meso.tiles_per_turn(cylinder.radius)),
        "meso_texels": max(width / meso.tile[0], height / meso.tile[1]),
    }


DEFAULT_BUDGET = 2 << 30  # bytes: with pictures and atlas at 4K, half of what cards have at least
_SETBACK = 0.5  # texels; 0, 0.5, 1 and 2 were tried on five models, and most alike were the pictures at 0.5
