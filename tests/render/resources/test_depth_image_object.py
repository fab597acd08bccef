"""Depth images on the GPU: geometry comes back as it was cooked, and every object has an owner."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from depthwalk.bake.meso import Meso
from depthwalk.cook.cook import CookedObject, CookOptions, cook_object
from depthwalk.cook.lod_geometry import vertex_positions
from depthwalk.cook.texture_detail import Detail
from depthwalk.gpu.device import Device, Scope
from depthwalk.render.resources.depth_image_object import DepthObject, upload_depth
from depthwalk.render.resources.surface_texture import upload_texture
from shapes import bake, sphere


@pytest.fixture(scope="module")
def cooked() -> CookedObject:
    return cook_object(bake(sphere(columns=64, rows=32), 32, 1), CookOptions())


@pytest.fixture
def scope(gl_device: Device) -> Iterator[Scope]:
    made = gl_device.scope("test")
    yield made
    made.release()


def upload(scope: Scope, cooked: CookedObject) -> DepthObject:
    """The whole object, texture and all."""
    grids, pages = cooked.load()
    uploaded = upload_depth(scope, cooked.outline, grids)
    uploaded.texture = upload_texture(scope, pages, Detail.FULL)
    return uploaded


def test_geometry_comes_back_as_it_was_cooked(scope: Scope, cooked: CookedObject) -> None:
    grids, _ = cooked.load()
    uploaded = upload(scope, cooked)
    positions, triangles = uploaded.shape([(0, 300), (300, 30)])
    assert triangles.shape == (110, 3)
    low, size = (np.array(bound, np.float32) for bound in (grids.box_low, grids.box_size))
    samples = np.asarray(grids.vertices).view(np.uint16).reshape(-1, 4)
    known = {tuple(point) for point in vertex_positions(samples, low, size).astype(np.float32).tolist()}
    assert {tuple(point) for point in positions.tolist()} <= known
    assert np.linalg.norm(positions - [0, 1, 0], axis=1) == pytest.approx(np.ones(len(positions)), abs=0.15)


def test_everything_is_owned_and_freed(scope: Scope, cooked: CookedObject, gl_device: Device) -> None:
    before = dict(+gl_device.live)
    uploaded = upload(scope, cooked)
    assert uploaded.bytes == cooked.bytes
    assert sum(gl_device.live.values()) == sum(before.values()) + len(uploaded.owned)
    scope.free(*uploaded.owned)
    assert dict(+gl_device.live) == before


def test_relief_is_a_define_and_a_texture(scope: Scope, cooked: CookedObject) -> None:
    plain = upload(scope, cooked)
    assert plain.defines == () and plain.relief["meso_height"] == 0 and plain.meso.size == (1, 1)
    meso = Meso(relief=np.zeros((4, 8, 3), np.float32), tile=(0.5, 0.25), height=0.1)
    rough = upload(scope, replace(cooked, outline=replace(cooked.outline, meso=meso)))
    assert rough.defines == ("MESO",) and rough.meso.size == (8, 4)
    assert rough.relief["meso_height"] == pytest.approx(0.1) and rough.relief["meso_turn"] == 13
    assert set(rough.surface_defines) == {"MESO", *plain.surface_defines}
