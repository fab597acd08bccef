"""What all kinds of anti-aliasing promise of a picture."""

import numpy as np
import pytest
from scipy.ndimage import binary_dilation

from depthwalk.colour import linear_from_srgb, srgb_from_linear
from depthwalk.render.antialiasing.modes import SUPERSAMPLING
from depthwalk.render.headless import HeadlessRenderer
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera, Representation
from depthwalk.scene.render_settings import RenderSettings
from depthwalk.scene.scene import Scene
from depthwalk.types import Array
from modes import AaName
from shapes import ShapeLibrary, box, scene_of
from studio import Studio

CAMERA = Camera((2, 2.3, 3.5), (0, 0.7, 0), 0.7)
SIZE = (160, 120)
ALL = RenderSettings.model_json_schema()["properties"]["aa"]["enum"]
NONE: AaName = "none"
KINDS = [kind for kind in ALL if kind not in ("none", "coverage")]  # of polygons


@pytest.fixture(scope="module")
def library() -> ShapeLibrary:
    return ShapeLibrary([box(1.4, 1.4, 1.4, (0, 0.7, 0))], [None])


def crate(aa: AaName, representation: Representation = Representation.MESH, **environment: dict[str, float]) -> Scene:
    scene = scene_of((0, (0, 0, 0), 0.3, 1.0), representation=representation, **environment)
    scene.render.aa = aa
    return scene


@pytest.fixture(scope="module")
def truth(studio: Studio, library: ShapeLibrary) -> Array:
    """The picture (H, W, 3) with 256 samples a pixel."""
    samples = 16
    with studio.device.context:
        fine = studio.picture(crate("none"), library, CAMERA, (SIZE[0] * samples, SIZE[1] * samples))[..., :3]
    linear = linear_from_srgb(fine).reshape(SIZE[1], samples, SIZE[0], samples, 3)
    return srgb_from_linear(linear.mean((1, 3)))


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_comes_nearer_to_the_truth(
    studio: Studio, library: ShapeLibrary, truth: Array, kind: AaName
) -> None:
    aliased, smooth = (studio.picture(crate(aa), library, CAMERA, SIZE)[..., :3] for aa in (NONE, kind))
    edge = binary_dilation(np.abs(aliased - truth).max(-1) > 0.02, iterations=2)
    error = {name: np.mean((picture - truth)[edge] ** 2) for name, picture in (("none", aliased), (kind, smooth))}
    assert error[kind] < 0.63 * error["none"]  # 2 dB
    assert np.abs(smooth - aliased)[~edge].max() < 0.02


@pytest.mark.parametrize("kind", KINDS)
def test_outlines_are_transparent_in_part_and_keep_their_colour(
    studio: Studio, library: ShapeLibrary, kind: AaName
) -> None:
    """Alpha between 0 and 1, and colours that are not mixed with what is not there."""
    solid = studio.picture(crate("none", ambient={"intensity": 0.4}), library, CAMERA, SIZE, transparent=True)
    smooth = studio.picture(crate(kind, ambient={"intensity": 0.4}), library, CAMERA, SIZE, transparent=True)
    part = (smooth[..., 3] > 0.2) & (smooth[..., 3] < 0.8)
    assert part.sum() > 50
    darkest = solid[solid[..., 3] == 1][:, 0].min()
    assert smooth[part][:, 0].min() > darkest - 0.06


@pytest.mark.gl
def test_linear_pictures_have_their_size_whatever_the_samples(library: ShapeLibrary) -> None:
    scene = crate("ssaa")
    with HeadlessRenderer(scene, library, SIZE, Representation.MESH) as headless:
        headless.draw(View(CAMERA, SIZE), transparent=True, linear=True)
        image, pixels = headless.linear_image(), headless.pixels()
        assert headless.renderer.targets is not None
        finer = headless.renderer.targets.size
    assert finer == (SIZE[0] * SUPERSAMPLING, SIZE[1] * SUPERSAMPLING)
    assert image.colour.shape == (SIZE[1], SIZE[0], 4) and image.distance.shape == (SIZE[1], SIZE[0])
    assert image.colour[..., 3] == pytest.approx(pixels[..., 3] / 255, abs=0.01)
    assert (np.isfinite(image.distance) == (image.colour[..., 3] > 0)).all()


def test_it_may_change_from_frame_to_frame(studio: Studio, library: ShapeLibrary) -> None:
    """Nothing of one kind is left in the next frame's picture."""
    scene = crate("none")
    with HeadlessRenderer(scene, library, SIZE, Representation.MESH) as headless:
        shown = []
        for kind in ("none", *KINDS, "none"):
            scene.render.aa = kind
            headless.draw(View(CAMERA, SIZE))
            shown.append(headless.pixels().copy())
    assert np.array_equal(shown[0], shown[-1])
    assert all(not np.array_equal(shown[0], each) for each in shown[1:-1])


@pytest.mark.gl
@pytest.mark.parametrize("aa", ALL)
def test_nothing_of_an_earlier_picture_shows(aa: AaName) -> None:
    """Where nothing is, targets that nobody reads there are not cleared."""
    aside = Camera((2.02, 2.3, 3.5), (0.02, 0.7, 0), 0.7)  # by a pixel
    library = ShapeLibrary([box(1.4, 1.4, 1.4, (0, 0.7, 0))], resolution=64)
    pictures = []
    for camera in (CAMERA, aside):
        with HeadlessRenderer(crate(aa, Representation.DPCI, sky={}), library, SIZE) as headless:
            for seen in (camera, aside):
                headless.draw(View(seen, SIZE))
            pictures.append(headless.pixels())
    np.testing.assert_array_equal(pictures[0], pictures[1])
