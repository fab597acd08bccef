"""Polygons: nothing that may be seen is missing where only some of the meshlets are drawn, in whatever phase."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from depthwalk.gpu.device import Device
from depthwalk.render import occlusion_phases
from depthwalk.render.draw.draw_lists import DrawBatch
from depthwalk.render.frame import Frame
from depthwalk.render.passes import mesh as mesh_pass
from depthwalk.render.passes.mesh import MeshPass
from depthwalk.render.resources.mesh_object import MeshObject
from depthwalk.scene.arrays import Camera, Representation
from shapes import ShapeLibrary, box, mesh_of, scene_of, sphere
from stage import OnScreen, view_of
from studio import Studio

SUN = {"direction": (0.2, -0.8, -0.6)}


@pytest.fixture(scope="module")
def library() -> ShapeLibrary:
    return ShapeLibrary([sphere(0.6, 128, 64)], [None])


def test_culled_meshlets_change_no_pixel(
    gl_device: Device, library: ShapeLibrary, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = scene_of((0, (-0.7, 0, 0), 0.2, 1.0), (0, (0.7, 0, -0.5), 0.9, 1.0), representation=Representation.MESH)
    pictures: list[NDArray[np.uint16]] = []
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
            targets = stage.renderer.targets
            assert targets is not None
            depth = np.frombuffer(targets.depth.read(alignment=1), np.float32)
            surface = np.frombuffer(targets.surface.read(alignment=1), np.uint16).reshape(len(depth), -1)
            pictures.append(np.where(depth[:, None] < 1, surface, 0))  # elsewhere nobody writes it
            assert 0.1 < (depth < 1).mean() < 0.9
    assert whole == [0, 2]
    np.testing.assert_array_equal(pictures[0], pictures[1])
    assert np.ptp(pictures[0]) > 0


def test_a_mesh_of_a_later_phase_hides_what_an_earlier_one_drew(
    gl_device: Device, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The visibility buffer shows polygons there, no longer the object, whose colours would be looked up."""
    library = ShapeLibrary([sphere(0.6, 32, 16), box(1.2, 1.2, 1.2)], resolution=64)
    scene = scene_of((0, (-0.4, 0, 0.05), 0.0, 1.0), (1, (0.5, 0, 0), 0.0, 1.0))
    scene.objects.representation[:] = Representation.DPCI, Representation.MESH
    shown: list[NDArray[Any]] = []
    continues: list[bool] = []
    draw = MeshPass._draw
    monkeypatch.setattr(
        MeshPass, "_draw", lambda self, frame: continues.append(frame.plan.continues) or draw(self, frame)
    )
    for first in (64, 1):
        monkeypatch.setattr(occlusion_phases, "FIRST_PHASE", first)
        with OnScreen(gl_device, scene, library) as stage:
            stage.draw(view_of((0.0, 0.6, 4.0), (0.0, 0.5, 0.0)))
            targets = stage.renderer.targets
            assert targets is not None
            shown.append(np.frombuffer(targets.visibility_texture.read(), np.uint32).reshape(-1, 2)[:, 0] > 0)
            shown.append(np.frombuffer(targets.surface.read(), np.uint32).reshape(-1, 2)[:, 0])
    assert continues == [False, True]  # together, or the mesh after the impostor
    assert 500 < shown[0].sum() < shown[0].size / 4
    np.testing.assert_array_equal(shown[0], shown[2])
    np.testing.assert_array_equal(shown[1][shown[0]], shown[3][shown[0]])


@pytest.mark.slow
@pytest.mark.parametrize("representation", [Representation.MESH, Representation.DPCI])
def test_there_is_nothing_where_alpha_is_low(studio: Studio, representation: Representation) -> None:
    """A square whose left half is cut out shows and shades as much as its right half alone."""
    texture = np.full((8, 8, 4), 255, np.uint8)
    texture[:, :4, 3] = 0
    normal = [(0.0, 0.0, 1.0)] * 4
    half = mesh_of([(0, 0, 0), (1, 0, 0), (1, 2, 0), (0, 2, 0)], [(0, 1, 2), (0, 2, 3)], normal)
    whole = mesh_of([(-1, 0, 0), (1, 0, 0), (1, 2, 0), (-1, 2, 0)], [(0, 1, 2), (0, 2, 3)], normal)
    uv = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], np.float32)
    cut = replace(whole, uv=uv, materials=(replace(whole.materials[0], texture=texture, cutoff=0.5),))
    shown = []
    for mesh in (half, cut):
        library = ShapeLibrary([mesh], resolution=64, kept=False)
        scene = scene_of((0, (0, 0.0, 0), 0.0, 1.0), representation=representation, ground={}, sun=SUN)
        scene.render.shadows.enabled = True
        picture = studio.picture(scene, library, Camera((0.0, 2.5, 4.0), (0.0, 0.8, 0.0), 1.0), size=(96, 72))
        shown.append(picture[..., :3])
    assert (np.abs(shown[0] - shown[1]).max(-1) > 0.06).mean() < 0.02
    assert np.ptp(shown[0]) > 0.3
