"""Convert the materials of MTL and glTF files to the Phong terms that the renderer draws with."""

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from depthwalk.ingest.image import TextureDecoder
from depthwalk.ingest.mesh import Material
from depthwalk.limits import MAX_SHININESS

if TYPE_CHECKING:  # most of a second to import; whoever has a material of trimesh has imported it
    from trimesh.visual.material import PBRMaterial, SimpleMaterial

WHITE = (1.0, 1.0, 1.0)


def convert_material(material: object, name: str, textures: TextureDecoder | None = None) -> Material | None:
    """Convert a material that trimesh has read to Phong's model.

    Parameters
    ----------
    material : trimesh.visual.material.Material or None
        The material as trimesh has it; None for a mesh without one.
    name : str
        The file, for messages.
    textures : TextureDecoder or None
        Decodes the pictures of the mesh; None for a material by itself.

    Returns
    -------
    Material | None
        The material; None where the file gives none, be it that trimesh has put a grey one in its place.

    Raises
    ------
    InputError
        Where its texture is damaged, too large or of a kind that is not supported.
    """
    from trimesh.visual.material import PBRMaterial, SimpleMaterial

    textures = textures or TextureDecoder()
    if isinstance(material, PBRMaterial):
        return _from_pbr(material, name, textures)
    if isinstance(material, SimpleMaterial) and not _is_stand_in(material) and (material.name or material.image):
        image: Any = material.image
        path = None if image is None else image.info.get("file_path", "embedded texture")
        texture = None if image is None else textures.decode(image, f"{name}: {path}")
        return phong_from_mtl(material.kwargs, texture)
    return None


def phong_from_mtl(terms: dict[str, Any], texture: NDArray[np.uint8] | None) -> Material:
    """Convert the terms of an MTL file to Phong's model.

    Kd, Ks and Ns are taken as linear, as Blender writes them.

    Parameters
    ----------
    terms : dict
        Numbers or lists of numbers by the keys "kd", "ks" and "ns"; what is missing or makes no sense has a default.
    texture : (H, W, 4) uint8 or None
        The colour texture, sRGB with alpha; None for a material without one.

    Returns
    -------
    Material
        The material.
    """
    colour = _rgb(terms.get("kd"), WHITE if texture is not None else Material.base_colour)
    if texture is not None and not any(colour):
        colour = WHITE  # exporters write Kd 0 0 0 beside a texture
    specular = max(_rgb(terms.get("ks"), (Material.specular,) * 3))
    shininess = _scalar(terms.get("ns"), Material.shininess)
    return _material(colour, texture, specular, shininess)


def _is_stand_in(material: "SimpleMaterial") -> bool:
    """Return whether it is trimesh's own grey picture.

    trimesh gives it to meshes with texture coordinates and without a material; it was read from no file.
    """
    return material.image is not None and material.image.format is None


def _from_pbr(material: "PBRMaterial", name: str, textures: TextureDecoder) -> Material:
    """Return the Phong material whose lobe is as wide as that of GGX with α = roughness²; rough surfaces have none."""
    factor = material.baseColorFactor
    colour = WHITE if factor is None else _rgb((np.asarray(factor[:3], np.float64) / 255.0).tolist(), WHITE)
    roughness = min(max(_scalar(material.roughnessFactor, 1.0), 0.0), 1.0)
    metallic = min(max(_scalar(material.metallicFactor, 1.0), 0.0), 1.0)
    shininess = 2.0 / max(roughness, 0.1) ** 4 - 2.0
    image: Any = material.baseColorTexture
    path = None if image is None else image.info.get("file_path", "embedded texture")
    texture = None if image is None else textures.decode(image, f"{name}: {path}")
    return _material(colour, texture, (1 - roughness) * (0.3 + 0.7 * metallic), shininess)


def _material(
    colour: tuple[float, float, float], texture: NDArray[np.uint8] | None, specular: float, shininess: float
) -> Material:
    return Material(colour, texture, min(max(specular, 0.0), 1.0), min(max(shininess, 1.0), MAX_SHININESS))


def _rgb(value: Any, default: tuple[float, float, float]) -> tuple[float, float, float]:
    """Return `value` clipped to 0–1 where it is three finite numbers, else the default."""
    try:
        red, green, blue = (min(max(float(term), 0.0), 1.0) for term in value)
    except (TypeError, ValueError):
        return default
    return (red, green, blue) if math.isfinite(red + green + blue) else default


def _scalar(value: Any, default: float) -> float:
    return float(value) if isinstance(value, (int, float)) and math.isfinite(value) else default
