"""A planar depth image drawn by the renderer against the paper's own way: Table(depth) and Phong in texture space."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.ndimage import map_coordinates

from depthwalk.bake.planar import bake_planar
from depthwalk.colour import linear_from_srgb, linear_from_srgb8, srgb_from_linear
from depthwalk.ingest.image import PlanarImage
from depthwalk.reference import light
from depthwalk.reference.light import Surfaces
from depthwalk.reference.planar import Placement, phong, view_vectors, warp_samples
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera
from depthwalk.types import Array
from shapes import ShapeLibrary, scene_of
from studio import Studio


def unit(vectors: Array) -> Array:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def random_image(rng: np.random.Generator, count: int = 50) -> tuple[Array, Array]:
    """Samples (u, v, depth) and normals in the image's frame, facing the viewer, in texture space."""
    samples = np.column_stack([rng.uniform(-1, 1, (count, 2)), rng.uniform(0, 0.5, count)])
    normal = unit(rng.normal(size=(count, 3)))
    normal[:, 2] = -np.abs(normal[:, 2])
    return samples, normal


def random_placement(rng: np.random.Generator) -> Placement:
    rotation, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return Placement(rng.normal(size=3) * 5, rotation * np.linalg.det(rotation), rng.uniform(0.1, 7))


@given(st.integers(0, 2**32 - 1))
def test_phong_in_texture_space_is_phong_in_the_world(seed: int) -> None:
    """Rotated, scaled, placed at random: equal within rounding."""
    rng = np.random.default_rng(seed)
    samples, normal = random_image(rng)
    placement = random_placement(rng)
    viewer = np.append(rng.normal(size=2), -rng.uniform(0.1, 4))
    to_sun, albedo = unit(rng.normal(size=3)), rng.uniform(size=(50, 3))
    specular, shininess = rng.uniform(size=50), rng.uniform(1, 200, 50)
    lights = rng.uniform(size=(2, 3))
    sun, up = placement.direction(to_sun), placement.direction(np.array([0.0, 1, 0]))
    surfaces = Surfaces(albedo=albedo, specular=specular, normal=normal, shininess=shininess)
    found = phong(samples, surfaces, viewer, sun, up, *lights)
    turned = replace(surfaces, normal=(normal * [1, 1, -1]) @ placement.rotation.T)
    view = unit(placement.world(samples) - placement.world(viewer))
    expected = light.phong(turned, view, to_sun, *lights)
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-12)


@given(st.integers(0, 2**32 - 1))
def test_texture_space_and_back(seed: int) -> None:
    rng = np.random.default_rng(seed)
    samples, _ = random_image(rng)
    placement = random_placement(rng)
    np.testing.assert_allclose(placement.point(placement.world(samples)), samples, atol=1e-9)
    viewer = np.array([0.3, -0.2, -1.5])
    lengths = np.linalg.norm(placement.world(samples) - placement.world(viewer), axis=1)
    np.testing.assert_allclose(np.linalg.norm(view_vectors(samples, viewer), axis=1) * placement.scale, lengths)


def test_table_moves_a_sample_to_where_the_viewer_sees_it_on_the_plane() -> None:
    viewer = np.array([0.5, -0.25, -2.0])
    samples = np.array([[1.5, 0.75, 0.0], [1.5, 0.75, 2.0], [0.5, -0.25, 7.0]])
    np.testing.assert_allclose(warp_samples(samples, viewer), [[1.5, 0.75], [1.0, 0.25], [0.5, -0.25]])


def relief(size: int = 192) -> PlanarImage:
    """Gentle waves with smooth colours, and their exact normals."""
    cell = 2.0 / size
    x = (np.arange(size) + 0.5) * cell - 1
    depth = (0.1 + 0.05 * (np.sin(4 * x)[None] + np.cos(3 * x)[:, None])).astype(np.float32)
    normal = np.stack(
        [*np.broadcast_arrays(0.2 * np.cos(4 * x)[None], -0.15 * np.sin(3 * x)[:, None]), 0 * depth + 1], -1
    )
    colour = np.stack(np.broadcast_arrays(150 + 60 * x[None], 150 - 60 * x[:, None], 120), -1).astype(np.uint8)
    return PlanarImage(depth=depth, colour=colour, normal=unit(normal).astype(np.float32), size=(2.0, 2.0))


@pytest.mark.parametrize("eye", [(0.5, 1.9, 4.5), (3.0, 3.2, 3.0), (0.3, 0.4, 3.0)], ids=["front", "aside", "close"])
def test_the_renderer_draws_the_papers_picture(studio: Studio, eye: tuple[float, float, float]) -> None:
    """Each texel warped, lit in texture space and carried to the screen by its place on the plane alone, as in the
    paper's second pass: the renderer's picture shows that colour there."""
    image, yaw, scale, position = relief(), 0.35, 1.3, np.array([0.2, 0.1, -0.3])
    scene = scene_of((0, tuple(position), yaw, scale))
    camera = Camera(eye, (0.2, 1.4, -0.3), 0.9)
    size = (200, 150)
    pixels = studio.picture(scene, ShapeLibrary([None], [bake_planar(image, "relief")]), camera, size=size)

    turn = np.array([[np.cos(yaw), 0, np.sin(yaw)], [0, 1, 0], [-np.sin(yaw), 0, np.cos(yaw)]])
    placement = Placement(position + scale * turn @ [0, 1, 0], turn, scale)
    inner = np.s_[8:-8:3, 8:-8:3]  # texels away from the border
    v, u = np.mgrid[0 : len(image.depth), 0 : len(image.depth)][(slice(None), *inner)] * (2.0 / len(image.depth))
    samples = np.stack([u, v, image.depth[inner]], -1).reshape(-1, 3)
    samples[:, :2] += 1 / len(image.depth) - 1
    viewer = placement.point(np.asarray(eye))
    environment = scene.environment
    lit = phong(
        samples,
        Surfaces(
            albedo=linear_from_srgb8(image.colour[inner]).reshape(-1, 3),
            specular=np.full(len(samples), 0.15),
            normal=image.normal[inner].reshape(-1, 3) * [1, 1, -1],
            shininess=np.full(len(samples), 32.0),
        ),
        viewer,
        placement.direction(-unit(np.asarray(environment.sun.direction))),
        placement.direction(np.array([0.0, 1, 0])),
        linear_from_srgb(environment.sun.colour) * environment.sun.intensity,
        linear_from_srgb(environment.ambient.colour) * environment.ambient.intensity,
    )
    on_plane = np.column_stack([warp_samples(samples, viewer), np.zeros(len(samples))])
    view = View(camera, size)
    x, y, ahead = ((placement.world(on_plane) - view.position) @ view.axes.T).T
    tan_x, tan_y = view.half_extent
    column = (x / ahead / tan_x + 1) / 2 * size[0] - 0.5
    row = (1 - y / ahead / tan_y) / 2 * size[1] - 0.5
    shown = (column > 1) & (column < size[0] - 2) & (row > 1) & (row < size[1] - 2) & (ahead > 0)
    assert shown.sum() > 500
    found = np.stack([map_coordinates(pixels[..., k], [row[shown], column[shown]], order=1) for k in range(3)], -1)
    difference = np.abs(found - srgb_from_linear(lit[shown]))
    assert difference.mean() < 0.004 and np.quantile(difference, 0.99) < 0.015
