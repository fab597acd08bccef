"""Who owns GL objects, and what happens where the driver refuses one."""

from collections.abc import Iterator
from types import SimpleNamespace

import moderngl
import numpy as np
import pytest

from depthwalk.gpu.device import Device, Scope
from depthwalk.gpu.failures import GpuError


@pytest.fixture
def scope(gl_device: Device) -> Iterator[Scope]:
    made = gl_device.scope("test")
    yield made
    made.release()


def test_a_scope_releases_everything_once(gl_device: Device) -> None:
    before = dict(+gl_device.live)
    scope = gl_device.scope("test")
    texture = scope.texture((4, 4), 4)
    scope.framebuffer([texture], scope.depth_texture((4, 4)))
    scope.buffer(b"abcd")
    scope.number_array((4, 4, 2), 2, bytes(128), "i2")
    scope.srgb_texture(np.zeros((2, 2, 4), np.uint8))
    scope.mipmapped_texture(np.zeros((4, 4, 1), np.uint8), 2)
    assert gl_device.live["texture"] == before.get("texture", 0) + 4
    assert gl_device.live["buffer"] == before.get("buffer", 0) + 1
    scope.free(texture)
    with pytest.raises(KeyError):
        scope.free(texture)
    scope.release()
    scope.release()
    assert dict(+gl_device.live) == before


def test_scopes_do_not_free_what_is_not_theirs(gl_device: Device, scope: Scope) -> None:
    other = gl_device.scope("other")
    buffer = other.buffer(b"abcd")
    with pytest.raises(KeyError):
        scope.free(buffer)
    other.release()


def test_objects_that_cannot_be_are_refused_with_their_owner_and_size(gl_device: Device, scope: Scope) -> None:
    before = dict(+gl_device.live)
    most = gl_device.limits.edge
    for make, complaint in (
        (lambda: scope.texture((most + 1, 4), 4), f"test: texture of {most + 1} × 4; this driver allows 1 to {most}"),
        (lambda: scope.depth_texture((0, 4)), "test: texture of 0 × 4"),
        (lambda: scope.number_array((1, 1, gl_device.limits.layers + 1), 1, b"", "i2"), "test: .* texture layers"),
        (lambda: scope.buffer(b""), "test: empty buffer"),
        (lambda: scope.buffer(), "test: empty buffer"),
    ):
        with pytest.raises(GpuError, match=complaint):
            make()
    assert dict(+gl_device.live) == before


def test_a_bound_framebuffer_can_be_freed(gl_device: Device, scope: Scope) -> None:
    """moderngl would bind it again when the next is made."""
    framebuffer = scope.framebuffer([scope.texture((4, 4), 4)])
    framebuffer.use()
    scope.free(framebuffer)
    scope.framebuffer([scope.texture((8, 8), 4)]).use()
    assert gl_device.context.error == "GL_NO_ERROR"


def test_a_refilled_buffer_grows_and_shrinks_under_its_vertex_arrays(scope: Scope) -> None:
    program = scope.device.context.program(
        vertex_shader="#version 330\nin float a; out float b; void main() { b = 2.0 * a; }", varyings=("b",)
    )
    buffer, out = scope.buffer(reserve=4, dynamic=True), scope.buffer(reserve=4 * 5000)
    array = scope.vertex_array(program, [(buffer, "f", "a")])
    scope.framebuffer([scope.texture((4, 4), 4)]).use()
    for count in (3, 5000, 2):
        values = np.arange(count, dtype=np.float32)
        scope.refill(buffer, values)
        array.transform(out, moderngl.POINTS, vertices=count)
        np.testing.assert_array_equal(np.frombuffer(out.read(4 * count), np.float32), 2 * values)
        assert buffer.size == 4 * count
    scope.refill(buffer, values[:0])
    assert buffer.size == 4 * count
    program.release()


def test_a_refused_refill_tells_its_size(scope: Scope, monkeypatch: pytest.MonkeyPatch) -> None:
    buffer = scope.buffer(reserve=4, dynamic=True)
    with (
        monkeypatch.context() as patch,
        pytest.raises(GpuError, match="test: the driver refused a buffer of 8: GL_OUT_OF_MEMORY"),
    ):
        patch.setattr(scope.device, "context", SimpleNamespace(error="GL_OUT_OF_MEMORY"))
        scope.refill(buffer, np.zeros(2, np.float32))
