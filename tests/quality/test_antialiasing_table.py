"""What anti-aliasing brings: the pixels that count, and the rows."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from depthwalk.gpu.device import Device
from depthwalk.pictures import LinearImage
from depthwalk.quality.antialiasing import GAINS, KINDS, REFERENCE_SAMPLES, examine, truth
from depthwalk.scene.loader import load_scene
from files import write_ply
from shapes import box


def fine(distance: Callable[..., Any]) -> LinearImage:
    """A picture of 6 × 4 pixels with all their samples, grey where something is."""
    columns = np.arange(6 * REFERENCE_SAMPLES) / REFERENCE_SAMPLES
    metres = np.broadcast_to(distance(columns), (4 * REFERENCE_SAMPLES, len(columns))).astype(np.float32)
    colour = np.where(np.isfinite(metres)[..., None], np.float32(0.5), 0) * np.ones(4, np.float32)
    return LinearImage(colour, metres)


def test_edge_pixels_are_those_with_a_jump_and_around() -> None:
    found = truth(fine(lambda x: np.where(x < 2.5, 3.0, np.inf)))
    assert found.edge.all(0).tolist() == [False, True, True, True, False, False]
    assert found.pixels[0, :, 0].tolist() == [188, 188, 137, 0, 0, 0]  # half of it: in linear light
    assert not truth(fine(lambda x: 3 + 0.2 * x)).edge.any()  # a slope is none


@pytest.fixture
def scene_file(tmp_path: Path) -> Path:
    write_ply(tmp_path / "box.ply", box(1, 1, 1))
    camera = "camera: {position: [2, 1.7, 2.9], target: [0, 0.4, 0], fov: 40}\n"
    assets = "assets: {box: {mesh: box.ply, dpci: {resolution: 64, layers: 1}}}\nobjects: [{asset: box}]\n"
    file = tmp_path / "box.yaml"
    file.write_text(f"version: 1\n{assets}{camera}")
    return file


def test_the_rows_of_a_box(
    gl_device: Device, scene_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    said = []
    rows = list(examine([load_scene(scene_file)], (96, 72), lambda name, stage: said.append((name, stage))))
    found = {(row.subject, row.name): row for row in rows}
    gains = [peer for peer in GAINS if peer in [kind.title for kind in KINDS]]
    assert len(found) == len(rows) == 2 * len(KINDS) + 2 * len(gains) + 1
    for representation in ("depth images", "mesh"):
        subject = f"box, {representation}"
        none, fxaa, ours = (found[subject, f"{kind}, dB"] for kind in ("none", "fxaa", "gpaa-edge"))
        assert none.details["× none"] == 1 and min(none.details["ms"], ours.details["ms"]) > 0
        assert none.measured + 1 < fxaa.measured < ours.measured - 3
        assert ours.details["FLIP"] < none.details["FLIP"]
        gain = found[subject, "gpaa-edge over fxaa, dB"]
        assert gain.measured == ours.measured - fxaa.measured and gain.goal == 3 and gain.reached
        assert none.measured + 1 < found[subject, "gpaa-edge, one sample, dB"].measured < ours.measured
    assert found["box, depth images", "silhouettes: gpaa-edge over none, against the mesh, dB"].reached
    ssaa = found["box, mesh", "ssaa, dB"]
    assert ssaa.measured == ssaa.details["against the mesh, dB"] and ssaa.goal is None
    assert [len(row.pictures) for row in rows].count(3) == 2 * len(KINDS)
    assert ("box", "anti-aliasing: gpaa-edge, one sample") in said
