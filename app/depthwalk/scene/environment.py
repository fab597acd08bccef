"""Declare what surrounds the objects: `environment:`, `camera:` and `walk:` of the scene file.

Colours are sRGB from 0 to 1, lengths metres, angles degrees, as in the file.
"""

from contextvars import ContextVar
from typing import Annotated, Any, Literal, Self, get_args

from pydantic import AfterValidator, Field, model_validator

from depthwalk.errors import InputError
from depthwalk.limits import MAX_FOV, MAX_LIGHTS, MAX_SKY_INTENSITY, MIN_FOV
from depthwalk.params import param
from depthwalk.scene.fields import Colour, Coordinate, FileParams, FilePath, Length, Vector


def _not_zero(value: tuple[float, float, float]) -> tuple[float, float, float]:
    if max(map(abs, value)) < 1e-6:
        raise ValueError("must not be the zero vector")
    return value


MIN_SPEED, MAX_SPEED = 0.001, 10_000.0  # m/s
MAX_SHADOW_ANGLE = 150  # degrees; beyond this a flat map has few texels left for the middle of the cone
OF_IMAGE = "image", "turn", "intensity", "sun"
"""Keys of a sky that is a picture alone."""
NOT_OF_IMAGE = "zenith", "horizon", "turbidity", "sun_size"
"""Keys of a sky that is no picture."""
_changing = ContextVar("_changing", default=False)
"""Whether a key of a sky is being set, not a sky read: then pydantic checks those of all models at once."""
SkyModel = Literal["gradient", "preetham", "image"]
Direction = Annotated[Vector, AfterValidator(_not_zero)]


class SkyParams(FileParams):
    """Describe a sky: two colours blended upward, clear daylight around the sun, or a picture of all directions."""

    model: SkyModel = param(
        "gradient",
        "Two colours (gradient), daylight scattered in air (Preetham et al. 1999), or a picture (image). In daylight, "
        "`sun` is the sun above the atmosphere, which dims and reddens it, and whose light makes the sky bright",
    )
    zenith: Colour = param((0.25, 0.46, 0.78), "Colour overhead, with `gradient`", unit="sRGB")
    horizon: Colour = param((0.80, 0.87, 0.93), "Colour at the horizon, with `gradient`", unit="sRGB")
    turbidity: float = param(2.5, "Haze, with `preetham`: 2 very clear, 3 clear, 6 hazy, 10 close to fog", ge=2, le=10)
    image: FilePath | None = param(
        None,
        "Picture, with `image`: equirectangular, twice as wide as high; .hdr, .exr, or 8 bits such as .jpg. Its "
        "middle is seen looking along -z",
    )
    turn: float = param(
        0.0, "Turn of the picture about +Y, counter-clockwise seen from above", unit="degrees", ge=-360, le=360
    )
    intensity: float = param(1.0, "Multiplies the light of the picture", ge=0, le=MAX_SKY_INTENSITY)
    sun: bool = param(
        False, "Let the brightest spot of the picture, if it is small, be the sun, instead of that of `environment`"
    )
    sun_size: float = param(
        0.0,
        "Diameter of the visible sun, except with `image`; 0.53 in reality, 0 draws none",
        unit="degrees",
        ge=0,
        le=20,
    )
    light: bool = param(
        False,
        "Light the scene by the sky, instead of `ambient`, and by what the ground reflects of it; a picture has its "
        "own ground",
    )

    @property
    def used_keys(self) -> frozenset[str]:
        """Return the keys that matter for its model."""
        painted = {"gradient": ("turbidity",), "preetham": ("zenith", "horizon"), "image": ()}[self.model]
        return frozenset(type(self).model_fields).difference(_unused(self.model), painted)

    @property
    def is_sun(self) -> bool:
        """Return whether its picture holds the sun, instead of `environment`."""
        return self.model == "image" and self.sun

    def __setattr__(self, name: str, value: Any) -> None:
        """Set a key. Raises InputError if its model has no use for it, or for a value that is not allowed.

        `image` can be set with any model, since the model `image` cannot be set without. What another model has used
        is kept, for when that is set again.
        """
        if name in _unused(self.model) and name != "image":
            raise InputError(f"{name}: {_misplaced(name)}")
        changing = _changing.set(True)
        try:
            super().__setattr__(name, value)
        finally:
            _changing.reset(changing)

    @model_validator(mode="before")
    @classmethod
    def _keys_of_its_model(cls, value: Any) -> Any:
        model = value.get("model", "gradient") if isinstance(value, dict) else None
        if model not in get_args(SkyModel):  # reported by the key itself
            return value
        for key in () if _changing.get() else _unused(model):
            if key in value and value[key] != cls.model_fields[key].default:
                raise ValueError(_misplaced(key))
        if model == "image" and value.get("image") is None:
            raise ValueError("'model: image' needs 'image', the file of the picture")
        return value


def _unused(model: object) -> tuple[str, ...]:
    """Return the keys of a sky that its model has no use for."""
    return NOT_OF_IMAGE if model == "image" else OF_IMAGE


