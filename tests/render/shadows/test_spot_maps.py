"""Shadow maps of spot lights: which lamps have one, what is drawn into it and when, and the shadows that it gives."""

import logging
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from depthwalk.reference.shadows import lifted, light_share
from depthwalk.render.lighting.light_clusters import lamp_table, visible_lamps
from depthwalk.render.shadows.casters import find_casters
from depthwalk.render.shadows.spot_maps import NEAR, assign_tiles, choose_shadow_lamps, lamp_spot, shadow_lamps
from depthwalk.render.view.bounds import Bounds
from depthwalk.render.view.view import View, matrix_array
from depthwalk.scene.arrays import Representation
from depthwalk.scene.environment import LampParams
from depthwalk.scene.scene import Scene
from depthwalk.types import Array, Mask
from shapes import ShapeLibrary, box, joined, scene_of, sphere
from stage import Stage, view_of
from studio import Studio

LAMP: dict[str, Any] = {
    "position": (1.5, 4.0, 1.0),
    "direction": (-0.35, -1.0, -0.2),
    "angle": 70.0,
    "range": 12.0,
    "intensity": 8.0,
}
DARK = {"sun": {"intensity": 0.0}, "ambient": {"intensity": 0.0}, "ground": {"colour": (1.0, 1.0, 1.0)}}
BALL, BOX = 0, 1


@pytest.fixture(scope="module")
def library() -> ShapeLibrary:
    return ShapeLibrary([sphere(0.7, 128, 64), box(1, 1.6, 0.6, (0, 0.8, 0))], resolution=64)


def spot_scene(
    *placed: tuple[int, tuple[float, float, float], float, float],
    representation: Representation = Representation.DPCI,
    lamps: Sequence[dict[str, Any]] = (LAMP,),
    resolution: int = 1024,
) -> Scene:
    lights = [{"shadow": True} | lamp for lamp in lamps]
    scene = scene_of(*placed, representation=representation, lights=lights, **DARK)
    scene.render.shadows.lamp_resolution = resolution
    return scene


def shares(stage: Stage, scene: Scene, view: View) -> tuple[Array, dict[str, float]]:
    """What part of the light of lamps is left by shadows (H, W); NaN where they hardly shine."""
    scene.render.shadows.lamps = 0
    stage.draw(view)
    whole = stage.lit().sum(-1)
    scene.render.shadows.lamps = 8
    counts = stage.draw(view)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(whole > 0.02, stage.lit().sum(-1) / whole, np.nan), counts


def overlap(one: Mask, other: Mask) -> float:
    return (one & other).sum() / (one | other).sum()


FROM_ABOVE = view_of((0.3, 4.5, 3.5), (-0.2, 0, -0.2))


@pytest.mark.parametrize("filter_width", [2, 3, 6])
def test_shares_match_their_twin(studio: Studio, library: ShapeLibrary, filter_width: int) -> None:
    scene = spot_scene((BALL, (-0.8, 0, 0), 0.3, 1.0), (BOX, (0.8, 0, -0.6), 0.4, 1.0), resolution=256)
    scene.render.shadows.filter_width = filter_width
    with Stage(studio, scene, library, sun=False) as stage:
        found, _ = shares(stage, scene, FROM_ABOVE)
        point, normal = stage.raised(), stage.normals()
        ((spot, depth),) = stage.maps(lamps=True).values()
    to_lamp = np.array(spot.centre) - point
    told = np.isfinite(found) & ((normal * to_lamp).sum(-1) > 0.01 * np.linalg.norm(to_lamp, axis=-1))
    point, normal, found = point[told], normal[told], found[told]
    texel = spot.texel * -((point - np.array(spot.centre)) @ spot.axes[2])
    moved = lifted(point, normal, spot.axes[2], texel, filter_width, scene.render.shadows.worst_error)
    expected = light_share(depth, spot, moved, filter_width)
    inside = np.isfinite(expected)
    assert inside.mean() > 0.95
    expected, off = expected[inside], np.abs(found - expected)[inside]
    assert ((expected > 0.05) & (expected < 0.95)).sum() > 100  # edges are there to be compared
    assert np.median(off) < 4e-3 and np.quantile(off, 0.98) < 0.1 and off.mean() < 5e-3


def test_a_box_shadows_the_ground_where_rays_to_the_lamp_meet_it(studio: Studio, library: ShapeLibrary) -> None:
    scene = spot_scene((BOX, (0, 0, 0), 0.0, 1.0), representation=Representation.MESH, resolution=2048)
    scene.render.lod.error = 0.0  # polygons are where they are
    with Stage(studio, scene, library, sun=False) as stage:
        share, _ = shares(stage, scene, view_of((-2.0, 3.5, -2.0), (-0.5, 0, -0.4)))
        point = stage.points()
    ground = (np.abs(point[..., 1]) < 1e-3) & np.isfinite(share)
    low, high = np.array([-0.5, 0, -0.3]), np.array([0.5, 1.6, 0.3])
    with np.errstate(divide="ignore", invalid="ignore"):
        ends = np.stack([low - point, high - point]) / (np.array(LAMP["position"]) - point)
    met = ends.min(0).max(-1) < ends.max(0).min(-1)
    assert (met & ground).sum() > 1500
    assert overlap((share < 0.5) & ground, met & ground) > 0.99


