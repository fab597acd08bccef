"""Objects that are warped straight to the screen have numbers that go on from those of impostor tiles."""

import numpy as np
import pytest

from depthwalk.cook.lod_geometry import IMAGE_BITS
from depthwalk.gpu.device import Device
from depthwalk.scene.arrays import Representation
from shapes import ShapeLibrary, box, scene_of
from stage import OnScreen, view_of


@pytest.fixture(scope="module")
def library() -> ShapeLibrary:
    return ShapeLibrary([box(0.8, 0.8, 0.8)], resolution=48)


def test_each_object_has_a_number_of_its_own(gl_device: Device, library: ShapeLibrary) -> None:
    places = (-1.2, 0.0, 1.2)
    scene = scene_of(*((0, (x, 0, 0), 0.0, 1.0) for x in places), representation=Representation.DMESH)
    scene.objects.representation[0] = Representation.DPCI
    with OnScreen(gl_device, scene, library) as stage:
        stage.draw(view_of((0.0, 0.5, 5.0), (0.0, 0.4, 0.0)))
        assert stage.renderer.targets is not None
        width, height = stage.renderer.targets.size
        data = stage.renderer.targets.visibility_texture.read(alignment=1)
        numbers = np.frombuffer(data, np.uint32).reshape(height, width, 2)[..., 0] >> IMAGE_BITS
    assert set(np.unique(numbers)) == {0, 1, 2, 3}
    columns = [np.flatnonzero((numbers == number).any(0)) for number in (1, 2, 3)]
    assert columns[0].max() < width / 2 - 10  # the impostor, on the left
    ranges = sorted((found.min(), found.max()) for found in columns)
    assert ranges[0][1] < ranges[1][0] and ranges[1][1] < ranges[2][0]
