"""Which representation drew the pixels of a frame, against what the pictures show."""

from typing import Any

import numpy as np
import pytest

from depthwalk.gpu.device import Device
from depthwalk.render import pixel_shares
from depthwalk.render.pixel_shares import CAPTURED_VIEW, POLYGON, count_kinds, shares
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera, Representation
from depthwalk.scene.scene import Scene
from modes import AaName
from shapes import ShapeLibrary, bake, scene_of, sphere
from stage import OnScreen

SIZE = 160, 120
CAMERA = Camera((0, 1.0, 6.0), (0, 0.5, 0), 0.9)


@pytest.fixture(scope="module")
def balls() -> ShapeLibrary:
    ball = sphere(0.5, columns=32, rows=16)
    return ShapeLibrary([ball], [bake(ball, resolution=64, layers=1)])


def three_balls(ground: bool = False) -> Scene:
    """From left to right as impostor, as samples and as mesh, the last of twice the size."""
    environment: dict[str, Any] = {"ground": {"height": 0.0, "half_size": 50.0}} if ground else {}
    scene = scene_of((0, (-2, 0, 0), 0, 1.0), (0, (0, 0, 0), 0, 1.0), (0, (2.2, 0, 0), 0, 2.0), **environment)
    scene.objects.representation[:] = Representation.DPCI, Representation.DMESH, Representation.MESH
    return scene


@pytest.mark.parametrize("ground", [False, True])
@pytest.mark.parametrize("aa", ["none", "msaa", "ssaa"])
def test_pixels_are_those_of_the_picture(gl_device: Device, balls: ShapeLibrary, ground: bool, aa: AaName) -> None:
    scene = three_balls(ground)
    scene.render.aa = aa
    with OnScreen(gl_device, scene, balls, SIZE) as stage:
        stage.draw(View(CAMERA, SIZE))
        counted = stage.renderer.sample_shares().count()
        columns = np.arange(SIZE[0])
        assert stage.renderer.targets is not None
        depth = np.frombuffer(stage.renderer.targets.depth.read(alignment=1), np.float32)
        width, height = stage.renderer.targets.size
    assert (counted[:3] > 100).all() and counted[2] > 2 * counted[0] and counted[3] == 0
    if not ground:  # else it would hide where objects are
        seen = depth.reshape(height, width) < 1
        scale = width / SIZE[0]
        ranges = [(0, 60), (60, 100), (100, columns[-1] + 1)]
        expected = np.array([seen[:, int(first * scale) : int(last * scale)].sum() for first, last in ranges])
        if aa == "none":
            assert (counted[:3] == expected).all()
        # Along edges, Mesa's software gives some samples a depth and no object.
        np.testing.assert_allclose(counted[:3] / counted.sum(), expected / expected.sum(), atol=0.02)


def test_large_pictures_are_sampled(gl_device: Device, balls: ShapeLibrary, monkeypatch: pytest.MonkeyPatch) -> None:
    with OnScreen(gl_device, three_balls(ground=True), balls, SIZE) as stage:
        stage.draw(View(CAMERA, SIZE))
        exact = shares(stage.renderer.sample_shares().count())
        monkeypatch.setattr(pixel_shares, "MOST_SAMPLES", 64)
        sampled = stage.renderer.sample_shares().count()
    assert sampled.sum() < 64 * 64
    assert shares(sampled) == pytest.approx(exact, abs=0.05)


def test_numbers_stand_for_kinds() -> None:
    numbers = np.array([0, 1, 1, 2, 3, 4, 4, 5, POLYGON, POLYGON, CAPTURED_VIEW, 0], np.uint32)
    kinds = [Representation.DPCI, Representation.DMESH, Representation.DPCI, Representation.RELIEF, Representation.BUMP]
    assert count_kinds(numbers, np.array(kinds, np.uint8)).tolist() == [3, 1, 2, 3, 1]
    of_all = {"share_dpci": 0.25, "share_dmesh": 0.125, "share_mesh": 0.375, "share_height_fields": 0.125}
    of_all["share_captured"] = 0.125
    assert shares(np.array([4, 2, 6, 2, 2])) == of_all
    assert set(shares(np.zeros(5, int)).values()) == {0.0}


def test_there_is_nothing_to_count_before_a_frame(gl_device: Device, balls: ShapeLibrary) -> None:
    with OnScreen(gl_device, three_balls(), balls, SIZE) as stage:
        assert stage.renderer.sample_shares().count().tolist() == [0, 0, 0, 0, 0]


@pytest.mark.parametrize("representation", [Representation.DPCI, Representation.DMESH])
@pytest.mark.parametrize("sun", [False, True])
def test_a_representation_that_is_asked_for_is_the_only_one(
    gl_device: Device, balls: ShapeLibrary, representation: Representation, sun: bool
) -> None:
    """Also in shadow maps. Drawn as the scene says, the same object is its mesh, so near it is."""
    scene = scene_of((0, (0, 0, 0), 0.0, 1.0))
    scene.render.lod.magnification, scene.render.shadows.enabled = 0.01, sun
    view = View(Camera((0, 0.5, 1.2), (0, 0.5, 0), 0.9), SIZE)
    with OnScreen(gl_device, scene, balls, SIZE) as stage:
        stage.draw(view)
        assert stage.counts["mesh_fallbacks"] == 1
        assert shares(stage.renderer.sample_shares().count())["share_mesh"] == 1
        stage.renderer.world.representation = representation
        stage.draw(view)
        assert (stage.counts["mesh"], stage.counts["mesh_fallbacks"]) == (0, 0)
        assert shares(stage.renderer.sample_shares().count())[f"share_{representation.label}"] == 1
        if sun:
            table = stage.renderer.world.table()
            assert (table.mesh_fallbacks.mesh < 0).all()
        stage.renderer.world.representation = None
        stage.draw(view)
        assert stage.counts["mesh_fallbacks"] == 1
