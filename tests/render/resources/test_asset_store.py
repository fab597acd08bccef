"""Depth images come to the GPU when they are seen, and go when others need the room."""

import logging
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from depthwalk.assets.library import SceneLibrary
from depthwalk.bake.images import BakedObject
from depthwalk.bake.model import BakedModel
from depthwalk.cook.cook import CookOptions, cook_object
from depthwalk.cook.cooked_file import find_cooked, keep_cooked
from depthwalk.cook.grid_lods import build_grid_lods
from depthwalk.cook.texture_detail import Detail
from depthwalk.errors import InputError
from depthwalk.gpu.device import Device
from depthwalk.render.image import read_pixels
from depthwalk.render.renderer import Renderer
from depthwalk.render.resources.asset_store import AssetStore
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera
from depthwalk.scene.loader import load_scene
from depthwalk.types import Picture
from shapes import ShapeLibrary, bake, box, leaves, sphere

SIZE = 96, 72


@pytest.fixture(scope="module")
def baked() -> list[BakedObject]:
    return [bake(sphere(1 + 0.1 * k, columns=32, rows=16), resolution=32, layers=1) for k in range(4)]


@pytest.fixture
def store(gl_device: Device, baked: Sequence[BakedObject]) -> Iterator[AssetStore]:
    store = AssetStore(gl_device, ShapeLibrary([None] * 4, baked))
    for asset in range(4):
        store.parts.numbers(asset)
    yield store
    store.release()


@contextmanager
def patience() -> Iterator[Callable[[], None]]:
    """Hand out what waits a moment, and fails after many."""
    moments = iter(range(2000))

    def goes_on() -> None:
        assert next(moments, None) is not None, "it never came"
        time.sleep(0.01)

    yield goes_on


def there(store: AssetStore, needed: Sequence[int], seconds: float | None = None) -> list[int]:
    return np.flatnonzero(store.stream(needed, seconds)[4:]).tolist()


def test_what_was_used_last_stays(store: AssetStore) -> None:
    sizes = [store.parts.cooked(number).bytes for number in range(4, 8)]
    store.budget = 3 * max(sizes)
    assert sum(sizes) > store.budget  # three fit
    assert there(store, [4, 5, 6]) == [0, 1, 2]
    assert there(store, [4]) == [0, 1, 2]  # nothing has to go
    before = store.gl.device.live["texture_array"]
    assert there(store, [7]) == [0, 2, 3]
    assert store.gpu_bytes <= store.budget and store.gl.device.live["texture_array"] == before


def test_what_is_needed_stays_over_the_budget_and_that_is_said_once(
    store: AssetStore, caplog: pytest.LogCaptureFixture
) -> None:
    store.budget = store.parts.cooked(4).bytes
    with caplog.at_level(logging.WARNING):
        for _ in range(2):
            assert there(store, [4, 5, 6, 7]) == [0, 1, 2, 3]
    limit = int(store.budget / 1e6)
    assert caplog.messages == [f"the visible assets need more GPU memory than the {limit} MB of render.gpu_memory"]
    assert there(store, [6]) == [2]  # as soon as it is not needed


