"""Hold a GL context and everything that is created in it.

moderngl does not free GL objects automatically, and hides failed allocations. So all objects are created through a
`Scope`, which checks the driver's error after each and owns it; releasing the scope frees everything in it.
`Device.live` counts the objects that exist; tests check that none are left. After a failure of the GPU
`Device.release` frees what all scopes own.
"""

import logging
from collections import Counter
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from pathlib import Path
from types import MappingProxyType
from typing import Any, Unpack
from weakref import WeakSet

import moderngl
import numpy as np
from numpy.typing import NDArray

from depthwalk.gpu.failures import AddressOf, GpuError, check_reset, never_reset, reset_status
from depthwalk.gpu.linked_programs import LinkedProgram, LinkedPrograms
from depthwalk.gpu.state import Changes, StateKeeper
from depthwalk.gpu.textures import TextureLimits, TextureMaker

log = logging.getLogger(__name__)

DEPTH_CLAMP = 0x864F  # GL_DEPTH_CLAMP, core since 3.2; moderngl has no name for it
PROGRAM_POINT_SIZE = 0x8642  # GL_PROGRAM_POINT_SIZE: the vertex shader sets the size of points
CLIP_DISTANCES = tuple(range(0x3000, 0x3004))  # GL_CLIP_DISTANCE0 to 3: a tile's four sides


class Device:
    """Hold a GL context, what it can do, and how many objects live in it.

    Attributes
    ----------
    context
        The moderngl context. Whoever created the device releases it last.
    live
        Number of existing objects, by kind.
    programs
        Links programs, and keeps those that no scope uses any more; `Scope.program` calls it.
    state
        Sets GL state and remembers it; `Scope.state` calls it.
    renderer
        The driver's name for the hardware.
    driver
        The driver's versions of OpenGL and of itself.
    software
        Whether it is a software rasteriser.
    limits
        How large textures may be.
    max_samples
        Samples per pixel that textures of every kind may have; 1 where shaders cannot run per sample.
    shaders
        The folder of the shaders; None: `resources.shader_root`.
    """

    def __init__(self, context: moderngl.Context, address_of: AddressOf | None = None) -> None:
        """Query what `context`, moderngl's, can do; it must be the current one.

        address_of: returns the address of the GL function of a name; None if the context is not robust.
        """
        self.context = context
        self._status = never_reset if address_of is None else reset_status(context, address_of)
        self._scopes: WeakSet[Scope] = WeakSet()
        self.live: Counter[str] = Counter()
        self.programs = LinkedPrograms(context)
        self.shaders: Path | None = None
        self.state = StateKeeper(context)
        self.renderer: str = context.info["GL_RENDERER"]
        self.driver: str = context.info["GL_VERSION"]
        self.software = any(name in self.renderer.lower() for name in ("llvmpipe", "softpipe", "swrast", "swiftshader"))
        self.limits = TextureLimits.of(context)
        self.max_samples = _max_samples(context)

    def scope(self, owner: str) -> "Scope":
        """Return a new scope for GL objects, which the caller releases; `owner` names it in messages."""
        scope = Scope(self, owner)
        self._scopes.add(scope)
        return scope

    def check(self) -> None:
        """Ask the driver whether the context was lost; call it once per picture. Raises ContextLostError."""
        check_reset(self._status)

    def finish(self) -> None:
        """Wait until everything that was submitted is drawn.

        The context is made current for the wait, since glFinish returns at once without one.
        """
        with self.context:
            self.context.finish()

    @property
    def notices_loss(self) -> bool:
        """Return whether the driver reports when the context is lost."""
        return self._status is not never_reset

    def release(self) -> None:
        """Release everything in all scopes, after a failure that may have left their owners half finished."""
        for scope in list(self._scopes):
            scope.release()
        self.programs.clear()


def _max_samples(context: moderngl.Context) -> int:
    """Return the most samples per pixel that textures of every kind may have and shaders can run for.

    That is 1 where shaders cannot run per sample, which in OpenGL 3.3 needs extensions.
    """
    if not {"GL_ARB_gpu_shader5", "GL_ARB_sample_shading"} <= set(context.extensions):
        return 1
    return min(int(context.info[f"GL_MAX_{kind}_SAMPLES"]) for kind in ("COLOR_TEXTURE", "DEPTH_TEXTURE", "INTEGER"))


