"""What surrounds the objects: `environment:` and `camera:` of the scene file. Colours in sRGB, angles in degrees."""

from typing import Annotated

from pydantic import AfterValidator, Field

from depthwalk.params import param
from depthwalk.scene.fields import Colour, Coordinate, FileParams, FilePath, Length, Vector


def _not_zero(value: tuple[float, float, float]) -> tuple[float, float, float]:
    if max(map(abs, value)) < 1e-6:
        raise ValueError("must not be the zero vector")
    return value


class SkyParams(FileParams):
    """A sky that fades from the horizon to the zenith."""

    zenith: Colour = param((0.25, 0.46, 0.78), "Colour overhead", unit="sRGB")
    horizon: Colour = param((0.80, 0.87, 0.93), "Colour at the horizon", unit="sRGB")


class GroundParams(FileParams):
    """A level square centred on the origin."""

    height: Coordinate = param(0.0, "Its y", unit="m")
    colour: Colour = param((0.45, 0.47, 0.40), "Colour, multiplies the texture", unit="sRGB")
    texture: FilePath | None = param(None, "Image repeated over it; after loading, an absolute path")
    tile: Length = param(2.0, "Side of one repetition of the texture", unit="m")
    size: Length = param(500.0, "Half the square's side", unit="m")


class SunParams(FileParams):
    """A directional light."""

    direction: Annotated[Vector, AfterValidator(_not_zero)] = param((-0.4, -0.8, -0.6), "Where its light goes")
    colour: Colour = param((1.0, 0.96, 0.90), "Its colour", unit="sRGB")
    intensity: float = param(1.0, "Its strength", ge=0, le=100)


class AmbientParams(FileParams):
    """Light from everywhere."""

    colour: Colour = param((0.85, 0.92, 1.0), "Its colour", unit="sRGB")
    intensity: float = param(0.35, "Its strength", ge=0, le=100)


class Environment(FileParams):
    """Sky, ground and lights. Without it in the file: neither sky nor ground, one default sun."""

    background: Colour = param((0.18, 0.19, 0.21), "What is behind everything where there is no sky", unit="sRGB")
    sky: SkyParams | None = param(None, "Present: a sky is drawn")
    ground: GroundParams | None = param(None, "Present: a ground is drawn")
    sun: SunParams = Field(default_factory=SunParams, description="The directional light")
    ambient: AmbientParams = Field(default_factory=AmbientParams, description="Light from everywhere")


class CameraParams(FileParams):
    """A pinhole camera."""

    position: Vector = param(..., "Where it stands", unit="m")
    target: Vector = param(..., "What it looks at", unit="m")
    fov: float = param(60.0, "Vertical angle of view", unit="degrees", ge=1, le=170)
