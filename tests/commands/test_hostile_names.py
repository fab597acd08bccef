"""What files are called and what they hold is shown as text, and what is no file is not waited for."""

import json
import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

FORGED = "KHR\x1b]0;mine\x07\nscene.yaml: ok"


def test_an_extension_forges_no_line(run: Callable[..., Any], tmp_path: Path) -> None:
    path = tmp_path / "a.gltf"
    path.write_text(json.dumps({"asset": {"version": "2.0"}, "extensionsRequired": [FORGED]}))
    done = run("check", path)
    shown = r"KHR\x1b]0;mine\x07\nscene.yaml: ok"
    assert (done.exit_code, done.stdout) == (2, "")
    assert done.stderr == f"{path}: the required glTF extension {shown} is not supported\n"


@pytest.mark.skipif(sys.platform == "win32", reason="no such names")
def test_names_of_files_forge_no_line(run: Callable[..., Any], tiny_scene: Path) -> None:
    forged = tiny_scene.rename(tiny_scene.with_name("a\x1b[2J\nb.yaml: ok.yaml"))
    shown = f"{forged.parent}/a\\x1b[2J\\nb.yaml: ok.yaml"
    assert run("check", forged).stdout == f"{shown}: ok, 1 object, 1 asset\n"
    assert run("info", forged).stdout.splitlines()[0] == f"file                     {shown}"
    forged.write_text("version: 1\nversion: 1\n")
    done = run("check", forged)
    assert (done.exit_code, done.stderr) == (2, f"{shown}:2:1: version: duplicate key; it is in line 1 too\n")


@pytest.mark.skipif(sys.platform == "win32", reason="no such names")
def test_names_in_warnings_forge_no_line(run: Callable[..., Any], tmp_path: Path) -> None:
    folder = tmp_path / "a\x1b[1m\nb"
    folder.mkdir()
    (folder / "a.mtl").write_text("newmtl m\nmap_Kd gone.png\n")
    (folder / "a.obj").write_text("mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl m\nf 1 2 3\n")
    done = run("info", folder / "a.obj")
    assert done.exit_code == 0
    assert done.stderr == f"{tmp_path}/a\\x1b[1m\\nb/a.obj: 'gone.png' is missing or outside the folder; ignored\n"


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes")
@pytest.mark.parametrize("name", ["a.yaml", "a.obj", "a.npz", "a.dpci.exr", "a.dpci.npz"])
def test_a_named_pipe_is_not_waited_for(run: Callable[..., Any], tmp_path: Path, name: str) -> None:
    os.mkfifo(tmp_path / name)
    for command in ("check", "info"):
        done = run(command, tmp_path / name)
        assert (done.exit_code, done.stderr) == (2, f"{tmp_path / name}: not a file\n")
