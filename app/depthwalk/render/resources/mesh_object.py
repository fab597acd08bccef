"""Meshes on the GPU: vertex buffers, textures, and whether their back faces can be seen."""

from dataclasses import dataclass
from typing import Any, NamedTuple

import moderngl
import numpy as np

from depthwalk.geometry.adjacency import Shape
from depthwalk.geometry.triangles import row_ids
from depthwalk.gpu.device import Scope
from depthwalk.ingest.mesh import Material, Mesh, Part
from depthwalk.render.resources.meshlets import Meshlets

WHITE = np.full((1, 1, 4), 255, np.uint8)  # the texture of what has none
PAINTED_LAYOUT = ("3f 3f 3f1 1x1 2f", "in_position", "in_normal", "in_colour", "in_uv")
PLAIN_LAYOUT = ("3f 3f 12x", "in_position", "in_normal")
POSITION_LAYOUT = ("3f 24x", "in_position")
_VERTEX = np.dtype([("position", "3f4"), ("normal", "3f4"), ("colour", "4u1"), ("uv", "2f4")])


class MaterialLook(NamedTuple):
    """texture: white where there is none; painted: whether that or colours of vertices show."""

    texture: moderngl.Texture
    uniforms: dict[str, Any]
    painted: bool


@dataclass
class MeshLook:
    """What all levels of a mesh share. solid: see `is_solid`."""

    materials: list[MaterialLook]
    solid: bool


@dataclass
class MeshObject:
    """One level of a mesh on the GPU."""

    parts: tuple[Part, ...]
    vertices: moderngl.Buffer
    indices: moderngl.Buffer
    look: MeshLook
    meshlets: Meshlets | None

    def shape(self) -> Shape:
        """Positions (v, 3), metres, and triangles (t, 3), read back."""
        vertices = np.frombuffer(self.vertices.read(), _VERTEX)
        return vertices["position"], np.frombuffer(self.indices.read(), np.uint32).reshape(-1, 3)


def upload_look(gl: Scope, mesh: Mesh, solid: bool) -> MeshLook:
    """The materials of `mesh` on the GPU. solid: see `is_solid`."""
    coloured = bool((mesh.colours != 255).any())
    return MeshLook([_upload_material(gl, material, coloured) for material in mesh.materials], solid)


def upload_mesh(gl: Scope, mesh: Mesh, look: MeshLook, meshlets: Meshlets | None) -> MeshObject:
    """A level of a mesh on the GPU; look: that of the mesh."""
    rows = np.arange(len(mesh.positions)) if meshlets is None else meshlets.vertices
    faces = mesh.faces if meshlets is None else meshlets.of_parts(mesh.parts)
    vertices = np.zeros(len(rows), _VERTEX)
    vertices["position"], vertices["normal"], vertices["uv"] = mesh.positions[rows], mesh.normals[rows], mesh.uv[rows]
    vertices["colour"][:, :3] = mesh.colours[rows]
    indices = gl.buffer(np.ascontiguousarray(faces, np.uint32))
    return MeshObject(mesh.parts, gl.buffer(vertices.view(np.uint8)), indices, look, meshlets)


def is_solid(mesh: Mesh) -> bool:
    """Whether the mesh is the skin of a solid, seen from outside: its faces meet in opposite directions at every edge
    and enclose a volume. Nobody outside sees a back face of it."""
    faces = row_ids(mesh.positions)[0][mesh.faces]
    start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    count = np.int64(len(mesh.positions))
    if not np.array_equal(np.sort(start * count + end), np.sort(end * count + start)):
        return False
    a, b, c = mesh.positions[mesh.faces].astype(np.float64).transpose(1, 0, 2)
    return bool(np.einsum("ij,ij->", a, np.cross(b, c)) > 0)


def _upload_material(gl: Scope, material: Material, coloured: bool) -> MaterialLook:
    """coloured: whether vertices of the mesh have colours."""
    texels = WHITE if material.texture is None else np.ascontiguousarray(material.texture[::-1])
    texture = gl.srgb_texture((texels.shape[1], texels.shape[0]), texels.tobytes())
    uniforms = {name: getattr(material, name) for name in ("base_colour", "specular", "shininess")}
    return MaterialLook(texture, uniforms, coloured or material.texture is not None)
