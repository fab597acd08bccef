"""Surfaces of one depth image that meet at a step keep their own colours (shaders/common/depth_images.glsl)."""

import pytest

from depthwalk.scene.arrays import Camera
from shapes import ShapeLibrary, box, joined, scene_of
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
