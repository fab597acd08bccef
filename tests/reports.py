"""Make benchmark reports of given frame times."""

from collections.abc import Mapping, Sequence

from depthwalk.bench import measure as bench
from depthwalk.bench.slow_frames import slowest_frames
from depthwalk.provenance import machine


def report_of(times: Mapping[str, Sequence[float]], scene: str = "scene.yaml") -> bench.Report:
    """Return a report of runs with these frame times."""
    runs = [
        bench.Run(
            representation=name,
            frames=len(spent),
            frame_ms=bench.spread(spent),
            passes_ms={"<warp>": bench.spread(spent)},
            counts={"<objects>": 1},
            slowest=slowest_frames(spent, {}, range(len(spent))),
            frame_times=tuple(spent),
        )
        for name, spent in times.items()
    ]
    return bench.Report(
        version="0",
        commit=None,
        date="2026-01-01T00:00:00+00:00",
        machine=machine(),
        renderer="<gl>",
        driver="4.5",
        timer="gpu",
        planning="numpy",
        resolution=(8, 8),
        scene=scene,
        path=None,
        stride=None,
        runs=tuple(runs),
    )
