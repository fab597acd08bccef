"""A camera as text, read again as a scene file and as options of the command line."""

import math
import shlex
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from depthwalk.commands.option_values import parse_camera
from depthwalk.scene.arrays import Camera
from depthwalk.scene.camera import view_from_world
from depthwalk.scene.loader import load_scene
from depthwalk.walk.camera_text import camera_options, camera_yaml


@pytest.mark.parametrize("distance", [0.003, 1.0, 250.0])
def test_a_scene_file_reads_the_same_camera(distance: float, tmp_path: Path) -> None:
    file = tmp_path / "scene.yaml"
    look = np.array([0.6, -0.1, -0.7]) / math.sqrt(0.86)
    place = np.array([-1234.56789, 1.7, 0.0])
    camera = Camera(tuple(place.tolist()), tuple((place + distance * look).tolist()), math.radians(47.5))
    file.write_text(f"version: 1\n{camera_yaml(camera)}\n")
    read = load_scene(file).camera
    assert read is not None and read.fov == pytest.approx(camera.fov)
    assert math.dist(read.position, camera.position) < 1e-3
    turned = np.array(view_from_world(read).to_list()) - np.array(view_from_world(camera).to_list())
    assert np.abs(turned[:3, :3]).max() < 2e-4


def test_zero_has_no_sign() -> None:
    text = camera_yaml(Camera((-1e-9, 0.0, 2.0), (0.0, 0.0, 0.0), math.radians(60)))
    assert text == "camera: {position: [0, 0, 2], target: [0, 0, 0], fov: 60}"


def test_options_say_the_same_camera() -> None:
    camera = Camera((1.0, 2.0, 3.0), (-0.5, 0.25, 0.0), math.radians(47.5))
    position, target, angle = shlex.split(camera_options(camera))[1::2]
    assert camera_options(replace(camera, time=2.5)) == f"{camera_options(camera)} --time 2.5"
    read = parse_camera(position, target, float(angle)).apply(Camera((9, 9, 9), (0, 0, 0), 1.0))
    assert (read.position, read.target) == (camera.position, camera.target)
    assert read.fov == pytest.approx(camera.fov)
