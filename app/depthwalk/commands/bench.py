"""`depthwalk bench`: what a scene costs, per frame and per pass."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import depthwalk
from depthwalk.bench.measure import Report, Run, measure, sample_path
from depthwalk.bench.report import to_html, to_json, to_text
from depthwalk.commands.console import frame_progress
from depthwalk.commands.options import CameraOptions, RepresentationName, representation
from depthwalk.commands.render import input_files, open_headless
from depthwalk.errors import InputError
from depthwalk.files import check_folder, write_bytes
from depthwalk.provenance import commit
from depthwalk.scene.path import CameraPath
from depthwalk.scene.scene import Scene

DEFAULT_FRAMES = 60  # of a camera that stands still


@dataclass(frozen=True)
class Plan:
    """What to measure. frames: None takes every frame of the path; size: (width, height), pixels."""

    scene: Scene
    path_name: Path | None
    path: CameraPath | None
    camera: CameraOptions
    frames: int | None
    warmup: int
    size: tuple[int, int]
    representations: Sequence[RepresentationName]


def parse_representations(texts: Sequence[str] | None) -> list[RepresentationName]:
    """Names from repeated options and comma lists, each once. Raises InputError."""
    names = [name.strip() for text in texts or ["scene"] for name in text.split(",")]
    unknown = [name for name in names if name not in set(RepresentationName)]
    if unknown:
        raise InputError(f"--representation {unknown[0]}: must be one of {', '.join(RepresentationName)}")
    return [RepresentationName(name) for name in dict.fromkeys(names)]


def check_report_files(files: Sequence[Path | None], plan: Plan) -> None:
    """Makes sure that the reports can be written. Raises InputError."""
    taken = {file.resolve() for file in input_files(plan.scene, plan.path_name)}
    for file in files:
        if file is not None:
            check_folder(file)
            if file.resolve() in taken:
                raise InputError(f"{file}: would overwrite what is measured, or the other report")
            taken.add(file.resolve())


def run_bench(plan: Plan, json_file: Path | None, html_file: Path | None) -> None:
    """Measures each representation, writes the files asked for and prints a table."""
    runs: list[Run] = []
    for name in plan.representations:
        with open_headless(plan.scene, plan.size, representation(name)) as headless:
            headless.renderer.remembers = True
            if plan.path is not None:
                cameras = sample_path(plan.path, plan.frames)
            else:
                still = plan.camera.apply(plan.scene.camera or headless.frame_all())
                cameras = [still] * (plan.frames or DEFAULT_FRAMES)
            with frame_progress(name, len(cameras)) as advance:
                runs.append(measure(headless, name, cameras, plan.warmup, advance))
            renderer, timer = headless.device.renderer, headless.renderer.timers.kind
    path_name = None if plan.path_name is None else str(plan.path_name)
    report = Report(
        version=depthwalk.__version__,
        commit=commit(),
        renderer=renderer,
        timer=timer,
        resolution=plan.size,
        scene=str(plan.scene.path),
        path=path_name,
        runs=tuple(runs),
    )
    if json_file is not None:
        write_bytes(json_file, to_json(report).encode())
    if html_file is not None:
        write_bytes(html_file, to_html(report).encode())
    print(to_text(report))
