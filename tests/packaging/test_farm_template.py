"""The template for render farms runs the program with options that it has, for frames that it takes."""

import os
import re
import subprocess
from pathlib import Path

import pytest
import yaml

from depthwalk.commands import render

TEMPLATE = Path(__file__).parents[2] / "examples" / "farm" / "render.yaml"


@pytest.mark.skipif(os.name == "nt", reason="the template is for bash")
@pytest.mark.parametrize(("frames", "taken"), [("3-9", "3-9"), ("4", "4-4")])
def test_the_script_renders_the_frames_of_its_task(tmp_path: Path, frames: str, taken: str) -> None:
    template = yaml.safe_load(TEMPLATE.read_text())
    script = template["steps"][0]["script"]["embeddedFiles"][0]["data"]
    values = {"Task.Param.Frame": frames} | {
        f"Param.{each['name']}": each["name"] for each in template["parameterDefinitions"]
    }
    filled = re.sub(r"\{\{([\w.]+)\}\}", lambda match: values[match[1]], script)
    program = tmp_path / "depthwalk"
    program.write_text('#!/bin/sh\nprintf "%s\\n" "$@"\n')
    program.chmod(0o755)
    path = {"PATH": f"{tmp_path}{os.pathsep}{os.environ['PATH']}"}
    said = subprocess.run(
        ["bash", "-c", filled], env=os.environ | path, capture_output=True, text=True, check=True
    ).stdout
    arguments = said.splitlines()
    assert arguments[:2] == ["render", "Scene"] and arguments[arguments.index("--frames") + 1] == taken
    assert "OutputFolder/frame-{frame:6}.png" in arguments
    source = Path(render.__file__).read_text()
    known = set(re.findall(r'"(--[a-z-]+)"', source)) | {"--path", "--resolution"}  # of options.py
    assert {option for option in arguments if option.startswith("--")} <= known
