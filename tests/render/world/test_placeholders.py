"""What is drawn of an asset whose depth images are not ready."""

import time
from collections.abc import Callable, Iterator

import numpy as np
import pytest

import shapes
from depthwalk.cook.cook import CookOptions
from depthwalk.gpu.device import Device
from depthwalk.render.resources.asset_store import AssetStore
from depthwalk.render.world import placeholders
from depthwalk.render.world.object_rows import ObjectRows, rows_of
from depthwalk.render.world.render_world import RenderWorld
from depthwalk.scene.arrays import Representation
from shapes import ShapeLibrary, scene_of

pytestmark = pytest.mark.gl
BALL, CONE = 0, 1
FAR, NEAR = (0, 0, -50), (0, 0, -2)


class FakeBackground:
    """Has ready what a test says, and notes what is asked for."""

    def __init__(self) -> None:
        self.ready: set[int] = set()
        self.asked: list[int] = []
        self.news = False

    def is_cooked(self, asset: int, options: CookOptions) -> bool:
        self.asked.append(asset)
        return asset in self.ready

    def poll(self) -> bool:
        news, self.news = self.news, False
        return news

    @property
    def is_busy(self) -> bool:
        return False

    def make(self, *assets: int) -> None:
        self.ready.update(assets)
        self.news = True


@pytest.fixture
def world(gl_device: Device) -> Iterator[RenderWorld]:
    """Two balls and a cone, far ball first; nothing is ready."""
    library = ShapeLibrary([shapes.sphere(1.0, columns=16, rows=8)] * 2, resolution=32, layers=1)
    store = AssetStore(gl_device, library)
    store.background = FakeBackground()
    scene = scene_of((BALL, FAR, 0.0, 1.0), (CONE, NEAR, 0.0, 1.0), (BALL, (3, 0, -40), 0.0, 1.0))
    yield RenderWorld(scene, library, store)
    store.release()


def background_of(world: RenderWorld) -> FakeBackground:
    assert isinstance(world._assets.background, FakeBackground)
    return world._assets.background


def arrive(world: RenderWorld, done: Callable[[], bool], viewer: tuple[float, float, float] = (0, 0, 0)) -> None:
    for _ in range(2000):
        world.take_arrivals(np.array(viewer))
        if done():
            return
        time.sleep(0.002)
    raise AssertionError("it never came")


def shown(world: RenderWorld) -> list[tuple[int, str]]:
    objects = world.objects()
    return [
        (number, Representation(kind).label)
        for number, kind in zip(objects.asset.tolist(), objects.representation.tolist(), strict=True)
    ]


def test_meshes_stand_in_and_depth_images_take_over(world: RenderWorld) -> None:
    assert shown(world) == [] and not world.is_whole  # no frame waits for a mesh either
    arrive(world, lambda: world.is_whole)
    assert shown(world) == [(BALL, "mesh"), (CONE, "mesh"), (BALL, "mesh")]
    background_of(world).make(CONE)
    arrive(world, lambda: "dpci" in dict(shown(world)).values())
    assert shown(world) == [(BALL, "mesh"), (2, "dpci"), (BALL, "mesh")]
    background_of(world).make(BALL)
    arrive(world, lambda: "mesh" not in dict(shown(world)).values())
    assert shown(world) == [(3, "dpci"), (2, "dpci"), (3, "dpci")]


def test_what_is_nearest_is_asked_for_first(world: RenderWorld) -> None:
    world.take_arrivals(np.zeros(3))
    world.objects()
    assert background_of(world).asked == [CONE, BALL]


def test_a_moved_object_keeps_its_row(world: RenderWorld) -> None:
    background_of(world).make(CONE)
    arrive(world, lambda: world.is_whole)
    drawn = ObjectRows(
        scene=world._scene, library=world._library, store=world._assets, placeholders=world._placeholders
    )
    for which in (np.array([0]), np.array([1]), np.array([0, 2])):
        np.testing.assert_array_equal(world.objects().asset[rows_of(which, world.owners())], drawn.place(which).asset)


@pytest.mark.parametrize(("most", "viewer", "balls"), [(400, 0.0, [2]), (400, -60.0, [0]), (448, 0.0, [0, 2])])
def test_of_crowds_the_nearest_are_drawn_meanwhile(
    world: RenderWorld, monkeypatch: pytest.MonkeyPatch, most: int, viewer: float, balls: list[int]
) -> None:
    """All their meshes would take seconds a frame."""
    monkeypatch.setattr(placeholders, "_MAX_TRIANGLES", most)  # one ball has 224
    arrive(world, lambda: len(shown(world)) == 1 + len(balls), (0.0, 0.0, viewer))
    rows = sorted([1, *balls])
    assert shown(world) == [(CONE if row == 1 else BALL, "mesh") for row in rows]
    np.testing.assert_array_equal(world.objects().position, world.scene_objects.position[rows])
    world.representation = Representation.MESH  # who asks for meshes gets them
    arrive(world, lambda: world.is_whole)
    assert shown(world) == [(BALL, "mesh"), (CONE, "mesh"), (BALL, "mesh")]


def test_frames_that_wait_have_everything(world: RenderWorld) -> None:
    world._assets.background = None
    assert [kind for _, kind in shown(world)] == ["dpci"] * 3 and world.is_whole


def test_a_preview_stands_in_until_depth_images_are_ready(world: RenderWorld, monkeypatch: pytest.MonkeyPatch) -> None:
    """And is replaced where somebody asks for the mesh."""
    whole = world._library.mesh(BALL)
    assert whole is not None
    coarse = shapes.sphere(1.0, columns=8, rows=4)
    previews = {BALL: coarse}
    monkeypatch.setattr(world._library, "preview", previews.get)
    monkeypatch.setattr(world._library, "drawn_mesh", lambda asset: previews.get(asset) or world._library.mesh(asset))
    monkeypatch.setattr(world._library, "forget_preview", lambda asset: previews.pop(asset, None))
    arrive(world, lambda: world.is_whole)
    assert shown(world) == [(BALL, "mesh"), (CONE, "mesh"), (BALL, "mesh")]
    assert world.table().full_triangles == 2 * len(coarse.faces) + len(whole.faces)
    assert len(world.points(BALL)) == len(coarse.positions)
    world.representation = Representation.MESH
    arrive(world, lambda: world.is_whole and world.table().full_triangles == 3 * len(whole.faces))
    assert len(world.points(BALL)) == len(whole.positions) and not previews
    world.representation = None
    background_of(world).make(CONE, BALL)
    arrive(world, lambda: "mesh" not in dict(shown(world)).values())
