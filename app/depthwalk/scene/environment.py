"""What surrounds the objects: `environment:`, `camera:` and `walk:` of the scene file. Colours in sRGB, angles in
degrees."""

from typing import Annotated, Literal, Self

from pydantic import AfterValidator, Field, model_validator

from depthwalk.limits import MAX_FOV, MAX_LIGHTS, MIN_FOV
from depthwalk.params import param
from depthwalk.scene.fields import Colour, Coordinate, FileParams, FilePath, Length, Vector


def _not_zero(value: tuple[float, float, float]) -> tuple[float, float, float]:
    if max(map(abs, value)) < 1e-6:
        raise ValueError("must not be the zero vector")
    return value


MIN_SPEED, MAX_SPEED = 0.001, 10_000.0  # m/s
MAX_SHADOW_ANGLE = 150  # degrees: beyond, a flat map has few texels left for the middle of the cone
Direction = Annotated[Vector, AfterValidator(_not_zero)]


class SkyParams(FileParams):
    """A sky that fades from the horizon to the zenith, or that of a clear day with the sun where it stands."""

    model: Literal["gradient", "preetham"] = param(
        "gradient",
        "Two colours, or daylight in air: `sun` is then the sun above the air, which dims and reddens it, and the sky "
        "is as bright beside it as it is",
    )
    zenith: Colour = param((0.25, 0.46, 0.78), "Colour overhead of `gradient`", unit="sRGB")
    horizon: Colour = param((0.80, 0.87, 0.93), "Colour at the horizon of `gradient`", unit="sRGB")
    turbidity: float = param(2.5, "Haze of `preetham`: 2 very clear, 3 clear, 6 hazy, 10 thin fog", ge=2, le=10)
    sun_size: float = param(0.0, "Diameter of the sun's disc, in truth 0.53; 0: not drawn", unit="degrees", ge=0, le=20)
    light: bool = param(False, "The scene is lit by this sky, and by the ground below it, in place of `ambient`")


class FogParams(FileParams):
    """Fog that thins with the height."""

    density: float = param(0.01, "Part of the light that is lost per metre", unit="1/m", ge=0, le=1)
    height: Coordinate = param(0.0, "The y up to which it is that dense", unit="m")
    falloff: float = param(20.0, "Rise over which it thins to 1/e above that", unit="m", ge=0.1, le=10_000)
    colour: Colour | None = param(None, "Its colour; absent: that of the sky at the horizon", unit="sRGB")


class GroundParams(FileParams):
    """A level square centred on the origin."""

    height: Coordinate = param(0.0, "Its y", unit="m")
    colour: Colour = param((0.45, 0.47, 0.40), "Colour, multiplies the texture", unit="sRGB")
    texture: FilePath | None = param(None, "Image repeated over it; after loading, an absolute path")
    tile: Length = param(2.0, "Side of one repetition of the texture", unit="m")
    size: Length = param(500.0, "Half the square's side", unit="m")


class SunParams(FileParams):
    """A directional light."""

    direction: Direction = param((-0.4, -0.8, -0.6), "Where its light goes")
    colour: Colour = param((1.0, 0.96, 0.90), "Its colour", unit="sRGB")
    intensity: float = param(1.0, "Its strength", ge=0, le=100)


class AmbientParams(FileParams):
    """Light from everywhere."""

    colour: Colour = param((0.85, 0.92, 1.0), "Its colour", unit="sRGB")
    intensity: float = param(0.35, "Its strength", ge=0, le=100)


class LampParams(FileParams):
    """A lamp: it shines everywhere, or with `direction` as a spot light."""

    position: Vector = param(..., "Where it hangs, world", unit="m")
    colour: Colour = param((1.0, 0.85, 0.65), "Its colour", unit="sRGB")
    intensity: float = param(1.0, "Its strength at 1 m, as the sun's; falls with the square", ge=0, le=10_000)
    range: Length = param(10.0, "Distance at which it ends", unit="m")
    direction: Direction | None = param(None, "Where a spot light shines; absent: everywhere")
    angle: float = param(60.0, "Of a spot light's cone, from edge to edge", unit="degrees", ge=1, le=180)
    shadow: bool = param(False, f"Objects in a spot light's cone, of {MAX_SHADOW_ANGLE}° at most, cast shadows")

    @model_validator(mode="after")
    def _shadow_in_cone(self) -> Self:
        if self.shadow and self.direction is None:
            raise ValueError("'shadow' needs a cone: give a 'direction'")
        if self.shadow and self.angle > MAX_SHADOW_ANGLE:
            raise ValueError(f"'shadow' needs a cone of at most {MAX_SHADOW_ANGLE} degrees")
        return self


class Environment(FileParams):
    """Sky, ground and lights. Without it in the file: neither sky nor ground, one default sun."""

    background: Colour = param((0.18, 0.19, 0.21), "What is behind everything where there is no sky", unit="sRGB")
    sky: SkyParams | None = param(None, "Present: a sky is drawn")
    ground: GroundParams | None = param(None, "Present: a ground is drawn")
    sun: SunParams = Field(default_factory=SunParams, description="The directional light")
    ambient: AmbientParams = Field(default_factory=AmbientParams, description="Light from everywhere")
    lights: Annotated[list[LampParams], Field(max_length=MAX_LIGHTS)] = param([], "Lamps; groups hold none")
    fog: FogParams | None = param(None, "Present: there is fog")


class CameraParams(FileParams):
    """A pinhole camera."""

    position: Vector = param(..., "Where it stands", unit="m")
    target: Vector = param(..., "What it looks at", unit="m")
    fov: float = param(60.0, "Vertical angle of view", unit="degrees", ge=MIN_FOV, le=MAX_FOV)

    @model_validator(mode="after")
    def _looks_somewhere(self) -> Self:
        if self.position == self.target:
            raise ValueError("'target' must be elsewhere than 'position'")
        return self


class WalkParams(FileParams):
    """How the window's viewer moves."""

    speed: float | None = param(
        None,
        "Speed at the start; absent: 3 m/s, unless crossing the objects would take less than 5 s or more than 2 min",
        unit="m/s",
        ge=MIN_SPEED,
        le=MAX_SPEED,
    )