def test_shadows_of_depth_images_are_those_of_the_mesh(studio: Studio) -> None:
    """On the ground, several lamps: intersection over union."""
    steps = joined(*[box(1.2 - 0.3 * k, 0.3, 1.2 - 0.3 * k, (0.1 * k, 0.15 + 0.4 * k, 0)) for k in range(3)])
    library = ShapeLibrary([steps], resolution=160)
    for position in ((1.5, 4.0, 1.0), (-3.0, 2.5, 0.5), (0.2, 2.2, -2.5)):
        aim = tuple(-np.array(position) + [0, 0.5, 0])
        lamp = LAMP | {"position": position, "direction": aim}
        found = []
        for representation in (Representation.DPCI, Representation.MESH):
            scene = spot_scene((0, (0, 0.6, 0), 0.3, 1.0), representation=representation, lamps=[lamp])
            with Stage(studio, scene, library, sun=False) as stage:
                share, _ = shares(stage, scene, view_of((0.3, 5.0, 4.0), (-position[0] / 4, 0, -position[2] / 4)))
                found.append((share < 0.5, (np.abs(stage.points()[..., 1]) < 1e-3) & np.isfinite(share)))
        (one, ground), (other, ground_too) = found
        both = ground & ground_too
        assert (other & both).sum() > 500
        assert overlap(one & both, other & both) > 0.99


@pytest.mark.parametrize("representation", [Representation.MESH, Representation.DPCI, Representation.DMESH])
def test_a_ball_never_shadows_itself_where_it_is_lit(
    studio: Studio, library: ShapeLibrary, representation: Representation
) -> None:
    scene = spot_scene((BALL, (0, 0, 0), 0.3, 1.0), representation=representation, resolution=512)
    with Stage(studio, scene, library, sun=False) as stage:
        share, _ = shares(stage, scene, view_of((1.0, 3.0, 3.0), (0, 0.5, 0)))
        point, normal = stage.points(), stage.normals()
    to_lamp = np.array(LAMP["position"]) - point
    ball = np.abs(np.linalg.norm(point - [0, 0.7, 0], axis=-1) - 0.7) < 0.03
    lit = ball & (point[..., 1] > 0.05) & ((normal * to_lamp).sum(-1) > 0.25 * np.linalg.norm(to_lamp, axis=-1))
    assert lit.sum() > 1500 and (share[lit] > 0.97).mean() > 0.999


def test_maps_are_redrawn_only_when_something_in_their_cone_moves(studio: Studio, library: ShapeLibrary) -> None:
    places = (BALL, (0, 0, 0), 0.3, 1.0), (BOX, (8.0, 0, 0), 0.0, 1.0)
    scene = spot_scene(*places, lamps=[LAMP, LAMP | {"position": (8.0, 4.0, 0)}])
    with Stage(studio, scene, library, sun=False) as stage:
        assert stage.draw(FROM_ABOVE)["shadow_maps"] == 2
        before = stage.lit()
        assert stage.draw(view_of((4.0, 8.0, 9.0), (4, 0, 0)))["shadow_maps"] == 0
        assert stage.draw(view_of((0, 1.6, 30.0), (0, 1.6, 60)))["shadow_maps"] == 0  # none in sight
        assert stage.draw(FROM_ABOVE)["shadow_maps"] == 0
        assert (stage.lit() == before).all()
        scene.objects.position[BALL, 0] += 0.2
        stage.renderer.world.moved(slice(0, 1))
        assert stage.draw(FROM_ABOVE)["shadow_maps"] == 1
        assert (stage.lit() != before).any()
        scene.environment.lights[1].position = (8.0, 4.0, 0.1)
        assert stage.draw(FROM_ABOVE)["shadow_maps"] == 1


def test_what_a_stage_of_shadows_made_is_freed(studio: Studio, library: ShapeLibrary) -> None:
    before = +studio.device.live
    with Stage(studio, spot_scene((BALL, (0, 0, 0), 0.3, 1.0)), library, sun=False) as stage:
        stage.draw(FROM_ABOVE)
        held = studio.device.live["texture"]
        stage.renderer.settings.shadows.lamp_resolution = 256
        stage.draw(FROM_ABOVE)
        assert studio.device.live["texture"] == held
    assert +studio.device.live == before


