"""Upload depth images: their geometry as vertex and index buffers, and a uniform block that shaders read of each.

A baked object is drawn in two steps. First its geometry is warped into an impostor or drawn straight into the picture,
which needs `use_geometry`. Later each pixel looks up the surface that it shows, which needs `use_surface`.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.face_grid import FaceGrid, square_texel
from depthwalk.bake.images import FACE_COUNT, BakedObject, Cylinder, Face
from depthwalk.bake.meso import Meso
from depthwalk.cook.cases import ALL_PIECES, piece_runs
from depthwalk.cook.index_chunks import Chunks, chunk_runs, vertex_numbers
from depthwalk.cook.lod_geometry import VERTEX_BYTES, LodGeometry, vertex_positions
from depthwalk.cook.virtual_texture import MAX_MIP_TIERS
from depthwalk.geometry.adjacency import Shape
from depthwalk.gpu.device import Scope
from depthwalk.gpu.instances import AssetArrays, InstanceStream
from depthwalk.gpu.program import Program
from depthwalk.render.resources.foliage import is_foliage
from depthwalk.render.resources.reflections import of_texels
from depthwalk.render.resources.surface_texture import SurfaceTexture
from depthwalk.scene.object_settings import LodParams

# Texels by which boundary strips are set back: they extrapolate a surface, and must not hide its samples. Of 0, 0.5, 1
# and 2, tried on five models, 0.5 gave the pictures most like those of the meshes.
_SETBACK = 0.5

# What looking up a surface reads, in the order of its texture units. Each has its own, as not all objects have all.
_PAGES = "page_normals", "page_colours", "page_tints", "page_table", "page_coordinates"
_SAMPLERS = *_PAGES, "base_texture", "page_reflections", "meso_relief"
SURFACE_UNITS = len(_SAMPLERS)

# std140: vectors of three begin at multiples of 16 bytes, as do all elements of arrays.
DEPTH_OBJECT = np.dtype(
    [
        ("cylinder", "4f4"),
        ("box_low", "3f4"),
        ("setback", "f4"),
        ("box_size", "3f4"),
        ("meso_spacing", "f4"),
        ("cylinder_height", "f4"),
        ("shininess", "f4"),
        ("image_size", "2f4"),
        ("meso_tile", "2f4"),
        ("meso_turn", "f4"),
        ("meso_texels", "f4"),
        ("meso_height", "f4"),
        ("last_mip_tier", "i4"),
        ("page_detail", "i4"),
        ("colour_level", "i4"),
        ("reflection", "4f4"),
        ("first_colour", "4f4"),
        ("colour_axes", "12f4"),
        ("first_images", "i4", (FACE_COUNT, 4)),
        ("texels", "f4", (FACE_COUNT, 4)),
        ("first_rows", "i4", (MAX_MIP_TIERS, 4)),
    ]
)
"""The uniform block of shaders/common/depth_object.glsl; of the elements of arrays only the first number counts."""
_BINDING = 2  # of the block; 0 and 1 are those of `render.view.view_block`
DEPTH_OBJECT_BLOCK = {"DepthObject": _BINDING}  # the `blocks` of each `Program` that draws depth images


def surface_samplers(first_unit: int) -> dict[str, int]:
    """Return the units of the samplers that look surfaces up, by name; first_unit: see `DepthObject.use_surface`."""
    return {name: unit for unit, name in enumerate(_SAMPLERS, first_unit)}


def depth_object_record(**values: Any) -> NDArray[np.void]:
    """Return a single DEPTH_OBJECT record of `values`, by the names of its fields; the others are 0."""
    record = np.zeros((), DEPTH_OBJECT)
    _fill(record, values)
    return record


def _fill(record: NDArray[np.void], values: Mapping[str, Any]) -> None:
    """Write `values` into the fields of a single DEPTH_OBJECT record."""
    for name, value in values.items():
        field = record[name]
        (field if field.ndim < 2 else field[:, 0])[...] = value


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
    record
        A single DEPTH_OBJECT record, what shaders read of the object.
    block
        The same on the GPU.
    least_texels
        The texels per metre of the face that has the fewest, object frame.
    bytes
        Bytes of GPU memory that geometry and texture take.
    keeps_normals
        Whether normals that face away from the viewer stay as they are, see `BakedObject`.
    is_unlit
        Whether its surfaces are shown without light.
    reflects
        Whether its surfaces reflect the sky.
    tells_roughness
        Whether its texels tell roughness and metalness, see `BakedObject`.
    """

    vertices: moderngl.Buffer
    indices: moderngl.Buffer
    index_type: np.dtype[np.unsignedinteger]
    chunks: Chunks
    finest: tuple[tuple[int, int], ...]
    texture: SurfaceTexture | None
    meso: moderngl.Texture
    record: NDArray[np.void]
    block: moderngl.Buffer
    least_texels: float
    keeps_normals: bool = False
    is_unlit: bool = False
    reflects: bool = False
    tells_roughness: bool = False

    @cached_property
    def defines(self) -> tuple[str, ...]:
        """Return the defines of the shaders that draw the geometry: `MESO` for an object with meso-structure."""
        return ("MESO",) if self.record["meso_height"] > 0 else ()

    @property
    def surface_defines(self) -> tuple[str, ...]:
        """Return the defines of the shader that looks up the surface: meso-structure, kinds of colour and normal."""
        normals = ("KEEPS_NORMALS",) if self.keeps_normals else ()
        light = ("UNLIT",) if self.is_unlit else ("TELLS_ROUGHNESS",) if self.tells_roughness else ()
        return *self.defines, *normals, *light, *self._shown_texture.defines

    @property
    def owned(self) -> tuple[moderngl.Buffer | moderngl.Texture | moderngl.TextureArray, ...]:
        """Return all GL objects of this object, to be freed when it is evicted."""
        textures = () if self.texture is None else self.texture.owned
        return self.vertices, self.indices, self.meso, self.block, *textures

    def __post_init__(self) -> None:
        self._geometry_bytes = self.bytes = self.vertices.size + self.indices.size

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
        low, size = self.record["box_low"], self.record["box_size"]
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

    def use_geometry(self, program: Program, lod: LodParams, relief_unit: int = 0) -> None:
        """Bind what the vertex stage reads: the uniform block and, where there is one, the meso-structure.

        Parameters
        ----------
        program
            The program that draws, with `DEPTH_OBJECT_BLOCK` as `blocks`.
        lod
            The settings of detail.
        relief_unit
            The texture unit of the meso-structure.
        """
        self.block.bind_to_uniform_block(_BINDING)
        if self.defines:
            self.meso.use(relief_unit)
            program.set(meso_fade=lod.meso_fade)

    def use_surface(self, program: Program, first_unit: int, lod: LodParams) -> None:
        """Bind what looking up a surface reads: the uniform block, and textures to `SURFACE_UNITS` texture units.

        Parameters
        ----------
        program
            The program that looks surfaces up, with `DEPTH_OBJECT_BLOCK` as `blocks` and `surface_samplers` set.
        first_unit
            The number of the first texture unit.
        lod
            The settings of detail.
        """
        for unit, image in enumerate(self._shown_texture.images, first_unit):
            if image is not None:
                image.use(unit)
        self.use_geometry(program, lod, first_unit + SURFACE_UNITS - 1)

    def show_texture(self, gl: Scope, texture: SurfaceTexture) -> None:
        """Look surfaces up in `texture` from now on. gl: the scope that owns the object."""
        self.texture, self.bytes = texture, self._geometry_bytes + texture.bytes
        _fill(self.record, texture.uniforms)
        gl.refill(self.block, self.record)

    def free_texture(self, gl: Scope) -> None:
        """Free the texture, if there is one, before another is shown. gl: the scope that owns the object."""
        if self.texture is not None:
            gl.free(*self.texture.owned)
        self.texture, self.bytes = None, self._geometry_bytes


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
    texels_per_metre = [1 / texels[face].longest_texel for face in Face]
    record = depth_object_record(
        box_low=grids.box_low,
        box_size=grids.box_size,
        setback=_SETBACK * square_texel(baked),
        meso_spacing=max(texels[image.face].longest_texel for image in images),
        texels=texels_per_metre,
        shininess=baked.shininess,
        image_size=(width, height),
        cylinder=(cylinder.radius, cylinder.bottom, cylinder.half_width, cylinder.half_depth),
        cylinder_height=cylinder.height,
        first_images=[(faces < face).sum() for face in Face],
        reflection=(0, 0, 0, 0) if baked.reflection is None else (*of_texels(baked.reflection), 0),
        **_relief(baked.meso, cylinder),
    )
    return DepthObject(
        vertices=gl.buffer(grids.vertices),
        indices=gl.buffer(grids.indices),
        index_type=grids.indices.dtype,
        chunks=grids.chunks,
        finest=tuple(piece_runs(grids.first[0], grids.count[0], ALL_PIECES)),
        texture=None,
        meso=_upload_meso(gl, baked.meso),
        record=record,
        block=gl.buffer(record, dynamic=True),
        least_texels=min(texels_per_metre),
        keeps_normals=baked.keeps_normals,
        is_unlit=baked.is_unlit,
        reflects=baked.reflection is not None,
        tells_roughness=baked.tells_roughness,
    )


def _upload_meso(gl: Scope, meso: Meso | None) -> moderngl.Texture:
    """Upload the tile of relief, which repeats; one texel without depth where there is none."""
    relief = np.zeros((1, 1, 3), np.float32) if meso is None else meso.relief
    texels = np.concatenate([relief, np.zeros_like(relief[..., :1])], -1).astype(np.float16)
    return gl.tiling_texture((texels.shape[1], texels.shape[0]), 4, texels.tobytes(), dtype="f2")


def _relief(meso: Meso | None, cylinder: Cylinder) -> dict[str, Any]:
    """Return the fields of DEPTH_OBJECT for the meso-structure; none without it."""
    if meso is None:
        return {}
    height, width = meso.relief.shape[:2]
    return {
        "meso_height": meso.height,
        "meso_tile": meso.tile,
        "meso_turn": float(meso.tiles_per_turn(cylinder.radius)),
        "meso_texels": max(width / meso.tile[0], height / meso.tile[1]),
    }
