"""The order in which translucent triangles are drawn."""

from collections.abc import Sequence

import numpy as np
import pytest

from depthwalk.gpu.device import Device
from depthwalk.ingest.mesh import Material
from depthwalk.render.draw import translucency_planner
from depthwalk.render.draw.translucency_planner import TranslucencyPlanner, TranslucentDraws, back_to_front
from depthwalk.render.resources.asset_store import AssetStore
from depthwalk.render.resources.translucent_mesh import gather_translucent
from depthwalk.render.view.view import View
from depthwalk.render.world.render_world import RenderWorld
from depthwalk.scene.arrays import Camera, Representation
from shapes import ShapeLibrary, panes, scene_of

GLASS = Material(opacity=0.5)
THREE = panes((0.0, GLASS), (1.0, GLASS), (2.0, GLASS))
LAMP = panes((0.0, Material(emission=(1.0, 1.0, 1.0))))


@pytest.mark.parametrize(("viewer", "expected"), [(5.0, [0, 1, 2]), (-5.0, [2, 1, 0]), (1.6, [0, 1, 2])])
def test_triangles_come_from_back_to_front(viewer: float, expected: list[float]) -> None:
    mesh = gather_translucent(THREE)
    assert mesh is not None
    ((run, faces),) = back_to_front(mesh, np.array([0.0, 1.0, viewer]))
    depths = mesh.vertices["position"][faces][:, 0, 2]
    assert run == 0 and depths.tolist() == np.repeat(expected, 2).tolist()


class Planned:
    """Plans frames of panes that stand on a line, seen from z = `viewer`."""

    def __init__(self, device: Device, assets: Sequence[int], places: Sequence[float]) -> None:
        library = ShapeLibrary([THREE, THREE, LAMP], [None, None, None])
        scene = scene_of(
            *((asset, (0.0, 0.0, z), 0.0, 1.0) for asset, z in zip(assets, places, strict=True)),
            representation=Representation.MESH,
        )
        self.library, self.assets = library, AssetStore(device, library)
        self.planner = TranslucencyPlanner(RenderWorld(scene, library, self.assets), self.assets)

    def plan(self, viewer: float, min_pixels: float = 0.0) -> TranslucentDraws:
        view = View(Camera((0.0, 1.0, viewer), (0.0, 1.0, viewer - 1), 1.0), (8, 8))
        return self.planner.plan(view, min_pixels, wait=True)


@pytest.fixture
def planned(gl_device: Device):  # type: ignore[no-untyped-def]
    made: list[Planned] = []

    def make(assets: Sequence[int], places: Sequence[float]) -> Planned:
        made.append(Planned(gl_device, assets, places))
        return made[-1]

    yield make
    for each in made:
        each.assets.release()


@pytest.mark.gl
def test_near_objects_are_drawn_one_by_one_the_farthest_first(planned) -> None:  # type: ignore[no-untyped-def]
    drawn = planned([0, 1, 0], [0.0, -20.0, -10.0]).plan(10.0)
    assert [(each.asset, each.first, each.count) for each in drawn.batches] == [(1, 0, 1), (0, 1, 1), (0, 2, 1)]
    assert drawn.records["origin"][:, 2].tolist() == [-30, -20, -10]
    assert len(drawn.faces) == 18 and [each.sorted[0].first for each in drawn.batches] == [0, 6, 12]


@pytest.mark.gl
def test_far_objects_are_drawn_by_asset(planned, monkeypatch: pytest.MonkeyPatch) -> None:  # type: ignore[no-untyped-def]
    monkeypatch.setattr(translucency_planner, "_SORTED_OBJECTS", 1)
    drawn = planned([0, 1, 0, 1], [0.0, -30.0, -20.0, -10.0]).plan(10.0)
    assert [(each.asset, each.count, each.sorted is None) for each in drawn.batches] == [
        (1, 2, True),
        (0, 1, True),
        (0, 1, False),
    ]
    assert drawn.records["origin"][:, 2].tolist() == [-40, -20, -30, -10]


@pytest.mark.gl
def test_what_only_glows_leaves_the_places_of_near_objects_to_glass(planned, monkeypatch: pytest.MonkeyPatch) -> None:  # type: ignore[no-untyped-def]
    monkeypatch.setattr(translucency_planner, "_SORTED_OBJECTS", 1)
    drawn = planned([0, 2, 1, 2, 2], [-20.0, -10.0, -5.0, 0.0, 5.0]).plan(10.0)
    assert [(each.asset, each.count, each.sorted is None) for each in drawn.batches] == [
        (0, 1, True),
        (2, 3, True),
        (1, 1, False),
    ]


@pytest.mark.gl
def test_triangles_of_an_asset_that_was_read_again_are_sorted_again(planned) -> None:  # type: ignore[no-untyped-def]
    """Its file may have become another."""
    planner = planned([0], [0.0])
    assert len(planner.plan(10.0).faces) == 6
    planner.assets.release()
    planner.library._meshes = [panes((0.0, GLASS))]
    assert len(planner.plan(10.0).faces) == 2


@pytest.mark.gl
def test_triangles_are_sorted_again_when_the_viewer_has_moved_noticeably(planned) -> None:  # type: ignore[no-untyped-def]
    planner = planned([0], [0.0])
    planner.plan(10.0)
    (first,) = planner.planner._orders.values()
    planner.plan(9.95)
    assert planner.planner._orders[0] is first
    planner.plan(9.0)
    assert planner.planner._orders[0] is not first


@pytest.mark.gl
def test_what_is_out_of_sight_is_not_drawn(planned) -> None:  # type: ignore[no-untyped-def]
    assert planned([0], [0.0]).plan(-10.0).batches == ()


@pytest.mark.gl
def test_what_is_smaller_than_objects_that_are_drawn_is_not_drawn(planned) -> None:  # type: ignore[no-untyped-def]
    planner = planned([0, 0], [0.0, -1000.0])
    assert [len(planner.plan(10.0, pixels).records) for pixels in (0.0, 0.1, 1.0, 8.0)] == [2, 1, 1, 0]
