"""A GL context and everything made in it. Objects are created through a `Scope`, which owns and releases them."""

import logging
from collections import Counter
from collections.abc import Callable
from contextlib import AbstractContextManager
from typing import Any, Unpack

import moderngl

from depthwalk.gpu.state import Changes, ColourMask, StateKeeper

log = logging.getLogger(__name__)

DEPTH_CLAMP = 0x864F  # GL_DEPTH_CLAMP, core since 3.2; moderngl has no name for it
CLIP_DISTANCES = tuple(range(0x3000, 0x3004))  # GL_CLIP_DISTANCE0 to 3: a tile's four sides
R8_SNORM = 0x8F94  # GL_R8_SNORM
_SRGB8_ALPHA8 = 0x8C43  # GL_SRGB8_ALPHA8: texels are decoded before they are filtered


class GpuError(Exception):
    """The driver refused an object or a program; the message says which and how large it was."""


class Device:
    """A context with its limits and a count of live objects by kind (`live`)."""

    def __init__(self, context: moderngl.Context) -> None:
        self.context = context
        self.live: Counter[str] = Counter()
        self.state = StateKeeper(context)
        self.renderer: str = context.info["GL_RENDERER"]
        self.software = any(name in self.renderer.lower() for name in ("llvmpipe", "softpipe", "swrast", "swiftshader"))
        self.max_texture_size: int = context.info["GL_MAX_TEXTURE_SIZE"]
        self.max_layers: int = context.info["GL_MAX_ARRAY_TEXTURE_LAYERS"]
        self.max_samples = _max_samples(context)

    def scope(self, owner: str) -> "Scope":
        return Scope(self, owner)


def headless_device() -> Device:
    """A device without a window: EGL where there is one, else the platform's own.

    Raises GpuError where no OpenGL 3.3 context can be had.
    """
    reasons = []
    attempts: list[dict[str, Any]] = [{"backend": "egl"}, {}]
    for settings in attempts:
        try:
            return Device(moderngl.create_context(require=330, standalone=True, **settings))
        except Exception as error:  # glcontext raises bare Exception
            reasons.append(str(error))
    raise GpuError(f"no OpenGL 3.3 context: {'; '.join(reasons)}")


def _max_samples(context: moderngl.Context) -> int:
    """Samples per pixel that textures of every kind may have and shaders run for; 1 where shaders cannot (GL 3.3)."""
    if not {"GL_ARB_gpu_shader5", "GL_ARB_sample_shading"} <= set(context.extensions):
        return 1
    return min(int(context.info[f"GL_MAX_{kind}_SAMPLES"]) for kind in ("COLOR_TEXTURE", "DEPTH_TEXTURE", "INTEGER"))


