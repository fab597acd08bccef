"""Upload depth images: their geometry as vertex and index buffers, and the uniforms of the shaders that draw them.

A baked object is drawn in two steps. First its geometry is warped into an impostor or drawn straight into the picture,
which needs `use_geometry`. Later each pixel looks up the surface that it shows, which needs `use_surface`.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.face_grid import FaceGrid, square_texel
from depthwalk.bake.images import BakedObject, Cylinder, Face
from depthwalk.bake.meso import Meso
from depthwalk.cook.cases import ALL_PIECES, piece_runs
from depthwalk.cook.index_chunks import Chunks, chunk_runs, vertex_numbers
from depthwalk.cook.lod_geometry import VERTEX_BYTES, LodGeometry, vertex_positions
from depthwalk.geometry.adjacency import Shape
from depthwalk.gpu.device import Scope
from depthwalk.gpu.instances import AssetArrays, InstanceStream
from depthwalk.gpu.program import Packed, Program
from depthwalk.render.resources.foliage import is_foliage
from depthwalk.render.resources.surface_texture import SurfaceTexture
from depthwalk.scene.object_settings import LodParams

# Texels by which boundary strips are set back: they extrapolate a surface, and must not hide its samples. Of 0, 0.5, 1
# and 2, tried on five models, 0.5 gave the pictures most like those of the meshes.
_SETBACK = 0.5

SURFACE_UNITS = 7  # texture units that looking up a surface takes


@dataclass(kw_only=True)
class DepthObject:
    """Hold a baked object on the GPU, whose GL objects belong to the asset store.

    Attributes
    ----------
    vertices
        The samples of all levels, packed as in `cook.lod_geometry`.
    indices
        The triangles of all levels.
    index_type
        The type of the indices.
    chunks
        The runs of indices that one draw call can take, small enough for 16 bits.
    finest
        First index and number of indices of the runs that draw the object in all its detail.
    texture
        Colours and normals; None until `TextureStreaming.fit` has chosen their resolution.
    meso
        The relief of the meso-structure, which repeats; one texel for an object without meso-structure.
    geometry
        Uniforms of the vertex stage, by name.
    surface
        Uniforms of shaders/common/depth_images.glsl, by name.
    relief
        Uniforms of shaders/common/meso.glsl and faces.glsl, by name.
    keeps_normals
        Whether normals that face away from the viewer stay as they are, see `BakedObject`.
    is_unlit
        Whether its surfaces are shown without light.
    """

    vertices: moderngl.Buffer
    indices: moderngl.Buffer
    index_type: np.dtype[np.unsignedinteger]
    chunks: Chunks
    finest: tuple[tuple[int, int], ...]
    texture: SurfaceTexture | None
    meso: moderngl.Texture
    geometry: dict[str, Any]
    surface: dict[str, Any]
    relief: dict[str, Any]
    keeps_normals: bool = False
    is_unlit: bool = False

    @property
    def defines(self) -> tuple[str, ...]:
        """Return the defines of the shaders that draw the geometry: `MESO` for an object with meso-structure."""
        return ("MESO",) if self.relief["meso_height"] > 0 else ()

    @property
    def surface_defines(self) -> tuple[str, ...]:
        """Return the defines of the shader that looks up the surface: meso-structure, kinds of colour and normal."""
        normals = ("KEEPS_NORMALS",) if self.keeps_normals else ()
        light = ("UNLIT",) if self.is_unlit else ()
        return *self.defines, *normals, *light, *self._shown_texture.defines

    @property
    def owned(self) -> tuple[moderngl.Buffer | moderngl.Texture | moderngl.TextureArray, ...]:
        """Return all GL objects of this object, to be freed when it is evicted."""
        textures = () if self.texture is None else self.texture.owned
        return self.vertices, self.indices, self.meso, *textures

    @property
    def bytes(self) -> int:
        """Return how many bytes of GPU memory geometry and texture take."""
        return self._geometry_bytes + (0 if self.texture is None else self.texture.bytes)

    @cached_property
    def _geometry_bytes(self) -> int:
        return self.vertices.size + self.indices.size

    @property
    def least_texels(self) -> float:
        """Return the texels per metre of the face that has the fewest, object frame."""
        return float(min(self.surface["texels"]))

    @property
    def _shown_texture(self) -> SurfaceTexture:
        """Return the texture, which `TextureStreaming.fit` uploads before anything is looked up."""
        assert self.texture is not None
        return self.texture

    @cached_property
    def shows_backs(self) -> bool:
        """Return whether a viewer inside sees the backs of surfaces, as in foliage; a solid's are never seen."""
        return is_foliage(self.shape(self.finest))

    def shape(self, runs: Sequence[tuple[int, int]]) -> Shape:
        """Read geometry back from the GPU.

        Parameters
        ----------
        runs
            First index and number of indices of each run.

        Returns
        -------
        Shape
            Positions (v, 3) float32, metres, object frame, and triangles (t, 3) uint32, rows of these.
        """
        low, size = (np.array(self.geometry[name], np.float32) for name in ("box_low", "box_size"))
        samples = np.frombuffer(self.vertices.read(), np.uint16).reshape(-1, 4)
        indices = np.frombuffer(self.indices.read(), self.index_type)
        numbers = [vertex_numbers(indices, self.chunks, first, count) for first, count in runs]
        corners, triangles = np.unique(np.concatenate(numbers), return_inverse=True)
        positions = vertex_positions(samples[corners], low, size).astype(np.float32)
        return positions, triangles.reshape(-1, 3).astype(np.uint32)

    def draw(
        self,
        arrays: AssetArrays,
        number: int,
        runs: Sequence[tuple[int, int]],
        instances: InstanceStream,
        records: NDArray[np.void],
    ) -> None:
        """Draw the given runs of indices.

        Parameters
        ----------
        arrays
            The vertex arrays, over all assets, of the program that draws.
        number
            The number of this object in `AssetStore`.
        runs
            First index and number of indices of each run.
        instances
            Takes the records to the GPU.
        records
            (n,) records of the instances that are drawn.
        """
        instances.upload(records)
        buffers = self.vertices, self.indices, self.index_type.itemsize
        for run in runs:
            if run not in self._divided:
                self._divided[run] = chunk_runs(self.chunks, *run)
            for first, count, base in self._divided[run]:
                array = arrays.get((number, base), *buffers, offset=base * VERTEX_BYTES)
                instances.bind(array)
                array.render(vertices=count, first=first, instances=len(records))

    @cached_property
    def _divided(self) -> dict[tuple[int, int], list[tuple[int, int, int]]]:
        """Return a cache of the draw calls for each run of indices; there are few runs, of levels and their pieces."""
        return {}

    def use_geometry(self, program: Program, lod: LodParams) -> None:
        """Bind the meso-structure to the first texture unit, and set the uniforms that the vertex stage reads.

        Parameters
        ----------
        program
            The program that draws.
        lod
            The settings of detail.
        """
        self.meso.use(0)
        key = program, None
        if key not in self._uniforms:
            self._uniforms[key] = program.packed(meso_relief=0, **self.geometry, **self.relief)
        program.use(self._uniforms[key])
        program.set(meso_fade=lod.meso_fade)

    def use_surface(self, program: Program, first_unit: int, lod: LodParams) -> None:
        """Bind textures to at most `SURFACE_UNITS` texture units, and set the uniforms for looking up a surface.

        Parameters
        ----------
        program
            The program that looks surfaces up.
        first_unit
            The number of the first texture unit.
        lod
            The settings of detail.
        """
        texture = self._shown_texture
        images: dict[str, moderngl.Texture | moderngl.TextureArray] = {
            "page_normals": texture.normals,
            "page_colours": texture.colours,
            "page_tints": texture.tints,
            "page_table": texture.page_table,
            "meso_relief": self.meso,
        }
        if texture.coordinates is not None and texture.base is not None:
            images |= {"page_coordinates": texture.coordinates, "base_texture": texture.base}
        for unit, image in enumerate(images.values(), first_unit):
            image.use(unit)
        key = program, (texture.detail, first_unit)
        if key not in self._uniforms:
            units = {name: unit for unit, name in enumerate(images, first_unit)}
            self._uniforms[key] = program.packed(**units, **texture.uniforms, **self.surface, **self.relief)
        program.use(self._uniforms[key])
        program.set(meso_fade=lod.meso_fade)

    @cached_property
    def _uniforms(self) -> dict[tuple[Program, tuple[int, int] | None], Packed]:
        """Return a cache of packed uniforms by program; for surfaces, also by texture detail and first unit."""
        return {}