def test_a_frame_in_a_hurry_brings_one_at_a_time_nearest_first(
    store: AssetStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    clock = iter(range(1000))
    monkeypatch.setattr("depthwalk.render.resources.asset_store.time.perf_counter", lambda: float(next(clock)))
    assert there(store, [6, 4, 5], seconds=1.0) == [2]
    assert there(store, [6, 4, 5], seconds=1.0) == [0, 2]
    assert there(store, [6, 4, 5], seconds=1.0) == [0, 1, 2]


def test_a_picture_beside_the_frames_makes_nothing_give_way(store: AssetStore) -> None:
    sizes = [store.parts.cooked(number).bytes for number in range(4, 8)]
    store.budget = sum(sizes[:2])
    assert there(store, [4]) == [0]
    assert np.flatnonzero(store.stream([5, 6, 7], None, releases=False)[4:]).tolist() == [0, 1]
    assert (not store.is_waiting and there(store, [6]) == [0, 2]) or there(store, [6]) == [1, 2]
    assert store.gpu_bytes <= store.budget


@pytest.fixture
def fine(gl_device: Device, monkeypatch: pytest.MonkeyPatch) -> Iterator[AssetStore]:
    """A store of one ball, of whose texture some may be left out."""
    monkeypatch.setattr("depthwalk.cook.texture_detail.WORTH", 0)
    store = AssetStore(gl_device, ShapeLibrary([None], [bake(sphere(columns=64, rows=32), resolution=64, layers=1)]))
    store.stream(list(store.parts.numbers(0)), None)
    yield store
    store.release()


def fit(store: AssetStore, covered: float, seconds: float | None) -> Detail:
    """What is left of the texture where a pixel covers so many texels."""
    drawn = store.depth_object(1)
    store.textures.fit([1], np.array([covered / drawn.least_texels]), seconds, exact=seconds is None)
    assert drawn.texture is not None
    return drawn.texture.detail


def test_a_texture_has_as_many_texels_as_are_seen(fine: AssetStore) -> None:
    """A frame that waits has neither less nor more, whatever was there before."""
    sizes: dict[Detail, int] = {}
    for covered in (0.5, 2, 8, 0.5):
        detail = fit(fine, covered, None)
        assert sizes.setdefault(detail, fine.gpu_bytes) == fine.gpu_bytes
    assert sizes[Detail.FULL] == fine.parts.cooked(1).bytes
    assert sizes[Detail.FULL] > sizes[Detail.HALF] > sizes[Detail.QUARTER]


def test_a_frame_in_a_hurry_shows_coarser_texels_first(fine: AssetStore) -> None:
    """The finer ones are read beside the frames and come as soon as there is time."""
    before = dict(fine.gl.device.live)
    assert fit(fine, 0.5, -1.0) is Detail.QUARTER  # too late for more, but something is shown
    assert fit(fine, 0.5, 9.0) is Detail.QUARTER
    with patience() as goes_on:
        while fit(fine, 0.5, 9.0) is not Detail.FULL:
            goes_on()
    assert fit(fine, 1.3, 9.0) is Detail.FULL  # a step back changes nothing
    with patience() as goes_on:
        while fit(fine, 8, 9.0) is not Detail.QUARTER:
            goes_on()
    assert fine.gl.device.live["texture"] == before["texture"] + 3
    fine.release()


@pytest.mark.parametrize(("now", "shown"), [([3], [3, 3]), ([1, 2, 3], [1, 2])])
def test_an_asset_replaced_by_one_of_other_parts_ends_no_walk(
    gl_device: Device, baked: Sequence[BakedObject], caplog: pytest.LogCaptureFixture, now: list[int], shown: list[int]
) -> None:
    """Its depth objects keep their numbers, and one that is left without a part shows the last one."""
    library = ShapeLibrary([None], [BakedModel(parts=tuple(baked[:2]))], kept=False)
    store = AssetStore(gl_device, library)
    numbers = store.parts.numbers(0)
    store.release()
    library._baked = [BakedModel(parts=tuple(baked[k] for k in now))]
    with caplog.at_level(logging.WARNING):
        assert [store.parts.cooked(number).outline.cylinder for number in numbers] == [baked[k].cylinder for k in shown]
        assert store.parts.baked(numbers[1]) is baked[shown[1]]
        assert store.stream(numbers, None).all()
    assert [record.message for record in caplog.records] == [
        f"the file of asset 0 was replaced: it has {len(now)} parts now, not 2; reload the scene to show it correctly"
    ]
    store.release()


@pytest.mark.slow
@pytest.mark.parametrize(
    "form", [CookOptions(), CookOptions(stepped=True), CookOptions(stepped=True, paper_cases=True)]
)
def test_what_was_prepared_is_read_as_it_was(
    form: CookOptions, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    ball = bake(sphere(1.0, columns=32, rows=16), resolution=32, layers=1)
    painted = bake(box(1.0, 2.0, 1.0), resolution=32, layers=2)
    made = tuple(cook_object(part, form) for part in (ball, painted))
    assert find_cooked("0", form) is None
    keep_cooked("0", form, made)
    found = find_cooked("0", form)
    assert found is not None
    assert find_cooked("0", CookOptions(not form.stepped)) is None
    for before, after in zip(made, found, strict=True):
        old, new = before.outline, after.outline
        assert (old.cylinder, old.steps, old.key, old.rotation) == (new.cylinder, new.steps, new.key, new.rotation)
        assert [(i.face, i.layer, i.depth.shape) for i in old.images] == [
            (i.face, i.layer, i.depth.shape) for i in new.images
        ]
        assert before.bytes == after.bytes
        np.testing.assert_array_equal(before.count, after.count)
        for one, other in zip(before.load(), after.load(), strict=True):
            for name, value in vars(one).items():
                np.testing.assert_array_equal(value, getattr(other, name), err_msg=name)
    next(tmp_path.rglob("*.npz")).write_bytes(b"PK\x03\x04")
    assert find_cooked("0", form) is None


@pytest.mark.slow
def test_of_small_images_only_foliage_is_simplified() -> None:
    """Images that take longer to simplify than they are worth, and such as are all borders."""
    solid, dense = (bake(mesh, 32) for mesh in (box(1.0, 2.0, 1.0), leaves(200, 0.1)))
    for baked, share in (solid, 1.0), (dense, 0.4):
        grids = build_grid_lods(baked)
        assert len(cook_object(baked, CookOptions()).load()[0].drawn(0)) <= share * len(grids.drawn(0))
        assert (cook_object(baked, CookOptions(stepped=True)).count == grids.count).all()
    assert (cook_object(solid, CookOptions()).count == build_grid_lods(solid).count).all()


def test_a_small_budget_changes_no_picture(
    gl_device: Device, tiny_scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Assets left and right; the second time around from the cache alone, which vanishes in between."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    assets = ", ".join(f"b{k}: {{mesh: ball.ply, height: {k}, dpci: {{resolution: 32}}}}" for k in (1, 2))
    tiny_scene.write_text(
        f"version: 1\nassets: {{{assets}}}\nobjects:\n  - {{asset: b1, position: [-9, 0, 0], representation: dpci}}\n"
        "  - {asset: b2, position: [9, 0, 0], representation: dpci}\n"
    )
    scene = load_scene(tiny_scene)
    views = [View(Camera((0, 1, 0), (x, 1, 0), 1.0), SIZE) for x in (-1, 1)]

    def pictures() -> Iterator[tuple[Picture, float]]:
        scope = gl_device.scope("test")
        screen = scope.framebuffer([scope.texture(SIZE, 4)])
        renderer = Renderer(gl_device, scene, SceneLibrary(scene.assets))
        for view in views * 2:
            renderer.render(view, screen)
            assert renderer.plan is not None
            yield read_pixels(screen).copy(), renderer.plan.counts["assets"]
        renderer.release()
        scope.release()

    whole = list(pictures())
    assert [count for _, count in whole] == [1, 2, 2, 2]
    scene.render.gpu_memory = 1000
    few = []
    for picture in pictures():
        few.append(picture)
        if len(few) == 2:
            for path in (tmp_path / "cache").rglob("*.npz"):
                path.unlink()
    assert [count for _, count in few] == [1, 1, 1, 1]
    # A tile that lies elsewhere in the atlas rounds otherwise.
    for (one, _), (other, _) in zip(whole, few, strict=True):
        differ = np.abs(one.astype(int) - other)
        assert differ.max() <= 4 and (differ > 0).mean() < 0.01
    assert not np.array_equal(whole[0][0], whole[1][0])


@pytest.mark.parametrize(
    ("text", "expected"), [("2 GiB", 2 << 30), ("1.5GB", 1_500_000_000), ("500 kB", 500_000), ("7", 7)]
)
def test_sizes_are_written_with_units(tiny_scene: Path, text: str, expected: int) -> None:
    assert load_scene(tiny_scene, overrides={"render.gpu_memory": text}).render.gpu_memory == expected


@pytest.mark.parametrize("text", ["-1", "much", "1.5", "99999 TiB"])
def test_other_sizes_are_refused(tiny_scene: Path, text: str) -> None:
    with pytest.raises(InputError, match=r"^--set render\.gpu_memory: must be") as error:
        load_scene(tiny_scene, overrides={"render.gpu_memory": text})
    assert "\n" not in str(error.value)
