"""What tests of widgets share, and tests in a real window."""

import contextlib
import os
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import trimesh
from imgui_bundle import imgui
from imgui_bundle._imgui_bundle.imgui import IO

from depthwalk.gpu.device import Device
from depthwalk.walk.overlay import set_up_look
from shown_windows import Window
from window_program import SCENE, Program, Start, User

missing = [tool for tool in ("Xvfb", "xdotool") if shutil.which(tool) is None]


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


@pytest.fixture
def small_surround(monkeypatch: pytest.MonkeyPatch) -> None:
    """A map of the surroundings that is as small beside pictures of tests as in use, which saves time."""
    monkeypatch.setattr("depthwalk.render.reprojection.surround.SURROUND_SIZE", 256)
    monkeypatch.setattr("depthwalk.render.reprojection.surround.SURROUND_VIEW_SIZE", 48)


@pytest.fixture
def sliced(gl_device: Device, small_surround: None) -> Iterator[Window]:
    with Window(gl_device, "on") as window:
        yield window


@pytest.fixture
def display(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """A virtual X server, which `DISPLAY` names; it stays when a client leaves, whom another may follow."""
    if missing:
        pytest.skip(f"not installed: {', '.join(missing)}")
    read, write = os.pipe()
    arguments = ["Xvfb", "-displayfd", str(write), "-noreset", "-screen", "0", "800x600x24"]
    with subprocess.Popen(arguments, pass_fds=[write], stderr=subprocess.PIPE, text=True) as server:
        os.close(write)
        try:
            with os.fdopen(read) as pipe:
                number = pipe.readline().strip()  # written once clients may connect; empty where the server ended
            if not number:
                raise RuntimeError(f"Xvfb: {server.communicate(timeout=10)[1]}")
            monkeypatch.setenv("DISPLAY", f":{number}")
            monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
            yield
        finally:
            server.terminate()


@pytest.fixture
def scene_file(tmp_path: Path) -> Path:
    ball, crate = trimesh.creation.icosphere(4, 0.8), trimesh.creation.box((1.0, 1.2, 1.0))
    for name, mesh, colour in (("ball", ball, (210, 80, 50, 255)), ("crate", crate, (60, 110, 190, 255))):
        mesh.visual.vertex_colors = np.tile(np.array(colour, np.uint8), (len(mesh.vertices), 1))
        mesh.export(tmp_path / f"{name}.ply")
    path = tmp_path / "scene.yaml"
    path.write_text(SCENE)
    return path


@pytest.fixture
def start(display: None, scene_file: Path, tmp_path: Path) -> Iterator[Start]:
    """start(samples): the walk through `scene_file`, with its user, ended with the test."""
    with contextlib.ExitStack() as stack:
        yield lambda samples=4, compiled=False: User(
            stack.enter_context(Program(scene_file, tmp_path, samples, compiled))
        )