def upload_depth(gl: Scope, baked: BakedObject, grids: LodGeometry) -> DepthObject:
    """Upload a cooked object into a scope, without its texture.

    Parameters
    ----------
    gl
        The scope that owns the GL objects.
    baked
        The depth images that it was cooked from; their pixels are not needed.
    grids
        The geometry.

    Returns
    -------
    DepthObject
        The object on the GPU, without a texture.
    """
    images, cylinder = baked.images, baked.cylinder
    height, width = images[0].depth.shape
    texels = {face: FaceGrid(cylinder=cylinder, face=face, height=height, width=width) for face in Face}
    faces = np.array([image.face for image in images])
    return DepthObject(
        vertices=gl.buffer(grids.vertices),
        indices=gl.buffer(grids.indices),
        index_type=grids.indices.dtype,
        chunks=grids.chunks,
        finest=tuple(piece_runs(grids.first[0], grids.count[0], ALL_PIECES)),
        texture=None,
        meso=_upload_meso(gl, baked.meso),
        geometry={
            "box_low": tuple(grids.box_low.tolist()),
            "box_size": tuple(grids.box_size.tolist()),
            "setback": _SETBACK * square_texel(baked),
            "meso_spacing": max(texels[image.face].longest_texel for image in images),
        },
        surface={
            "texels": [1 / texels[face].longest_texel for face in Face],
            "shininess": baked.shininess,
            "image_size": (width, height),
        },
        relief=_relief(baked.meso, cylinder)
        | {
            "cylinder": (cylinder.radius, cylinder.bottom, cylinder.half_width, cylinder.half_depth),
            "cylinder_height": cylinder.height,
            "first_images": [int((faces < face).sum()) for face in Face],
        },
        keeps_normals=baked.keeps_normals,
        is_unlit=baked.is_unlit,
    )


def _upload_meso(gl: Scope, meso: Meso | None) -> moderngl.Texture:
    """Upload the tile of relief, which repeats; one texel without depth where there is none."""
    relief = np.zeros((1, 1, 3), np.float32) if meso is None else meso.relief
    texels = np.concatenate([relief, np.zeros_like(relief[..., :1])], -1).astype(np.float16)
    return gl.tiling_texture((texels.shape[1], texels.shape[0]), 4, texels.tobytes(), dtype="f2")


def _relief(meso: Meso | None, cylinder: Cylinder) -> dict[str, Any]:
    """Return the uniforms of shaders/common/meso.glsl; without meso-structure only a height of 0."""
    if meso is None:
        return {"meso_height": 0.0}
    height, width = meso.relief.shape[:2]
    return {
        "meso_height": meso.height,
        "meso_tile": meso.tile,
        "meso_turn": float(meso.tiles_per_turn(cylinder.radius)),
        "meso_texels": max(width / meso.tile[0], height / meso.tile[1]),
    }
