"""Reproduce table 2 of the paper: a planar depth image against other ways to draw it (Liu, Liu and Wu 2007, §4).

The relief is that of figure 1, 512² texels and a metre wide; the picture has the paper's 1024 × 768 pixels. Nothing is
reused from frame to frame, so each impostor is re-warped, as in the paper. The rivals are those of docs/rivals.md.
"""

import math
from collections.abc import Iterator
from contextlib import ExitStack

import numpy as np

from depthwalk.assets.library import SceneLibrary
from depthwalk.assets.mesh_library import Report
from depthwalk.bench.equal import SUPERSAMPLING, supersampled
from depthwalk.bench.measure import Run, measure
from depthwalk.bench.ratio import paired_ratio
from depthwalk.bench.tables.table import Cell, Table
from depthwalk.bench.tables.walks import FOV, compared
from depthwalk.render import kernels
from depthwalk.render.headless import HeadlessRenderer
from depthwalk.resources import scene_root
from depthwalk.scene.arrays import HEIGHT_FIELDS, Camera, Representation
from depthwalk.scene.loader import load_scene

SIZE = 1024, 768
VIEWS = {"in front": 8.0, "aside": 40.0, "flat": 65.0}  # degrees from the picture's axis
AWAY = 1.2  # metres from the middle of the relief
SWAY = 0.4  # degrees from frame to frame
FRAMES, WARMUP = 32, 3
KINDS = (Representation.DPCI, Representation.DMESH, *HEIGHT_FIELDS)
# Times as long as the warp: 68.14 frames a second ÷ theirs; of bar textures the text of §4 says about 2.
PAPER = {"relief": 11.6, "distance": 3.7, "dmesh": 3.9, "bar-texture": 2.0}
_MIDDLE = np.array([0.0, 0.5, -0.1])  # of the relief, metres, world


def measured(report: Report) -> Table:
    """Measure the table.

    Parameters
    ----------
    report
        Called with the name of a view and the stage that begins.

    Returns
    -------
    Table
        A row for each view and way.

    Raises
    ------
    GpuError
        If no OpenGL 3.3 context can be created.
    """
    kernels.load()
    return Table(
        name="planar",
        title="Table 2: a planar depth image against its rivals",
        source="Liu, Liu and Wu 2007, table 2: 68 frames a second, 11.6 × relief mapping, 3.7 × distance, 3.9 × dmesh, "
        "and §4: some 2 × bar textures",
        columns=("view", "way", "passes, ms", "÷ dpci", "frame, ms", "frame ÷ dpci's", "paper", "PSNR, FLIP"),
        rows=tuple(_rows(report)),
        notes=(
            "passes: the time of the passes that find the surface, median over the frames in which passes are timed; "
            "the other passes look up colours and add light, and are the same for all.",
            "frame ÷ dpci's: medians over the frames, with the bounds of 95 % confidence in brackets; all ways "
            "alternate frame by frame.",
            "PSNR and FLIP: compared with the displaced surface at 16 samples per pixel, where either shows "
            "it. bump and parallax show no silhouettes.",
        ),
    )


def _rows(report: Report) -> Iterator[tuple[Cell, ...]]:
    with ExitStack() as opened:
        scene = load_scene(scene_root() / "paper" / "figure-01-relief.yaml", overrides={"render.preset": "default"})
        library = SceneLibrary(scene.assets, report)

        def open_way(kind: Representation, scale: int = 1) -> HeadlessRenderer:
            headless = HeadlessRenderer(scene, library, (SIZE[0] * scale, SIZE[1] * scale), kind)
            return opened.enter_context(headless)

        drawn = {kind.label: open_way(kind) for kind in KINDS}
        true = open_way(Representation.DISPLACEMENT, SUPERSAMPLING)
        for view, degrees in VIEWS.items():
            report(view, f"{degrees:.0f}° aside")
            cameras = [_camera(degrees + SWAY * (number % 8)) for number in range(FRAMES)]
            runs = {run.representation: run for run in measure(drawn, cameras, WARMUP, lambda: None)}
            camera = _camera(degrees)
            (reference,) = supersampled(true, [camera])
            own = _passes(runs["dpci"])
            for name, headless in drawn.items():
                run = runs[name]
                yield (
                    *(view, name, _passes(run), _passes(run) / own, run.frame_ms.p50),
                    paired_ratio(run.frame_times, runs["dpci"].frame_times),
                    PAPER.get(name),
                    str(compared(headless, reference, camera)),
                )


def _passes(run: Run) -> float:
    """Return the time of the passes that find the surface, milliseconds."""
    names = ("warp", "composite") if run.representation == "dpci" else (run.representation.replace("-", "_"),)
    return sum(run.passes_ms[name].p50 for name in names)


def _camera(degrees: float) -> Camera:
    """Return the camera that looks at the relief's centre from `degrees` to its side."""
    turn = math.radians(degrees)
    place = _MIDDLE + AWAY * np.array([math.sin(turn), 0.12, math.cos(turn)])
    return Camera(tuple(place.tolist()), tuple(_MIDDLE.tolist()), FOV)
