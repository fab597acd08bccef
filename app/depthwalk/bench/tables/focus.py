"""Measure what depth of field adds to a frame, at the paper's resolution (depth-of-field paper of 2008, §4: 70 fps)."""

from contextlib import ExitStack
from typing import Any

from depthwalk.assets.library import SceneLibrary
from depthwalk.assets.mesh_library import Report
from depthwalk.bench.measure import measure
from depthwalk.bench.ratio import paired_ratio
from depthwalk.bench.tables.table import Table
from depthwalk.render import kernels
from depthwalk.render.headless import HeadlessRenderer
from depthwalk.resources import scene_root
from depthwalk.scene.loader import load_scene

SIZE = 1280, 1024
FRAMES, WARMUP = 24, 4
MODES: tuple[Any, ...] = ("none", "paper", "gather")


def measured(report: Report) -> Table:
    """Measure the table; `report` is called with the name of a mode and the stage that begins."""
    kernels.load()
    file = scene_root() / "paper" / "focus.yaml"
    with ExitStack() as opened:
        drawn = {}
        for mode in MODES:
            report(mode, "depth of field")
            scene = load_scene(file, overrides={"render.dof.mode": mode})
            library = SceneLibrary(scene.assets, report)
            drawn[mode] = opened.enter_context(HeadlessRenderer(scene, library, SIZE))
        camera = scene.camera
        assert camera is not None  # the scene has one
        runs = measure(drawn, [camera] * FRAMES, WARMUP, lambda: None)
    bare = runs[0].frame_times
    return Table(
        name="focus",
        title="Depth of field: what it adds to a frame",
        source="The depth-of-field paper of 2008, §4: 70 frames a second at 1280 × 1024, on a GeForce 7600 GT",
        columns=("mode", "frame, ms", "÷ frame without"),
        rows=tuple((run.representation, run.frame_ms.p50, paired_ratio(run.frame_times, bare)) for run in runs),
        notes=(
            f"scenes/paper/focus.yaml, {SIZE[0]} × {SIZE[1]}; modes alternate, and every frame is drawn from scratch.",
        ),
    )
