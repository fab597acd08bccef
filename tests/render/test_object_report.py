"""What a frame says about an object, and about the object that a point belongs to."""

from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from pyglm import glm

from depthwalk.cook.cases import Case
from depthwalk.gpu.device import Device
from depthwalk.render.object_ids import object_at
from depthwalk.render.object_report import ObjectReport, report_object
from depthwalk.render.passes import default_passes
from depthwalk.render.passes.object_id import ObjectIdPass
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera, Representation
from depthwalk.scene.environment import GroundParams
from shapes import ShapeLibrary, box, scene_of, sphere, two_halves
from stage import SIZE, OnScreen, set_all, view_of

CRATE, BALL = 0, 1
AHEAD = (0.0, 0.0, 0.0)


@pytest.fixture(scope="module")
def library() -> ShapeLibrary:
    return ShapeLibrary([box(1.0, 2.0, 1.0, (0, 1, 0)), sphere(0.5, 48, 24)], resolution=64, layers=1)


class Stage(OnScreen):
    """A scene of objects in one unnamed node of a named group, whose renderer can tell which object a point shows."""

    def __init__(self, device: Device, library: ShapeLibrary, *placed: Any, **environment: Any) -> None:
        scene: Any = scene_of(*placed, **environment)
        scene.nodes = SimpleNamespace(name=("yard", ""), parent=np.array([-1, 0]))
        scene.owner = np.ones(len(placed), np.int32)
        self.scene, self.ids = scene, ObjectIdPass()
        super().__init__(device, self.scene, library, passes=[*default_passes(), self.ids])

    def report(self, number: int) -> ObjectReport:
        report = report_object(self.renderer, number)
        assert report is not None
        return report

    def at(self, across: float, down: float) -> int | None:
        point = self.renderer.point_at(across, down)
        assert point is not None
        return object_at(self.renderer, self.ids, point)


@pytest.fixture
def stage(gl_device: Device, library: ShapeLibrary) -> Iterator[Stage]:
    """A crate ahead, a ball far behind it, and one to the right that is a mesh."""
    placed = (CRATE, AHEAD, 0.0, 1.0), (BALL, (0, 0, -30), 0.0, 1.0), (BALL, (2, 0.5, 0), 0.0, 1.0)
    with Stage(gl_device, library, *placed, ground=GroundParams()) as stage:
        stage.scene.objects.representation[2] = Representation.MESH
        yield stage


def test_an_impostor_is_described(stage: Stage) -> None:
    stage.draw(view_of((0.0, 3.0, 5.0)))
    report = stage.report(0)
    assert (report.number, report.asset, report.node) == (0, "asset 0", "yard")
    assert report.images is not None and report.images[1:] == (64, 64) and report.images[0] >= 3
    (impostor,) = report.impostors
    assert report.parts == 1 and report.mesh is None and report.other is None and not report.clustered
    assert report.distance == pytest.approx(np.hypot(5 - np.hypot(0.5, 0.5), 1), abs=0.05)  # of the cylinder's rim
    assert impostor.case == Case.SIDE_AND_TOP and impostor.step >= 1
    table, plan = stage.renderer.world.table(), stage.renderer.plan
    assert plan is not None and impostor.triangles == table.triangles[len(stage.scene.assets), impostor.level]
    assert impostor.resolution == 1 and impostor.error == 0
    assert impostor.tile in [tuple(tile) for tile in plan.composite.records["tile"].astype(int).tolist()]


