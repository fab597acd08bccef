"""Hold a GL context and everything that is made in it.

moderngl frees no GL object by itself and hides failed allocations. So all objects are created through a `Scope`, which
checks the driver's error after each, and owns it: whoever asks the device for a scope releases the scope, and with it
everything made in it. `Device.live` counts what has been made and not released, which tests compare with nothing.
Where the GPU has failed half-way through something, `Device.release` frees what all scopes own.
"""

import logging
from collections import Counter
from collections.abc import Callable
from contextlib import AbstractContextManager
from functools import partial
from pathlib import Path
from typing import Any, Unpack
from weakref import WeakSet

import moderngl
import numpy as np

from depthwalk.gpu.egl import RobustContext
from depthwalk.gpu.failures import AddressOf, GpuError, check_reset, never_reset, reset_status
from depthwalk.gpu.mip_maps import SNORM, Texels, mip_maps, set_mip_maps
from depthwalk.gpu.state import Changes, StateKeeper

log = logging.getLogger(__name__)

DEPTH_CLAMP = 0x864F  # GL_DEPTH_CLAMP, core since 3.2; moderngl has no name for it
PROGRAM_POINT_SIZE = 0x8642  # GL_PROGRAM_POINT_SIZE: the vertex shader says how large a point is
CLIP_DISTANCES = tuple(range(0x3000, 0x3004))  # GL_CLIP_DISTANCE0 to 3: a tile's four sides
_SRGB8_ALPHA8 = 0x8C43  # GL_SRGB8_ALPHA8: texels are decoded before they are filtered


class Device:
    """Hold a GL context, what it can do, and how many objects live in it.

    Attributes
    ----------
    context
        The moderngl context. Whoever made the device releases it last.
    live
        How many objects live, by kind.
    state
        Sets GL state and remembers it; `Scope.state` calls it.
    renderer
        The driver's name for the hardware.
    driver
        The version of OpenGL that it offers, and its own.
    software
        Whether the CPU does the drawing.
    max_texture_size
        Texels along an edge of a texture.
    max_layers
        Layers of an array texture.
    max_samples
        Samples per pixel that textures of every kind may have; 1 where shaders cannot run per sample.
    shaders
        The folder of the shaders that programs are compiled of; None: `resources.shader_root`.
    """

    def __init__(self, context: moderngl.Context, address_of: AddressOf | None = None) -> None:
        """Find out what `context`, moderngl's, can do; it must be the current one.

        address_of: returns the address of the GL function of a name; None where the context is not a robust one.
        """
        self.context = context
        self._status = never_reset if address_of is None else reset_status(context, address_of)
        self._scopes: WeakSet[Scope] = WeakSet()
        self.live: Counter[str] = Counter()
        self.shaders: Path | None = None
        self.state = StateKeeper(context)
        self.renderer: str = context.info["GL_RENDERER"]
        self.driver: str = context.info["GL_VERSION"]
        self.software = any(name in self.renderer.lower() for name in ("llvmpipe", "softpipe", "swrast", "swiftshader"))
        self.max_texture_size: int = context.info["GL_MAX_TEXTURE_SIZE"]
        self.max_layers: int = context.info["GL_MAX_ARRAY_TEXTURE_LAYERS"]
        self.max_samples = _max_samples(context)

    def scope(self, owner: str) -> "Scope":
        """Return a new scope for GL objects, which the caller releases; `owner` names it in messages."""
        scope = Scope(self, owner)
        self._scopes.add(scope)
        return scope

    def check(self) -> None:
        """Ask the driver whether the context still lives, once for each picture. Raises ContextLostError."""
        check_reset(self._status)

    @property
    def notices_loss(self) -> bool:
        """Return whether the driver tells when the context is lost."""
        return self._status is not never_reset

    def release(self) -> None:
        """Release everything in all scopes: after a failure, of which nobody knows how far it let their owners come."""
        for scope in list(self._scopes):
            scope.release()


def headless_device() -> Device:
    """Return a device without a window: by EGL where there is one, else as the platform does it.

    Its context is robust where the driver offers that. It is current within `with device.context` only; the caller
    releases it.

    Returns
    -------
    Device
        The device.

    Raises
    ------
    GpuError
        Where no OpenGL 3.3 context can be had; the message has the reasons of all attempts.
    """
    reasons: dict[str, None] = {}
    for make in (_robust_device, partial(_ordinary_device, backend="egl"), _ordinary_device):
        try:
            device = make()
        except Exception as error:  # glcontext raises bare Exception
            reasons[str(error)] = None
            continue
        if reasons:
            log.info("the driver will not tell of a lost context: %s", "; ".join(reasons))
        return device
    raise GpuError(f"no OpenGL 3.3 context: {'; '.join(reasons)}")