class Scope:
    """Owns the GL objects of one part of the program. `release()` frees them all; single ones by `free(object)`."""

    def __init__(self, device: Device, owner: str) -> None:
        self.device = device
        self.owner = owner
        self._objects: dict[int, tuple[str, Any]] = {}

    def texture(
        self, size: tuple[int, int], components: int, dtype: str = "f1", data: bytes | None = None
    ) -> moderngl.Texture:
        """A 2-D texture without filtering, clamped. dtype as moderngl names them ("f1" 8-bit, "f2" half, "nu2" …)."""
        self._check_size(size)
        make = self.device.context.texture
        texture = self._make("texture", size, lambda: make(size, components, data, dtype=dtype))
        texture.filter = moderngl.NEAREST, moderngl.NEAREST
        texture.repeat_x = texture.repeat_y = False
        return texture

    def srgb_texture(self, size: tuple[int, int], data: bytes) -> moderngl.Texture:
        """An RGBA texture of 8-bit sRGB colours (alpha linear), repeating, with mip-maps."""
        return self.tiling_texture(size, 4, data, internal_format=_SRGB8_ALPHA8)

    def tiling_texture(self, size: tuple[int, int], components: int, data: bytes, **layout: Any) -> moderngl.Texture:
        """A 2-D texture with mip-maps, trilinear, repeating. layout: moderngl's dtype or internal_format."""
        self._check_size(size)
        make = self.device.context.texture
        texture = self._make("texture", size, lambda: make(size, components, data, **layout))
        texture.build_mipmaps()
        texture.filter = moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR
        return texture

    def mipmapped_texture(
        self, size: tuple[int, int], components: int, data: bytes, levels: int, **layout: Any
    ) -> moderngl.Texture:
        """A 2-D texture with so many `levels` of mip-maps, trilinear, clamped. layout: moderngl's dtype or
        internal_format; else 8-bit."""
        self._check_size(size)
        make = self.device.context.texture
        texture = self._make("texture", size, lambda: make(size, components, data, **layout))
        texture.build_mipmaps(max_level=levels)
        texture.filter = moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR
        texture.repeat_x = texture.repeat_y = False
        return texture

    def number_array(
        self, size: tuple[int, int, int], components: int, data: bytes, dtype: str
    ) -> moderngl.TextureArray:
        """Layers (width, height, count) of integers, which shaders fetch. dtype: moderngl's ("i2", "u4" …)."""
        self._check_size(size[:2])
        if size[2] > self.device.max_layers:
            raise GpuError(f"{self.owner}: {size[2]} texture layers; this driver allows {self.device.max_layers}")
        make = self.device.context.texture_array
        array: moderngl.TextureArray = self._make(
            "texture_array", size, lambda: make(size, components, data, dtype=dtype)
        )
        array.filter = moderngl.NEAREST, moderngl.NEAREST
        return array

    def multisampled_texture(
        self, size: tuple[int, int], samples: int, components: int, dtype: str = "f1"
    ) -> moderngl.Texture:
        """A 2-D texture of several samples per texel, which shaders fetch one by one. dtype: as for `texture`."""
        self._check_size(size)
        make = self.device.context.texture
        return self._make("texture", size, lambda: make(size, components, samples=samples, dtype=dtype))

    def multisampled_depth(self, size: tuple[int, int], samples: int) -> moderngl.Texture:
        """A 24-bit depth texture of several samples per texel."""
        self._check_size(size)
        return self._make("texture", size, lambda: self.device.context.depth_texture(size, samples=samples))

    def depth_texture(self, size: tuple[int, int]) -> moderngl.Texture:
        """A 24-bit depth texture that shaders read as plain numbers."""
        self._check_size(size)
        texture = self._make("texture", size, lambda: self.device.context.depth_texture(size))
        texture.compare_func = ""
        texture.filter = moderngl.NEAREST, moderngl.NEAREST
        texture.repeat_x = texture.repeat_y = False
        return texture

    def framebuffer(
        self, colours: list[moderngl.Texture], depth: moderngl.Texture | None = None
    ) -> moderngl.Framebuffer:
        return self._make("framebuffer", None, lambda: self.device.context.framebuffer(colours, depth))

    def buffer(self, data: Any = None, reserve: int = 0, dynamic: bool = False) -> moderngl.Buffer:
        """A buffer with `data` in it, or of `reserve` bytes."""
        size = reserve if data is None else len(memoryview(data).cast("B"))
        if not size:
            raise GpuError(f"{self.owner}: empty buffer")
        make = self.device.context.buffer
        return self._make("buffer", size, lambda: make(data, reserve=reserve, dynamic=dynamic))

    def program(self, vertex: str, fragment: str) -> moderngl.Program:
        make = self.device.context.program
        return self._make("program", None, lambda: make(vertex_shader=vertex, fragment_shader=fragment))

    def vertex_array(self, program: moderngl.Program, content: list[Any], **options: Any) -> moderngl.VertexArray:
        make = self.device.context.vertex_array
        return self._make("vertex_array", None, lambda: make(program, content, **options))

    def state(
        self,
        into: moderngl.Framebuffer | None = None,
        *,
        depth_write: bool = True,
        colour_mask: ColourMask | None = None,
        **changes: Unpack[Changes],
    ) -> AbstractContextManager[None]:
        """GL state for a `with` block, by the fields of `gpu.state.State`; see `StateKeeper.changed`."""
        return self.device.state.changed(into, depth_write=depth_write, colour_mask=colour_mask, **changes)

    def free(self, *objects: Any) -> None:
        """Releases single objects of this scope before the scope itself."""
        for gl_object in objects:
            kind, _ = self._objects.pop(id(gl_object))
            if gl_object is self.device.context.fbo:  # moderngl binds the last one again whenever it creates another
                self.device.context.detect_framebuffer(0).use()
            gl_object.release()
            self.device.live[kind] -= 1

    def release(self) -> None:
        self.free(*[gl_object for _, gl_object in reversed(self._objects.values())])

    def _make(self, kind: str, size: Any, create: Callable[[], Any]) -> Any:
        if (stale := self.device.context.error) != "GL_NO_ERROR":
            log.warning("%s: an earlier GL call failed: %s", self.owner, stale)
        gl_object = create()
        self._objects[id(gl_object)] = kind, gl_object
        self.device.live[kind] += 1
        error = self.device.context.error
        if error != "GL_NO_ERROR":
            self.free(gl_object)
            raise GpuError(f"{self.owner}: the driver refused a {kind}{f' of {size}' if size else ''}: {error}")
        return gl_object

    def _check_size(self, size: tuple[int, int]) -> None:
        if not 0 < min(size) <= max(size) <= self.device.max_texture_size:
            limit = self.device.max_texture_size
            raise GpuError(f"{self.owner}: texture of {size[0]} × {size[1]}; this driver allows 1 to {limit}")
