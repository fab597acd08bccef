"""Express materials of USD, networks of UsdPreviewSurface, as those of glTF."""

import math
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pxr import Sdf, UsdShade

from depthwalk.ingest.usd.glb import GlbBuilder, Header
from depthwalk.ingest.usd.pictures import Channel, Pictures
from depthwalk.ingest.usd.problems import Unread

_STRENGTH = "KHR_materials_emissive_strength"
_CHANNELS = {"r": 0, "g": 1, "b": 2, "a": 3, "rgb": 0}
_WRAPS = {"clamp": 33071, "black": 33071, "mirror": 33648}
_LEFT_OUT = {"displacement": "displacement", "occlusion": "occlusion map", "clearcoat": "clear coat"}


def _identity() -> NDArray[np.float64]:
    return np.eye(3)[:2]


@dataclass(frozen=True, kw_only=True)
class Look:
    """Hold how surfaces with a material look.

    Attributes
    ----------
    number
        The number of the material in the file; None for surfaces without one.
    coordinates
        The primvar of the texture coordinates; "" if no picture is shown.
    transform : (2, 3) float64
        Turns these into those of the picture, v upward.
    colours
        The primvar of the colours of vertices; "" without them.
    """

    number: int | None
    coordinates: str = ""
    transform: NDArray[np.float64] = field(default_factory=_identity)
    colours: str = ""


class _Texture(NamedTuple):
    """A texture that an input reads: the picture, its channel "rgb" or one, where, and how its values are changed."""

    picture: int
    output: str
    coordinates: str
    transform: tuple[float, ...]
    scale: tuple[float, ...]
    bias: tuple[float, ...]
    wrap: str

    def channel(self, number: int | None = None) -> Channel:
        """Return a channel, by its number or that of the output."""
        place = _CHANNELS[self.output] if number is None else number
        return Channel(self.picture, place, self.scale[place], self.bias[place])

    @property
    def place(self) -> tuple[object, ...]:
        """What must be alike in textures that share their coordinates."""
        return self.coordinates, self.transform


class Materials:
    """Write materials into a file, each once."""

    def __init__(self, builder: GlbBuilder, pictures: Pictures, time: Any, unread: Unread) -> None:
        """Prepare to write into a file what the materials are at a time."""
        self._builder, self._pictures, self._time, self._unread = builder, pictures, time, unread
        self._looks: dict[str, Look] = {}

    def look(self, material: Any) -> Look:
        """Return how a material looks, a `UsdShade.Material`; None stands for surfaces without one."""
        key = "" if material is None else str(material.GetPath())
        if key not in self._looks:
            self._looks[key] = _NONE if material is None else self._read(material)
        return self._looks[key]

    def _read(self, material: Any) -> Look:
        shader = material.ComputeSurfaceSource()[0]
        if not shader or shader.GetShaderId() != "UsdPreviewSurface":
            self._unread.count("material without a UsdPreviewSurface", "materials without UsdPreviewSurface")
            return _NONE
        return _Surface(shader, self._builder, self._pictures, self._time, self._unread).look(
            material.GetPrim().GetName()
        )


_NONE = Look(number=None, colours="displayColor")