def _misplaced(key: str) -> str:
    """Return what is wrong with a key of a sky whose model has no use for it."""
    return f"{key!r} is {'not' if key in NOT_OF_IMAGE else 'only'} for 'model: image'"


class FogParams(FileParams):
    """Describe fog that gets thinner with height."""

    density: float = param(0.01, "Fraction of the light that is lost per metre", unit="1/m", ge=0, le=1)
    height: Coordinate = param(0.0, "y up to which the fog has its full density", unit="m")
    falloff: float = param(
        20.0, "Height above that over which the density falls to 1/e (37 %)", unit="m", ge=0.1, le=10_000
    )
    colour: Colour | None = param(None, "Colour; if left out, the sky's colour at the horizon", unit="sRGB")


class GroundParams(FileParams):
    """Describe the ground: a horizontal square centred on the origin."""

    height: Coordinate = param(0.0, "y of the ground", unit="m")
    colour: Colour = param((0.45, 0.47, 0.40), "Colour; multiplies the texture", unit="sRGB")
    texture: FilePath | None = param(None, "Image that is repeated over the ground, a path relative to the scene file")
    tile: Length = param(2.0, "Side of one repetition of the texture", unit="m")
    half_size: Length = param(10_000.0, "Half the side of the square; the default reaches the horizon", unit="m")


class SunParams(FileParams):
    """Describe the sun: light from the same direction everywhere."""

    direction: Direction = param((-0.4, -0.8, -0.6), "Direction in which the light travels, a vector of any length")
    colour: Colour = param((1.0, 0.96, 0.90), "Colour of the light", unit="sRGB")
    intensity: float = param(1.0, "Strength; at 1, a white surface facing the sun is lit to white", ge=0, le=100)


class AmbientParams(FileParams):
    """Describe light that comes from all directions, more of it from one side: a hemisphere light."""

    colour: Colour = param((0.85, 0.92, 1.0), "Colour of the light", unit="sRGB")
    intensity: float = param(0.35, "Strength on surfaces that face the brightest side", ge=0, le=100)
    direction: Direction = param((0, -1, 0), "Direction in which most of it travels, a vector of any length")
    contrast: float = param(0.5, "Fraction of it that does not reach surfaces facing the other way", ge=0, le=1)


class LampParams(FileParams):
    """Describe a lamp: a point light, or with `direction` a spot light."""

    position: Vector = param(..., "Position in the world", unit="m")
    colour: Colour = param((1.0, 0.85, 0.65), "Colour of the light", unit="sRGB")
    intensity: float = param(
        1.0, "Strength at 1 m, in the unit of the sun's; it falls with the square of the distance", ge=0, le=10_000
    )
    range: Length = param(10.0, "Distance at which the light ends", unit="m")
    direction: Direction | None = param(None, "Direction of a spot light; if left out, the lamp is a point light")
    angle: float = param(60.0, "Full opening angle of a spot light's cone", unit="degrees", ge=1, le=180)
    shadow: bool = param(
        False, f"Let a spot light cast shadows; its cone may then be at most {MAX_SHADOW_ANGLE} degrees wide"
    )

    @model_validator(mode="after")
    def _shadow_in_cone(self) -> Self:
        if self.shadow and self.direction is None:
            raise ValueError("'shadow' needs a cone: give a 'direction'")
        if self.shadow and self.angle > MAX_SHADOW_ANGLE:
            raise ValueError(f"'shadow' needs a cone of at most {MAX_SHADOW_ANGLE} degrees")
        return self


class Environment(FileParams):
    """Describe sky, ground and lights. A file without it has neither sky nor ground, and the default sun."""

    background: Colour = param((0.18, 0.19, 0.21), "Colour behind everything if there is no sky", unit="sRGB")
    sky: SkyParams | None = param(None, "Sky; if left out, none is drawn")
    ground: GroundParams | None = param(None, "Ground; if left out, none is drawn")
    sun: SunParams = Field(default_factory=SunParams, description="Directional light")
    ambient: AmbientParams = Field(default_factory=AmbientParams, description="Light from all directions")
    lights: Annotated[list[LampParams], Field(max_length=MAX_LIGHTS)] = param(
        [], "Lamps, in world coordinates; groups cannot hold any"
    )
    fog: FogParams | None = param(None, "Fog; if left out, there is none")


class CameraParams(FileParams):
    """Describe a pinhole camera."""

    position: Vector = param(..., "Position of the camera", unit="m")
    target: Vector = param(..., "Point it looks at, at the centre of the picture", unit="m")
    fov: float = param(60.0, "Vertical field of view", unit="degrees", ge=MIN_FOV, le=MAX_FOV)

    @model_validator(mode="after")
    def _target_is_elsewhere(self) -> Self:
        if self.position == self.target:
            raise ValueError("'target' must be elsewhere than 'position'")
        return self


class WalkParams(FileParams):
    """Describe how the user walks through the scene in the window."""

    speed: float | None = param(
        None,
        "Initial walking speed; if left out, 3 m/s, or another that takes 5 s to 2 min to cross the objects",
        unit="m/s",
        ge=MIN_SPEED,
        le=MAX_SPEED,
    )
    collide: bool = param(True, "Stop at surfaces while walking, and go up and down steps; nothing stops who flies")
