"""Assets on the GPU: depth images as grids and texture arrays, meshes as vertex buffers. Loaded when first drawn."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import moderngl
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

from depthwalk.bake.images import BakedObject, Cylinder, Face, square_texel, texel_size
from depthwalk.bake.meso import Meso
from depthwalk.gpu.device import Device, Scope
from depthwalk.gpu.program import Program
from depthwalk.ingest.mesh import Mesh, Part
from depthwalk.render.grids import Grids, build_grids
from depthwalk.render.lod import LodParams


class Library(Protocol):
    """Where the renderer gets assets from, by number; it never reads files itself."""

    def __len__(self) -> int: ...
    def has_baked(self, asset: int) -> bool: ...
    def has_mesh(self, asset: int) -> bool: ...
    def baked(self, asset: int) -> BakedObject | None: ...
    def mesh(self, asset: int) -> Mesh | None: ...
    def texture(self, path: Path) -> NDArray[np.uint8]: ...


@dataclass
class DepthObject:
    """A baked object on the GPU. first, count: see Grids."""

    baked: BakedObject
    first: NDArray[np.int64]
    count: NDArray[np.int64]
    vertices: moderngl.Buffer
    indices: moderngl.Buffer
    albedo: moderngl.TextureArray
    normal: moderngl.TextureArray
    meso: moderngl.Texture
    geometry: dict[str, Any]  # uniforms of the vertex stage
    surface: dict[str, Any]  # uniforms of common/depth_images.glsl
    relief: dict[str, Any]  # uniforms of common/meso.glsl and common/faces.glsl

    def use_geometry(self, program: Program, unit: int, lod: LodParams, pixel_angle: float) -> None:
        """Binds relief and uniforms that the vertex stage reads, to a texture unit. pixel_angle: metres that a pixel
        covers at one metre."""
        self.meso.use(unit)
        program.set(meso_relief=unit, meso_fade=lod.meso_fade, pixel_angle=pixel_angle, **self.geometry, **self.relief)

    def use_surface(self, program: Program, units: tuple[int, int, int]) -> None:
        """Binds images and uniforms that `surface_at` reads, to three texture units."""
        self.albedo.use(units[0])
        self.normal.use(units[1])
        self.meso.use(units[2])
        images = {"albedo_images": units[0], "normal_images": units[1], "meso_relief": units[2]}
        program.set(**images, **self.surface, **self.relief)


@dataclass
class MeshObject:
    """A mesh on the GPU; textures: one per material."""

    parts: tuple[Part, ...]
    vertices: moderngl.Buffer
    indices: moderngl.Buffer
    textures: list[moderngl.Texture]
    materials: list[dict[str, Any]]


class AssetStore:
    """Uploads assets once and owns their GL objects. Several passes draw from it."""

    def __init__(self, device: Device, library: Library) -> None:
        self.gl = device.scope("assets")
        self._library = library
        self._depth: dict[int, DepthObject] = {}
        self._grids: dict[int, Grids] = {}
        self._mesh: dict[int, MeshObject] = {}

    def depth_object(self, asset: int) -> DepthObject:
        if asset not in self._depth:
            baked = self._library.baked(asset)
            if baked is None:
                raise LookupError(f"asset {asset} has no depth images")
            self._depth[asset] = _upload_baked(self.gl, baked, build_grids(baked))
        return self._depth[asset]

    def grids(self, asset: int) -> Grids:
        """The arrays that `depth_object` uploaded, made again for whoever needs them on this side."""
        if asset not in self._grids:
            self._grids[asset] = build_grids(self.depth_object(asset).baked)
        return self._grids[asset]

    def mesh_object(self, asset: int) -> MeshObject:
        if asset not in self._mesh:
            mesh = self._library.mesh(asset)
            if mesh is None:
                raise LookupError(f"asset {asset} has no mesh")
            self._mesh[asset] = _upload_mesh(self.gl, mesh)
        return self._mesh[asset]

    def texture(self, path: Path | None) -> NDArray[np.uint8]:
        """Texels (H, W, 4) of an image file, sRGB; one white texel for None."""
        return _WHITE if path is None else self._library.texture(path)

    def release(self) -> None:
        self.gl.release()
        self._depth.clear()
        self._grids.clear()
        self._mesh.clear()


def _upload_baked(gl: Scope, baked: BakedObject, grids: Grids) -> DepthObject:
    images = baked.images
    height, width = images[0].depth.shape
    albedo = np.stack([_spread(image.albedo, image.depth) for image in images])
    normal = np.stack([_spread(image.normal, image.depth) for image in images])
    # Colours as square roots: 8 bits suffice, and moderngl offers no sRGB texture arrays.
    colours = _byte(np.concatenate([np.sqrt(np.maximum(albedo[..., :3], 0)), albedo[..., 3:]], -1))
    depth = np.stack([np.minimum(image.depth / _reach(baked.cylinder, image.face), 1) for image in images])
    shading = _byte(np.concatenate([normal / 2 + 0.5, depth[..., None]], -1))
    size = (width, height, len(images))
    cylinder = baked.cylinder
    shape = (height, width)
    faces = np.array([image.face for image in images])
    return DepthObject(
        baked,
        grids.first,
        grids.count,
        gl.buffer(grids.vertices),
        gl.buffer(grids.indices),
        gl.texture_array(size, 4, colours.tobytes(), "f1"),
        gl.texture_array(size, 4, shading.tobytes(), "f1"),
        _upload_meso(gl, baked.meso),
        geometry={
            "box_low": tuple(grids.box_low.tolist()),
            "box_size": tuple(grids.box_size.tolist()),
            "setback": _SETBACK * square_texel(baked),
            "meso_spacing": max(max(texel_size(cylinder, image.face, shape)) for image in images),
        },
        surface={
            "texels": tuple(1 / max(texel_size(cylinder, face, shape)) for face in (Face.SIDE, Face.TOP)),
            "shininess": baked.shininess,
        },
        relief=_relief(baked.meso, cylinder)
        | {
            "cylinder": (cylinder.radius, cylinder.bottom, cylinder.half_width, cylinder.half_depth),
            "cylinder_height": cylinder.height,
            "first_images": (int((faces < Face.SIDE).sum()), int((faces < Face.BOTTOM).sum())),
        },
    )


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


def _reach(cylinder: Cylinder, face: Face) -> float:
    """The greatest depth of a face, metres; empty texels have it too."""
    return 2 * cylinder.radius if face is Face.SIDE else cylinder.height


def _spread(values: NDArray[np.float32], depth: NDArray[np.float32]) -> NDArray[np.float32]:
    """`values` (H, W, C) with every empty texel set to its nearest used one, so that filtering meets no black."""
    empty = ~np.isfinite(depth)
    if not empty.any():
        return values
    rows, columns = distance_transform_edt(empty, return_distances=False, return_indices=True)
    return values[rows, columns]


def _byte(values: NDArray[np.float32]) -> NDArray[np.uint8]:
    return np.round(np.clip(values, 0, 1) * 255).astype(np.uint8)


_SETBACK = 0.5  # texels; 0, 0.5, 1 and 2 were tried on five models, and most alike were the pictures at 0.5
_WHITE = np.full((1, 1, 4), 255, np.uint8)
_VERTEX = np.dtype([("position", "3f4"), ("normal", "3f4"), ("colour", "4u1"), ("uv", "2f4")])
MESH_LAYOUT = ("3f 3f 3f1 1x1 2f", "in_position", "in_normal", "in_colour", "in_uv")


def _upload_mesh(gl: Scope, mesh: Mesh) -> MeshObject:
    vertices = np.zeros(len(mesh.positions), _VERTEX)
    vertices["position"], vertices["normal"], vertices["uv"] = mesh.positions, mesh.normals, mesh.uv
    vertices["colour"][:, :3] = mesh.colours
    textures, materials = [], []
    for material in mesh.materials:
        texels = _WHITE if material.texture is None else np.ascontiguousarray(material.texture[::-1])
        textures.append(gl.srgb_texture((texels.shape[1], texels.shape[0]), texels.tobytes()))
        materials.append(
            {
                "base_colour": tuple(material.base_colour),
                "specular": material.specular,
                "shininess": material.shininess,
            }
        )
    indices = gl.buffer(np.ascontiguousarray(mesh.faces, np.uint32))
    return MeshObject(mesh.parts, gl.buffer(vertices.view(np.uint8)), indices, textures, materials)