class _Surface:
    """Read a shader of UsdPreviewSurface."""

    def __init__(self, shader: Any, builder: GlbBuilder, pictures: Pictures, time: Any, unread: Unread) -> None:
        self._shader, self._builder, self._pictures, self._time, self._unread = shader, builder, pictures, time, unread
        self._where = str(shader.GetPath())
        self._first: _Texture | None = None
        self._colours = ""

    def look(self, name: str) -> Look:
        """Write the material, and return how it looks."""
        metallic_roughness: Header = {}
        material: Header = {"name": name, "pbrMetallicRoughness": metallic_roughness}
        colour, texture = self._colour("diffuseColor", (0.18, 0.18, 0.18))
        alpha = self._alpha(material, texture, metallic_roughness)
        metallic_roughness["baseColorFactor"] = [*(min(max(term, 0.0), 1.0) for term in colour), alpha]
        self._highlight(metallic_roughness)
        self._emission(material)
        self._normal_map(material)
        for key, text in _LEFT_OUT.items():
            source = self._source(key)
            if isinstance(source, _Texture) or (isinstance(source, float) and source not in (0.0, 1.0)):
                self._unread.count(text)
        number = self._builder.add("materials", material)
        if self._first is None:
            return Look(number=number, colours=self._colours)
        transform = np.array(self._first.transform).reshape(2, 3)
        return Look(number=number, coordinates=self._first.coordinates, transform=transform, colours=self._colours)

    def _alpha(self, material: Header, texture: _Texture | None, metallic_roughness: Header) -> float:
        """Set the texture of colours and the meaning of its alpha; return the factor of alpha."""
        opacity, threshold = self._source("opacity", 1.0), self._number("opacityThreshold", 0.0)
        mask = opacity if isinstance(opacity, _Texture) else None
        factor = 1.0 if mask is not None else min(max(float(opacity or 0.0), 0.0), 1.0)
        if texture is not None and mask is not None:
            same = mask.picture == texture.picture and mask.output == "a" and mask.channel()[2:] == (1.0, 0.0)
            colours = [Channel(texture.picture, place) for place in range(3)]
            index = None if same else self._pictures.combined((*colours, mask.channel()))
            metallic_roughness["baseColorTexture"] = self._use(texture, index)
        elif texture is not None:
            metallic_roughness["baseColorTexture"] = self._use(texture)
        elif mask is not None:
            metallic_roughness["baseColorTexture"] = self._use(
                mask, self._pictures.combined((1.0, 1.0, 1.0, mask.channel()))
            )
        if mask is None and factor == 1.0:
            return 1.0
        if threshold > 0 and mask is not None:
            material |= {"alphaMode": "MASK", "alphaCutoff": threshold}
        elif threshold <= 0:
            material["alphaMode"] = "BLEND"
        return factor

    def _highlight(self, metallic_roughness: Header) -> None:
        """Set roughness and metalness."""
        roughness, metallic = self._source("roughness", 0.5), self._source("metallic", 0.0)
        if self._number("useSpecularWorkflow", 0.0):
            metallic = 0.0
        maps = [each for each in (roughness, metallic) if isinstance(each, _Texture) and self._shares(each)]
        values = [
            each.channel() if isinstance(each, _Texture) and each in maps else _unit(each)
            for each in (roughness, metallic)
        ]
        if maps:
            metallic_roughness["metallicRoughnessTexture"] = self._use(
                maps[0], self._pictures.combined((0.0, values[0], values[1], 1.0), coarse=True)
            )
        else:
            metallic_roughness |= {"roughnessFactor": values[0], "metallicFactor": values[1]}

    def _emission(self, material: Header) -> None:
        colour, texture = self._colour("emissiveColor", (0.0, 0.0, 0.0), coloured=False)
        colour = tuple(max(term, 0.0) for term in colour)
        if not any(colour):
            return
        strength = max(1.0, *colour)
        material["emissiveFactor"] = [term / strength for term in colour]
        if strength > 1:
            material["extensions"] = {_STRENGTH: {"emissiveStrength": strength}}
        if texture is not None and self._shares(texture):
            material["emissiveTexture"] = self._use(texture)

    def _normal_map(self, material: Header) -> None:
        source = self._source("normal")
        if not isinstance(source, _Texture) or not self._shares(source):
            return
        strength = source.scale[0] / 2 if source.bias[0] else source.scale[0]
        index = None
        if source.scale[1] * source.scale[0] < 0:  # y downward
            channels = [Channel(source.picture, place) for place in range(4)]
            channels[1] = Channel(source.picture, 1, -1.0, 1.0)
            index = self._pictures.combined(tuple(channels))
        material["normalTexture"] = self._use(source, index) | ({} if strength == 1 else {"scale": abs(strength)})

    def _shares(self, texture: _Texture) -> bool:
        """Return whether a texture has the coordinates of the material's other ones; if not, count it as unread."""
        if self._first is None or self._first.place == texture.place:
            return True
        self._unread.count(
            "texture with other coordinates than the colours", "textures with other coordinates than the colours"
        )
        return False

    def _use(self, texture: _Texture, index: int | None = None) -> Header:
        """Return the entry of a texture, by its own picture or another texture of the file."""
        self._first = self._first or texture
        if texture.wrap:
            self._unread.count("texture that does not repeat", "textures that do not repeat")
        return {"index": self._pictures.texture(texture.picture) if index is None else index}

    def _colour(
        self, name: str, default: tuple[float, float, float], coloured: bool = True
    ) -> tuple[tuple[float, ...], _Texture | None]:
        """Return the colour of an input, or the factor of its texture, and that texture."""
        source = self._source(name, default)
        if isinstance(source, _Texture):
            if any(source.bias[:3]):
                self._unread.count("offset of a colour texture", "offsets of colour textures")
            return source.scale[:3], source
        if isinstance(source, str):
            if coloured:
                self._colours = source
                return (1.0, 1.0, 1.0), None
            return default, None
        values = tuple(source) if isinstance(source, tuple) and len(source) >= 3 else default
        return values[:3], None

    def _number(self, name: str, default: float) -> float:
        source = self._source(name, default)
        return source if isinstance(source, float) else default

    def _source(self, name: str, default: Any = None) -> Any:
        """Return what an input gets: a number, numbers, a `_Texture`, the name of a primvar, or the default."""
        return self._value(self._shader.GetInput(name), default)

    def _value(self, wanted: Any, default: Any = None) -> Any:
        attributes = UsdShade.Utils.GetValueProducingAttributes(wanted) if wanted else []
        if not attributes:
            return default
        attribute = attributes[0]
        if UsdShade.Utils.GetType(attribute.GetName()) == UsdShade.AttributeType.Output:
            found = self._output(UsdShade.Shader(attribute.GetPrim()), UsdShade.Output(attribute).GetBaseName())
            return default if found is None else found
        value = attribute.Get(self._time)
        if isinstance(value, bool | int | float):
            return float(value) if math.isfinite(value) else default
        if isinstance(value, str):
            return value
        try:
            values = tuple(float(term) for term in value)
        except (TypeError, ValueError):
            return default if value is None else value
        return values if all(map(math.isfinite, values)) else default

    def _output(self, shader: Any, output: str) -> "_Texture | str | None":
        """Return what the output of a shader gives: a texture, or the name of a primvar; None for any other."""
        kind = str(shader.GetShaderId()) if shader else ""
        if kind == "UsdUVTexture":
            return self._texture(shader, output)
        if kind.startswith("UsdPrimvarReader_"):
            return str(self._value(shader.GetInput("varname"), "") or "") or None
        self._unread.count("shader of another kind", "shaders of other kinds")
        return None

    def _texture(self, shader: Any, output: str) -> _Texture | None:
        asset = self._value(shader.GetInput("file"))
        if not isinstance(asset, Sdf.AssetPath) or not asset.path or output not in _CHANNELS:
            return None
        if "<UDIM>" in asset.path:
            self._unread.count("texture in tiles (UDIM)", "textures in tiles (UDIM)")
            return None
        number = self._pictures.number(asset, str(shader.GetPath()))
        if number is None:
            return None
        coordinates, transform = self._coordinates(shader.GetInput("st"))
        wraps = {str(self._value(shader.GetInput(name), "")) for name in ("wrapS", "wrapT")}
        return _Texture(
            number,
            output,
            coordinates,
            tuple(transform.ravel().tolist()),
            _four(self._value(shader.GetInput("scale")), 1.0),
            _four(self._value(shader.GetInput("bias")), 0.0),
            next((wrap for wrap in wraps if wrap in _WRAPS), ""),
        )

    def _coordinates(self, wanted: Any) -> tuple[str, NDArray[np.float64]]:
        """Return the primvar of texture coordinates, and their transform (2, 3): UsdTransform2d, or none."""
        attributes = UsdShade.Utils.GetValueProducingAttributes(wanted) if wanted else []
        shader = UsdShade.Shader(attributes[0].GetPrim()) if attributes else None
        if shader and shader.GetShaderId() == "UsdTransform2d":
            coordinates, inner = self._coordinates(shader.GetInput("in"))
            turn = math.radians(self._as_float(shader.GetInput("rotation")))
            scale = _four(self._value(shader.GetInput("scale")), 1.0)[:2]
            shift = _four(self._value(shader.GetInput("translation")), 0.0)[:2]
            cos, sin = math.cos(turn), math.sin(turn)
            linear = np.array([[cos, -sin], [sin, cos]]) @ np.diag(scale)
            return coordinates, np.column_stack([linear @ inner[:, :2], linear @ inner[:, 2] + shift])
        name = self._value(wanted)
        return (name if isinstance(name, str) and name else "st"), _identity()

    def _as_float(self, wanted: Any) -> float:
        value = self._value(wanted, 0.0)
        return value if isinstance(value, float) else 0.0


def _four(values: Any, default: float) -> tuple[float, ...]:
    """Return four numbers, the defaults for those that are missing."""
    found = tuple(values) if isinstance(values, tuple) else ()
    return (*found, *(default,) * 4)[:4]


def _unit(value: Any) -> float:
    return min(max(value, 0.0), 1.0) if isinstance(value, float) else 0.0
