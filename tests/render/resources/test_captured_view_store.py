"""Captured views are made beside the frames where these do not wait."""

import threading
import time

import numpy as np
import pytest

from depthwalk.bake.capture import capture_views
from depthwalk.bake.captured_views import CapturedViews, CaptureParams
from depthwalk.gpu.device import Device
from depthwalk.render.resources.captured_views import CapturedViewStore
from shapes import box

PARAMS = CaptureParams(directions="azimuths", count=2, resolution=8)
FINER = CaptureParams(directions="azimuths", count=2, resolution=16)


def captured(asset: int, params: CaptureParams) -> CapturedViews | None:
    return capture_views(box(1, 2, 1), params) if asset == 0 else None


def test_frames_that_wait_have_their_views(gl_device: Device) -> None:
    gl = gl_device.scope("test")
    store = CapturedViewStore(gl, captured)
    views = store.views(0, PARAMS, wait=True)
    assert views is not None and views is store.views(0, PARAMS, wait=True) and store.bytes == views.bytes == 1365
    finer = store.views(0, FINER, wait=True)
    assert finer is not None and store.bytes == finer.bytes  # the others are freed
    with pytest.raises(LookupError):
        store.views(1, PARAMS, wait=True)
    store.forget()
    assert store.bytes == 0
    gl.release()


def test_others_go_on_with_what_there_is(gl_device: Device) -> None:
    gl, let = gl_device.scope("test"), threading.Event()

    def slowly(asset: int, params: CaptureParams) -> CapturedViews | None:
        let.wait()
        return captured(asset, params)

    store = CapturedViewStore(gl, slowly)
    assert store.views(0, PARAMS, wait=False) is None and store.is_busy
    let.set()
    deadline = time.monotonic() + 20
    while (views := store.views(0, PARAMS, wait=False)) is None and time.monotonic() < deadline:
        time.sleep(0.01)
    assert views is not None and not store.is_busy
    assert store.views(0, FINER, wait=False) is views and store.is_busy
    store.forget()
    gl.release()


def test_texels_hold_colour_coverage_normal_and_depth() -> None:
    views = capture_views(box(1, 2, 1, (0, 1, 0)), CaptureParams(directions="azimuths", count=4, resolution=16))
    np.testing.assert_allclose(views.centre, [0, 1, 0])
    assert views.radius == pytest.approx(np.sqrt(1.5))
    middle = views.surface[:, 8, 8]
    assert (views.colour[:, 8, 8, 3] == 255).all() and (views.colour[:, 0, 0, 3] == 0).all()
    np.testing.assert_allclose(middle[0, :3], [128, 128, 255], atol=1)  # normal +z of the first view
    np.testing.assert_allclose(middle[1, :3], [255, 128, 128], atol=1)
    np.testing.assert_allclose(middle[:, 3] / 255, (np.sqrt(1.5) - 0.5) / (2 * np.sqrt(1.5)), atol=0.004)
    assert (views.surface[0, 0, 0] == middle[0]).all()  # beyond the silhouette: as the nearest texel within
