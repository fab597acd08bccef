"""A finished picture that follows the camera: the shader against its twin, and against what the camera truly sees."""

import numpy as np
import pytest
from numpy.typing import NDArray

from depthwalk.gpu.device import Device
from depthwalk.reference.finished_picture import roughness
from depthwalk.reference.reprojection import look_up, sources, tiles
from depthwalk.render.image import read_pixels
from depthwalk.render.reprojection.reprojection import BEYOND, Reprojection, seen_from
from depthwalk.render.reprojection.smooth_tiles import TILE, TileClass
from depthwalk.render.view.field_of_view import widened
from depthwalk.render.view.view import View, view_distance
from depthwalk.scene.arrays import Camera, Representation
from depthwalk.scene.environment import GroundParams, SkyParams
from shapes import ShapeLibrary, box, scene_of, sphere
from stage import OnScreen

SIZE = (160, 120)
HERE = Camera((0.0, 1.2, 4.0), (0.0, 0.6, 0.0), 0.8)
ASIDE = Camera((0.15, 1.25, 3.8), (0.3, 0.6, 0.0), 0.8)


class Moving(OnScreen):
    """A crate and a ball on the ground, or a crate before a post so wide, of which one picture is kept."""

    def __init__(self, device: Device, margin: float = 0.0, camera: Camera = HERE, post: float = 0.0) -> None:
        shapes = [box(1.0, 1.0, 1.0, (0, 0.5, 0)), sphere(0.5, 64, 32)]
        places = [(0, (-0.6, 0.0, 0.0), 0.4, 1.0), (1, (0.9, 0.5, 1.2), 0.0, 1.0)]
        if post:
            shapes[1] = box(post, 3.0, 0.1, (0, 0.5, 0), colour=(250, 10, 10))
            places = [(0, (0.0, 0.0, 0.0), 0.0, 1.0), (1, (-1.45, 0.0, -3.0), 0.0, 1.0)]
        library = ShapeLibrary(shapes, [None, None])
        scene = scene_of(*places, representation=Representation.MESH)
        scene.environment.ground, scene.environment.sky = GroundParams(), SkyParams()
        super().__init__(device, scene, library, SIZE)
        self.reprojection = Reprojection(device)
        source = widened(View(camera, SIZE), margin)
        self.renderer.render(source, self.reprojection.canvas(source.size))
        assert self.renderer.view is not None and self.renderer.targets is not None
        self.source = View(source.camera, source.size, *self.renderer.view.depth_range)
        self.depth = np.frombuffer(self.renderer.targets.depth.read(alignment=1), np.float32).reshape(source.size[::-1])
        self.reprojection.take(self.renderer.targets, self.source)

    def __exit__(self, *_: object) -> None:
        self.reprojection.release()
        super().__exit__()

    def distances(self) -> NDArray[np.float64]:
        metres = view_distance(self.depth, *self.source.depth_range)
        return np.where(np.isinf(metres), BEYOND, metres)

    def moved(self, camera: Camera) -> NDArray[np.int64]:
        self.reprojection.show(View(camera, SIZE), self.screen)
        return self.pixels()


@pytest.mark.parametrize("margin", [0.0, 0.1])
def test_who_stands_still_sees_the_picture_itself(gl_device: Device, margin: float) -> None:
    """With a margin, too, whose pixels lie outside: the same to the bit but where the other far plane rounds depths."""
    with Moving(gl_device, margin) as stage:
        shown, true = stage.moved(HERE), stage.true(HERE)
    assert (np.abs(shown - true).max(-1) > 1).mean() < (0.002 if margin else 1e-9)


def test_the_shader_is_its_twin(gl_device: Device) -> None:
    """Of a picture whose colours tell places, seen through the distances of a scene."""
    with Moving(gl_device) as stage:
        assert stage.reprojection._shown is not None
        picture = stage.reprojection._shown.drawn.colours.texture
        x, y = np.meshgrid((np.arange(160) + 0.5) / 160, (np.arange(120) + 0.5) / 120)
        picture.write((np.stack([x, y, 0 * x, 0 * x + 1], -1) * 255).round().astype(np.uint8).tobytes())
        shown = stage.moved(ASIDE)[..., :2] / 255
        expected = sources(stage.source, stage.distances(), View(ASIDE, SIZE))
    off = np.abs(shown - expected).max(-1)
    assert np.median(off) < 0.003 and (off > 0.01).mean() < 0.01  # single precision decides along edges


