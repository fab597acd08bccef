"""Ambient occlusion in cases that can be computed by hand."""

import numpy as np
import pytest

from depthwalk.reference.ambient_occlusion import SeenSurfaces, ambient_visibility, light_up_to, turns, with_reflected
from depthwalk.types import Array

SIZE = 64
REACH = SIZE / 2  # pixels that a metre covers at one metre, at a field of view of 90°


def rays() -> Array:
    """From the viewer, who looks along −z, to one metre along the view axis: (SIZE, SIZE, 3)."""
    place = (np.arange(SIZE) + 0.5) / SIZE * 2 - 1
    x, y = np.meshgrid(place, place)
    return np.stack([x, y, -np.ones_like(x)], -1)


def seen(planes: list[tuple[Array, float]]) -> SeenSurfaces:
    """The nearest of planes, n · p = d, each facing the viewer."""
    ray = rays()
    with np.errstate(divide="ignore"):
        distances = np.stack([d / (ray @ n) for n, d in planes])
    distances[distances <= 0] = np.inf
    nearest = distances.argmin(0)
    distance = distances.min(0)
    return SeenSurfaces(
        point=np.where(np.isfinite(distance), distance, 0)[..., None] * ray,
        normal=np.array([n for n, _ in planes])[nearest],
        present=np.isfinite(distance),
        right=np.array([1.0, 0, 0]),
        up=np.array([0, 1.0, 0]),
        reach=REACH / np.where(np.isfinite(distance), distance, 1),
    )


@pytest.mark.parametrize(("horizon", "turned"), [(0.9, 0.0), (1.2, -0.3), (-0.7, 0.6), (-2.0, -1.1)])
def test_the_closed_form_is_the_integral_of_cosine_and_solid_angle(horizon: float, turned: float) -> None:
    """Eq. 5: ∫ cos(θ − γ) |sin θ| dθ from the ray to the horizon."""
    angle = np.linspace(0, horizon, 20001)
    values = np.cos(angle - turned) * np.abs(np.sin(angle))
    integral = np.sum((values[1:] + values[:-1]) / 2) * abs(angle[1] - angle[0])
    assert light_up_to(np.array(horizon), np.array(turned)) == pytest.approx(integral / 1.0, abs=1e-6)


def test_all_texels_of_a_block_turn_differently() -> None:
    assert sorted(turns(4, 4).ravel()) == (np.arange(16) / 16).tolist()
    assert (turns(8, 8)[4:, :4] == turns(4, 4)).all()


@pytest.mark.parametrize("tilt", [0.0, 0.5, 1.2])
def test_nothing_darkens_a_plane(tilt: float) -> None:
    normal = np.array([np.sin(tilt), 0, np.cos(tilt)])
    found = ambient_visibility(seen([(normal, -2.0)]), 0.8, 2, 4)
    assert found == pytest.approx(1, abs=2e-2)


def test_a_wall_takes_half_of_the_light_from_the_floor_below_it() -> None:
    """Both go on far beyond the radius; a normal to the left, one to the right."""
    left, right = np.array([np.sqrt(0.5), 0, np.sqrt(0.5)]), np.array([-np.sqrt(0.5), 0, np.sqrt(0.5)])
    corner = seen([(left, -3.0), (right, -3.0)])
    assert corner.present.all()
    found = ambient_visibility(corner, 4.0, 8, 24)
    beside = found[12:20, 15:17].mean()  # the corner lies between columns 31 and 32
    assert beside == pytest.approx(0.5, abs=0.07)
    assert found[16, 8:16].min() >= beside - 0.1
    assert (np.diff(found[12:20, 4:16].mean(0)) < 0.03).all()  # lighter away from it


def test_what_is_far_in_front_darkens_nothing() -> None:
    scene = seen([(np.array([0, 0, 1.0]), -6.0)])
    scene.point[20:40, 20:40] *= 0.2
    found = ambient_visibility(scene, 0.5, 4, 8)
    assert found.min() > 0.97


@pytest.mark.parametrize("colour", [0.0, 0.3, 0.9])
def test_bright_surfaces_pass_on_what_they_receive(colour: float) -> None:
    visibility = np.linspace(0, 1, 21)
    found = with_reflected(visibility, np.full((21, 3), colour))
    assert (found >= visibility[:, None]).all()
    assert found[-1] == pytest.approx(1, abs=2e-3)
    again = 0.5 / (1 - 0.5 * colour)  # all that is hidden reflects what it receives, again and again
    assert found[10, 0] == pytest.approx(again, abs=0.06)
