"""Upload meshes: vertex and index buffers, and materials with their textures.

A mesh may have several levels of detail. Each level is a `MeshObject` with its own buffers; all share one `MeshLook`,
the materials.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import moderngl
import numpy as np
from numpy.typing import NDArray

from depthwalk.geometry.adjacency import Shape
from depthwalk.gpu.device import Scope
from depthwalk.gpu.program import Program
from depthwalk.ingest.mesh import Material, Mesh, Part
from depthwalk.render.resources.meshlets import Meshlets
from depthwalk.render.resources.reflections import REFLECTS, of_highlight

WHITE = np.full((1, 1, 4), 255, np.uint8)  # the texture of materials without one
# moderngl's format of a vertex, and the attributes that a pass reads: all, all but colour and uv, or positions only.
PAINTED_LAYOUT = ("3f 3f 3f1 1x1 2f", "in_position", "in_normal", "in_colour", "in_uv")
PLAIN_LAYOUT = ("3f 3f 12x", "in_position", "in_normal")
POSITION_LAYOUT = ("3f 24x", "in_position")
CUT_OUT_LAYOUT = ("3f 16x 2f", "in_position", "in_uv")  # for shadows of meshes with cut-outs
# Texture units; 0 is that of the colours, and 1 to 3 are those of `render.cluster_drawing`.
_NORMAL_MAP, _REFLECTION_MAP = 4, 5
_VERTEX = np.dtype([("position", "3f4"), ("normal", "3f4"), ("colour", "4u1"), ("uv", "2f4")])
# An estimate for meshes that are not read yet: a smooth one has half a vertex per triangle, a faceted one three.
BYTES_PER_TRIANGLE = 3 * 4 + _VERTEX.itemsize


class MaterialLook(NamedTuple):
    """Hold a material on the GPU.

    Attributes
    ----------
    texture
        The colours; one white texel for a material without texture.
    uniforms
        The uniforms of shaders/mesh/mesh.frag, by name.
    painted
        Whether the texture or the vertices have colours, or there is another map, so that the mesh is drawn with
        PAINTED_LAYOUT.
    cutoff
        Alpha of the texture below which there is no surface; None: the surface is everywhere.
    normal_map
        The normals in tangent space; None: those of the vertices.
    unlit
        Whether the surface is shown without light.
    reflects
        Whether the surface reflects the sky.
    reflection_map
        Roughness and metalness; None: they are the same everywhere.
    """

    texture: moderngl.Texture
    uniforms: dict[str, Any]
    painted: bool
    cutoff: float | None = None
    normal_map: moderngl.Texture | None = None
    unlit: bool = False
    reflects: bool = False
    reflection_map: moderngl.Texture | None = None

    def defines(self, sky_lights: bool) -> tuple[str, ...]:
        """Return the defines of shaders/mesh/mesh.frag. sky_lights: whether the sky lights the scene."""
        has = {
            "PAINTED": self.painted,
            "CUT_OUT": self.cutoff is not None,
            "NORMAL_MAP": self.normal_map is not None,
            "UNLIT": self.unlit,
            REFLECTS: self.reflects and sky_lights,
            "REFLECTION_MAP": self.reflection_map is not None,
        }
        return tuple(name for name, present in has.items() if present)

    @property
    def textures(self) -> tuple[moderngl.Texture, ...]:
        """Return its textures."""
        return tuple(filter(None, (self.texture, self.normal_map, self.reflection_map)))

    def use(self, program: Program) -> None:
        """Bind the textures and set the uniforms of a program that was compiled with `defines`."""
        self.texture.use(0)
        if self.normal_map is not None:
            self.normal_map.use(_NORMAL_MAP)
        if self.reflection_map is not None:
            self.reflection_map.use(_REFLECTION_MAP)
        program.set(**self.uniforms)


@dataclass
class MeshLook:
    """Hold what all levels of a mesh share.

    Attributes
    ----------
    materials
        The materials, on the GPU.
    solid
        Whether back faces are never visible, see `is_solid`.
    """

    materials: list[MaterialLook]
    solid: bool

    @property
    def has_cut_outs(self) -> bool:
        """Return whether a material cuts anything out."""
        return any(material.cutoff is not None for material in self.materials)

    @property
    def has_unlit(self) -> bool:
        """Return whether a material is shown without light."""
        return any(material.unlit for material in self.materials)

    @property
    def reflects(self) -> bool:
        """Return whether a material reflects the sky."""
        return any(material.reflects for material in self.materials)


@dataclass(kw_only=True)
class MeshObject:
    """Hold one level of a mesh on the GPU, whose GL objects belong to the mesh store.

    Attributes
    ----------
    parts
        The runs of triangles that have one material each.
    vertices
        The buffer of vertices: position, normal, colour and texture coordinates, see `PAINTED_LAYOUT`.
    indices
        The buffer of indices, three uint32 per triangle.
    look
        The materials.
    meshlets
        The meshlets, in whose order the triangles are; None where the level is always drawn whole.
    """

    parts: tuple[Part, ...]
    vertices: moderngl.Buffer
    indices: moderngl.Buffer
    look: MeshLook
    meshlets: Meshlets | None

    def shape(self) -> Shape:
        """Read the geometry back from the GPU.

        Returns
        -------
        Shape
            Positions (v, 3) float32, metres, asset frame, and triangles (t, 3) uint32, rows of these.
        """
        vertices = np.frombuffer(self.vertices.read(), _VERTEX)
        return vertices["position"], np.frombuffer(self.indices.read(), np.uint32).reshape(-1, 3)


def upload_look(gl: Scope, mesh: Mesh, solid: bool) -> MeshLook:
    """Upload the materials of a mesh.

    Parameters
    ----------
    gl
        The scope that owns the textures.
    mesh
        The mesh.
    solid
        Whether back faces are never visible: the result of `is_solid`, which takes too long to compute here.

    Returns
    -------
    MeshLook
        The materials on the GPU.
    """
    coloured = bool((mesh.colours != 255).any())
    return MeshLook([_upload_material(gl, material, coloured) for material in mesh.materials], solid)


def upload_mesh(gl: Scope, mesh: Mesh, look: MeshLook, meshlets: Meshlets | None) -> MeshObject:
    """Upload one level of a mesh into a scope.

    Parameters
    ----------
    gl
        The scope that owns the buffers.
    mesh
        The mesh at this level.
    look
        The materials of the mesh, which all levels share.
    meshlets
        The meshlets of the level; None where it is drawn whole.

    Returns
    -------
    MeshObject
        The level on the GPU.
    """
    rows = np.arange(len(mesh.positions)) if meshlets is None else meshlets.vertices
    faces = mesh.faces if meshlets is None else meshlets.of_parts(mesh.parts)
    vertices = np.zeros(len(rows), _VERTEX)
    vertices["position"], vertices["normal"], vertices["uv"] = mesh.positions[rows], mesh.normals[rows], mesh.uv[rows]
    vertices["colour"][:, :3] = mesh.colours[rows]
    # A mesh without opaque parts gets a degenerate triangle that no part draws, as GL has no empty buffers.
    corners = np.ascontiguousarray(faces if len(faces) else np.zeros((1, 3)), np.uint32)
    indices = gl.buffer(corners)
    return MeshObject(
        parts=mesh.parts, vertices=gl.buffer(vertices.view(np.uint8)), indices=indices, look=look, meshlets=meshlets
    )


def _upload_material(gl: Scope, material: Material, coloured: bool) -> MaterialLook:
    """Upload a material. coloured: whether vertices of the mesh have colours."""
    texels = WHITE if material.texture is None else material.texture[::-1]
    texture = gl.srgb_texture(texels)
    uniforms = {name: getattr(material, name) for name in ("base_colour", "specular", "shininess")}
    uniforms["base_texture"] = 0
    if material.cutoff is not None:
        uniforms["cutoff"] = material.cutoff
    normal_map = None if material.normal_map is None else upload_map(gl, material.normal_map)
    if normal_map is not None:
        uniforms |= {"normal_map": _NORMAL_MAP, "normal_scale": material.normal_scale}
    if material.reflection is not None:
        uniforms["reflection"] = of_highlight(material.reflection)
    reflection_map = None if material.reflection_map is None else upload_map(gl, material.reflection_map)
    if reflection_map is not None:
        uniforms["reflection_map"] = _REFLECTION_MAP
    maps = material.texture, normal_map, reflection_map
    return MaterialLook(
        texture,
        uniforms,
        painted=coloured or any(each is not None for each in maps),
        cutoff=material.cutoff,
        normal_map=normal_map,
        unlit=material.unlit,
        reflects=material.reflection is not None,
        reflection_map=reflection_map,
    )


def upload_map(gl: Scope, texels: NDArray[np.uint8]) -> moderngl.Texture:
    """Upload a map of numbers into a scope; its mip-maps hold means, which are filtered like the texels of a texture.

    Parameters
    ----------
    gl
        The scope that owns the texture.
    texels
        (H, W, k) uint8, row 0 at the top, see `Material.normal_map` and `Material.reflection_map`.

    Returns
    -------
    moderngl.Texture
        The texture, row 0 at v = 0.
    """
    height, width, components = texels.shape
    return gl.tiling_texture((width, height), components, np.ascontiguousarray(texels[::-1]).tobytes())
