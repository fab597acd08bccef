"""Surfaces of one depth image that meet at a step keep their own colours (shaders/common/depth_images.glsl)."""

from dataclasses import replace

import numpy as np
import pytest

from depthwalk.scene.arrays import Camera
from shapes import ShapeLibrary, box, joined, leaves, scene_of
from studio import Studio


@pytest.mark.parametrize("height", [0.1, 0.2])
def test_a_blue_block_on_a_red_base_has_no_purple_rim(studio: Studio, height: float) -> None:
    """From above, at five and ten texels of depth: texels of both surround the rim, and only one's may be blended."""
    base = box(1, 0.3, 1, (0, 0.15, 0), colour=(255, 20, 20))
    block = box(0.5, height, 0.5, (0, 0.3 + height / 2, 0), colour=(20, 20, 255))
    library = ShapeLibrary([joined(base, block)], resolution=48, layers=1)
    camera = Camera((0.0, 1.6, 0.01), (0.0, 0.3, 0.0), 0.6)
    pixels = studio.picture(scene_of((0, (0, 0, 0), 0.0, 1.0)), library, camera, (96, 72), transparent=True)
    pixels = pixels[pixels[..., 3] == 1]
    red = pixels[..., 0] / (pixels[..., 0] + pixels[..., 2])
    assert (red > 0.9).sum() > 1000 and (red < 0.1).sum() > 1000
    assert ((red > 0.3) & (red < 0.7)).sum() < 5


def test_leaves_do_not_take_the_colour_of_what_stands_below(studio: Studio) -> None:
    """One layer of a face does not reach leaves between leaves, but the face at which the viewer looks shows them."""
    crown = leaves(600, 0.15, colour=(20, 200, 20))
    crown = replace(crown, positions=crown.positions + np.array([0, 0.6, 0], np.float32))
    base = box(1, 0.3, 1, (0, 0.15, 0), colour=(255, 20, 20))
    library = ShapeLibrary([joined(base, crown)], layers=1)
    camera = Camera((1.4, 1.1, 0.3), (0.0, 1.1, 0.0), 0.7)
    pixels = studio.picture(scene_of((0, (0, 0, 0), 0.0, 1.0)), library, camera, (512, 384), transparent=True)[:230]
    assert (pixels[..., 3] == 1).sum() > 60_000
    assert ((pixels[..., 0] > pixels[..., 1]) & (pixels[..., 3] == 1)).sum() < 5
