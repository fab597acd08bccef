"""One phase's plan: every object is drawn once, in the way that its representation and the viewer's place ask for."""

from collections.abc import Iterator

import numpy as np
import pytest

from depthwalk.cook.cases import ALL_PIECES
from depthwalk.gpu.device import Device
from depthwalk.render.draw.plan_settings import PlanSettings
from depthwalk.render.draw.planner import Planner
from depthwalk.render.renderer import Renderer
from depthwalk.render.world.render_world import SceneArrays
from depthwalk.scene.arrays import Representation
from depthwalk.scene.object_settings import LodParams, MeshLodParams, TileParams
from shapes import ShapeLibrary, scene_of, sphere
from stage import view_of

SETTINGS = PlanSettings(lod=LodParams(), layout=TileParams(), polygons=MeshLodParams(), atlas_size=(512, 512))


@pytest.fixture
def arrays(gl_device: Device) -> Iterator[SceneArrays]:
    """Four balls side by side in front of the camera, and one about it."""
    library = ShapeLibrary([sphere(0.5, 32, 16)], resolution=64)
    places = [(0, (1.5 * k - 2.25, 0.5, 0), 0.0, 1.0) for k in range(4)] + [(0, (0, 1.4, 5.0), 0.0, 1.0)]
    renderer = Renderer(gl_device, scene_of(*places), library)
    yield renderer.world.arrays()
    renderer.release()


def test_every_object_is_drawn_once(arrays: SceneArrays) -> None:
    arrays.objects.representation[:] = [Representation.DPCI, Representation.DMESH, Representation.DPCI, 1, 1]
    visible = np.array([4, 2, 0, 1, 3])
    plan = Planner().plan(view_of(), arrays, visible, SETTINGS, first_object_id=7)
    assert sorted(plan.object_rows) == sorted(visible)
    assert plan.object_rows[plan.tiled].tolist() == [2, 0, 3]  # nearest first
    assert sorted(plan.object_rows[~plan.tiled]) == [1, 4]  # the camera is within the last
    assert len(plan.composite.records) == len(plan.warp.records) == len(plan.cleared) == 3
    assert len(plan.dmesh.records) == 2 and plan.next_object_id == 12


def test_what_the_viewer_is_within_is_drawn_whole(arrays: SceneArrays) -> None:
    plan = Planner().plan(view_of(), arrays, np.array([4]), SETTINGS)
    assert not plan.tiled.any() and plan.dmesh.batches[0].pieces == ALL_PIECES


def test_meshes_are_neither_numbered_nor_warped(arrays: SceneArrays) -> None:
    arrays.objects.representation[1] = Representation.MESH
    arrays.objects.asset[1] = 0
    plan = Planner().plan(view_of(), arrays, np.array([0, 1, 2]), SETTINGS)
    assert sorted(plan.object_rows) == [0, 2] and plan.counts["mesh"] == len(plan.mesh.records) == 1


def test_tiles_are_reused_until_the_settings_change(arrays: SceneArrays) -> None:
    planner, view, visible = Planner(), view_of(), np.arange(4)
    warped = [planner.plan(view, arrays, visible, SETTINGS).counts["warped"] for _ in range(2)]
    assert warped == [4, 0]
    other = PlanSettings(lod=LodParams(bias=1.0), layout=TileParams(), polygons=MeshLodParams(), atlas_size=(512, 512))
    assert planner.plan(view, arrays, visible, other).counts["warped"] == 4


def test_tiles_do_not_outlive_the_arrays(arrays: SceneArrays) -> None:
    planner, view, visible = Planner(), view_of(), np.arange(4)
    planner.plan(view, arrays, visible, SETTINGS)
    moved = type(arrays)(objects=arrays.objects, bounds=arrays.bounds, table=arrays.table, generation=1)
    assert planner.plan(view, moved, visible, SETTINGS).counts["warped"] == 4
