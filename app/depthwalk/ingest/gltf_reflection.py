"""Determine highlight and reflection of glTF materials from roughness and metalness, and from a map of both.

A mesh has one set of texture coordinates. So a map counts texel by texel if it uses those of the material's other
textures, which is what exporters write; of any other, the mean counts.
"""

from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from depthwalk.ingest.gltf import object_under, objects_under
from depthwalk.ingest.gltf_geometry import shares_coordinates
from depthwalk.ingest.image import TextureDecoder
from depthwalk.ingest.mesh import DIELECTRIC_HIGHLIGHT, MATT, Reflection

if TYPE_CHECKING:
    from trimesh.visual.material import PBRMaterial

LEAST_METALNESS = 0.1
"""Mean metalness from which on a rough surface counts as metal."""
MAP_SIDE = 2048
"""Most texels along a side of a map; larger ones are averaged."""
_LEAST_PART = 0.02  # of a surface, that must be glossy or metal for a rough one to reflect
_MEAN_SIDE = 512  # texels along a side of maps from which means are taken
_EVEN = 5  # steps of 255 by which the texels of a map may differ that counts by its mean
_KEY = "metallicRoughnessTexture"
_APART = "\x1e"  # record separator: after the name of a material whose map has other texture coordinates


class Highlight(NamedTuple):
    """Describe how a material reflects, by the names of `Material`."""

    specular: float
    shininess: float
    reflection: Reflection | None
    reflection_map: NDArray[np.uint8] | None


def highlight(
    material: "PBRMaterial | SimpleNamespace",
    roughness_factor: float,
    metallic_factor: float,
    name: str,
    textures: TextureDecoder,
    uv: NDArray[np.float64] | None,
) -> Highlight:
    """Return how a glTF material reflects.

    Strength and exponent of the highlight are those of a lobe as wide as that of GGX with α = roughness²; rough
    surfaces have none. With a map they are means at the vertices, since parts of it that no surface shows may hold
    anything.

    Parameters
    ----------
    material
        The terms of the material, see `phong_from_pbr`.
    roughness_factor, metallic_factor
        Its factors, 0 to 1.
    name
        The file, for messages.
    textures
        Decodes the pictures of the mesh.
    uv
        (V, 2) texture coordinates of the vertices that have the material, NaN where there are none, or None.

    Returns
    -------
    Highlight
        The terms of a `Material`. Maps that are the same everywhere are left out.

    Raises
    ------
    InputError
        If the map is damaged, too large or of an unsupported kind.
    """
    roughness, metallic = np.array([roughness_factor]), np.array([metallic_factor])
    image, texels = getattr(material, _KEY), None
    if image is not None and uv is not None and np.isfinite(uv).any():
        called = f"{name}: {image.info.get('file_path', 'embedded texture')}"
        if shares_its_map(material.name):
            texels = _map(image, roughness_factor, metallic_factor, called, textures)
        shown = _at_vertices(textures.coarse(image, called, _MEAN_SIDE), uv)
        roughness, metallic = roughness * shown[:, 1], metallic * shown[:, 2]
    specular = phong_strength(roughness, metallic)
    # The width of the highlight is that of the parts that have one.
    weight = specular if specular.any() else np.ones_like(specular)
    mean, metalness = float((weight * roughness).sum() / weight.sum()), float(metallic.mean())
    shows = mean < MATT or metalness >= LEAST_METALNESS
    if texels is not None:
        shows = shows or bool(((roughness < MATT) | (metallic >= 0.5)).mean() >= _LEAST_PART)
    reflection = Reflection(mean, metalness) if shows else None
    return Highlight(float(specular.mean()), phong_exponent(mean), reflection, texels if shows else None)


def phong_strength(roughness: NDArray[np.floating], metalness: NDArray[np.floating]) -> NDArray[np.floating]:
    """Return the strengths (n,) of the highlights of surfaces by roughness and metalness, (n,) 0 to 1 each."""
    return np.asarray((1 - roughness) * (DIELECTRIC_HIGHLIGHT + (1 - DIELECTRIC_HIGHLIGHT) * metalness))


def phong_exponent(roughness: float) -> float:
    """Return the exponent of a highlight as wide as that of GGX with α = roughness²."""
    return 2.0 / max(roughness, 0.1) ** 4 - 2.0


def roughness_map_counts(header: dict[str, Any]) -> tuple[int, int]:
    """Return how many materials have a map that counts texel by texel, and how many have one that does not.

    header: the JSON header; parts of it may be malformed, and such maps count by their means.
    """
    materials = [each for each in objects_under(header, "materials") if _KEY in object_under(each, _TERMS)]
    shared = sum(_shares(material) for material in materials)
    return shared, len(materials) - shared


def fold_roughness_maps(header: dict[str, Any]) -> bool:
    """Mark the materials in a JSON header whose maps have other texture coordinates; see `shares_its_map`.

    header: its materials are changed in place. Returns whether anything was.
    """
    apart = [
        material
        for material in header.get("materials", [])
        if _KEY in object_under(material, _TERMS) and not _shares(material)
    ]
    for material in apart:
        material["name"] = f"{material.get('name') or ''}{_APART}"
    return bool(apart)


def shares_its_map(name: str | None) -> bool:
    """Return whether the map of a material of that name has the texture coordinates of its mesh."""
    return not (name or "").endswith(_APART)


def without_mark(name: str | None) -> str | None:
    """Return the name that a material had before `fold_roughness_maps`."""
    return name if name is None else name.removesuffix(_APART)


_TERMS = "pbrMetallicRoughness"


def _shares(material: dict[str, Any]) -> bool:
    try:
        return "index" in material[_TERMS][_KEY] and shares_coordinates(material, material[_TERMS][_KEY])
    except (AttributeError, LookupError, TypeError, ValueError):
        return False


def _map(
    image: Any, roughness_factor: float, metallic_factor: float, name: str, textures: TextureDecoder
) -> NDArray[np.uint8] | None:
    """Return `Material.reflection_map` of a picture; None if it is the same everywhere."""

    def made() -> NDArray[np.uint8]:
        texels = textures.coarse(image, name, MAP_SIDE)[..., 1:3]
        factors = np.array([roughness_factor, metallic_factor], np.float32)
        return np.ascontiguousarray(texels) if (factors == 1).all() else np.round(texels * factors).astype(np.uint8)

    texels = textures.once((_KEY, id(image), roughness_factor, metallic_factor), made)
    return texels if max(np.ptp(texels[..., 0]), np.ptp(texels[..., 1])) > _EVEN else None


def _at_vertices(texels: NDArray[np.uint8], uv: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return texels (H, W, 4) as numbers 0 to 1, (n, 4), at texture coordinates (V, 2), where these are finite."""
    u, v = uv[np.isfinite(uv).all(axis=1)].T
    rows = ((1 - v) % 1 * texels.shape[0]).astype(np.int64)
    return np.asarray(
        texels[rows % texels.shape[0], (u % 1 * texels.shape[1]).astype(np.int64) % texels.shape[1]] / 255.0
    )
