"""Records of objects on the GPU: they come back as they went in, and buffers follow their number."""

from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any, cast

import moderngl
import numpy as np
import pytest
from numpy.typing import NDArray

from depthwalk.gpu.device import Device, Scope
from depthwalk.gpu.instances import RECORDS_PER_ROW, AssetArrays, InstanceStream, RecordTexture
from depthwalk.gpu.program import Program

RECORD = np.dtype([("place", "3f4"), ("size", "f4")])
VERTEX = """#version 330 core
in vec2 in_corner; in vec3 in_place; in float in_size; out vec4 found;
void main() { found = vec4(in_place, in_size + in_corner.x); gl_Position = vec4(0); }"""


@pytest.fixture
def scope(gl_device: Device) -> Iterator[Scope]:
    made = gl_device.scope("test")
    yield made
    made.release()


def records_of(count: int) -> NDArray[Any]:
    records = np.zeros(count, RECORD)
    records["place"] = np.arange(3 * count).reshape(-1, 3)
    records["size"] = -np.arange(count)
    return records


def test_each_draw_reads_the_records_that_were_uploaded_last(gl_device: Device, scope: Scope) -> None:
    program = gl_device.context.program(vertex_shader=VERTEX, varyings=("found",))
    corner, index = scope.buffer(np.array([[0.5, 0]], np.float32)), scope.buffer(np.array([0], np.uint32))
    scope.framebuffer([scope.texture((4, 4), 4)]).use()
    arrays, stream = (
        AssetArrays(scope, cast(Program, SimpleNamespace(gl=program)), "2f", "in_corner"),
        InstanceStream(scope, RECORD),
    )
    records = records_of(5)
    array = arrays.get("dot", corner, index)
    assert arrays.get("dot", corner, index) is array
    outs = []
    for drawn in (records[:2], records[2:]):
        stream.upload(drawn)
        stream.bind(array)
        outs.append(scope.buffer(reserve=16 * len(drawn)))
        array.transform(outs[-1], moderngl.POINTS, vertices=1, instances=len(drawn))
    found = np.concatenate([np.frombuffer(out.read(), np.float32).reshape(-1, 4) for out in outs])
    before = gl_device.live["vertex_array"]
    arrays.forget()
    program.release()
    assert gl_device.live["vertex_array"] == before - 1
    np.testing.assert_array_equal(found[:, :3], records["place"])
    np.testing.assert_array_equal(found[:, 3], records["size"] + 0.5)


def test_an_offset_stands_in_for_a_base_vertex(gl_device: Device, scope: Scope) -> None:
    text = "#version 330 core\nin uvec2 in_number; flat out uvec2 found; void main() { found = in_number; }"
    program = gl_device.context.program(vertex_shader=text, varyings=("found",))
    numbers, index = np.arange(8, dtype=np.uint16).reshape(4, 2), scope.buffer(np.array([1], np.uint32))
    arrays = AssetArrays(scope, cast(Program, SimpleNamespace(gl=program)), "2u2", "in_number")
    vertices, out = scope.buffer(numbers), scope.buffer(reserve=8)
    scope.framebuffer([scope.texture((4, 4), 4)]).use()
    for base in (0, 2):
        arrays.get(base, vertices, index, offset=4 * base).transform(out, moderngl.POINTS, vertices=1)
        assert np.frombuffer(out.read(), np.uint32).tolist() == numbers[base + 1].tolist()
    arrays.forget()
    program.release()


def test_a_stream_has_the_size_of_its_records_and_stays_one_buffer(gl_device: Device, scope: Scope) -> None:
    stream, before = InstanceStream(scope, RECORD), gl_device.live["buffer"]
    for count in (10, 10_000, 9_000, 0, 10):
        stream.upload(records_of(count))
        assert gl_device.live["buffer"] == before
        assert not count or stream._buffer.size == records_of(count).nbytes


@pytest.mark.parametrize(
    "counts",
    [(3,), (RECORDS_PER_ROW + 1, 2), (0, RECORDS_PER_ROW), (3 * RECORDS_PER_ROW + 5, 70 * RECORDS_PER_ROW + 9)],
)
def test_a_record_texture_has_records_by_their_number(gl_device: Device, scope: Scope, counts: tuple[int, ...]) -> None:
    texture, before = RecordTexture(scope, RECORD), gl_device.live["texture"]
    for count in counts:
        records = records_of(count)
        texture.upload(records)
        held = np.frombuffer(texture._texture.read(), np.float32).view(RECORD).ravel()
        np.testing.assert_array_equal(held[:count], records)
        assert texture._texture.height.bit_count() == 1  # as of the first; others would have programs compiled anew
    assert gl_device.live["texture"] == before


def test_records_that_there_is_room_for_take_no_more(gl_device: Device, scope: Scope) -> None:
    texture = RecordTexture(scope, RECORD, 2 * RECORDS_PER_ROW + 5)
    first = texture._texture
    texture.upload(records_of(2 * RECORDS_PER_ROW + 5))
    assert texture._texture is first and first.height == 3
