"""Run the parts of `depthwalk quality`: anti-aliasing, depth of field, shadows and edges, one scene at a time."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import depthwalk
from depthwalk.assets.mesh_library import Report
from depthwalk.cluster.address import ClusterAddress
from depthwalk.cluster.tasks import Task
from depthwalk.commands.journal import Journal, digest, file_states
from depthwalk.commands.measuring import Measurements, measured
from depthwalk.commands.progress import asset_progress, quiet
from depthwalk.commands.reports import input_files
from depthwalk.commands.scene_file import SceneFile
from depthwalk.errors import InputError
from depthwalk.gpu.headless_device import headless_device
from depthwalk.provenance import commit
from depthwalk.quality import antialiasing, dof, edges, shadows
from depthwalk.quality.overview import Overview
from depthwalk.quality.rows import Examine, Row
from depthwalk.resources import scene_root
from depthwalk.scene.scene import Asset, MeshAsset, Scene

SHIPPED = "room.yaml", "garden.yaml"
SMALLEST = 64  # pixels, each side of a picture
LARGEST = 1024  # pixels; the reference picture is `antialiasing.REFERENCE_SAMPLES` times as wide

PARTS: dict[str, Examine] = {
    "antialiasing": antialiasing.examine,
    "dof": dof.examine,
    "shadows": shadows.examine,
    "edges": edges.examine,
}
SOLIDS = "edges of solids"  # what the part "edges" measures in addition, without a scene
_ONCE: dict[str, Callable[[MeshAsset], object]] = {  # an asset shared by several scenes is examined once
    "shadows": lambda asset: (asset.mesh, str(asset.dpci)),
    "edges": lambda asset: asset.mesh,
}

Found = tuple[list[Row], str]
"""The measured values, and the name of the GL driver."""


@dataclass(frozen=True, kw_only=True)
class Piece:
    """Describe what one task examines.

    Attributes
    ----------
    part
        A key of `PARTS`, or `SOLIDS`.
    scene
        The scene; None for the solids.
    assets
        The numbers of the scene's assets to examine; None for the whole scene.
    """

    part: str
    scene: SceneFile | None = None
    assets: tuple[int, ...] | None = None


def shipped_scenes() -> list[Path]:
    """Return the files of the scenes that `depthwalk quality` examines by default."""
    return [scene_root() / name for name in SHIPPED]


def parse_parts(text: str | None) -> list[str]:
    """Return the parts of the examination in the option --only.

    Parameters
    ----------
    text
        Names separated by commas; None, if the option is not given, means all parts.

    Returns
    -------
    list[str]
        Keys of `PARTS`, without duplicates and in their order there.

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
    """Raise InputError if pictures of `size`, (width, height) in pixels, are too small or too large to measure."""
    if not SMALLEST <= min(size) <= max(size) <= LARGEST:
        width, height = size
        raise InputError(f"--resolution {width},{height}: each side must be {SMALLEST} to {LARGEST} pixels")


@contextmanager
def run_quality(
    files: Sequence[SceneFile],
    scenes: Sequence[Scene],
    parts: Sequence[str],
    size: tuple[int, int],
    cluster: ClusterAddress | None = None,
) -> Iterator[Overview]:
    """Examine scenes, one part after the other, skipping what an interrupted earlier run has examined.

    Parameters
    ----------
    files, scenes
        The scenes to draw, and the files from which they were read.
    parts
        Names of the parts of the examination, keys of `PARTS`.
    size
        (width, height) of the pictures, pixels.
    cluster
        Cluster on which to do so, a part of one scene at a time per worker; None for this process.

    Yields
    ------
    Overview
        The measured values of each part, which are stored until the `with` block ends.

    Raises
    ------
    InputError
        If an asset cannot be used.
    GpuError
        If no OpenGL 3.3 context can be created.
    TaskError, ClusterError
        If a scene cannot be examined on the cluster for another reason, or the cluster is lost for good.
    """
    pieces = [piece for part in parts for piece in _pieces(part, files, scenes)]
    states = {file: file_states(input_files(scene, None)) for file, scene in zip(files, scenes, strict=True)}
    with measured(_measurements(pieces, states, size), cluster) as found:
        rows: dict[str, list[Row]] = {part: [] for part in parts}
        for piece, (own, _) in zip(pieces, found, strict=True):
            rows["edges" if piece.part == SOLIDS else piece.part] += own
        drivers = "; ".join(dict.fromkeys(driver for _, driver in found))
        yield Overview(version=depthwalk.__version__, commit=commit(), renderer=drivers, image_size=size, parts=rows)


def _pieces(part: str, files: Sequence[SceneFile], scenes: Sequence[Scene]) -> Iterator[Piece]:
    """Yield what a part examines, one scene at a time; an asset shared by scenes only once, if it is drawn alone."""
    if part == "edges":
        yield Piece(part=SOLIDS)
    seen: set[object] = set()
    for file, scene in zip(files, scenes, strict=True):
        if part not in _ONCE:
            yield Piece(part=part, scene=file)
        elif fresh := tuple(_fresh(scene.assets, _ONCE[part], seen)):
            yield Piece(part=part, scene=file, assets=fresh)


def _fresh(assets: Sequence[Asset], name: Callable[[MeshAsset], object], seen: set[object]) -> Iterator[int]:
    for number, asset in enumerate(assets):
        if isinstance(asset, MeshAsset) and name(asset) not in seen:
            seen.add(name(asset))
            yield number


def _measurements(
    pieces: Sequence[Piece], states: Mapping[SceneFile, object], size: tuple[int, int]
) -> Measurements[Found]:
    """Return how pieces are examined, here and by workers. states: values that change with the files."""

    @contextmanager
    def here() -> Iterator[Callable[[int], Found]]:
        with asset_progress() as report:
            yield lambda number: _examine(pieces[number], size, report)

    tasks = []
    for piece in pieces:
        state = states[piece.scene] if piece.scene else None
        piece = replace(piece, scene=piece.scene and piece.scene.absolute())
        key = f"quality-{digest(piece, size, state)}"
        tasks.append(Task(key=key, function=examine_alone, arguments=(piece, size)))
    return Measurements(
        what="examinations",
        names=[f"{piece.scene.path}: {piece.part}" if piece.scene else piece.part for piece in pieces],
        tasks=tasks,
        here=here,
        named=lambda number, outcome: outcome,
        kind=Found,
        journal=Journal("quality", pieces, size),
    )


def examine_alone(piece: Piece, size: tuple[int, int]) -> Found:
    """Examine a part of a scene in a worker process, without reporting progress.

    Parameters
    ----------
    piece
        What to examine.
    size
        (width, height) of the pictures, pixels.

    Returns
    -------
    Found
        The measurements, and the name of the driver.

    Raises
    ------
    InputError
        If an asset cannot be used.
    GpuError
        If no OpenGL 3.3 context can be created.
    """
    with quiet():
        return _examine(piece, size, lambda name, stage: None)


def _examine(piece: Piece, size: tuple[int, int], report: Report) -> Found:
    device = headless_device()
    driver = device.renderer
    device.context.release()
    if piece.scene is None:
        return list(edges.examine_solids(size, report)), driver
    scene = piece.scene.open()  # opened again, since every part may change the settings
    if piece.assets is not None:
        scene = replace(scene, assets=tuple(scene.assets[number] for number in piece.assets))
    return list(PARTS[piece.part]([scene], size, report)), driver
