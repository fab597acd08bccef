"""Depth images on the GPU: grids as vertex and index buffers, pages as pictures, and the uniforms that tell of them."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.face_grid import FaceGrid, square_texel
from depthwalk.bake.images import BakedObject, Cylinder, Face
from depthwalk.bake.meso import Meso
from depthwalk.cook.index_chunks import Chunks, chunk_runs, vertex_numbers
from depthwalk.cook.lod_geometry import GRID_LAYOUT, VERTEX_BYTES, LodGeometry, vertex_positions
from depthwalk.cook.virtual_texture import LEVELS, VirtualTexture
from depthwalk.geometry.adjacency import Shape
from depthwalk.gpu.device import R8_SNORM, Scope
from depthwalk.gpu.instances import AssetArrays
from depthwalk.gpu.program import Program
from depthwalk.scene.render_settings import LodParams

_SETBACK = 0.5  # texels; 0, 0.5, 1 and 2 were tried on five models, and most alike were the pictures at 0.5


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
    colour_defines: tuple[str, ...]  # of common/virtual_texture.glsl
    surface: dict[str, Any]  # uniforms of common/depth_images.glsl and common/virtual_texture.glsl
    relief: dict[str, Any]  # uniforms of common/meso.glsl and common/faces.glsl

    @property
    def defines(self) -> tuple[str, ...]:
        """What the shaders that draw it are told."""
        return ("MESO",) if self.relief["meso_height"] > 0 else ()

    @property
    def surface_defines(self) -> tuple[str, ...]:
        """What the shader that looks its surface up is told."""
        return *self.defines, *self.colour_defines

    @property
    def owned(self) -> tuple[moderngl.Buffer | moderngl.Texture | moderngl.TextureArray, ...]:
        """The GL objects that are its own."""
        textures = self.normals, self.colours, self.tints, self.page_table, self.meso
        return self.vertices, self.indices, *textures

    def shape(self, runs: Sequence[tuple[int, int]]) -> Shape:
        """Positions (v, 3), metres, and triangles (t, 3) of runs of indices, first and count each, read back."""
        low, size = (np.array(self.geometry[name], np.float32) for name in ("box_low", "box_size"))
        samples = np.frombuffer(self.vertices.read(), np.uint16).reshape(-1, 4)
        indices = np.frombuffer(self.indices.read(), self.index_type)
        numbers = [vertex_numbers(indices, self.chunks, first, count) for first, count in runs]
        corners, triangles = np.unique(np.concatenate(numbers), return_inverse=True)
        positions = vertex_positions(samples[corners], low, size).astype(np.float32)
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

    def use_geometry(self, program: Program, unit: int, lod: LodParams) -> None:
        """Binds relief and uniforms that the vertex stage reads, to a texture unit."""
        self.meso.use(unit)
        program.set(meso_relief=unit, meso_fade=lod.meso_fade, **self.geometry, **self.relief)

    def use_surface(self, program: Program, first_unit: int, lod: LodParams) -> None:
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
        program.set(meso_fade=lod.meso_fade, **self.surface, **self.relief)


def upload_depth(gl: Scope, baked: BakedObject, grids: LodGeometry, pages: VirtualTexture) -> DepthObject:
    """baked: without pixels, see `CookedObject`."""
    images, cylinder = baked.images, baked.cylinder
    height, width = images[0].depth.shape
    texels = {face: FaceGrid(cylinder=cylinder, face=face, height=height, width=width) for face in Face}
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
            "meso_spacing": max(texels[image.face].longest_texel for image in images),
        },
        colour_defines=tuple(name for name, picture in pictures.items() if picture.size),
        surface={
            "texels": [1 / texels[face].longest_texel for face in Face],
            "shininess": baked.shininess,
            "first_colour": tuple(pages.palette[0].tolist()),
            "colour_axes": tuple(pages.palette[1:].ravel().tolist()),
            "image_size": (width, height),
            "first_rows": pages.first_rows,
            "last_mip_tier": pages.last_mip_tier,
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