def _robust_device() -> Device:
    """Return a device that notices when its context is lost. Raises GpuError, and what moderngl raises."""
    robust = RobustContext()
    try:
        with robust:
            context = moderngl.create_context(require=330, standalone=True, context=robust)  # type: ignore[arg-type]
            return Device(context, robust.load_opengl_function)
    except BaseException:
        robust.release()
        raise


def _ordinary_device(**settings: Any) -> Device:
    """Return a device whose context moderngl makes, with these settings of it. Raises what it raises."""
    context = moderngl.create_context(require=330, standalone=True, **settings)
    with context:
        return Device(context)


def _max_samples(context: moderngl.Context) -> int:
    """Return the most samples per pixel that textures of every kind may have and shaders can run for.

    That is 1 where shaders cannot run per sample, which OpenGL 3.3 does by extensions only.
    """
    if not {"GL_ARB_gpu_shader5", "GL_ARB_sample_shading"} <= set(context.extensions):
        return 1
    return min(int(context.info[f"GL_MAX_{kind}_SAMPLES"]) for kind in ("COLOR_TEXTURE", "DEPTH_TEXTURE", "INTEGER"))


class Scope:
    """Own the GL objects of one part of the program: create them, and free single ones or all.

    Every method that creates an object raises GpuError where the driver refuses it, or where it would exceed the
    device's limits.

    Attributes
    ----------
    device
        The device that the objects live on.
    owner
        The name of that part of the program, for messages.
    """

    def __init__(self, device: Device, owner: str) -> None:
        """Begin a scope on `device` that owns nothing yet; `owner` names it in messages. Users call `Device.scope`."""
        self.device = device
        self.owner = owner
        self._objects: dict[int, tuple[str, Any]] = {}

    def texture(
        self, size: tuple[int, int], components: int, dtype: str = "f1", data: bytes | None = None
    ) -> moderngl.Texture:
        """Create and return a 2-D texture without filtering, clamped at its edges.

        Parameters
        ----------
        size
            (width, height), texels.
        components
            Numbers per texel, 1 to 4.
        dtype
            As moderngl names it: "f1" 8-bit, "f2" half, "f4" float, "nu2" 16-bit from 0 to 1, and so on.
        data
            The texels, lower row first; None leaves them undefined.
        """
        self._check_size(size)
        make = self.device.context.texture
        texture: moderngl.Texture = self._make("texture", size, lambda: make(size, components, data, dtype=dtype))
        texture.filter = moderngl.NEAREST, moderngl.NEAREST
        texture.repeat_x = texture.repeat_y = False
        return texture

    def srgb_texture(self, size: tuple[int, int], data: bytes) -> moderngl.Texture:
        """Create and return an RGBA texture of 8-bit sRGB colours (alpha is linear) with mip-maps that repeats.

        Parameters
        ----------
        size
            (width, height), texels.
        data
            The texels, four bytes each, lower row first.
        """
        return self.tiling_texture(size, 4, data, internal_format=_SRGB8_ALPHA8)

    def tiling_texture(self, size: tuple[int, int], components: int, data: bytes, **layout: Any) -> moderngl.Texture:
        """Create and return a 2-D texture with mip-maps that repeats, filtered trilinearly.

        Parameters
        ----------
        size
            (width, height), texels.
        components
            Numbers per texel, 1 to 4.
        data
            The texels, lower row first.
        **layout
            moderngl's `dtype` or `internal_format`; 8-bit where neither is given.
        """
        self._check_size(size)
        make = self.device.context.texture
        texture: moderngl.Texture = self._make("texture", size, lambda: make(size, components, data, **layout))
        texture.build_mipmaps()
        texture.filter = moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR
        return texture

    def mipmapped_texture(self, texels: Texels, levels: int) -> moderngl.Texture:
        """Create and return a 2-D texture with mip-maps, filtered trilinearly, clamped at its edges.

        Parameters
        ----------
        texels
            (H, W, k) uint8 with k from 1 to 4, or int8 with k = 1 or 2; lower row first.
        levels
            The number of the coarsest mip-map; 0 is the finest, and each is half as wide and high as the one before. It
            is lower where a width or height becomes odd.
        """
        height, width, components = texels.shape
        size = width, height
        self._check_size(size)
        layout: dict[str, Any] = (
            {"dtype": "ni1", "internal_format": SNORM[components]} if texels.dtype == np.int8 else {}
        )
        make = self.device.context.texture

        def create() -> moderngl.Texture:
            made = make(size, components, texels.tobytes(), **layout)
            set_mip_maps(self.device.context, made, mip_maps(texels, levels))
            return made

        texture: moderngl.Texture = self._make("texture", size, create)
        texture.filter = moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR
        texture.repeat_x = texture.repeat_y = False
        return texture

    def number_array(
        self, size: tuple[int, int, int], components: int, data: bytes | None, dtype: str
    ) -> moderngl.TextureArray:
        """Create and return an array texture of numbers, which shaders fetch without filtering.

        Parameters
        ----------
        size
            (width, height, layers), texels.
        components
            Numbers per texel, 1 to 4.
        data
            The texels, layer by layer, lower row first; None leaves them undefined.
        dtype
            As moderngl names it: "i2", "u4", "f4" and so on.
        """
        array = self._array(size, components, data, dtype)
        array.filter = moderngl.NEAREST, moderngl.NEAREST
        return array

    def filtered_array(self, size: tuple[int, int, int], components: int, data: bytes) -> moderngl.TextureArray:
        """Create and return an array texture of 8 bits, 0 to 1, with mip-maps, clamped at the edges of its layers.

        Texels are filtered linearly, of the mip-map that is nearest to the level asked for.

        Parameters
        ----------
        size
            (width, height, layers), texels.
        components
            Numbers per texel, 1 to 4.
        data
            The texels, layer by layer, lower row first.
        """
        array = self._array(size, components, data, "f1")
        array.build_mipmaps()
        array.filter = moderngl.LINEAR_MIPMAP_NEAREST, moderngl.LINEAR
        array.repeat_x = array.repeat_y = False
        return array

    def _array(
        self, size: tuple[int, int, int], components: int, data: bytes | None, dtype: str
    ) -> moderngl.TextureArray:
        """Return a new array texture; raise GpuError where the driver does not allow its size."""
        self._check_size(size[:2])
        if size[2] > self.device.max_layers:
            raise GpuError(f"{self.owner}: {size[2]} texture layers; this driver allows {self.device.max_layers}")
        make = self.device.context.texture_array
        array: moderngl.TextureArray = self._make(
            "texture_array", size, lambda: make(size, components, data, dtype=dtype)
        )
        return array

    def volume(self, size: tuple[int, int, int], components: int, dtype: str, data: bytes) -> moderngl.Texture3D:
        """Create and return a 3-D texture, filtered linearly, clamped at its faces.

        Parameters
        ----------
        size
            (width, height, depth), texels.
        components
            Numbers per texel, 1 to 4.
        dtype
            As moderngl names it: "f1" 8-bit, "f2" half and so on.
        data
            The texels, slice by slice, lower row first.
        """
        limit = int(self.device.context.info["GL_MAX_3D_TEXTURE_SIZE"])
        if not 0 < min(size) <= max(size) <= limit:
            raise GpuError(f"{self.owner}: volume of {size}; this driver allows 1 to {limit}")
        make = self.device.context.texture3d
        volume: moderngl.Texture3D = self._make("volume", size, lambda: make(size, components, data, dtype=dtype))
        volume.filter = moderngl.LINEAR, moderngl.LINEAR
        volume.repeat_x = volume.repeat_y = volume.repeat_z = False
        return volume

    def multisampled_texture(
        self, size: tuple[int, int], samples: int, components: int, dtype: str = "f1"
    ) -> moderngl.Texture:
        """Create and return a 2-D texture of several samples per texel, which shaders fetch one by one.

        Parameters
        ----------
        size
            (width, height), texels.
        samples
            Samples per texel, at most `Device.max_samples`.
        components
            Numbers per sample, 1 to 4.
        dtype
            As moderngl names it: "f1" 8-bit, "f4" float and so on.
        """
        self._check_size(size)
        make = self.device.context.texture
        texture: moderngl.Texture = self._make(
            "texture", size, lambda: make(size, components, samples=samples, dtype=dtype)
        )
        return texture

    def multisampled_depth(self, size: tuple[int, int], samples: int) -> moderngl.Texture:
        """Create and return a 24-bit depth texture of `size` (width, height) texels, with `samples` samples per texel.

        `Device.max_samples` is the most that there may be.
        """
        self._check_size(size)
        make = self.device.context.depth_texture
        texture: moderngl.Texture = self._make("texture", size, lambda: make(size, samples=samples))
        return texture

    def depth_texture(self, size: tuple[int, int]) -> moderngl.Texture:
        """Create and return a 24-bit depth texture of `size` (width, height) texels.

        Shaders read its depths as numbers from 0 to 1, without comparison and without filtering.
        """
        self._check_size(size)
        texture: moderngl.Texture = self._make("texture", size, lambda: self.device.context.depth_texture(size))
        texture.compare_func = ""
        texture.filter = moderngl.NEAREST, moderngl.NEAREST
        texture.repeat_x = texture.repeat_y = False
        return texture

    def framebuffer(
        self, colours: list[moderngl.Texture], depth: moderngl.Texture | None = None
    ) -> moderngl.Framebuffer:
        """Create and return a framebuffer that draws into textures.

        Parameters
        ----------
        colours
            The textures of the shader's outputs, in their order; none for a framebuffer of depth only.
        depth
            The depth texture; None for a framebuffer without depth.
        """
        make = self.device.context.framebuffer
        framebuffer: moderngl.Framebuffer = self._make("framebuffer", None, lambda: make(colours, depth))
        return framebuffer

    def buffer(self, data: Any = None, reserve: int = 0, dynamic: bool = False) -> moderngl.Buffer:
        """Create and return a buffer.

        Parameters
        ----------
        data
            Its contents: bytes, or an array of any shape and dtype. None leaves them undefined.
        reserve
            Size in bytes, above 0, of a buffer without `data`.
        dynamic
            Whether the contents will be replaced often, which the driver is told.
        """
        size = reserve if data is None else len(memoryview(data).cast("B"))
        if not size:
            raise GpuError(f"{self.owner}: empty buffer")
        make = self.device.context.buffer
        buffer: moderngl.Buffer = self._make("buffer", size, lambda: make(data, reserve=reserve, dynamic=dynamic))
        return buffer

    def program(self, vertex: str, fragment: str) -> moderngl.Program:
        """Compile, link and return a program.

        Parameters
        ----------
        vertex, fragment
            The text of its two shaders, GLSL without `#include` and `#from`, which `gpu.program` resolves.

        Raises
        ------
        moderngl.Error
            Where the compiler refuses the shaders; the message is its log.
        """
        make = self.device.context.program
        program: moderngl.Program = self._make(
            "program", None, lambda: make(vertex_shader=vertex, fragment_shader=fragment)
        )
        return program

    def vertex_array(self, program: moderngl.Program, content: list[Any], **options: Any) -> moderngl.VertexArray:
        """Create and return a vertex array, which tells a program where its attributes lie in buffers.

        Parameters
        ----------
        program
            The program that draws with it.
        content
            Tuples of a buffer, its format and the names of the attributes, as `moderngl.Context.vertex_array` takes
            them.
        **options
            Keyword arguments of `moderngl.Context.vertex_array`, such as `index_buffer`.
        """
        make = self.device.context.vertex_array
        array: moderngl.VertexArray = self._make("vertex_array", None, lambda: make(program, content, **options))
        return array

    def state(
        self,
        into: moderngl.Framebuffer | None = None,
        *,
        depth_write: bool = True,
        **changes: Unpack[Changes],
    ) -> AbstractContextManager[None]:
        """Set GL state for a `with` block; afterwards it is what it was before.

        Parameters
        ----------
        into
            The framebuffer to draw into, which stays bound after the block; None leaves it as it is.
        depth_write
            Whether draws write the framebuffer's depth, where there is a depth test.
        **changes
            Fields of `State` with their new values; those that are not named stay as they are.
        """
        return self.device.state.changed(into, depth_write=depth_write, **changes)

    def free(self, *objects: Any) -> None:
        """Release some objects of this scope before the scope itself.

        Parameters
        ----------
        *objects
            What methods of this scope have created.

        Raises
        ------
        KeyError
            For an object that this scope does not own.
        """
        for gl_object in objects:
            kind, _ = self._objects.pop(id(gl_object))
            if gl_object is self.device.context.fbo:  # moderngl binds the last one again whenever it creates another
                self.device.context.detect_framebuffer(0).use()
            self.device.live[kind] -= 1
            gl_object.release()

    def release(self) -> None:
        """Release everything in this scope, the newest first. The scope may be used again, and released twice."""
        self.free(*[gl_object for _, gl_object in reversed(self._objects.values())])

    def _make(self, kind: str, size: Any, create: Callable[[], Any]) -> Any:
        """Create an object, own it, and ask the driver whether it really exists.

        kind: what `Device.live` counts it as; size: how large it is, for messages, None for what has no size.
        """
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
        """Raise GpuError where a texture (width, height) would exceed what the driver allows."""
        if not 0 < min(size) <= max(size) <= self.device.max_texture_size:
            limit = self.device.max_texture_size
            raise GpuError(f"{self.owner}: texture of {size[0]} × {size[1]}; this driver allows 1 to {limit}")
