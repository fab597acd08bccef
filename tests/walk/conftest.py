"""What tests of widgets share."""

from collections.abc import Iterator

import pytest
from imgui_bundle import imgui
from imgui_bundle._imgui_bundle.imgui import IO

from depthwalk.walk.overlay import set_up_look


@pytest.fixture
def overlay_io() -> Iterator[IO]:
    """imgui with the walk's font and style, without anything that draws."""
    context = imgui.create_context()
    io = imgui.get_io()
    io.set_ini_filename("")
    io.backend_flags |= imgui.BackendFlags_.renderer_has_textures
    set_up_look(io)
    yield io
    imgui.destroy_context(context)
