"""Materials of MTL and glTF as the Phong terms the renderer draws with."""

from typing import Any

import numpy as np
from PIL import Image
from trimesh.visual.material import PBRMaterial, SimpleMaterial

from depthwalk.ingest.image import rgba
from depthwalk.ingest.mesh import Material
from depthwalk.limits import MAX_SHININESS

WHITE = (1.0, 1.0, 1.0)


def convert_material(material: Any, name: str) -> Material | None:
    """The Phong material for one of trimesh's, None where the file gave none. Raises InputError for its texture."""
    if isinstance(material, PBRMaterial):
        return _from_pbr(material, name)
    if isinstance(material, SimpleMaterial) and not _is_stand_in(material) and (material.name or material.image):
        return _from_mtl(material, name)
    return None


def _is_stand_in(material: SimpleMaterial) -> bool:
    """Whether it is the grey picture, read from no file, that trimesh gives texture coordinates without a material."""
    return material.image is not None and material.image.format is None


def _from_mtl(material: SimpleMaterial, name: str) -> Material:
    """Kd, Ks and Ns are taken as linear, as Blender writes them; the file's own floats, not trimesh's 8 bits."""
    terms = material.kwargs
    colour = _rgb(terms.get("kd"), WHITE if material.image is not None else Material.base_colour)
    if material.image is not None and not any(colour):
        colour = WHITE  # exporters write Kd 0 0 0 beside a texture
    specular = max(_rgb(terms.get("ks"), (Material.specular,) * 3))
    shininess = _scalar(terms.get("ns"), Material.shininess)
    return _material(colour, material.image, specular, shininess, name)


def _from_pbr(material: PBRMaterial, name: str) -> Material:
    """Roughness r → the Phong exponent of a GGX lobe with α = r²; rough surfaces lose their highlight."""
    factor = material.baseColorFactor
    colour = WHITE if factor is None else _rgb((np.asarray(factor[:3], np.float64) / 255.0).tolist(), WHITE)
    roughness = min(max(_scalar(material.roughnessFactor, 1.0), 0.0), 1.0)
    metallic = min(max(_scalar(material.metallicFactor, 1.0), 0.0), 1.0)
    shininess = 2.0 / max(roughness, 0.1) ** 4 - 2.0
    return _material(colour, material.baseColorTexture, (1 - roughness) * (0.3 + 0.7 * metallic), shininess, name)


def _material(
    colour: tuple[float, float, float], image: Image.Image | None, specular: float, shininess: float, name: str
) -> Material:
    texture = None if image is None else rgba(image, f"{name}: {image.info.get('file_path', 'embedded texture')}")
    return Material(colour, texture, min(max(specular, 0.0), 1.0), min(max(shininess, 1.0), MAX_SHININESS))


def _rgb(value: Any, default: tuple[float, float, float]) -> tuple[float, float, float]:
    """`value` clipped to 0–1 where it is three finite numbers."""
    try:
        red, green, blue = (float(np.clip(float(each), 0.0, 1.0)) for each in value)
    except (TypeError, ValueError):
        return default
    return (red, green, blue) if np.isfinite([red, green, blue]).all() else default


def _scalar(value: Any, default: float) -> float:
    return float(value) if isinstance(value, (int, float)) and np.isfinite(value) else default
