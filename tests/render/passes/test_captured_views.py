"""Captured views show the mesh from where they were captured, and nearly so between."""

from functools import cache

import numpy as np
import pytest

from depthwalk.bake.capture import capture_views
from depthwalk.bake.captured_views import CapturedViews, CaptureParams
from depthwalk.geometry.view_directions import azimuth_directions, octahedral_directions
from depthwalk.gpu.device import Device
from depthwalk.ingest.mesh import Mesh
from depthwalk.reference.captured_views import billboard_hits, blended_views, octahedral_hits
from depthwalk.render.object_ids import object_ids
from depthwalk.render.passes import default_passes
from depthwalk.render.passes.object_id import ObjectIdPass
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import CAPTURED, Camera, Representation
from depthwalk.scene.environment import GroundParams
from depthwalk.types import Array
from fields import parts_off, picture_distance
from shapes import ShapeLibrary, box, joined, scene_of, sphere
from stage import SIZE, OnScreen, set_all

OCTAHEDRAL, BILLBOARD = CAPTURED
VIEWS, SIDE = 9, 96
SETTINGS = {"octahedral.views": VIEWS, "octahedral.resolution": SIDE, "billboard.resolution": SIDE}
DEPTH_STEP = 2 * 1.1 / 255  # metres: of the depths in 8 bits


@cache
def library() -> ShapeLibrary:
    """A table with a ball on it, and a ball alone."""
    table = joined(box(1.2, 0.1, 0.8, (0, 0.7, 0)), box(0.1, 0.7, 0.1, (0, 0.35, 0)), _ball())
    return ShapeLibrary([table, _ball()], [None, None])


def _ball() -> Mesh:
    return sphere(0.3, 48, 24)


def view_from(direction: Array, distance: float) -> View:
    """A view of the table from a direction, as large in the picture from any distance."""
    middle = np.array([0, 0.4, 0])
    place = middle + distance * np.asarray(direction)
    fov = float(2 * np.arctan(0.9 / distance))
    return View(Camera(tuple(place.tolist()), tuple(middle.tolist()), fov), SIZE, near=0.1, far=200)


def distance_of(device: Device, kind: Representation, view: View, **settings: object) -> Array:
    scene = scene_of((0, (0, 0, 0), 0.0, 1.0), representation=kind)
    set_all(scene.render, SETTINGS | {name.replace("__", "."): value for name, value in settings.items()})
    with OnScreen(device, scene, library()) as stage:
        return picture_distance(stage, view)


@pytest.mark.parametrize("number", [4 * VIEWS + 4, 3 * VIEWS + 2, 5 * VIEWS + 4, 6 * VIEWS + 7])
def test_octahedral_views_are_the_mesh_from_their_directions(gl_device: Device, number: int) -> None:
    view = view_from(octahedral_directions(VIEWS, False)[number], 60.0)
    found, true = (distance_of(gl_device, kind, view) for kind in (OCTAHEDRAL, Representation.MESH))
    depths, silhouette = parts_off(found, true, 2 * DEPTH_STEP)
    assert silhouette < 0.05 and depths < 0.05  # along edges, half a texel; a texel is two pixels


@pytest.mark.parametrize("number", [0, 3])
def test_billboards_are_the_mesh_from_their_directions(gl_device: Device, number: int) -> None:
    view = view_from(azimuth_directions(8)[number], 60.0)
    found, true = (distance_of(gl_device, kind, view) for kind in (BILLBOARD, Representation.MESH))
    depths, silhouette = parts_off(found, true, 2 * DEPTH_STEP)
    assert silhouette < 0.06 and depths < 0.05


def test_between_the_views_the_picture_is_off(gl_device: Device) -> None:
    """More the farther apart views are; hemispheres have them closer together."""
    view = view_from(np.array([0.45, 0.5, 0.74]), 6.0)
    true = distance_of(gl_device, Representation.MESH, view)
    off = [
        sum(parts_off(distance_of(gl_device, OCTAHEDRAL, view, **settings), true, 0.05))
        for settings in ({"octahedral__views": 4}, {}, {"octahedral__hemisphere": True})
    ]
    assert off[0] > 1.3 * off[1] > 1.3 * off[2] > 0.01


def test_pictures_shifted_by_their_depth_fit_each_other(gl_device: Device) -> None:
    view = view_from(np.array([0.45, 0.5, 0.74]), 6.0)
    true = distance_of(gl_device, Representation.MESH, view)
    off = [
        sum(parts_off(distance_of(gl_device, OCTAHEDRAL, view, **{"octahedral.parallax_steps": steps}), true, 0.05))
        for steps in (0, 1)
    ]
    assert off[0] > 1.5 * off[1]


@pytest.mark.parametrize("representation", CAPTURED)
def test_the_shader_does_what_its_twin_does(gl_device: Device, representation: Representation) -> None:
    view = view_from(np.array([0.45, 0.5, 0.74]), 6.0)
    x, y = ((np.arange(n) + 0.5) / n * 2 - 1 for n in SIZE)
    screen = np.stack(np.broadcast_arrays(x[None], y[:, None], 1.0), -1).reshape(-1, 3)
    viewer, rays = np.asarray(view.position), screen @ view.ray_from_screen.T
    if representation is OCTAHEDRAL:
        params = CaptureParams(directions="sphere", count=VIEWS, resolution=SIDE)
        twin = octahedral_hits(_views(params), params, viewer, rays)
    else:
        params = CaptureParams(directions="azimuths", count=8, resolution=SIDE)
        twin = billboard_hits(_views(params), viewer, rays)
    twin = np.where(np.isnan(twin), np.inf, twin).reshape(SIZE[::-1])
    found = distance_of(gl_device, representation, view)
    assert max(parts_off(found, twin, 1.2 * DEPTH_STEP)) < 0.002


