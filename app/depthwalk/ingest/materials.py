"""Convert the materials of MTL and glTF files to the Phong terms that the renderer uses.

If the alpha of a texture marks where there is no surface, none is drawn there; otherwise alpha is opacity.
"""

import logging
import math
from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from depthwalk.errors import quoted
from depthwalk.ingest.gltf_normal_maps import name_and_scale
from depthwalk.ingest.gltf_reflection import highlight, without_mark
from depthwalk.ingest.image import TextureDecoder
from depthwalk.ingest.mesh import OPAQUE, Material
from depthwalk.limits import MAX_EMISSION, MAX_SHININESS

if TYPE_CHECKING:  # takes most of a second to import; callers with a trimesh material have already imported it
    from trimesh.visual.material import PBRMaterial, SimpleMaterial

log = logging.getLogger(__name__)

WHITE = (1.0, 1.0, 1.0)
_CUTOFF = 0.5  # glTF's default
_CLEAR = 0.01  # alpha up to which a surface counts as invisible
_BLACK = (0.0, 0.0, 0.0)


def convert_material(
    material: object, name: str, textures: TextureDecoder | None = None, uv: NDArray[np.float64] | None = None
) -> Material | None:
    """Convert a material read by trimesh to Phong's model.

    Parameters
    ----------
    material : trimesh.visual.material.Material or None
        The material; None for a mesh without one.
    name : str
        The file, for messages.
    textures : TextureDecoder or None
        Decodes the pictures of the mesh; None for a single material.
    uv : (V, 2) float64 or None
        Texture coordinates of the vertices that have the material, v upward, NaN where there are none. They tell which
        parts of a roughness map count.

    Returns
    -------
    Material | None
        The material; None if the file has none, even if trimesh has substituted a grey one.

    Raises
    ------
    InputError
        If its texture is damaged, too large or of an unsupported kind.
    """
    from trimesh.visual.material import PBRMaterial, SimpleMaterial

    textures = textures or TextureDecoder()
    if isinstance(material, PBRMaterial):
        return phong_from_pbr(material, name, textures, uv)
    if isinstance(material, SimpleMaterial) and not _is_placeholder(material) and (material.name or material.image):
        image: Any = material.image
        path = None if image is None else image.info.get("file_path", "embedded texture")
        texture = None if image is None else textures.decode(image, f"{name}: {path}")
        return phong_from_mtl(material.kwargs, texture, _called(name, material.name), textures=textures)
    return None