@pytest.mark.parametrize("margin", [0.0, 0.4])
def test_tiles_are_drawn_as_the_twin_says(gl_device: Device, margin: float) -> None:
    """Sky and the even ground are interpolated, the edges of crate and ball searched; without a margin some end.

    Beside crate and ball, some show what is behind.
    """
    with Moving(gl_device, margin) as stage:
        stage.moved(ASIDE)
        shown, made = stage.reprojection._shown, stage.reprojection._tiles._made
        assert shown is not None and made is not None
        rough = np.frombuffer(shown.roughness.texture.read(), np.float32)
        drawn = made.classes.texture
        classes = np.frombuffer(drawn.read(), np.float32).reshape(drawn.size[::-1])
        expected, _ = tiles(stage.source, stage.distances(), View(ASIDE, SIZE))
        assert rough == pytest.approx(roughness(stage.distances()).ravel(), rel=1e-3, abs=1e-4)
    assert (classes == expected).mean() > 0.97  # single precision decides at the limits
    counts = np.bincount(expected.ravel(), minlength=len(TileClass))
    assert counts[TileClass.SMOOTH] > 20 and counts[TileClass.SEARCHED] > 5 < counts[TileClass.UNCOVERED]
    assert (counts[TileClass.AROUND] > 0) == (margin == 0)


def test_a_screen_need_not_have_whole_tiles(gl_device: Device) -> None:
    """Its last column and row of tiles are drawn as far as they reach."""
    size = SIZE[0] - 7, SIZE[1] - 5
    with Moving(gl_device, 0.1) as stage:
        whole = stage.moved(ASIDE)
        scope = gl_device.scope("part")
        part = scope.framebuffer([scope.texture(size, 4)])
        fov = 2 * np.arctan(np.tan(ASIDE.fov / 2) * size[1] / SIZE[1])
        stage.reprojection.show(View(Camera(ASIDE.position, ASIDE.target, fov), size), part)
        shown = read_pixels(part)[::-1, :, :3].astype(int)  # lowest row first
        scope.release()
    cut = (whole[2:-3, 3:-4] + whole[3:-2, 4:-3]) / 2  # off by half a pixel
    off = np.abs(shown - cut).max(-1)
    assert np.median(off) <= 2 and np.median(off[-6:]) <= 2 and np.median(off[:, -6:]) <= 2


def test_a_moved_picture_is_nearer_to_the_truth_than_the_old_one(gl_device: Device) -> None:
    with Moving(gl_device, 0.1) as stage:
        old, shown, true = stage.moved(HERE), stage.moved(ASIDE), stage.true(ASIDE)
    before, after = (np.abs(picture - true).mean() for picture in (old, shown))
    assert after < before / 5


def test_what_stands_beside_a_nearer_object_is_shown_once(gl_device: Device) -> None:
    """The post beside a crate, from 0.5 m aside: the wider gap between both is not filled with another post."""
    start, end = (Camera((x, 1.2, 4.0), (x, 0.6, 0.0), 0.8) for x in (0.0, -0.5))
    with Moving(gl_device, 0.2, start, post=0.6) as stage:
        shown, true = (picture[60:72] for picture in (stage.moved(end), stage.true(end)))
    red = [(picture[..., 0] > 2 * picture[..., 1]).mean(0) > 0.5 for picture in (shown, true)]
    first, last = np.flatnonzero(red[1])[[0, -1]]
    assert last - first > 8 and red[0][first : last + 1].mean() > 0.8
    assert not red[0][: first - 1].any() and not red[0][last + 2 :].any()


@pytest.mark.parametrize(("wide", "aside"), [(0.15, -0.2), (0.15, 0.2), (0.3, 0.4)])
def test_a_narrow_thing_beside_a_nearer_object_is_shown(gl_device: Device, wide: float, aside: float) -> None:
    """A post in one cell with the crate: the first step from the crate's distance leads past it."""
    start, end = (Camera((x, 1.2, 4.0), (x, 0.6, 0.0), 0.8) for x in (0.0, aside))
    with Moving(gl_device, 0.2, start, post=wide) as stage:
        shown, true = (picture[60:72] for picture in (stage.moved(end), stage.true(end)))
    red = [picture[..., 0] > 2 * picture[..., 1] for picture in (shown, true)]
    assert red[1].sum() > 30 and (red[0] & red[1]).sum() > 0.9 * red[1].sum()


def test_places_in_a_moved_picture_have_the_distances_of_the_surfaces(gl_device: Device) -> None:
    with Moving(gl_device, 0.1) as stage:
        places = [(0.5, 0.5), (0.3, 0.55), (0.75, 0.6), (0.5, 0.9), (0.5, 0.02)]
        shown = [stage.reprojection.distance_at(View(ASIDE, SIZE), *place) for place in places]
        stage.true(ASIDE)
        true = [stage.renderer.distance_at(*place) for place in places]
    assert np.isinf(true[-1]) and shown == pytest.approx(true, rel=0.02)


