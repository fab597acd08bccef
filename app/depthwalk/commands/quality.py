"""`depthwalk quality`: what anti-aliasing, depth of field and shadows come to, against pictures that took longer."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import depthwalk
from depthwalk.assets.library import Report
from depthwalk.commands.console import asset_progress
from depthwalk.commands.render import input_files
from depthwalk.errors import InputError
from depthwalk.files import check_folder, write_bytes
from depthwalk.gpu.device import headless_device
from depthwalk.provenance import commit
from depthwalk.quality import antialiasing, dof, edges, shadows
from depthwalk.quality.overview import Overview, to_html, to_json, to_text
from depthwalk.quality.rows import Row
from depthwalk.resources import scene_root
from depthwalk.scene.scene import Scene

SHIPPED = "room.yaml", "garden.yaml"
SMALLEST = 64  # pixels, each side of a picture
LARGEST = 1024  # likewise: a truth is `antialiasing.REFERENCE_SAMPLES` times as wide

Examine = Callable[[Sequence[Scene], tuple[int, int], Report], Iterator[Row]]
PARTS: dict[str, Examine] = {
    "antialiasing": antialiasing.examine,
    "dof": dof.examine,
    "shadows": shadows.examine,
    "edges": edges.examine,
}


@dataclass(frozen=True)
class Plan:
    """What to examine. parts: names of `PARTS`; size: (width, height) of the pictures, pixels."""

    scenes: Sequence[Scene]
    parts: Sequence[str]
    size: tuple[int, int]


def shipped_scenes() -> list[Path]:
    """What is examined where no scene is named."""
    return [scene_root() / name for name in SHIPPED]


def parse_parts(text: str | None) -> list[str]:
    """The parts that are named, each once, in the order of `PARTS`; all of them for None. Raises InputError."""
    names = list(PARTS) if text is None else [name.strip() for name in text.split(",")]
    unknown = [name for name in names if name not in PARTS]
    if unknown:
        raise InputError(f"--only {unknown[0]}: must be one of {', '.join(PARTS)}")
    return [name for name in PARTS if name in names]


def check_plan(plan: Plan, files: Sequence[Path | None]) -> None:
    """Makes sure that the pictures can be drawn and the reports written. Raises InputError."""
    if not SMALLEST <= min(plan.size) <= max(plan.size) <= LARGEST:
        width, height = plan.size
        raise InputError(f"--resolution {width},{height}: each side must be {SMALLEST} to {LARGEST} pixels")
    taken = {file.resolve() for scene in plan.scenes for file in input_files(scene, None)}
    for file in files:
        if file is not None:
            check_folder(file)
            if file.resolve() in taken:
                raise InputError(f"{file}: would overwrite what is examined, or the other report")
            taken.add(file.resolve())


def run_quality(plan: Plan, json_file: Path | None, html_file: Path | None) -> None:
    """Examines the parts one after the other, prints the table and writes the files asked for.

    Raises InputError, and GpuError without OpenGL.
    """
    device = headless_device()
    renderer = device.renderer
    device.context.release()
    with asset_progress() as report:
        parts = {name: list(PARTS[name](list(map(_private, plan.scenes)), plan.size, report)) for name in plan.parts}
    overview = Overview(
        version=depthwalk.__version__, commit=commit(), renderer=renderer, image_size=plan.size, parts=parts
    )
    if json_file is not None:
        write_bytes(json_file, to_json(overview).encode())
    if html_file is not None:
        write_bytes(html_file, to_html(overview).encode())
    print(to_text(overview))


def _private(scene: Scene) -> Scene:
    """The scene with settings of its own, which a part may change."""
    return replace(scene, render=scene.render.model_copy(deep=True))