def phong_from_mtl(
    terms: dict[str, Any],
    texture: NDArray[np.uint8] | None,
    name: str = "material",
    *,
    cut_out: bool = False,
    emission_texture: NDArray[np.uint8] | None = None,
    normal_map: NDArray[np.uint8] | None = None,
    normal_scale: float = 1.0,
    textures: TextureDecoder | None = None,
) -> Material:
    """Convert the terms of an MTL file to Phong's model.

    Kd, Ks and Ns are taken as linear, as Blender writes them. There are no highlights with `illum` 0 and 1, which
    exclude them, nor with an exponent Ns below 1: programs that make textured meshes of scans write Ns 0, some of them
    beside Ks 1, and a lobe as wide as that would whiten half of the texture.

    Parameters
    ----------
    terms : dict
        Numbers or lists of numbers by the keys "kd", "ks", "ns", "d", "tr", "ke" and "illum"; missing or invalid ones
        get defaults.
    texture : (H, W, 4) uint8 or None
        The colour texture, sRGB with alpha; None for a material without one.
    name : str
        Name of the material in warnings.
    cut_out : bool
        Whether there is no surface where the texture's alpha is low.
    emission_texture : (H, W, 4) uint8 or None
        The texture of the emitted light, sRGB; None for a material without one.
    normal_map : (H, W, 4) uint8 or None
        The normal map, see `Material.normal_map`; None for a material without one.
    normal_scale : float
        Factor on x and y of its normals.
    textures : TextureDecoder or None
        The decoder of the textures; None for a single material.

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
    if shininess < 1 or _scalar(terms.get("illum"), 2.0) < 2:
        specular = 0.0
    clear = _scalar(terms.get("tr"), 0.0)
    # MeshLab writes Tr 1 for what is opaque; nobody writes a surface of which nothing shows.
    opacity = _scalar(terms.get("d"), 1 - clear if clear < 1 else 1.0)
    emission = _rgb(terms.get("ke"), _BLACK, MAX_EMISSION)
    if emission_texture is not None and not any(emission):
        emission = WHITE  # as Kd beside a texture
    return _material(
        name,
        Material(
            colour,
            texture,
            specular,
            shininess,
            emission=emission,
            emission_texture=emission_texture,
            normal_map=normal_map,
            normal_scale=normal_scale,
        ),
        cutoff=_CUTOFF if cut_out else None,
        opacity=opacity,
        without_alpha=(textures or TextureDecoder()).without_alpha,
    )


def plain_material(coloured: bool) -> Material:
    """Return the material of surfaces without one: grey, or white where vertices have colours, as it tints these."""
    return Material(base_colour=WHITE) if coloured else Material()


def without_light(material: Material) -> Material:
    """Return a material of the same colour and alpha that is shown without light, see `Material.unlit`."""
    return replace(
        material,
        unlit=True,
        specular=0.0,
        emission=_BLACK,
        emission_texture=None,
        normal_map=None,
        normal_scale=1.0,
        reflection=None,
        reflection_map=None,
    )


def _is_placeholder(material: "SimpleMaterial") -> bool:
    """Return whether it is trimesh's own grey picture.

    trimesh gives it to meshes with texture coordinates but without a material; it comes from no file.
    """
    return material.image is not None and material.image.format is None


def phong_from_pbr(
    material: "PBRMaterial | SimpleNamespace", name: str, textures: TextureDecoder, uv: NDArray[np.float64] | None
) -> Material:
    """Return the Phong material that stands for one of glTF.

    Parameters
    ----------
    material
        The terms by their names in glTF, None where absent: colours in bytes, pictures opened by Pillow.
    name
        The file, for messages.
    textures
        Decodes the pictures of the mesh.
    uv
        As `convert_material` takes them.

    Returns
    -------
    Material
        The material.

    Raises
    ------
    InputError
        If a texture is damaged, too large or of an unsupported kind.
    """
    factor = material.baseColorFactor
    colour = WHITE if factor is None else _rgb((np.asarray(factor[:3], np.float64) / 255.0).tolist(), WHITE)
    roughness, metallic = (
        min(max(_scalar(term, 1.0), 0.0), 1.0) for term in (material.roughnessFactor, material.metallicFactor)
    )
    shine = highlight(material, roughness, metallic, name, textures, uv)
    texture, emission_texture, normal_map = (
        None if image is None else textures.decode(image, f"{name}: {image.info.get('file_path', 'embedded texture')}")
        for image in (material.baseColorTexture, material.emissiveTexture, material.normalTexture)
    )
    own_name, normal_scale = name_and_scale(without_mark(material.name))
    alpha = 1.0 if factor is None or len(factor) < 4 else float(factor[3]) / 255.0
    mode, cutoff = material.alphaMode, None
    if mode == "MASK":
        cutoff = _scalar(material.alphaCutoff, _CUTOFF) / max(alpha, 1e-3)
    elif mode == "BLEND" and texture is not None and _cuts_out(texture):
        cutoff = _CUTOFF
    emission = _rgb(material.emissiveFactor, _BLACK, MAX_EMISSION)
    return _material(
        _called(name, own_name),
        Material(
            colour,
            texture,
            shine.specular,
            shine.shininess,
            emission=emission,
            emission_texture=emission_texture,
            normal_map=normal_map,
            normal_scale=normal_scale,
            reflection=shine.reflection,
            reflection_map=shine.reflection_map,
        ),
        cutoff=cutoff,
        opacity=alpha if mode == "BLEND" else 1.0,
        without_alpha=None if mode == "BLEND" else textures.without_alpha,
    )


def _cuts_out(texture: NDArray[np.uint8]) -> bool:
    """Return whether the alpha of a texture (H, W, 4) cuts out: some is low, and most is near 0 or near 1.

    Otherwise it is opacity, as for a stained window.
    """
    alpha = texture[..., 3]
    between = np.count_nonzero((alpha > 0.1 * 255) & (alpha < 0.9 * 255))
    return bool(alpha.min() < _CUTOFF * 255 and 2 * between < alpha.size)


def _called(file: str, name: str | None) -> str:
    """Return the name of the material `name` of a file in messages."""
    return f"{file}: material {quoted(name)}" if name else f"{file}: a material"


def _material(
    name: str,
    material: Material,
    *,
    cutoff: float | None,
    opacity: float,
    without_alpha: Callable[[NDArray[np.uint8], str], NDArray[np.uint8]] | None = None,
) -> Material:
    """Complete a material by the meaning of its alpha, and bring its highlight into range.

    Parameters
    ----------
    name
        Its name in warnings.
    material
        The material, opaque and whole.
    cutoff
        Alpha of the texture below which there is no surface; None: there is surface everywhere.
    opacity
        Opacity of the material, 0 to 1.
    without_alpha
        Returns a texture, with its name in messages, with alpha set to 255: for formats in which alpha has no further
        meaning. None: the alpha of the texture multiplies `opacity`, as in glTF.
    """
    texture = material.texture
    if texture is None or (cutoff is not None and texture[..., 3].min() >= cutoff * 255):
        cutoff = None  # nothing is cut out, so faster code for whole surfaces can be used
    opacity = min(max(opacity, 0.0), 1.0)
    least = opacity * (1.0 if texture is None or without_alpha else texture[..., 3].min() / 255)
    if cutoff is not None and opacity < OPAQUE:
        log.warning("%s is see-through (alpha %.2g) and cut out; what is not cut out is drawn opaque", name, opacity)
    elif opacity < _CLEAR:
        log.warning("%s is clear (alpha %.2g): nothing of it shows but highlights", name, opacity)
    is_translucent = cutoff is None and least < OPAQUE
    if is_translucent and texture is not None and without_alpha:
        texture = without_alpha(texture, name)
    return replace(
        material,
        texture=texture,
        specular=min(max(material.specular, 0.0), 1.0),
        shininess=min(max(material.shininess, 1.0), MAX_SHININESS),
        cutoff=cutoff,
        opacity=opacity if is_translucent else None,
    )


def _rgb(value: Any, default: tuple[float, float, float], most: float = 1.0) -> tuple[float, float, float]:
    """Return `value` clipped to 0 to `most` if it is three finite numbers, otherwise the default."""
    try:
        red, green, blue = (min(max(float(term), 0.0), most) for term in value)
    except (TypeError, ValueError):
        return default
    return (red, green, blue) if math.isfinite(red + green + blue) else default


def _scalar(value: Any, default: float) -> float:
    return float(value) if isinstance(value, (int, float)) and math.isfinite(value) else default
