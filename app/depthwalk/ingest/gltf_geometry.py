"""Express the geometry of glTF files in the terms that trimesh reads.

trimesh skips what is not in the core of glTF, and some of what is: it draws characters unposed and shape keys unshaped,
textures with other coordinates than the material names, and takes integers that stand for fractions for what they are.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthwalk.ingest.gltf_accessors import Accessors, Numbers, is_converted
from depthwalk.ingest.gltf_pose import is_posed, pose, top_nodes

TRANSFORM = "KHR_texture_transform"
_GLOSSINESS = "KHR_materials_pbrSpecularGlossiness"
_FAN, _FLOAT = 6, 5126

Header = dict[str, Any]


def is_other_geometry(header: Header) -> bool:
    """Return whether a file looks otherwise since its geometry is expressed in terms that trimesh reads.

    Says nothing about files that used to be rejected, nor about malformed ones, which are reported on reading the mesh.
    """
    try:
        primitives = [primitive for mesh in header.get("meshes", []) for primitive in mesh["primitives"]]
        return (
            is_posed(header)
            or any("camera" in node for node in header.get("nodes", []))
            or any(primitive.get("mode") == _FAN for primitive in primitives)
            or any(_coordinates(header, primitive) != ("TEXCOORD_0", None) for primitive in primitives)
        )
    except (AttributeError, LookupError, TypeError, ValueError):
        return False


def express(header: Header, accessors: Accessors) -> bool:
    """Change a header, and add data to it, so that trimesh reads what the file means.

    - Meshes with a skin or shape keys become those that their joints and weights make of them at rest.
    - Each primitive gets the texture coordinates of its material as its first ones, with `KHR_texture_transform`.
    - Sparse and normalised values become plain floats, fans separate triangles.
    - Cameras are dropped, whose meshes and children trimesh drops as well. A file without scenes gets one of all nodes.

    Parameters
    ----------
    header
        The JSON header, checked by `gltf.check_header`; changed in place.
    accessors
        Reads the file's accessors; holds the added data.

    Returns
    -------
    bool
        Whether anything was changed.

    Raises
    ------
    ValueError, TypeError, LookupError
        For damaged data.
    """
    nodes = header.get("nodes", [])
    changed = [_with_scene(header, nodes), pose(header, accessors) if is_posed(header) else False]
    changed += [node.pop("camera", None) is not None for node in nodes]
    plain = _Plain(header, accessors)
    for mesh in header.get("meshes", []):
        changed += [plain.express(primitive) for primitive in mesh["primitives"]]
    return any(changed)


def _with_scene(header: Header, nodes: list[Header]) -> bool:
    """Give a file without scenes one of all nodes that are no node's children; return whether it had none."""
    if header.get("scenes") or not nodes:
        return False
    header["scenes"] = [{"nodes": top_nodes(nodes)}]
    header["scene"] = 0
    return True