def test_the_rectangle_touches_the_cylinder_and_surrounds_the_object_in_the_picture(stage: Stage) -> None:
    view = view_of((0.0, 1.0, 5.0))
    stage.draw(view)
    report = stage.report(0)
    corners = report.impostors[0].rectangle
    radius = float(report.cylinders.radius[0])
    assert corners[:, 2] == pytest.approx(radius, abs=0.03)  # the plane between viewer and object that touches it
    assert np.ptp(corners[:, 0]) == pytest.approx(2 * 0.5, rel=0.35) and np.ptp(corners[:, 1]) == pytest.approx(
        2, rel=0.3
    )
    right, up, ahead = view.axes @ (corners - view.position).T
    width, height = SIZE
    columns = (1 + right / ahead / view.half_extent[0]) / 2 * width
    rows = (1 + up / ahead / view.half_extent[1]) / 2 * height
    stage.ids.requested = True
    stage.draw(view)
    found = [(column, row) for column in range(0, width, 6) for row in range(0, height, 6)
             if np.isfinite(stage.renderer.distance_at((column + 0.5) / width, 1 - (row + 0.5) / height))
             and stage.at((column + 0.5) / width, 1 - (row + 0.5) / height) == 0]  # fmt: skip
    assert len(found) > 30
    x, y = np.array(found).T + 0.5
    assert columns.min() - 2 < x.min() < columns.min() + 12 and columns.max() - 12 < x.max() < columns.max() + 2
    assert rows.min() - 2 < y.min() < rows.min() + 12 and rows.max() - 12 < y.max() < rows.max() + 2


def test_a_turned_and_scaled_object_has_its_rectangle_where_it_stands(gl_device: Device, library: ShapeLibrary) -> None:
    with Stage(gl_device, library, (CRATE, (1, 0.5, -2), 0.7, 2.0)) as stage:
        stage.draw(view_of((1.0, 2.5, 8.0), (1, 2.5, -2)))
        report = stage.report(0)
        middle = report.impostors[0].rectangle.mean(0)
        assert middle == pytest.approx([1, 2.5, -2 + float(report.cylinders.radius[0])], abs=0.2)
        assert report.cylinders.half_height[0] == pytest.approx(2.0, rel=0.1)


def test_a_mesh_is_described(stage: Stage) -> None:
    stage.draw(view_of((0.0, 1.0, 5.0)))
    mesh = stage.report(2)
    assert mesh.mesh is not None and (mesh.mesh.level, mesh.mesh.triangles) == (0, mesh.mesh_triangles)
    assert mesh.mesh_triangles > 1000 and mesh.images is None and not mesh.impostors


def test_each_of_two_meshes_is_told_apart(gl_device: Device, library: ShapeLibrary) -> None:
    """One that stands in another's place, as an urn on its pedestal, and one of the same asset farther away."""
    placed = (CRATE, AHEAD, 0.0, 1.0), (BALL, AHEAD, 0.0, 1.6), (BALL, (3, 0, -25), 0.0, 1.6)
    with Stage(gl_device, library, *placed, representation=Representation.MESH_LOD) as stage:
        stage.draw(view_of((0.0, 1.0, 5.0)))
        meshes = [stage.report(number).mesh for number in range(3)]
        triangles = stage.renderer.world.table().meshes.triangles
        assert all(
            mesh and mesh.triangles == triangles[asset, mesh.level]
            for mesh, asset in zip(meshes, (0, 1, 1), strict=True)
        )
        assert meshes[0] and meshes[1] and meshes[2] and meshes[0].triangles == 12 and meshes[1].level < meshes[2].level


def test_what_is_hidden_is_not_drawn_nor_what_is_out_of_sight(gl_device: Device, library: ShapeLibrary) -> None:
    crowd = [(BALL, (x, 0, -12 - z), 0.0, 1.0) for x in range(-5, 6) for z in range(20)]
    with Stage(gl_device, library, (CRATE, AHEAD, 0.0, 9.0), *crowd) as stage:
        stage.draw(view_of((0.0, 1.0, 15.0)))
        reports = [stage.report(number) for number in range(1, len(crowd) + 1)]
        hidden = [report for report in reports if not report.impostors]
        assert len(hidden) > 50 and all(report.in_view for report in hidden)
        assert not any(report.mesh or report.other or report.clustered for report in hidden)
        stage.draw(view_of((0.0, 1.0, 15.0), (0.0, 1.0, 20.0)))
        assert not stage.report(0).in_view and not stage.report(0).impostors


