"""What a window loads for a scene, and what it shows where that cannot be had."""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any, cast

import pytest

from depthwalk.errors import InputError
from depthwalk.gpu.device import Device
from depthwalk.render.renderer import Renderer
from depthwalk.scene.arrays import Representation
from depthwalk.walk.clock import WalkClock
from depthwalk.walk.loading import LoadingScreen, StoppedError
from depthwalk.walk.scene_loader import SceneLoader
from depthwalk.walk.window import Window
from walks import FakeWindow, loading


def renderer_of(table: Callable[[], None], aa: str = "none") -> Renderer:
    """One whose assets are loaded by `table`."""
    world = SimpleNamespace(representation=None, table=table)
    return cast(Renderer, SimpleNamespace(world=world, settings=SimpleNamespace(aa=aa)))


def loader_of(
    window: FakeWindow | None,
    screen: LoadingScreen,
    device: SimpleNamespace | None = None,
    clock: WalkClock | None = None,
) -> SceneLoader:
    return SceneLoader(cast(Device, device), cast(Window, window), screen, clock or WalkClock())


def test_a_stopped_bake_leads_back_to_what_was_shown() -> None:
    """However impatient its user is, a window that showed meshes shows them again, and stays open."""
    window, _, screen = loading([])
    baked: list[str] = []
    told: list[str] = []

    def table() -> None:
        if world.representation is None:
            baked.append("bust")
            screen.report("bust", "side")
            screen.stop()
            screen.report("bust", "caps")

    renderer = renderer_of(table)
    world = renderer.world
    loader = loader_of(window, screen)
    loader._usable = Representation.MESH
    loader.load_missing(renderer, told.append)
    assert world.representation is Representation.MESH and baked == ["bust"]
    assert told == ["Stopped loading"] and not screen.busy


def test_what_cannot_be_loaded_is_told_and_what_was_shown_stays() -> None:
    window, _, screen = loading([])
    told: list[str] = []

    def table() -> None:
        if renderer.world.representation is Representation.DPCI:
            raise InputError("bust.ply: no such file")

    renderer = renderer_of(table)
    loader = loader_of(window, screen)
    for wanted, shown in ((Representation.MESH,) * 2, (Representation.DPCI, Representation.MESH)):
        renderer.world.representation = wanted
        loader.load_missing(renderer, told.append)
        assert renderer.world.representation is shown
    assert told == ["bust.ply: no such file"]


def test_what_cannot_be_read_is_told_once_though_several_needed_it() -> None:
    """Its mesh in place of depth images, and whoever bakes these."""
    window, _, screen = loading([])
    reader = SimpleNamespace(failures=["a.obj:3: broken", "b.obj: gone"])
    world = SimpleNamespace(is_whole=False, take_arrivals=lambda viewer: None)
    renderer = SimpleNamespace(world=world, assets=SimpleNamespace(meshes=SimpleNamespace(reader=reader)))
    library, scene = SimpleNamespace(failures=["a.obj:3: broken"]), SimpleNamespace(camera=None)
    with pytest.raises(InputError) as caught:
        loader_of(window, screen)._wait(cast(Any, renderer), cast(Any, library), cast(Any, scene))
    assert caught.value.lines == ("a.obj:3: broken", "b.obj: gone")


def test_who_closes_the_window_ends_what_is_loaded() -> None:
    window, _, screen = loading([])
    window.is_closing = True
    with pytest.raises(StoppedError):
        loader_of(window, screen).load_missing(renderer_of(lambda: screen.report("bust", "side")), print)


def test_samples_that_the_machine_lacks_are_told() -> None:
    window, _, screen = loading([])
    told: list[str] = []
    renderer = renderer_of(lambda: None, aa="msaa")
    device = SimpleNamespace(max_samples=1, renderer="driver")
    assert not loader_of(window, screen, device).load_missing(renderer, told.append)
    assert "driver offers 1" in told[0]
    renderer.settings.aa = "ssaa"
    assert loader_of(window, screen, device).load_missing(renderer, told.append) and len(told) == 1


def test_time_spent_on_loading_is_left_out_while_the_screen_is_shown() -> None:
    window, _, screen = loading([])
    clock = WalkClock()
    loader = loader_of(window, screen, clock=clock)
    with loader.clock_stopped():
        screen.report("bust", "reading")
        assert screen.busy
    assert clock.left_out > 0 and not screen.busy
    before = clock.left_out
    with loader.clock_stopped():
        pass
    assert clock.left_out > before


def test_time_is_left_out_also_where_loading_fails() -> None:
    """And the loading screen goes, so that the walk's next frames are not reported to it."""
    ended, clock = [], WalkClock()
    loader = loader_of(None, cast(LoadingScreen, SimpleNamespace(end=lambda: ended.append(True))), clock=clock)
    with pytest.raises(StoppedError), loader.clock_stopped():
        raise StoppedError
    assert ended and clock.left_out > 0