def test_distances_are_those_of_the_surfaces_that_the_shader_finds(gl_device: Device) -> None:
    """Beside edges too, where a search that begins elsewhere ends at another surface; in smooth tiles, to a pixel."""
    view = View(ASIDE, SIZE)
    with Moving(gl_device) as stage:
        distances = stage.distances()
        places, (classes, _) = sources(stage.source, distances, view), tiles(stage.source, distances, view)
        _, viewer, axis = seen_from(stage.source, view)
        found, expected, smooth = [], [], []
        for row, column in np.random.default_rng(3).integers(0, (90, 160), (200, 2)).tolist():
            found.append(stage.reprojection.distance_at(view, (column + 0.5) / 160, 1 - (row + 0.5) / 120))
            place = places[row, column]
            ray, ahead = np.append((2 * place - 1) * stage.source.half_extent, 1), float(look_up(distances, place))
            expected.append(axis @ (ray * ahead - viewer) if ahead < BEYOND else np.inf)
            smooth.append(classes[row // TILE, column // TILE] == TileClass.SMOOTH)
    off = ~np.isclose(np.array(found), np.array(expected), rtol=np.where(smooth, 0.05, 1e-3))
    assert off.sum() <= 1 and np.sum(smooth) > 50 < np.sum(~np.array(smooth))  # single precision decides along edges


@pytest.mark.parametrize(("way", "wrong"), [(3.0, 0.01), (6.0, 0.1), (9.0, 0.15)])
def test_who_walks_ahead_sees_the_floor_wherever_it_was(gl_device: Device, way: float, wrong: float) -> None:
    """From 2.4 m ahead on it is seen, which is less than the way: undamped, the search ends at the vanishing point."""
    start, end = (Camera((0.0, 1.2, z), (0.0, 1.0, z - 4), 0.8) for z in (14.0, 14.0 - way))
    with Moving(gl_device, 0.1, start) as stage:
        shown, true = stage.moved(end), stage.true(end)
    floor = np.abs(shown - true)[:50].max(-1)
    assert np.median(floor) <= 2 and (floor > 20).mean() < wrong


def test_without_a_picture_there_is_no_surface(gl_device: Device) -> None:
    reprojection = Reprojection(gl_device)
    try:
        assert np.isinf(reprojection.distance_at(View(HERE, SIZE), 0.5, 0.5))
    finally:
        reprojection.release()


def test_it_knows_how_much_of_a_view_the_picture_lacks(gl_device: Device) -> None:
    """The picture is 2 · 4 / 3 · tan 0.4 wide, one metre ahead."""
    with Moving(gl_device) as stage:
        wide = 2 * 4 / 3 * np.tan(0.4)
        aside = Camera(HERE.position, (4.5 * wide / 2, 0.6, 0.0), 0.8)  # in the middle of what was the right edge
        assert stage.reprojection.unseen(View(HERE, SIZE)) == 0
        assert stage.reprojection.unseen(View(aside, SIZE)) == pytest.approx(0.47, abs=0.1)
        away = Camera(HERE.position, (0.0, 1.2, 8.0), 0.8)
        assert stage.reprojection.unseen(View(away, SIZE)) == 1


def test_it_knows_how_much_a_step_uncovers(gl_device: Device) -> None:
    """A crate of one metre whose front is 3.5 m away, its middle as high as the camera, before sky and floor.

    A step aside of 0.2 m uncovers a strip beside it, as wide as it moves against the sky; less against the floor.
    """
    start = Camera((0.0, 0.5, 4.0), (0.0, 0.5, 0.0), 0.8)
    with Moving(gl_device, 0.0, start, post=0.01) as stage:
        high = 2 * np.tan(0.4)
        strip = 0.2 / 3.5 / (high * 4 / 3) * (1 / 3.5 / high)
        still, right, left, farther = (
            stage.reprojection.uncovered(np.array((x, 0.5, 4.0))) for x in (0.0, 0.2, -0.2, 0.4)
        )
    assert still == 0 and (right, left) == pytest.approx((strip, strip), rel=0.5)
    assert farther == pytest.approx(2 * right)


def test_everything_is_released(gl_device: Device) -> None:
    before = +gl_device.live
    with Moving(gl_device) as stage:
        stage.reprojection.canvas((64, 48))  # another size
    assert +gl_device.live == before
