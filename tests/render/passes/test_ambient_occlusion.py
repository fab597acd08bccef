"""Ambient occlusion: the pass against its twin, and what it may and may not darken."""

from typing import Any

import numpy as np
import pytest

from alone import Alone, MakeAlone
from depthwalk.reference.ambient_occlusion import SeenSurfaces, ambient_visibility, with_reflected
from depthwalk.reference.gbuffer import packed_surfaces, unpacked_surfaces
from depthwalk.reference.light import Surfaces
from depthwalk.render.headless import HeadlessRenderer
from depthwalk.render.passes.ambient_occlusion import AmbientOcclusionPass
from depthwalk.render.view.field_of_view import spread_rays
from depthwalk.render.view.view import View, view_distance
from depthwalk.scene.arrays import Camera, Representation
from depthwalk.scene.effect_settings import AmbientOcclusionParams
from depthwalk.types import Array
from shapes import ShapeLibrary, box, scene_of, sphere

VIEW = View(Camera((0.0, 1.5, 0.0), (0.0, 1.0, -4.0), 0.9), (63, 40), near=0.5, far=20.0)
ON = AmbientOcclusionParams(enabled=True, radius=0.8, directions=2, steps=4)


def put(pass_: Alone, depth: Array, normal: Array) -> SeenSurfaces:
    """Fill depth (H, W) and normals (H, W, 3) of a pass by itself; return what it sees."""
    height, width = depth.shape
    grey = np.full((height * width, 3), 0.25)
    ones = np.ones(height * width)
    words = packed_surfaces(Surfaces(albedo=grey, specular=0 * ones, normal=normal.reshape(-1, 3), shininess=ones))
    pass_.targets.surface.write(words.tobytes())
    pass_.targets.depth.write(depth.astype(np.float32).tobytes())
    view = pass_.view
    rays = spread_rays(view, width, height).reshape(height, width, 3)
    distance = np.minimum(view_distance(depth.astype(np.float32), *view.depth_range), view.depth_range[1])
    right, up = (column / np.linalg.norm(column) for column in view.ray_from_screen.T[:2])
    return SeenSurfaces(
        point=rays * distance[..., None],
        normal=unpacked_surfaces(words).normal.reshape(height, width, 3),
        present=depth < 1,
        right=right,
        up=up,
        reach=view.focal_pixels / distance,
    )


def visibility(pass_: Alone, number: int = 0) -> Array:
    """What the pass has estimated (number 0) or smoothed (1), (⌈H / 2⌉, ⌈W / 2⌉)."""
    texture, _ = pass_.pass_._own[number]  # type: ignore[attr-defined]
    width, height = texture.size
    return np.frombuffer(texture.read(alignment=1), np.float32).reshape(height, width, 2)[..., 0]


def rough(rng: np.random.Generator, size: tuple[int, int]) -> tuple[Array, Array]:
    """Depths of a ground with bumps and a hole to the sky, and normals that face the viewer more or less."""
    width, height = size
    x, y = np.meshgrid(np.linspace(-1, 1, width), np.linspace(-1, 1, height))
    depth = 0.9 + 0.04 * np.sin(9 * x) * np.cos(7 * y) + 0.02 * (x > 0.2)
    depth[-6:, :9] = 1.0
    normal = np.stack([0.4 * np.cos(9 * x), 0.4 * np.sin(7 * y), np.ones_like(x)], -1) + rng.normal(
        size=(height, width, 3), scale=0.1
    )
    return depth, normal / np.linalg.norm(normal, axis=-1, keepdims=True)


def corner() -> tuple[Array, Array]:
    """Depths and normals of a floor 1.5 m below the viewer and a wall 4 m ahead."""
    width, height = VIEW.size
    rays = spread_rays(VIEW, width, height).reshape(height, width, 3)
    floor, wall = -1.5 / np.minimum(rays[..., 1], -1e-6), -4.0 / rays[..., 2]
    distance, near, far = np.minimum(floor, wall), *VIEW.depth_range
    normal = np.where((floor < wall)[..., None], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0])
    return (far - near * far / distance) / (far - near), normal


