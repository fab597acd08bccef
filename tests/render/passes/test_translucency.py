"""Translucent surfaces over what is behind them, and light that surfaces send out."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from depthwalk.colour import linear_from_srgb
from depthwalk.ingest.mesh import Material, Mesh
from depthwalk.reference.fog import fog_through
from depthwalk.reference.light import Surfaces
from depthwalk.reference.translucency import in_fog, over, translucent_light
from depthwalk.render import occlusion_phases
from depthwalk.render.image import read_pixels
from depthwalk.render.lighting.irradiance import lighting
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera, Representation
from depthwalk.scene.environment import Environment
from depthwalk.types import Array
from shapes import ShapeLibrary, box, joined, panes, scene_of
from studio import Studio

pytestmark = pytest.mark.gl

SIZE = (16, 16)
CAMERA = Camera((0.0, 1.0, 4.0), (0.0, 1.0, 0.0), 0.7)
GREY = Material((0.5, 0.5, 0.5), opacity=0.5, specular=0.0)
BACKGROUND = (0.9, 0.3, 0.6)
DARK: dict[str, Any] = {"sun": {"intensity": 0.0}, "ambient": {"intensity": 0.0}}
STEP = 2 / 255


def picture(studio: Studio, mesh: Mesh, transparent: bool = False, **environment: Any) -> Array:
    """What is seen of a mesh at the origin, sRGB and alpha (16, 16, 4)."""
    shown = Environment.model_validate({"background": BACKGROUND, **environment})
    scene = scene_of((0, (0.0, 0.0, 0.0), 0.0, 1.0), representation=Representation.MESH)
    scene.environment = shown  # type: ignore[misc]
    return studio.picture(scene, ShapeLibrary([mesh], [None]), CAMERA, SIZE, transparent)


def middle(pixels: Array) -> Array:
    """The linear colour of the pixel in the middle."""
    return linear_from_srgb(pixels[8, 8, :3])


def light_of(material: Material, environment: dict[str, Any]) -> Array:
    """What the twin says of a pane of a material in the middle of the picture, (1, 4)."""
    shown, one = Environment.model_validate(environment), np.ones(1)
    light, view = lighting(shown), np.array([[0.0, 0, -1]])
    ambient = shown.ambient.intensity * linear_from_srgb(np.array(shown.ambient.colour))
    surfaces = Surfaces(
        albedo=np.array([material.base_colour]),
        specular=one * material.specular,
        normal=-view,
        shininess=one * material.shininess,
    )
    opacity, emission = one * (material.opacity or 0), np.array(material.emission)
    return translucent_light(surfaces, opacity, view, light.to_sun, light.sun, ambient, emission)


WALL = np.array([[*linear_from_srgb(np.array(BACKGROUND)), 1.0]])


@pytest.mark.parametrize(
    "material",
    [replace(GREY, specular=0.1, shininess=4.0), replace(GREY, opacity=0.1, emission=(1.0, 0.0, 0.5))],
)
def test_a_pane_before_a_known_background(studio: Studio, material: Material) -> None:
    sun: dict[str, Any] = {"sun": {"direction": (0.1, -0.2, -1.0)}}
    pixels = picture(studio, panes((0.0, material)), **sun)
    expected = over(light_of(material, sun), WALL)[0, :3]
    assert expected.max() < 1
    assert middle(pixels) == pytest.approx(expected, abs=STEP)
    assert linear_from_srgb(pixels[0, 0, :3]) == pytest.approx(WALL[0, :3], abs=STEP)


def test_panes_hide_each_other_in_their_order(studio: Studio) -> None:
    """Wherever they stand in the file."""
    colours = {z: replace(GREY, base_colour=tuple(np.eye(3)[z])) for z in range(3)}
    expected = WALL
    for z in range(3):
        expected = over(light_of(colours[z], {}), expected)
    pixels = picture(studio, panes(*((z / 2, colours[z]) for z in (2, 0, 1))))
    assert middle(pixels) == pytest.approx(expected[0, :3], abs=STEP)


def test_what_is_before_glass_hides_it(studio: Studio) -> None:
    stone = Material((0.2, 0.2, 0.2))
    alone, before = (picture(studio, panes((1.0, stone), *more)) for more in ((), ((0.0, GREY),)))
    assert (alone == before).all()


@pytest.mark.parametrize("aa", ["none", "msaa"])
def test_what_lies_on_the_ground_is_in_front_of_it(studio: Studio, aa: Any) -> None:
    upright = panes((0.0, replace(GREY, base_colour=(0.0, 0.0, 0.0))), width=4.0)
    lying = replace(upright, positions=upright.positions[:, [0, 2, 1]] * np.array([1.0, 0.0, -1.0]))
    scene = scene_of((0, (0.0, 0.0, 0.0), 0.0, 1.0), representation=Representation.MESH)
    scene.environment = Environment.model_validate({"ground": {"colour": (1.0, 1.0, 1.0)}})  # type: ignore[misc]
    scene.render.aa = aa
    cameras = (Camera((0.3 * k, 0.5 + k, 2.0 + k), (0.0, 0.0, -2.0), 0.5) for k in range(3))
    for camera in cameras:
        light = linear_from_srgb(studio.picture(scene, ShapeLibrary([lying], [None]), camera, (64, 48))[..., 1])
        ground = light[-1, 0]
        dimmed = np.abs(light - 0.5 * ground) < 0.02
        rows = dimmed.any(1)
        first, last = dimmed.argmax(1), dimmed.shape[1] - 1 - dimmed[:, ::-1].argmax(1)
        assert rows.sum() > 6
        assert dimmed.sum() == (last - first + 1)[rows].sum() and rows[rows.argmax() :].sum() == rows.sum()


def test_a_label_hides_the_glass_close_behind_it(studio: Studio) -> None:
    stone = Material((0.2, 0.2, 0.2))
    aside = Camera((3.0, 1.0, 2.0), (0.0, 1.0, 0.0), 0.35)
    scene = scene_of((0, (0.0, 0.0, 0.0), 0.0, 1.0), representation=Representation.MESH)
    pictures = (
        studio.picture(scene, ShapeLibrary([panes((0.01, stone), *more)], [None]), aside, (64, 48))
        for more in ((), ((0.0, GREY),))
    )
    alone, before = (pixels[10:-10, 20:-20] for pixels in pictures)
    assert (alone == before).all()


def test_what_glows_is_seen_in_the_dark(studio: Studio) -> None:
    """As bright as it is, on what it shows in light, and not through what is before it."""
    lamp = Material((0.0, 0.0, 0.0), emission=(0.5, 0.25, 0.0), specular=0.0)
    assert middle(picture(studio, panes((0.0, lamp)), **DARK)) == pytest.approx([0.5, 0.25, 0], abs=STEP)
    white = replace(lamp, base_colour=(1.0, 1.0, 1.0))
    lit, glowing = (middle(picture(studio, panes((0.0, each)))) for each in (replace(white, emission=(0, 0, 0)), white))
    assert glowing == pytest.approx(np.minimum(lit + np.array(lamp.emission), 1), abs=STEP)
    hidden = picture(studio, panes((0.0, lamp), (1.0, Material((0.0, 0.0, 0.0), specular=0.0))), **DARK)
    assert middle(hidden).tolist() == [0, 0, 0]


def test_what_is_cut_out_does_not_glow(studio: Studio) -> None:
    stencil = np.array([[[255, 255, 255, 0], [255, 255, 255, 255]]], np.uint8)  # no left half
    lamp = Material((0.0, 0.0, 0.0), texture=stencil, cutoff=0.5, emission=(0.0, 0.5, 0.0), specular=0.0)
    pixels = linear_from_srgb(picture(studio, panes((0.0, lamp)), **DARK)[8, :, :3])
    assert pixels[6] == pytest.approx(WALL[0, :3], abs=STEP)
    assert pixels[10] == pytest.approx([0, 0.5, 0], abs=STEP)


def test_glass_dims_what_glows_behind_it(studio: Studio) -> None:
    lamp = Material((0.0, 0.0, 0.0), emission=(0.8, 0.4, 0.0), specular=0.0)
    pixels = picture(studio, panes((0.0, lamp), (1.0, GREY)), **DARK)
    assert middle(pixels) == pytest.approx([0.4, 0.2, 0], abs=STEP)


def test_textures_colour_and_dim(studio: Studio) -> None:
    stained = np.array([[[255, 0, 0, 102]]], np.uint8)
    glass = Material((1.0, 1.0, 1.0), texture=stained, opacity=0.5, specular=0.0, emission=(0.0, 1.0, 1.0))
    glass = replace(glass, emission_texture=np.array([[[0, 0, 255, 255]]], np.uint8))
    expected = over(light_of(replace(glass, base_colour=(1, 0, 0), opacity=0.2, emission=(0, 0, 1)), {}), WALL)
    assert middle(picture(studio, panes((0.0, glass)))) == pytest.approx(expected[0, :3], abs=STEP)


def test_an_empty_picture_has_the_alpha_of_what_is_over_it(studio: Studio) -> None:
    pixels = picture(studio, panes((0.0, GREY)), transparent=True)
    assert pixels[0, 0, 3] == 0 and pixels[8, 8, 3] == pytest.approx(0.5, abs=STEP)
    expected = light_of(GREY, {})[0]
    assert middle(pixels) == pytest.approx(expected[:3] / expected[3], abs=STEP)


def test_fog_is_before_between_and_behind(studio: Studio) -> None:
    fog = {"density": 0.2, "height": 9.0, "falloff": 2.0}
    environment: dict[str, Any] = {"fog": fog | {"colour": (0.5, 0.6, 0.7)}}
    wall = Material((0.0, 0.0, 0.0), emission=(0.5, 0.0, 0.0), specular=0.0)
    pixels = picture(studio, panes((-2.0, wall), (0.0, GREY)), **environment, **DARK)
    colour = linear_from_srgb(np.array([0.5, 0.6, 0.7]))
    near, far = (fog_through(1.0, np.array([[0.0, 0.0, -metres]]), **fog) for metres in (4.0, 6.0))
    behind = in_fog(np.array([[0.5, 0, 0, 1.0]]), far, colour)
    expected = over(in_fog(np.array([[0.0, 0, 0, 0.5]]), near, colour), behind)
    assert middle(pixels) == pytest.approx(expected[0, :3], abs=STEP)


def test_lamps_light_glass(studio: Studio) -> None:
    lamp: dict[str, Any] = {"position": (0.0, 1.0, 2.0), "intensity": 3.0, "colour": (1.0, 1.0, 1.0)}
    pixels = picture(studio, panes((0.0, GREY)), background=(0.0, 0.0, 0.0), lights=[lamp], **DARK)
    opaque = picture(studio, panes((0.0, replace(GREY, opacity=None))), lights=[lamp], **DARK)
    assert middle(opaque).max() > 0.2
    assert middle(pixels) == pytest.approx(0.5 * middle(opaque), abs=STEP)


def test_glass_casts_no_shadow_and_is_in_shadow(studio: Studio) -> None:
    """As bright as the same surface is where it is opaque."""
    sun: dict[str, Any] = {"sun": {"direction": (0.0, -1.0, -0.2)}, "ambient": {"intensity": 0.0}}
    glass, stone = panes((0.0, GREY)), panes((0.0, replace(GREY, opacity=None)))
    roof = box(4.0, 0.1, 4.0, centre=(0.0, 3.0, 0.0))
    scene = scene_of((0, (0.0, 0.0, 0.0), 0.0, 1.0), (1, (0.0, 0.0, 0.0), 0.0, 1.0), representation=Representation.MESH)
    scene.environment = Environment.model_validate({"background": (0.0, 0.0, 0.0), **sun})  # type: ignore[misc]
    scene.render.shadows.enabled = True
    shaded, lit = [], []
    for mesh in (glass, stone):
        shaded.append(middle(studio.picture(scene, ShapeLibrary([mesh, roof], [None, None]), CAMERA, SIZE)))
        lit.append(middle(picture(studio, mesh, **sun | {"background": (0.0, 0.0, 0.0)})))
    assert lit[1].min() > 0.05 and shaded[0].max() < 0.01 and shaded[1].max() < 0.01
    assert lit[0] == pytest.approx(0.5 * lit[1], abs=STEP)


def test_depth_images_show_it_as_meshes_do(studio: Studio) -> None:
    lamp = Material((0.1, 0.1, 0.1), emission=(0.0, 0.8, 0.2), specular=0.0)
    body = joined(box(1.0, 1.0, 1.0, (0.0, 0.5, 0.0)))
    glass = panes((0.9, GREY))
    mesh = replace(
        body,
        positions=np.concatenate([body.positions, glass.positions]),
        normals=np.concatenate([body.normals, glass.normals]),
        colours=np.concatenate([body.colours, glass.colours]),
        uv=np.concatenate([body.uv, glass.uv]),
        materials=(lamp, GREY),
        translucent_faces=glass.translucent_faces + np.int32(len(body.positions)),
        translucent_parts=(replace(glass.translucent_parts[0], material=1),),
    )
    library = ShapeLibrary([mesh], resolution=64, layers=1)
    camera = replace(CAMERA, position=(1.5, 2.0, 4.0), target=(0.0, 0.6, 0.0))
    both = []
    for representation in (Representation.MESH, Representation.DPCI):
        scene = scene_of((0, (0.0, 0.0, 0.0), 0.4, 1.0), representation=representation)
        both.append(studio.picture(scene, library, camera, (48, 48)))
    off = np.abs(both[0] - both[1]).max(-1)
    assert (both[0][..., 1] > 0.7).mean() > 0.03  # the glow shows
    assert (off > 0.1).mean() < 0.02


def test_an_opaque_scene_pays_nothing(studio: Studio) -> None:
    scene = scene_of((0, (0.0, 0.0, 0.0), 0.0, 1.0), representation=Representation.MESH)
    for mesh, drawn in ((box(1, 1, 1), False), (panes((0.0, GREY)), True)):
        with studio._drawn(scene, ShapeLibrary([mesh], [None]), CAMERA, SIZE, False) as (renderer, _):
            assert renderer.targets is not None
            steps = set(renderer.steps(View(CAMERA, SIZE), renderer.targets.screen))
            assert ("translucency" in steps) == drawn and (renderer.assets.translucent.bytes > 0) == drawn


def test_what_was_released_is_drawn_again(studio: Studio) -> None:
    """As after a lost context, when all of the GPU is made anew."""
    scene = scene_of((0, (0.0, 0.0, 0.0), 0.0, 1.0), representation=Representation.MESH)
    with studio._drawn(scene, ShapeLibrary([panes((0.0, GREY))], [None]), CAMERA, SIZE, False) as (renderer, before):
        assert renderer.targets is not None
        renderer.assets.release()
        assert not renderer.assets.translucent.objects
        screen = renderer.targets.screen
        renderer.render(View(CAMERA, SIZE), screen)
        assert (read_pixels(screen) == np.round(255 * before)).all()


def test_glass_behind_a_crowd_is_drawn(studio: Studio, monkeypatch: pytest.MonkeyPatch) -> None:
    """Far objects are tested for what hides them in later phases of the frame; their glass must not wait for that."""
    monkeypatch.setattr(occlusion_phases, "FIRST_BATCH", 1)
    crowd = [(0, (0.008 * k - 1, 2.0, z), 0.0, 0.1) for z in (0.0, -40.0) for k in range(255)]
    scene = scene_of(*crowd, (1, (0.0, -8.0, -40.0), 0.0, 9.0), representation=Representation.MESH)
    scene.environment = Environment.model_validate({"background": BACKGROUND, **DARK})  # type: ignore[misc]
    library = ShapeLibrary([box(1, 1, 1), panes((0.0, GREY))], [None, None])
    assert middle(studio.picture(scene, library, CAMERA, SIZE)) == pytest.approx(WALL[0, :3] / 2, abs=STEP)
