"""Hand the ambient visibility of a picture to the passes that light it, as a texture and the uniforms to read it by."""

from dataclasses import dataclass
from typing import Any

import moderngl

# Part of the radius by which a point may be off a surface's plane and still belong to it.
_OFF_SURFACE = 0.1


@dataclass(frozen=True, kw_only=True)
class AmbientVisibility:
    """Hold the part of the ambient light that reaches the surfaces of a picture, for ambient_visibility.glsl.

    Attributes
    ----------
    texture : half as wide and high as the picture; see the target `ambient_visibility`.
    radius : distance within which surfaces hide each other from ambient light, metres.
    """

    texture: moderngl.Texture
    radius: float

    @property
    def textures(self) -> dict[str, moderngl.Texture]:
        """Return the texture by the name of its sampler."""
        return {"ambient_visibility": self.texture}

    @property
    def uniforms(self) -> dict[str, Any]:
        """Return the uniforms of shaders/ambient_occlusion/neighbour.glsl, without the sampler."""
        return {"off_surface": _OFF_SURFACE * self.radius}
