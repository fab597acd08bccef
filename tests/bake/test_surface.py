"""What a ray sees where it hits."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from depthwalk.bake.raycast import RayCaster
from depthwalk.bake.reflection_code import reflections_of_codes
from depthwalk.bake.samples import face_samples
from depthwalk.bake.surface import mean_reflection, mean_shininess, surface_at
from depthwalk.ingest.mesh import MATT, Material, Mesh, Part, Reflection
from depthwalk.types import Array
from shapes import mesh_of

DOWN = np.array([[0, -1.0, 0]], np.float32)


def card(**changes: Any) -> Mesh:
    """A unit square on y = 0, its texture upright seen from above."""
    positions = [(0, 0, 0), (1, 0, 0), (1, 0, -1), (0, 0, -1)]
    mesh = mesh_of(positions, [(0, 1, 2), (0, 2, 3)], [(0, 1.0, 0)] * 4, colour=(255, 255, 255))
    uv = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], np.float32)
    return replace(mesh, uv=uv, **changes)


def seen(mesh: Mesh, x: float, z: float, down: Array = DOWN) -> tuple[Array, Array]:
    origin = np.array([[x, -5 * down[0, 1], z]], np.float32)
    hits = RayCaster(mesh).peel(origin, down, 1, 10.0)
    normal, albedo = surface_at(mesh, hits)
    return normal[0, 0], albedo[0, 0]


def test_normals_are_interpolated_and_turned_to_the_viewer() -> None:
    mesh = card()
    mesh.normals[[1, 2]] = (0.6, 0.8, 0)
    normal, _ = seen(mesh, 0.5, -0.25)
    expected = np.array([0.3, 0.9, 0]) / np.linalg.norm([0.3, 0.9, 0])
    np.testing.assert_allclose(normal, expected, atol=1e-5)
    np.testing.assert_allclose(seen(mesh, 0.5, -0.25, -DOWN)[0], -expected, atol=1e-5)


def test_texture_material_and_colour_are_multiplied() -> None:
    texture = np.full((4, 4, 4), 255, np.uint8)
    texture[:2] = (0, 0, 0, 255)  # the upper half is black
    mesh = card(materials=(Material((0.5, 1.0, 1.0), texture=texture, specular=0.4),))
    mesh.colours[:] = (255, 0, 255)
    np.testing.assert_allclose(seen(mesh, 0.5, -0.25)[1], [0.5, 0, 1, 0.4], atol=1e-6)
    np.testing.assert_allclose(seen(mesh, 0.5, -0.75)[1], [0, 0, 0, 0.4], atol=1e-6)


def test_maps_tell_roughness_and_metalness_of_what_is_seen() -> None:
    """Beside faces whose material has no map: as glossy as it is, or as dull as its highlight is wide."""
    told = np.zeros((4, 4, 2), np.uint8)
    told[:2], told[2:] = (51, 255), (204, 0)
    parts = Part(0, 1, 0), Part(1, 1, 1)
    materials = [Material(reflection=Reflection(0.5, 0.5), reflection_map=told)]
    for other, expected in (
        (Material(reflection=Reflection(0.25, 1.0)), (0.25, 1)),
        (Material(shininess=2 / 0.9**4 - 2), (0.9, 0)),
        (Material(shininess=1024), (MATT, 0)),
    ):
        mesh = card(parts=parts, materials=(*materials, other))
        assert mesh.has_reflection_maps and mesh.nbytes - replace(mesh, materials=()).nbytes == told.nbytes
        below, above = (seen(mesh, 0.9, z)[1][3:] for z in (-0.25, -0.75))
        assert np.stack(reflections_of_codes(below)).ravel() == pytest.approx((0.8, 0), abs=1e-6)
        assert np.stack(reflections_of_codes(above)).ravel() == pytest.approx((0.2, 1), abs=1e-6)
        assert np.stack(reflections_of_codes(seen(mesh, 0.1, -0.5)[1][3:])).ravel() == pytest.approx(expected, abs=1e-6)


def test_nothing_is_seen_beside_the_mesh() -> None:
    normal, albedo = seen(card(), 3.0, 3.0)
    assert not normal.any() and not albedo.any()


def test_shininess_is_the_mean_over_the_faces() -> None:
    parts = Part(0, 1, 0), Part(1, 1, 1)
    assert mean_shininess(card(parts=parts, materials=(Material(shininess=10), Material(shininess=30)))) == 20


def test_reflection_is_that_of_the_parts_that_shine() -> None:
    """Of two equal faces: roughness by the strength of their highlights, metalness by their areas."""
    parts = Part(0, 1, 0), Part(1, 1, 1)

    def mean(*found: Reflection | None, strength: tuple[float, float] = (0.999, 0.199)) -> Reflection | None:
        pairs = zip(found, strength, strict=True)
        return mean_reflection(card(parts=parts, materials=tuple(Material(specular=s, reflection=r) for r, s in pairs)))

    metal, glaze = Reflection(0.2, 1.0), Reflection(0.8, 0.0)
    assert mean(metal, glaze) == pytest.approx((0.3, 0.5)) and mean(metal, None) == pytest.approx((0.2, 0.5))
    assert mean(metal, metal, strength=(0.0, 0.0)) == pytest.approx(metal) and mean(None, None) is None


@pytest.mark.parametrize("shape", [(2, 3), (3, 2)])
def test_samples_have_the_images_shape(shape: tuple[int, int]) -> None:
    origin = np.array([[x, 5.0, -0.5] for x in np.linspace(0.1, 1.6, 6)], np.float32)
    hits = RayCaster(card()).peel(origin, np.repeat(DOWN, 6, axis=0), 2, 10.0)
    found = face_samples(card(), hits, shape)
    assert found.samples.depth.shape == (2, *shape) and found.normal.shape == (2, *shape, 3)
    solid = np.isfinite(found.samples.depth)
    assert solid.sum() == 4 and solid[0].ravel().tolist() == [True] * 4 + [False] * 2
    assert (found.albedo[solid][:, :3] == 1).all() and not found.albedo[~solid].any()
    assert found.samples.facing[solid] == pytest.approx(np.tile([0, 1, 0], (4, 1)))