def test_the_estimate_is_that_of_the_twin(alone: MakeAlone) -> None:
    pass_ = alone(AmbientOcclusionPass(ON), VIEW)
    seen = put(pass_, *rough(np.random.default_rng(0), VIEW.size))
    pass_.draw()
    expected = ambient_visibility(seen, ON.radius, ON.directions, ON.steps)
    off = np.abs(visibility(pass_) - expected)
    assert expected.min() < 0.7 and expected.max() == 1
    assert np.quantile(off, 0.9) < 2e-3  # drivers round some places to another pixel
    assert off.mean() < 5e-3


def test_smoothing_averages_a_surface_and_keeps_its_edges(alone: MakeAlone) -> None:
    """The corner of floor and wall: what differs from texel to texel evens out. And a strip far in front of a wall."""
    pass_ = alone(AmbientOcclusionPass(ON), VIEW)
    put(pass_, *corner())
    pass_.draw()
    raw, smooth = (visibility(pass_, number)[2:-2, 2:-2] for number in (0, 1))
    assert raw.min() < 0.6
    assert np.abs(np.diff(smooth)).mean() < 0.4 * np.abs(np.diff(raw)).mean()
    assert smooth.mean() == pytest.approx(raw.mean(), abs=0.02)
    depth = np.full((40, 63), 0.97)
    depth[:, 20:40] = 0.85
    put(pass_, depth, np.broadcast_to(-VIEW.axes[2], (40, 63, 3)))
    pass_.draw()
    assert visibility(pass_, 1) == pytest.approx(1, abs=0.03)


def test_it_is_dropped_when_it_is_switched_off(alone: MakeAlone) -> None:
    pass_ = alone(AmbientOcclusionPass(ON), VIEW)
    put(pass_, *rough(np.random.default_rng(0), VIEW.size))
    pass_.draw()
    assert pass_.targets.ambient_visibility is not None
    off = AmbientOcclusionParams()
    assert pass_.pass_.enabled(pass_.frame(), off)
    pass_.draw(off)
    assert pass_.targets.ambient_visibility is None
    assert not pass_.pass_.enabled(pass_.frame(), off)


SHAPES = [box(4, 0.2, 4, (0, -0.1, 0)), sphere(0.5, 32, 16)]


def picture(size: tuple[int, int] = (120, 80), kind: Representation = Representation.MESH, **render: Any) -> Array:
    """A ball on a slab; ambient light alone, unless `sun` is given: linear (H, W, 3), the top row first."""
    sun = render.pop("sun", 0.0)
    scene = scene_of((0, (0, 0, 0), 0, 1), (1, (0, 0, 0), 0, 1), representation=kind, sun={"intensity": sun})
    for name, value in render.items():
        setattr(scene.render, name, value)
    with HeadlessRenderer(scene, ShapeLibrary(SHAPES, resolution=64), size) as headless:
        headless.draw(View(Camera((0.0, 1.6, 3.0), (0.0, 0.3, 0.0), 0.8), size), linear=True)
        return headless.linear_image().colour[..., :3].astype(float)


ROOMY = AmbientOcclusionParams(enabled=True, radius=0.6, directions=4, steps=8)


@pytest.mark.gl
@pytest.mark.slow
@pytest.mark.parametrize("kind", [Representation.MESH, Representation.DPCI])
def test_the_ground_below_a_ball_is_dark_and_the_rest_is_not(kind: Representation) -> None:
    plain, darkened = picture(kind=kind), picture(kind=kind, ambient_occlusion=ROOMY)
    share = (darkened / np.maximum(plain, 1e-6)).min(-1)
    assert share.max() == pytest.approx(1, abs=0.01)
    assert share[40:56, 50:70].min() < 0.75  # where ball and slab meet
    assert np.median(share) > 0.97
    assert (share > 0.3).all()


@pytest.mark.gl
@pytest.mark.slow
def test_sunlight_stays() -> None:
    lit = picture(sun=1.0) - picture()
    also = picture(sun=1.0, ambient_occlusion=ROOMY) - picture(ambient_occlusion=ROOMY)
    assert also == pytest.approx(lit, abs=2e-3)


def test_white_surfaces_lose_less() -> None:
    dark, white = with_reflected(np.array([0.4]), np.array([[0.05] * 3, [0.95] * 3]))
    assert white[0] > dark[0] + 0.2
