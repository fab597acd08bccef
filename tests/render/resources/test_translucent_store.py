"""What is translucent is read when it is first in sight, and beside the frames where these do not wait."""

import logging
import threading
import time

import pytest

from depthwalk.errors import InputError
from depthwalk.gpu.device import Device
from depthwalk.ingest.mesh import Material, Mesh
from depthwalk.render.resources.translucent_store import TranslucentStore
from shapes import panes

pytestmark = pytest.mark.gl


def read(asset: int) -> Mesh | None:
    if asset == 2:
        raise InputError("glass.obj: broken")
    return panes((0.0, Material(opacity=0.5))) if asset == 1 else None


def taken(store: TranslucentStore) -> None:
    """Poll until nothing is read any more."""
    deadline = time.monotonic() + 20
    while store.is_busy and time.monotonic() < deadline:
        store.poll()
        time.sleep(0.005)


def test_frames_that_wait_have_what_they_ask_for(gl_device: Device) -> None:
    gl = gl_device.scope("test")
    store = TranslucentStore(gl, read, 3)
    store.ask([0, 1], wait=True)
    assert list(store.objects) == [1] and store.is_unknown.tolist() == [False, False, True]
    assert store.bytes == store.objects[1].vertices.size + 2 * 12 + 5  # with a white texel
    with pytest.raises(InputError, match="broken"):
        store.ask([2], wait=True)
    store.forget()
    assert store.bytes == 0 and store.is_unknown.all()
    gl.release()


def test_others_go_on_without(gl_device: Device, caplog: pytest.LogCaptureFixture) -> None:
    gl, let = gl_device.scope("test"), threading.Event()

    def slowly(asset: int) -> Mesh | None:
        let.wait()
        return read(asset)

    store = TranslucentStore(gl, slowly, 3)
    with caplog.at_level(logging.WARNING):
        store.ask([0, 1, 2], wait=False)
        store.poll()
        assert store.is_busy and not store.objects
        let.set()
        taken(store)
    assert list(store.objects) == [1]
    assert caplog.messages == ["glass.obj: broken"]
    store.ask([0, 1, 2], wait=False)
    assert not store.is_busy  # each is asked for once
    store.forget()
    gl.release()