def test_casters_are_all_that_reach_into_the_pyramid() -> None:
    """Against points of random spheres; what is under a texel is left out."""
    rng = np.random.default_rng(4)
    spot = lamp_spot(LampParams.model_validate({**LAMP, "shadow": True}), 512)
    bounds = Bounds(np.array(spot.centre) + rng.uniform(-20, 20, (4000, 3)), rng.choice([0.002, 0.5, 3.0], 4000))
    found = np.isin(np.arange(4000), find_casters(spot, bounds))
    direction = rng.normal(size=(4000, 200, 3))
    direction *= np.cbrt(rng.uniform(0, 1, (4000, 200, 1))) / np.linalg.norm(direction, axis=-1, keepdims=True)
    point = bounds.centre[:, None] + bounds.bounding_radius[:, None, None] * direction - np.array(spot.centre)
    clip_from_centre = matrix_array(spot.clip_from_centre)
    clip = point @ clip_from_centre[:, :3].T + clip_from_centre[:, 3]
    within = (np.abs(clip[..., :3]) < clip[..., 3:]).all(-1).any(1)
    large = bounds.bounding_radius > 0.1
    assert found[within & large].all() and within.sum() > 100
    assert not found[~large & (np.linalg.norm(bounds.centre - spot.centre, axis=1) > 3)].any()
    assert (found & ~within).sum() < 0.5 * found.sum()


def lamps_at(*places: tuple[int, int, int]) -> list[LampParams]:
    return [
        LampParams.model_validate({**LAMP | {"position": place, "intensity": 1.0}, "shadow": True}) for place in places
    ]


def test_those_with_maps_come_first_in_every_cell() -> None:
    lights = [each.model_copy(update={"range": 2.0}) for each in lamps_at(*[(x, 1, -4 - x) for x in range(6)])]
    found = visible_lamps(view_of(), lamp_table(lights), {4: 1, 1: 0})
    tile = found.records["shadow"][:, 3]
    assert tile[tile >= 0].tolist() == [0, 1]  # of lights 1 and 4
    lists = found.lists["numbers"].ravel().astype(int)
    begin, count, mapped = found.cells["numbers"][:, :3].astype(int).T
    assert {0, 1, 2} <= set(mapped.tolist()) and (count > mapped).any()
    for first, all_of_them, some in zip(begin, count, mapped, strict=True):
        assert ((tile[lists[first : first + all_of_them]] >= 0) == (np.arange(all_of_them) < some)).all()


def test_the_brightest_in_sight_come_first_and_keep_their_tiles() -> None:
    lamps = lamps_at((0, 3, 0), (0, 3, -8), (0, 3, 90), (2, 3, 2))
    lamps[1].intensity = 20.0
    lamps[3].shadow = False
    assert choose_shadow_lamps(view_of(), shadow_lamps(lamps)) == [1, 0]  # the third is behind the viewer
    assert assign_tiles([1, 0], lamps, 3) == {0: 0, 1: 1}
    assert assign_tiles([1], lamps, 3) == {1: 1}
    assert sorted(assign_tiles([0, 1, 2], lamps, 3).values()) == [0, 1, 2]
    assert assign_tiles([0, 2], lamps, 2) == {0: 0, 2: 1}  # the third would like the first one's


def test_more_lamps_than_maps_are_told_of_once(
    studio: Studio, library: ShapeLibrary, caplog: pytest.LogCaptureFixture
) -> None:
    scene = spot_scene((BALL, (0, 0, 0), 0.3, 1.0), lamps=[LAMP] * 3)
    scene.render.shadows.lamps = 2
    with caplog.at_level(logging.WARNING), Stage(studio, scene, library, sun=False) as stage:
        assert stage.draw(FROM_ABOVE)["shadow_maps"] == 2
        assert stage.draw(FROM_ABOVE)["shadow_maps"] == 0
    assert caplog.messages == ["3 visible lamps should cast shadows, but render.shadows.lamps allows only 2"]


def test_what_is_at_the_lamp_casts_no_shadow(studio: Studio, library: ShapeLibrary) -> None:
    """A ball about it, smaller than the distance at which its map begins."""
    bulb = NEAR * LAMP["range"] / 2
    place = np.array(LAMP["position"]) - [0, 0.7 * bulb, 0]
    scene = spot_scene((BALL, tuple(place), 0.0, bulb))
    with Stage(studio, scene, library, sun=False) as stage:
        share, counts = shares(stage, scene, FROM_ABOVE)
        ground = (np.abs(stage.points()[..., 1]) < 1e-3) & np.isfinite(share)
    assert counts["shadow_maps"] == 1
    assert ground.sum() > 10_000 and (share[ground] > 0.99).all()


@pytest.mark.parametrize("wrong", [{"direction": None}, {"angle": 160.0}])
def test_a_lamp_without_a_cone_to_look_into_is_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(ValidationError, match="'shadow' needs a cone"):
        LampParams.model_validate({**LAMP | {"shadow": True} | wrong})