@cache
def _views(params: CaptureParams) -> CapturedViews:
    mesh = library().mesh(0)
    assert mesh is not None
    return capture_views(mesh, params)


def test_weights_are_those_of_the_triangle_around_the_direction() -> None:
    params = CaptureParams(directions="sphere", count=VIEWS, resolution=SIDE)
    numbers, weights = blended_views(np.array([0.3, -0.5, 0.8]), params)
    assert len(set(numbers.tolist())) == 3 and weights.sum() == pytest.approx(1) and (weights >= 0).all()
    vectors = params.unit_vectors()
    assert ((vectors[numbers] @ [0.3, -0.5, 0.8]) / np.sqrt(0.98) > np.cos(np.radians(40))).all()
    for number in 5, 40, 77:  # a view's own direction shows it alone
        numbers, weights = blended_views(vectors[number], params)
        assert np.linalg.norm(weights @ vectors[numbers] - vectors[number]) < 1e-6


@pytest.mark.parametrize("representation", CAPTURED)
def test_meshes_hide_captured_views_and_are_hidden(gl_device: Device, representation: Representation) -> None:
    """The nearer is in front at every pixel; both are counted as what they are."""
    places, view = ((0, (0, 0, 0), 0.3, 1.0), (1, (0.3, 0.5, -0.1), 0.0, 1.0)), view_from(np.array([0.0, 0.2, 0.98]), 6)
    alone = []
    for place, kind in zip(places, (representation, Representation.MESH), strict=True):
        scene = scene_of(place, representation=kind)
        set_all(scene.render, SETTINGS)
        with OnScreen(gl_device, scene, library()) as stage:
            alone.append(picture_distance(stage, view))
    scene = scene_of(*places)
    scene.objects.representation[:] = representation, Representation.MESH
    set_all(scene.render, SETTINGS)
    with OnScreen(gl_device, scene, library()) as stage:
        both = picture_distance(stage, view)
        counts, shares = stage.counts, stage.renderer.sample_shares().count()
    np.testing.assert_allclose(both, np.minimum(*alone), rtol=1e-4)
    assert ((alone[0] < alone[1]) & np.isfinite(alone[1])).any()
    assert (counts["captured"], counts["mesh"]) == (1, 1)
    assert shares[2] > 0 and shares[4] > 0 and shares[[0, 1, 3]].sum() == 0


@pytest.mark.parametrize("representation", CAPTURED)
def test_from_within_the_box_the_mesh_is_drawn(gl_device: Device, representation: Representation) -> None:
    scene = scene_of((0, (0, 0, 0), 0.0, 1.0), representation=representation)
    set_all(scene.render, SETTINGS)
    with OnScreen(gl_device, scene, library()) as stage:
        stage.draw(view_from(np.array([0.0, 0.0, 1.0]), 0.5))
        assert (stage.counts["captured"], stage.counts["mesh"]) == (0, 1)
        stage.draw(view_from(np.array([0.0, 0.0, 1.0]), 3.0))
        assert (stage.counts["captured"], stage.counts["mesh"]) == (1, 0)


def test_pixels_that_are_drawn_flat_are_those_of_the_object(gl_device: Device) -> None:
    """Straight above, no upright billboard is seen; the octahedral impostor is."""
    view = view_from(np.array([0.0, 1.0, 0.001]), 6.0)
    assert np.isinf(distance_of(gl_device, BILLBOARD, view)).mean() > 0.99
    assert np.isfinite(distance_of(gl_device, OCTAHEDRAL, view)).mean() > 0.05


@pytest.mark.parametrize("representation", CAPTURED)
def test_their_pixels_tell_which_object_they_show(gl_device: Device, representation: Representation) -> None:
    """Two of them and a mesh, each to the left of the next."""
    scene = scene_of((1, (-1, 0, 0), 0.0, 1.0), (1, (0, 0, 0), 0.0, 1.0), (1, (1, 0, 0), 0.0, 1.0))
    scene.objects.representation[:] = representation, representation, Representation.MESH
    set_all(scene.render, SETTINGS)
    ids = ObjectIdPass()
    with OnScreen(gl_device, scene, library(), passes=[*default_passes(), ids]) as stage:
        ids.requested = True
        stage.draw(view_from(np.array([0.0, 0.0, 1.0]), 6.0))
        found = object_ids(stage.renderer, ids, scene.objects)
    middles = [np.nonzero(found == number)[1].mean() for number in range(3)]
    assert middles[0] < middles[1] - 40 < middles[2] - 80
    assert min((found == number).sum() for number in range(3)) > 500


@pytest.mark.parametrize("representation", CAPTURED)
def test_their_shadow_is_the_mesh_s(gl_device: Device, representation: Representation) -> None:
    lit = []
    for kind in (representation, Representation.MESH_LOD):
        scene = scene_of((1, (0, 1, 0), 0.0, 1.0), representation=kind, ground=GroundParams())
        set_all(scene.render, SETTINGS | {"shadows.enabled": True})
        with OnScreen(gl_device, scene, library()) as stage:
            stage.renderer.keeps = frozenset({"shadow"})
            stage.draw(view_from(np.array([0.0, 0.6, 0.8]), 8.0))
            assert stage.renderer.targets is not None
            lit.append(np.frombuffer(stage.renderer.targets.shadow_texture.read(alignment=1), np.uint8))
            depth = np.frombuffer(stage.renderer.targets.depth.read(alignment=1), np.float32)
        lit[-1] = np.where(depth < 1, lit[-1], 255)
    dark = [picture < 128 for picture in lit]
    assert dark[1].sum() > 200 and (dark[0] != dark[1]).sum() < 0.3 * dark[1].sum()