class Scope(TextureMaker):
    """Own the GL objects of one part of the program: create them, and free single ones or all.

    Every method that creates an object raises GpuError where the driver refuses it, or where it would exceed the
    device's limits.

    Attributes
    ----------
    device
        The device that the objects live on.
    """

    def __init__(self, device: Device, owner: str) -> None:
        """Begin a scope on `device` that owns nothing yet; `owner` names it in messages. Users call `Device.scope`."""
        super().__init__(device.context, device.limits, owner)
        self.device = device
        self._objects: dict[int, tuple[str, Any]] = {}

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
            A hint to the driver that the contents will be replaced often.
        """
        size = reserve if data is None else len(memoryview(data).cast("B"))
        if not size:
            raise GpuError(f"{self.owner}: empty buffer")
        make = self.device.context.buffer
        buffer: moderngl.Buffer = self._make("buffer", size, lambda: make(data, reserve=reserve, dynamic=dynamic))
        return buffer

    def refill(self, buffer: moderngl.Buffer, data: NDArray[Any]) -> None:
        """Replace the contents and the size of a buffer of this scope.

        It gets new memory, no more than it needs: the old one may still be read by what is being drawn, and drivers
        take time for every megabyte that they allocate. Vertex arrays over the buffer stay valid.

        Parameters
        ----------
        buffer
            The buffer, which is `dynamic`.
        data
            Its new contents, an array of any shape and dtype; an empty one leaves it as it is.

        Raises
        ------
        GpuError
            If the driver has no memory for it.
        """
        if not data.nbytes:
            return
        grows = data.nbytes > buffer.size
        buffer.orphan(data.nbytes)
        if grows:
            self._check("buffer", data.nbytes)
        buffer.write(np.ascontiguousarray(data))

    def program(self, vertex: str, fragment: str, blocks: Mapping[str, int] = MappingProxyType({})) -> LinkedProgram:
        """Return a linked program of this scope's own; one that another scope has released is used again.

        Parameters
        ----------
        vertex, fragment
            The text of its two shaders; `gpu.shader_source` has resolved `#include` and `#from`.
        blocks
            Binding points of uniform blocks by their names; those that are not named are bound to point 0.

        Raises
        ------
        moderngl.Error
            Where the compiler refuses the shaders; the message is its log.
        """
        make = self.device.programs.linked
        program: LinkedProgram = self._make("program", None, lambda: make(vertex, fragment, blocks))
        return program

    def vertex_array(self, program: moderngl.Program, content: list[Any], **options: Any) -> moderngl.VertexArray:
        """Create and return a vertex array, which maps a program's attributes to buffers.

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
        """Set GL state for a `with` block; afterwards it is what it was before. See `StateKeeper.changed`."""
        return self.device.state.changed(into, depth_write=depth_write, **changes)

    def free(self, *objects: Any) -> None:
        """Release single objects before the scope itself.

        Parameters
        ----------
        *objects
            Objects that this scope has created.

        Raises
        ------
        KeyError
            For an object that this scope does not own.
        """
        for gl_object in objects:
            kind, _ = self._objects.pop(id(gl_object))
            if gl_object is self.device.context.fbo:  # moderngl would bind it again when it creates another
                self.device.context.detect_framebuffer(0).use()
            self.device.live[kind] -= 1
            gl_object.release()

    def release(self) -> None:
        """Release everything in this scope, the newest first. The scope may be used again, and released twice."""
        self.free(*[gl_object for _, gl_object in reversed(self._objects.values())])

    def _make(self, kind: str, size: Any, create: Callable[[], Any]) -> Any:
        """Create an object, own it, and check that the driver has really created it."""
        if (stale := self.device.context.error) != "GL_NO_ERROR":
            log.warning("%s: an earlier GL call failed: %s", self.owner, stale)
        gl_object = create()
        self._objects[id(gl_object)] = kind, gl_object
        self.device.live[kind] += 1
        try:
            self._check(kind, size)
        except GpuError:
            self.free(gl_object)
            raise
        return gl_object

    def _check(self, kind: str, size: Any) -> None:
        """Raise GpuError if the driver has refused an object of this kind, with the size that its message tells."""
        error = self.device.context.error
        if error != "GL_NO_ERROR":
            raise GpuError(f"{self.owner}: the driver refused a {kind}{f' of {size}' if size else ''}: {error}")