class _Plain:
    """Express primitives by accessors that trimesh reads; each accessor is converted once."""

    def __init__(self, header: Header, accessors: Accessors) -> None:
        self.header = header
        self.accessors = accessors
        self.added: dict[object, int] = {}

    def express(self, primitive: Header) -> bool:
        """Change a primitive in place; return whether there was any need to."""
        before = primitive["attributes"], primitive.get("indices"), primitive.get("mode")
        attributes = dict(before[0])
        count = self.header["accessors"][attributes["POSITION"]]["count"]
        name, transform = _coordinates(self.header, primitive)
        attributes.pop("TEXCOORD_0", None)
        if name in before[0]:
            attributes["TEXCOORD_0"] = self._texture_coordinates(before[0][name], count, transform)
        for name in ("POSITION", "NORMAL", "COLOR_0"):
            if name in attributes:
                attributes[name] = self._floats(attributes[name], count, keeps_bytes=name == "COLOR_0")
        primitive["attributes"] = attributes
        if primitive.get("mode") == _FAN:
            self._separate(primitive, count)
        elif "indices" in primitive and "sparse" in self.header["accessors"][primitive["indices"]]:
            primitive["indices"] = self._once(("indices", primitive["indices"]), self._indices(primitive, count))
        return before != (attributes, primitive.get("indices"), primitive.get("mode"))

    def _floats(self, number: int, count: int, *, keeps_bytes: bool = False) -> int:
        """Return the number of an accessor with the same values that trimesh reads right."""
        if not is_converted(self.header["accessors"][number], keeps_bytes=keeps_bytes):
            return number
        if number not in self.added:
            self.added[number] = self.accessors.add(self.accessors.read(number, count).astype(np.float32))
        return self.added[number]

    def _texture_coordinates(self, number: int, count: int, transform: "_Transform | None") -> int:
        """Return the number of an accessor with the transformed texture coordinates, as floats."""
        accessor = self.header["accessors"][number]
        if transform is None and accessor["componentType"] == _FLOAT and not is_converted(accessor):
            return number
        key = number, transform
        if key not in self.added:
            uv = self.accessors.read(number, count)
            uv = uv if transform is None else _moved(uv.astype(np.float64), transform)
            self.added[key] = self.accessors.add(uv.astype(np.float32))
        return self.added[key]

    def _indices(self, primitive: Header, count: int) -> NDArray[np.uint32]:
        """Return the indices (C,) of a primitive's corners; `count` is the number of its vertices."""
        if "indices" not in primitive:
            return np.arange(count, dtype=np.uint32)
        return self.accessors.read(primitive["indices"])[:, 0].astype(np.uint32)

    def _separate(self, primitive: Header, count: int) -> None:
        """Make separate triangles of a fan."""
        corners = self._indices(primitive, count)
        triangles = np.stack([np.broadcast_to(corners[:1], len(corners) - 2), corners[1:-1], corners[2:]], axis=1)
        primitive["indices"] = self._once((_FAN, primitive.get("indices", -count)), triangles.ravel())
        del primitive["mode"]

    def _once(self, key: object, indices: NDArray[np.uint32]) -> int:
        if key not in self.added:
            self.added[key] = self.accessors.add(indices[:, None])
        return self.added[key]


_Transform = tuple[float, float, float, float, float]  # offset u, v, rotation in radians, scale u, v


def _coordinates(header: Header, primitive: Header) -> tuple[str, _Transform | None]:
    """Return which texture coordinates the material of a primitive uses, and how they are transformed.

    Depth images and meshes have one set of coordinates, so those of the colour texture serve the glow, too, and maps of
    normals and roughness that share them.
    """
    material = header["materials"][primitive["material"]] if "material" in primitive else {}
    return _placement(_leading_texture(material) or {})


def shares_coordinates(material: Header, texture: Header) -> bool:
    """Return whether a texture of a material uses the texture coordinates that meshes of the material get.

    Raises AttributeError, LookupError, TypeError or ValueError for malformed ones.
    """
    return _placement(texture) == _placement(_leading_texture(material) or texture)


def _leading_texture(material: Header) -> Header | None:
    """Return the texture of a material whose coordinates the others share; None if it has none."""
    terms = material.get("pbrMetallicRoughness", {})
    found = (
        material.get("extensions", {}).get(_GLOSSINESS, {}).get("diffuseTexture"),
        terms.get("baseColorTexture"),
        material.get("emissiveTexture"),
        material.get("normalTexture"),
        terms.get("metallicRoughnessTexture"),
    )
    return next(filter(None, found), None)


def _placement(texture: Header) -> tuple[str, _Transform | None]:
    """Return which texture coordinates a texture uses, and how they are transformed."""
    terms = texture.get("extensions", {}).get(TRANSFORM)
    name = f"TEXCOORD_{(terms or {}).get('texCoord', texture.get('texCoord', 0))}"
    if terms is None:
        return name, None
    offset, scale = terms.get("offset", (0, 0)), terms.get("scale", (1, 1))
    u, v, rotation, su, sv = (float(term) for term in (*offset, terms.get("rotation", 0), *scale))
    transform = u, v, rotation, su, sv
    return name, None if transform == (0, 0, 0, 1, 1) else transform


def _moved(uv: NDArray[np.float64], transform: _Transform) -> Numbers:
    """Return texture coordinates (N, 2) scaled, turned and moved as `KHR_texture_transform` defines."""
    u, v, rotation, *scale = transform
    cos, sin = math.cos(rotation), math.sin(rotation)
    with np.errstate(all="ignore"):
        return np.asarray((uv * scale) @ np.array([[cos, -sin], [sin, cos]]) + [u, v])
