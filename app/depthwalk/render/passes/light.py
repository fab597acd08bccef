"""Light the G-buffer by sun, ambient light and lamps, and draw the sky behind it: linear light goes to `lit`.

A surface reflects albedo · max(n · l, 0) + specular · max(r · l, 0)^shininess of a light (Phong 1975), with the shadow
maps as factor. Ambient light is a polynomial of its normal (Ramamoorthi and Hanrahan 2001), times the part that
`ambient_occlusion` lets through. Lamps come from lists of cells of the view frustum (Olsson, Billeter and Assarsson
2012). Unlit surfaces keep their colour. Glossy and metallic ones reflect a sky that lights the scene.
"""

from collections.abc import Hashable
from typing import Any

import moderngl
import numpy as np

from depthwalk.gpu.device import Scope
from depthwalk.gpu.instances import RecordTexture
from depthwalk.render.frame import Frame
from depthwalk.render.lamp_inputs import LampInputs
from depthwalk.render.lighting.image_sky import ImageSky, SkyImage
from depthwalk.render.lighting.reflection import ReflectedSky, reflected_parts
from depthwalk.render.pixel_pass import PixelInputs, PixelPass
from depthwalk.scene.effect_settings import LightParams

_MAX_RADIANCE = 1e4  # of the sun's disc: half floats end at 65504
_STRIP_PIXELS = 1 << 17  # pixels that are lit by lamps in one part of the pass


class LightPass(PixelPass[LightParams]):
    """Compute linear light from albedo, normals and shadows: deferred lighting."""

    name = "light"
    per_sample = True
    reads = ("surface", "depth", "shadow", "sun_maps", "lamp_maps", "ambient_visibility")
    writes = ("lit",)

    def setup(self, gl: Scope) -> None:
        """Create the textures that hold lamps; `gl` owns them."""
        super().setup(gl)
        self._lamps = LampInputs(gl)
        self._sky: tuple[SkyImage, moderngl.Texture] | None = None  # the picture shown last
        self._parts: moderngl.Texture | None = None  # that surfaces reflect of even light
        self._mirrored: tuple[Hashable, moderngl.Texture, int] | None = None  # the sky reflected last, and its levels

    def fuses_with_next(self, frame: Frame, params: LightParams) -> bool:
        """Return whether all of `frame` is lit here; in forward mode depth images are lit already."""
        return not frame.common.forward

    def inputs(self, frame: Frame, params: LightParams) -> PixelInputs:
        """Return the light of `frame`, its sky and the lamps; `params` do not matter: `frame.common` has the mode."""
        light, lamps = frame.light, self._lamps.of(frame)
        defines, values = _background(frame)
        defines += light.defines
        values |= light.uniforms()
        if frame.common.forward:
            defines += ("FORWARD",)
        if frame.assets.has_unlit:
            defines += ("UNLIT",)
        if frame.targets.sun_maps is not None:
            defines += ("SHADOWS",)
        textures: dict[str, moderngl.Texture | RecordTexture] = {}
        if isinstance(light.sky, ImageSky) and not frame.transparent:
            textures["sky_image"] = self._sky_texture(light.sky.image)
        if frame.assets.reflects and light.reflected is not None:
            defines += ("REFLECTIONS",)
            textures["mirrored_sky"], levels = self._mirrored_texture(light.reflected)
            self._parts = self._parts or self.gl.table_texture(reflected_parts())
            textures["reflected_parts"] = self._parts
            values |= light.reflected.uniforms(levels)
        if (ambient := frame.targets.ambient_visibility) is not None:
            defines += ("AMBIENT_OCCLUSION",)
            textures |= ambient.textures
            values |= ambient.uniforms
        even_sky = _even_background(frame) and not frame.common.forward
        if lamps is None:
            return PixelInputs(defines=defines, textures=textures, uniforms=values, even_sky=even_sky)
        return PixelInputs(
            defines=(*defines, *lamps.defines),
            textures={**textures, **lamps.textures},
            uniforms={**values, **lamps.uniforms},
            strip_pixels=_STRIP_PIXELS,
            even_sky=even_sky,
        )

    def _sky_texture(self, image: SkyImage) -> moderngl.Texture:
        """Return the texture of the picture that is the sky; that of another one is freed."""
        if self._sky is None or self._sky[0] is not image:
            if self._sky is not None:
                self.gl.free(self._sky[1])
                self._sky = None
            self._sky = image, self.gl.sky_texture(image.levels)
        return self._sky[1]

    def _mirrored_texture(self, reflected: ReflectedSky) -> tuple[moderngl.Texture, int]:
        """Return the texture of the sky that surfaces reflect, and its levels; that of another one is freed."""
        if self._mirrored is None or self._mirrored[0] != reflected.key:
            levels = reflected.levels()
            if self._mirrored is not None:
                self.gl.free(self._mirrored[1])
                self._mirrored = None
            self._mirrored = reflected.key, self.gl.sky_texture(levels), len(levels)
        return self._mirrored[1:]


def _background(frame: Frame) -> tuple[tuple[str, ...], dict[str, Any]]:
    """Return defines and uniforms of the sky, of the sun's disc in it, or of the plain background."""
    light, params = frame.light, frame.environment.sky
    if params is None or params.model == "image" or params.sun_size == 0:
        return light.sky.defines, light.sky.uniforms()
    radius = np.radians(params.sun_size / 2)
    disc = np.minimum(light.sun / radius**2, _MAX_RADIANCE)  # π · sun over the solid angle π · radius²
    return (*light.sky.defines, "DISC"), light.sky.uniforms() | {"disc": tuple(disc.tolist()), "disc_radius": radius}


def _even_background(frame: Frame) -> bool:
    """Return whether the background has one colour, or none in a transparent picture."""
    return frame.transparent or frame.environment.sky is None
