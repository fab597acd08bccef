"""Polygons: nothing that may be seen is missing where only some of the meshlets are drawn."""

import numpy as np
import pytest

from depthwalk.gpu.device import Device
from depthwalk.render.draw.draw_lists import DrawBatch
from depthwalk.render.frame import Frame
from depthwalk.render.passes import mesh as mesh_pass
from depthwalk.render.passes.mesh import MeshPass
from depthwalk.render.resources.mesh_object import MeshObject
from depthwalk.scene.arrays import Representation
from depthwalk.types import Rows
from shapes import ShapeLibrary, scene_of, sphere
from stage import OnScreen, view_of


@pytest.fixture(scope="module")
def library() -> ShapeLibrary:
    return ShapeLibrary([sphere(0.6, 128, 64)], [None])


def test_culled_meshlets_change_no_pixel(
    gl_device: Device, library: ShapeLibrary, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = scene_of((0, (-0.7, 0, 0), 0.2, 1.0), (0, (0.7, 0, -0.5), 0.9, 1.0), representation=Representation.MESH)
    pictures: list[Rows] = []
    whole: list[int] = []
    draw_part = mesh_pass.MeshPass._draw_part

    def counted(
        self: MeshPass, frame: Frame, asset: MeshObject, batch: DrawBatch, number: int, first: int, count: int
    ) -> None:
        whole[-1] += count
        draw_part(self, frame, asset, batch, number, first, count)

    monkeypatch.setattr(mesh_pass.MeshPass, "_draw_part", counted)
    for culled in (4, 0):
        monkeypatch.setattr(mesh_pass, "_CULLED_OBJECTS", culled)
        whole.append(0)
        with OnScreen(gl_device, scene, library) as stage:
            stage.draw(view_of((0.0, 0.8, 3.0), (0.0, 0.5, 0.0)))
            assert stage.renderer.targets is not None
            pictures.append(np.frombuffer(stage.renderer.targets.surface.read(alignment=1), np.uint16))
    assert whole == [0, 2]
    np.testing.assert_array_equal(pictures[0], pictures[1])
    assert np.ptp(pictures[0]) > 0
