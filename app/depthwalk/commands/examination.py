"""Run the parts of `depthwalk quality` one after the other: anti-aliasing, depth of field, shadows and edges."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import depthwalk
from depthwalk.assets.library import Report
from depthwalk.commands.progress import asset_progress
from depthwalk.errors import InputError
from depthwalk.gpu.device import headless_device
from depthwalk.provenance import commit
from depthwalk.quality import antialiasing, dof, edges, shadows
from depthwalk.quality.overview import Overview
from depthwalk.quality.rows import Row
from depthwalk.resources import scene_root
from depthwalk.scene.scene import Scene

SHIPPED = "room.yaml", "garden.yaml"
SMALLEST = 64  # pixels, each side of a picture
LARGEST = 1024  # pixels; the reference picture is `antialiasing.REFERENCE_SAMPLES` times as wide

Examine = Callable[[Sequence[Scene], tuple[int, int], Report], Iterator[Row]]
PARTS: dict[str, Examine] = {
    "antialiasing": antialiasing.examine,
    "dof": dof.examine,
    "shadows": shadows.examine,
    "edges": edges.examine,
}


def shipped_scenes() -> list[Path]:
    """Return the files of the scenes that `depthwalk quality` examines where none is named."""
    return [scene_root() / name for name in SHIPPED]


def parse_parts(text: str | None) -> list[str]:
    """Return the parts of the examination that the option --only names.

    Parameters
    ----------
    text
        Names with commas between; None, where the option is not given, stands for all parts.

    Returns
    -------
    list[str]
        Keys of `PARTS`, each once and in their order there.

    Raises
    ------
    InputError
        For a name that does not exist.
    """
    names = list(PARTS) if text is None else [name.strip() for name in text.split(",")]
    unknown = [name for name in names if name not in PARTS]
    if unknown:
        raise InputError(f"--only {unknown[0]}: must be one of {', '.join(PARTS)}")
    return [name for name in PARTS if name in names]


def check_size(size: tuple[int, int]) -> None:
    """Raise InputError where pictures of `size`, (width, height) in pixels, are too small or too large to measure."""
    if not SMALLEST <= min(size) <= max(size) <= LARGEST:
        width, height = size
        raise InputError(f"--resolution {width},{height}: each side must be {SMALLEST} to {LARGEST} pixels")


def run_quality(scenes: Sequence[Scene], parts: Sequence[str], size: tuple[int, int]) -> Overview:
    """Examine scenes, one part after the other.

    Parameters
    ----------
    scenes
        The scenes to draw. Every part gets copies of their settings, which it may change.
    parts
        Names of the parts of the examination, keys of `PARTS`.
    size
        (width, height) of the pictures, pixels.

    Returns
    -------
    Overview
        The measured values of each part.

    Raises
    ------
    InputError
        Where an asset cannot be used.
    GpuError
        Where no OpenGL 3.3 context can be created.
    """
    device = headless_device()
    renderer = device.renderer
    device.context.release()
    with asset_progress() as report:
        rows = {part: list(PARTS[part](list(map(_with_own_settings, scenes)), size, report)) for part in parts}
    return Overview(version=depthwalk.__version__, commit=commit(), renderer=renderer, image_size=size, parts=rows)


def _with_own_settings(scene: Scene) -> Scene:
    return replace(scene, render=scene.render.model_copy(deep=True))
