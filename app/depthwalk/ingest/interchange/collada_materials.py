"""Read the materials of COLLADA files: effects of the common profile, with the pictures that they name."""

from urllib.parse import unquote

from depthwalk.ingest.interchange.xml_tree import Element
from depthwalk.ingest.mtl import MtlMaterial

_LUMINANCE = (0.212671, 0.715160, 0.072169)  # of RGB_ZERO, COLLADA 1.4, chapter 7
_SHADERS = ("phong", "blinn", "lambert", "constant")


def read_materials(root: Element) -> tuple[dict[str, MtlMaterial], dict[str, str]]:
    """Return the materials of a file by name, and the names by the materials' IDs."""
    images = {
        each.attributes.get("id", ""): _file(each)
        for library in root.all("library_images")
        for each in library.all("image")
    }
    effects = {
        each.attributes.get("id", ""): each for library in root.all("library_effects") for each in library.all("effect")
    }
    materials: dict[str, MtlMaterial] = {}
    names: dict[str, str] = {}
    for library in root.all("library_materials"):
        for each in library.all("material"):
            number = each.attributes.get("id", "")
            name = each.attributes.get("name") or number
            names[number] = name = name if name not in materials else f"{name} {number}"
            use = each.find("instance_effect")
            effect = effects.get(use.attributes.get("url", "").lstrip("#")) if use is not None else None
            materials[name] = MtlMaterial() if effect is None else _Effect(effect, images).material()
    return materials, names


def _file(image: Element) -> str:
    """Return the name of the file that a picture is in; "" for one that is within the file."""
    begin = image.find("init_from")
    if begin is None:
        return ""
    reference = begin.find("ref")
    name = (begin if reference is None else reference).text
    return unquote(name.removeprefix("file://")) if name.startswith("file://") else name


class _Effect:
    """Read an effect of the common profile."""

    def __init__(self, effect: Element, images: dict[str, str]) -> None:
        self._images = images
        self._profile = effect.find("profile_COMMON")
        profile = self._profile
        parts = [] if profile is None else [*effect.all("newparam"), *profile.all("newparam"), *profile.all("image")]
        self._parameters = {each.attributes.get("sid", ""): each for each in parts if each.tag == "newparam"}

    def material(self) -> MtlMaterial:
        """Return its material."""
        made = MtlMaterial()
        technique = self._profile.find("technique") if self._profile is not None else None
        shader = (
            next((each for each in technique.children if each.tag in _SHADERS), None) if technique is not None else None
        )
        if technique is None or shader is None:
            return made
        for part, key, use in (("diffuse", "kd", "image"), ("specular", "ks", ""), ("emission", "ke", "glow")):
            colour, picture = self._colour(shader.find(part))
            if picture and use:
                setattr(made, use, picture)
            elif colour:
                made.terms[key] = colour[:3]
        if shader.tag == "constant":  # shows what it emits, whatever light there is
            made.terms["kd"] = [0.0, 0.0, 0.0]
        if shader.tag in ("lambert", "constant"):
            made.terms["illum"] = 1
        if (exponent := self._number(shader.find("shininess"))) is not None:
            made.terms["ns"] = exponent
        self._take_opacity(made, shader)
        bump = self._bump(technique)
        if bump:
            made.bump = bump
        return made

    def _take_opacity(self, made: MtlMaterial, shader: Element) -> None:
        """Note the opacity of a material; what would be clear altogether is opaque, as programs write it."""
        through = shader.find("transparent")
        amount = self._number(shader.find("transparency"))
        colour, picture = self._colour(through)
        if picture:
            made.mask = picture if picture == made.image else None  # only alpha of the picture of colours cuts out
            return
        opaque = (through.attributes.get("opaque") if through is not None else None) or "A_ONE"
        opacity = 1.0 if amount is None else amount
        if colour and opaque.startswith("RGB"):
            light = sum(a * b for a, b in zip(_LUMINANCE, colour, strict=False))
            opacity = light * opacity if opaque == "RGB_ONE" else 1 - light * opacity
        elif colour and len(colour) > 3:
            opacity = colour[3] * opacity if opaque == "A_ONE" else 1 - colour[3] * opacity
        made.terms["d"] = opacity if 0 < opacity <= 1 else 1.0

    def _colour(self, part: Element | None) -> tuple[list[float] | None, str | None]:
        """Return a colour with alpha, or the file of a picture, whichever a part of a shader has."""
        if part is None:
            return None, None
        if (texture := part.find("texture")) is not None:
            return None, self._picture(texture.attributes.get("texture", ""))
        if (named := part.find("param")) is not None:
            part = self._parameters.get(named.attributes.get("ref", ""), part)
        found = next((each for tag in ("color", "float4", "float3") if (each := part.find(tag)) is not None), None)
        return (None if found is None else found.numbers().tolist()), None

    def _number(self, part: Element | None) -> float | None:
        """Return the number of a part of a shader; None if it has none."""
        if part is not None and (named := part.find("param")) is not None:
            part = self._parameters.get(named.attributes.get("ref", ""), part)
        found = part.find("float") if part is not None else None
        return None if found is None else float(found.numbers()[0])

    def _picture(self, name: str) -> str | None:
        """Return the file of a picture, by the parameters through which a texture names it."""
        for _ in range(8):  # texture, sampler, surface, image
            parameter = self._parameters.get(name)
            if parameter is None:
                break
            for way in (
                ("sampler2D", "source"),
                ("sampler2D", "instance_image"),
                ("surface", "init_from"),
            ):
                if (found := parameter.find(*way)) is not None:
                    name = found.attributes.get("url", "").lstrip("#") or found.text
                    break
            else:
                break
        return self._images.get(name) or None

    def _bump(self, technique: Element) -> str | None:
        """Return the file of the height or normal map that the extensions of several programs name."""
        for extra in technique.all("extra"):
            for other in extra.all("technique"):
                texture = other.find("bump", "texture")
                if texture is not None:
                    return self._picture(texture.attributes.get("texture", ""))
        return None
