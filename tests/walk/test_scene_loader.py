"""What a window loads for a scene, and what it shows where that cannot be had."""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any, cast

import pytest

from depthwalk.errors import InputError
from depthwalk.gpu.device import Device
from depthwalk.render.renderer import Renderer
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera, Representation
from depthwalk.walk.loading import LoadingScreen, StoppedError
from depthwalk.walk.scene_loader import SceneLoader
from depthwalk.walk.window import Window
from walks import FakeWindow, loading


def renderer_of(table: Callable[[], None], aa: str = "none") -> Renderer:
    """One whose assets are loaded by `table`."""
    world = SimpleNamespace(representation=None, table=table)
    return cast(Renderer, SimpleNamespace(world=world, settings=SimpleNamespace(aa=aa)))


def loader_of(window: FakeWindow | None, screen: LoadingScreen, device: SimpleNamespace | None = None) -> SceneLoader:
    return SceneLoader(cast(Device, device), cast(Window, window), screen)


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
    assert told == ["Loading was stopped"] and not screen.busy


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


def test_who_closes_the_window_ends_what_is_loaded() -> None:
    window, _, screen = loading([])
    window.is_closing = True
    with pytest.raises(StoppedError):
        loader_of(window, screen).load_missing(renderer_of(lambda: screen.report("bust", "side")), print)


def test_samples_that_the_machine_lacks_are_told_and_none_are_used() -> None:
    window, _, screen = loading([])
    told: list[str] = []
    renderer = renderer_of(lambda: None, aa="msaa")
    device = SimpleNamespace(max_samples=1, renderer="driver")
    loader_of(window, screen, device).load_missing(renderer, told.append)
    assert renderer.settings.aa == "none" and "driver offers 1" in told[0]


def test_time_spent_on_loading_is_counted_while_the_screen_is_shown() -> None:
    window, _, screen = loading([])
    loader = loader_of(window, screen)
    with loader.clock_stopped():
        screen.report("bust", "reading")
        assert screen.busy
    assert loader.seconds > 0 and not screen.busy
    before = loader.seconds
    with loader.clock_stopped():
        pass
    assert loader.seconds > before


def test_time_counts_as_loading_also_where_it_fails() -> None:
    """And the loading screen goes, so that the walk's next frames are not reported to it."""
    ended = []
    loader = loader_of(None, cast(LoadingScreen, SimpleNamespace(end=lambda: ended.append(True))))
    with pytest.raises(StoppedError), loader.clock_stopped():
        raise StoppedError
    assert ended and loader.seconds > 0


@pytest.mark.parametrize(("searching", "reading"), [(True, False), (False, True), (False, False)])
def test_nothing_is_baked_while_there_is_something_else_to_wait_for(searching: bool, reading: bool) -> None:
    """Baking would take the cores from what the first picture needs, unless it needs what is baked."""
    window, _, screen = loading([])
    waited: list[bool] = []

    def take_arrivals(viewer: object) -> None:
        waited.append(library.baking_waits)
        world.is_whole = len(waited) == 2

    world = SimpleNamespace(is_whole=False, take_arrivals=take_arrivals, objects=lambda: [0])
    meshes = SimpleNamespace(reader=SimpleNamespace(failures=[], is_reading=reading))
    renderer = SimpleNamespace(world=world, assets=SimpleNamespace(meshes=meshes))
    library = SimpleNamespace(failures=[], is_searching=searching, baking_waits=True)
    loader_of(window, screen)._wait(cast(Any, renderer), cast(Any, library), cast(Any, SimpleNamespace(camera=None)))
    assert waited == [True, searching or reading]


@pytest.mark.parametrize(("shown", "rehearsals"), [(0, 1), (1, 0)])
def test_shaders_are_compiled_while_no_object_is_there(shown: int, rehearsals: int) -> None:
    """Once, by a frame that nobody sees; not where objects would make it a frame of work."""
    window, _, screen = loading([])
    polls: list[object] = []
    rehearsed: list[View] = []

    def take_arrivals(viewer: object) -> None:
        polls.append(viewer)
        world.is_whole = len(polls) == 3

    world = SimpleNamespace(is_whole=False, take_arrivals=take_arrivals, objects=lambda: [0] * shown)
    renderer = SimpleNamespace(
        world=world,
        settings=SimpleNamespace(aa="none"),
        assets=SimpleNamespace(meshes=SimpleNamespace(reader=SimpleNamespace(failures=[], is_reading=True))),
        frame_all=lambda aspect: Camera((0.0, 0.0, 1.0), (0.0, 0.0, 0.0), 1.0),
        rehearse=lambda view, screen: rehearsed.append(view),
    )
    library = SimpleNamespace(failures=[], is_searching=True, baking_waits=True)
    loader_of(window, screen)._wait(cast(Any, renderer), cast(Any, library), cast(Any, SimpleNamespace(camera=None)))
    assert len(rehearsed) == rehearsals and library.baking_waits