@pytest.mark.parametrize("kind", [Representation.DMESH, Representation.OCTAHEDRAL, Representation.BILLBOARD])
def test_other_representations_are_told(gl_device: Device, library: ShapeLibrary, kind: Representation) -> None:
    with Stage(gl_device, library, (CRATE, AHEAD, 0.0, 1.0), representation=kind) as stage:
        set_all(stage.scene.render, {"octahedral.views": 4, "octahedral.resolution": 32, "billboard.resolution": 32})
        stage.draw(view_of((0.0, 1.0, 9.0)))
        report = stage.report(0)
        assert report.other is kind and not report.impostors and report.mesh is None and not report.clustered


def test_each_part_has_an_impostor(gl_device: Device) -> None:
    halves = ShapeLibrary([None], [two_halves(sphere(1.0, 48, 24))])
    with Stage(gl_device, halves, (0, (-1.5, 0, 0), 0.0, 1.0), (0, (1.5, 0, 0), 0.0, 1.0)) as stage:
        stage.ids.requested = True
        stage.draw(view_of((0.0, 1.0, 6.0)))
        report = stage.report(1)
        assert report.parts == 2 and len(report.impostors) == 2
        left, right = sorted(impostor.rectangle[:, 0].mean() for impostor in report.impostors)
        assert 0.3 < left < right - 0.5 < 2.2
        assert (stage.at(0.25, 0.6), stage.at(0.75, 0.6)) == (0, 1)


def test_members_of_far_clusters_say_so_and_others_do_not(gl_device: Device, library: ShapeLibrary) -> None:
    far = [(BALL, (x, 0, z), 0.0, 1.0) for x in range(-8, 8) for z in range(-120, -104)]
    near = [(BALL, (x, 25, z), 0.0, 1.0) for x in range(-8, 8) for z in range(-30, -14)]
    with Stage(gl_device, library, *far, *near) as stage:
        stage.scene.render.warp.cluster_pixels = 64
        stage.draw(View(Camera((0.0, 40.0, 0.0), (0.0, 0.0, -60.0), 1.6), SIZE))
        assert stage.counts["clusters"] > 0
        reports = [stage.report(number) for number in range(len(far) + len(near))]
        assert sum(report.clustered for report in reports[: len(far)]) > 100
        singles = [report for report in reports[len(far) :] if report.in_view]
        assert len(singles) > 100 and not any(report.clustered for report in singles)
        assert sum(len(report.impostors) == 1 for report in singles) > 100
        assert all(not (report.clustered and report.impostors) for report in reports)


def test_a_point_tells_its_object_in_a_picture_from_elsewhere(stage: Stage) -> None:
    stage.draw(view_of((0.0, 1.2, 5.0)))
    crate, ball, ground = (stage.renderer.point_at(*place) for place in ((0.5, 0.5), (0.81, 0.52), (0.1, 0.9)))
    stage.ids.requested = True
    stage.draw(view_of((0.6, 1.4, 4.5)))
    assert crate is not None and ball is not None and ground is not None
    assert [object_at(stage.renderer, stage.ids, point) for point in (crate, ball, ground)] == [0, 2, None]
    behind, aside, in_air = glm.dvec3(0, 1, 9), glm.dvec3(40, 1, 0), glm.dvec3(0.6, 1.4, 3)
    assert [object_at(stage.renderer, stage.ids, point) for point in (behind, aside, in_air)] == [None] * 3


def test_meshes_are_told_only_by_frames_that_were_asked_to(stage: Stage) -> None:
    stage.ids.requested = True
    stage.draw(view_of())
    assert stage.ids.has_drawn and stage.ids.read() is not None
    stage.ids.requested = True  # again: the frame drawn last does not count any more
    assert not stage.ids.has_drawn and stage.ids.read() is None


def test_before_the_first_frame_there_is_no_report(stage: Stage) -> None:
    assert report_object(stage.renderer, 0) is None
