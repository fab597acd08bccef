"""Objects about other axes than +Y, and models of several, as the renderer draws them."""

from dataclasses import replace
from typing import Literal

import numpy as np
import pytest

from depthwalk.bake.model import BakedModel
from depthwalk.bake.params import ModelParams
from depthwalk.bake.parts import bake_model
from depthwalk.gpu.device import Device
from depthwalk.ingest.mesh import Material, Mesh
from depthwalk.render.renderer import Renderer
from depthwalk.render.up_axis import model_points
from depthwalk.scene.arrays import Camera, Representation
from depthwalk.scene.environment import GroundParams
from shapes import ShapeLibrary, box, joined, panes, scene_of, shared, sphere, two_halves
from studio import Studio


@pytest.fixture(scope="module")
def halves() -> tuple[Mesh, BakedModel, BakedModel]:
    """Two halves of a ball, and the ball."""
    mesh = sphere(0.5, columns=96, rows=48)
    return mesh, shared(bake_model, mesh, ModelParams(resolution=64, layers=1), "whole"), two_halves(mesh)


@pytest.mark.parametrize("axis", ["x", (1.0, 2.0, -0.5)])
def test_a_turned_cylinder_shows_the_same_picture(
    studio: Studio, axis: Literal["x"] | tuple[float, float, float]
) -> None:
    """A bent shape beside its origin, in an object that is itself turned, scaled and moved."""
    mesh = joined(box(1.0, 0.4, 0.4, (0.6, 0.2, 0)), box(0.3, 1.0, 0.3, (1.0, 0.7, 0.2), colour=(60, 90, 200)))
    scene, camera = scene_of((0, (0.5, 0.1, 0), 0.7, 1.5)), Camera((1, 2, 4.5), (1.2, 0.9, -1), 0.6)
    scene.render.lod.error = 0.0  # where triangles are left out differs
    params = ModelParams(resolution=64, layers=2)
    pictures = [
        studio.picture(scene, ShapeLibrary([mesh], [shared(bake_model, mesh, each, "")]), camera, transparent=True)
        for each in (params, replace(params, axis=axis))
    ]
    upright, turned = (picture[..., 3] > 0.5 for picture in pictures)
    assert upright.sum() > 1000 and (upright ^ turned).sum() < 0.01 * upright.sum()
    both = upright & turned
    assert np.abs(pictures[0] - pictures[1])[both].mean() < 0.01


def test_parts_show_the_same_picture(studio: Studio, halves: tuple[Mesh, BakedModel, BakedModel]) -> None:
    mesh, whole, parts = halves
    scene = scene_of((0, (0.2, 0, 0), 0.5, 1.0), (0, (1.5, 0, -1), 2.0, 0.7))
    camera = Camera((0.5, 1, 4), (0.5, 0.4, 0), 0.6)
    one, two = (studio.picture(scene, ShapeLibrary([mesh], [m]), camera, transparent=True) for m in (whole, parts))
    shape, other = one[..., 3] > 0.5, two[..., 3] > 0.5
    assert shape.sum() > 1000 and (shape ^ other).sum() < 0.01 * shape.sum()
    differ = np.abs(one - two).max(-1)[shape & other] > 0.1
    assert differ.mean() < 0.002  # no crack along the cut shows what is behind


def test_every_part_is_an_object_of_the_renderer(
    gl_device: Device, halves: tuple[Mesh, BakedModel, BakedModel]
) -> None:
    mesh, whole, parts = halves
    library = ShapeLibrary([mesh, mesh], [parts, whole])
    scene = scene_of((0, (0, 0, 0), 0.0, 1.0), (1, (3, 0, 0), 0.0, 1.0), (0, (6, 0, 0), 1.0, 2.0))
    renderer = Renderer(gl_device, scene, library)
    try:
        objects, table = renderer.world.objects(), renderer.world.table()
        assert objects.asset.tolist() == [2, 3, 4, 2, 3] and len(table.texel) == 5
        centres = renderer.world.bounds().centre
        assert centres[0, 0] < 0 < centres[1, 0] and (np.abs(centres[[0, 1], 0]) < 0.5).all()
        assert np.linalg.norm(centres[[3, 4]].mean(0) - [6, 1, 0]) < 0.1
        bounds = renderer.world.bounds()
        middle, radius = bounds.sphere()
        away = np.linalg.norm(bounds.centre - middle, axis=1) + bounds.bounding_radius
        assert away.max() == pytest.approx(radius)
        assert renderer.world.ground_height is None
        scene.environment.ground = GroundParams(height=-1.0)
        assert renderer.world.ground_height == -1.0
        of_halves = parts.parts[0].mesh_triangles  # of several parts the first tells of the whole mesh
        assert of_halves is not None and renderer.world.table().full_triangles == 2 * of_halves + len(mesh.faces)
        renderer.world.representation = Representation.MESH
        assert renderer.world.objects().asset.tolist() == [0, 1, 0]
        assert renderer.world.table().full_triangles == 3 * len(mesh.faces)
        assert renderer.world.bounds().centre[0] == pytest.approx([0, 0.5, 0], abs=1e-3)
        renderer.world.representation = Representation.DPCI
        assert renderer.world.objects().asset.tolist() == [2, 3, 4, 2, 3]
    finally:
        renderer.release()


@pytest.mark.parametrize("axis", ["y", "x"])
def test_glass_that_depth_images_do_not_show_counts_for_framing(gl_device: Device, axis: Literal["x", "y"]) -> None:
    """Or a model would be framed, and stand, without it."""
    mesh = panes((0.0, Material()), (3.0, Material(opacity=0.5)))
    model = bake_model(mesh, ModelParams(resolution=32, layers=1, axis=axis), "")
    renderer = Renderer(gl_device, scene_of((0, (0.0, 0.0, 0.0), 0.0, 1.0)), ShapeLibrary([mesh], [model]))
    points = model_points(renderer, 0)
    renderer.release()
    assert points.min(0) == pytest.approx(mesh.positions.min(0), abs=0.1)
    assert points.max(0) == pytest.approx(mesh.positions.max(0), abs=0.1)


def test_points_are_read_once_to_show_all_objects(gl_device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """Again only once something else is drawn."""
    renderer = Renderer(gl_device, scene_of((0, (0, 0, 0), 0.0, 1.0)), ShapeLibrary([box(1, 1, 1)]))
    try:
        world, read = renderer.world, []
        points = world.points
        monkeypatch.setattr(world, "points", lambda number: read.append(number) or points(number))
        first = renderer.frame_all(1.5)
        assert len(read) == 1 and renderer.frame_all(1.5) == first and len(read) == 1
        world.representation = Representation.MESH
        assert renderer.frame_all(1.5) and len(read) == 2
    finally:
        renderer.release()
