"""Bake meshes to files, several at a time, and report on each."""

import contextlib
import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np

from depthwalk.assets.bake_job import Baked, Job, Kept, UnwritableError
from depthwalk.assets.batch_bake import Outcomes, Stage, bake_all
from depthwalk.assets.cluster_bake import bake_on
from depthwalk.bake.cache import sidecar
from depthwalk.bake.file import SUFFIX
from depthwalk.bake.params import ModelParams
from depthwalk.cluster.address import ClusterAddress
from depthwalk.cluster.connection import open_cluster
from depthwalk.cluster.store import check_url, is_url
from depthwalk.cluster.tasks import TaskError
from depthwalk.commands.cluster_progress import cluster_progress
from depthwalk.commands.progress import live_options, log, plain_steps, show_progress
from depthwalk.errors import InputError, missing_file, printable
from depthwalk.files import check_folder
from depthwalk.ingest.formats import COOKED_SUFFIX, check_suffix
from depthwalk.ingest.texture_beside import texture_hint
from depthwalk.ingest.units import unit_hint
from depthwalk.limits import MAX_COORDINATE
from depthwalk.scene.scene import MeshAsset

Failed = InputError | UnwritableError | TaskError

_SEEN_LOSS = 0.02  # part of the visible surface whose loss shows as holes; most models lose a thousandth


def output_files(meshes: Sequence[Path], out: str | None) -> list[Path | str]:
    """Return where the depth images of each mesh are to be stored.

    Parameters
    ----------
    meshes
        The mesh files.
    out
        The folder to write to, or the file; a URL is a folder if it ends in a slash. None writes beside each mesh.

    Returns
    -------
    list[Path | str]
        One file or URL for each mesh.

    Raises
    ------
    InputError
        If two meshes would share a file, `out` has a wrong suffix, or a file cannot be written.
    """
    files: list[Path | str]
    if out is None:
        files = [sidecar(mesh) for mesh in meshes]
    elif is_url(out):
        files = list(_urls(meshes, out))
    else:
        files = list(_files(meshes, Path(out)))
    firsts: dict[Path | str, Path] = {}
    for mesh, file in zip(meshes, files, strict=True):
        if file in firsts:
            raise InputError(f"{file}: {firsts[file]} and {mesh} would both be baked to it")
        firsts[file] = mesh
        if out is not None and isinstance(file, Path):
            check_folder(file)
    return files


def _files(meshes: Sequence[Path], out: Path) -> list[Path]:
    if out.is_dir():
        return [out / sidecar(mesh).name for mesh in meshes]
    if len(meshes) > 1:
        raise InputError(f"{out}: several meshes need an existing folder")
    if not out.name.endswith((".exr", COOKED_SUFFIX)):
        raise InputError(f"{out}: must be an existing folder, or a file that ends in {SUFFIX} or {COOKED_SUFFIX}")
    return [out]


def _urls(meshes: Sequence[Path], out: str) -> list[str]:
    check_url(out)
    if out.endswith("/"):
        return [out + sidecar(mesh).name for mesh in meshes]
    if len(meshes) > 1:
        raise InputError(f"{out}: several meshes need a folder, whose URL ends in /")
    if not out.endswith((".exr", COOKED_SUFFIX)):
        raise InputError(f"{out}: must end in / or in {SUFFIX} or {COOKED_SUFFIX}")
    return [out]


def mesh_spec(mesh: Path, texture: Path | None, up: Literal["y", "z"], height: float | None) -> MeshAsset:
    """Return the asset that a scene file with these values would define, so that both get the same cache key.

    Parameters
    ----------
    mesh
        The mesh file.
    texture
        A picture that replaces those that the mesh names; None keeps them.
    up
        The axis that points upward in the file.
    height
        Height in metres to which the mesh is scaled; None keeps its size.

    Returns
    -------
    MeshAsset
        The asset, named by the file.

    Raises
    ------
    InputError
        If the height is not a positive number of metres.
    """
    if height is not None and not 0 < height <= MAX_COORDINATE:
        raise InputError(f"--height {height:g}: must be above 0 and at most {MAX_COORDINATE:.0f} metres")
    return MeshAsset(name=mesh.stem, mesh=mesh, texture=texture, up=up, height=height, dpci=None)


def check_inputs(specs: Sequence[MeshAsset]) -> None:
    """Check, before the first mesh is baked, that every input file exists and may be a mesh.

    Problems that show only on reading, such as a damaged mesh, do not prevent the others from being baked.

    Parameters
    ----------
    specs
        The meshes and their textures.

    Raises
    ------
    InputError
        If files are missing, are folders, or do not have a mesh's suffix; with one line for each.
    """
    complaints: list[str] = []
    for spec in specs:
        try:
            for file in filter(None, (spec.mesh, spec.texture)):
                if not os.path.isfile(file):  # also False for names that the system rejects
                    raise missing_file(file)
            check_suffix(spec.mesh)
        except InputError as error:
            complaints += error.lines
    if complaints:
        raise InputError(*dict.fromkeys(complaints))  # a texture belongs to every mesh


def bake_meshes(
    specs: Sequence[MeshAsset],
    params: ModelParams,
    files: Sequence[Path | str],
    processes: int | None,
    force: bool,
    cluster: ClusterAddress | None = None,
) -> list[Failed]:
    """Bake each mesh to its file and print a line about each.

    Parameters
    ----------
    specs, files
        The meshes, and the file or URL to which each is baked.
    params
        How to bake all of them.
    processes
        Number of meshes baked at a time; None: one per core.
    force
        Whether to bake even files that are up to date.
    cluster
        Cluster on which to bake; None for this process and its pool.

    Returns
    -------
    list[Failed]
        Why meshes failed: mistakes in them, files that cannot be written, and repeated failures on a cluster. They have
        been logged.

    Raises
    ------
    ClusterError
        If the cluster cannot be reached, or is lost for good.
    """
    failures: list[Failed] = []
    jobs = [_job(spec, params, file, force) for spec, file in zip(specs, files, strict=True)]
    run = _here(jobs, processes) if cluster is None else _on_cluster(jobs, cluster)
    with contextlib.closing(run):
        for number, outcome in run:
            if isinstance(outcome, TaskError):
                outcome = TaskError(f"{jobs[number].spec.mesh}: {outcome}")
            if isinstance(outcome, Failed):
                failures.append(outcome)
                log.error("%s", outcome)
            else:
                print(printable(describe(outcome, params.resolution)), flush=True)
                _tell_of_loss(outcome, params)
                _tell_of_unit(outcome, specs[number])
                _tell_of_texture(outcome, specs[number])
    return failures


def _tell_of_loss(outcome: Baked | Kept, params: ModelParams) -> None:
    """Warn if so much of a surface is missing from all depth images that holes will show, and suggest a remedy."""
    if isinstance(outcome, Baked) and outcome.left_out > _SEEN_LOSS and params.layers != "auto":
        remedy = "raycast with --layers auto" if params.by_six_views else "--layers auto"
        missing = f"{100 * outcome.left_out:.1f} % of the visible surface will be missing; {remedy} captures more of it"
        log.warning("%s: %s", outcome.out, missing)


def _tell_of_unit(outcome: Baked | Kept, spec: MeshAsset) -> None:
    """Warn if a mesh was baked that seems too large to be in metres, and whose height the user has not given."""
    if isinstance(outcome, Kept) or spec.height is not None:
        return
    if hint := unit_hint(spec.mesh, np.array(outcome.extent), "--height"):
        log.warning("%s: %s", spec.mesh, hint)


def _tell_of_texture(outcome: Baked | Kept, spec: MeshAsset) -> None:
    """Warn if a mesh was baked without a texture although a picture beside it may be one."""
    if isinstance(outcome, Baked) and spec.texture is None and (hint := texture_hint(spec.mesh, "--texture ")):
        log.warning("%s: %s", spec.mesh, hint)


def _job(spec: MeshAsset, params: ModelParams, file: Path | str, force: bool) -> Job:
    if isinstance(file, Path):
        return Job(spec=spec, params=params, out=file, force=force)
    return Job(spec=spec, params=params, out=Path(file.rpartition("/")[2]), url=file, force=force)


def _here(jobs: Sequence[Job], processes: int | None) -> Outcomes:
    """Do jobs in this process or in its pool, and show which are in progress."""
    with contextlib.ExitStack() as stack:
        display = stack.enter_context(_progress([job.spec.mesh.name for job in jobs]))
        for number, outcome in stack.enter_context(contextlib.closing(bake_all(jobs, processes, display.stage))):
            display.done(number)
            yield number, outcome


def _on_cluster(jobs: Sequence[Job], address: ClusterAddress) -> Outcomes:
    """Do jobs on a cluster, and show how many are done. Workers run in folders of their own."""
    absolute = [
        replace(
            job,
            spec=replace(
                job.spec, mesh=job.spec.mesh.absolute(), texture=job.spec.texture and job.spec.texture.absolute()
            ),
            out=job.out if job.url else job.out.absolute(),
        )
        for job in jobs
    ]
    with open_cluster(address) as cluster, cluster_progress("meshes", len(jobs), cluster) as display:
        for number, outcome in bake_on(cluster, absolute, display.progress, display.show):
            display.done(1)
            if isinstance(outcome, Baked | Kept):
                outcome = replace(outcome, out=jobs[number].target)
            yield number, outcome


def absolute(spec: MeshAsset) -> MeshAsset:
    """Return an asset with absolute file names, for workers that run in other folders."""
    return replace(spec, mesh=spec.mesh.absolute(), texture=spec.texture and spec.texture.absolute())


def describe(baked: Baked | Kept, resolution: int) -> str:
    """Return the line that `depthwalk bake` prints about a mesh.

    `baked` holds the results of its bake, or says that its file was up to date; `resolution` is the greatest width of
    its depth images, texels.
    """
    if isinstance(baked, Kept):
        return f"{baked.out}: {'copied from the cache' if baked.cached else 'is up to date'}; --force bakes it again"
    stages = ", ".join(f"{name} {seconds:.2f}" for name, seconds in baked.seconds.items())
    parts = f"{baked.parts} parts, " if baked.parts > 1 else ""
    side = f"at most {resolution}" if baked.parts > 1 else f"{resolution}"
    triangles = f"{baked.triangles} triangle{'' if baked.triangles == 1 else 's'}"
    return (
        f"{baked.out}: {triangles}, {parts}{baked.images} images of {side}², "
        f"{baked.bytes / 1e6:.1f} MB, {100 * baked.left_out:.2f} % of the visible surface left out; "
        f"{sum(baked.seconds.values()):.2f} s ({stages})"
    )


@dataclass(frozen=True)
class _Display:
    """Report on jobs by their numbers.

    Attributes
    ----------
    stage
        Called with a job's number and its current stage.
    done
        Called with the number of a job that has ended.
    """

    stage: Stage
    done: Callable[[int], None]


@contextlib.contextmanager
def _progress(names: Sequence[str]) -> Iterator[_Display]:
    """Show a line on stderr for each mesh being baked, and the number that are done; see `plain_steps`."""
    if not show_progress():
        finished: list[int] = []
        with plain_steps() as report:

            def step(number: int, name: str) -> None:
                counted = f" ({len(finished)} of {len(names)} baked)" if len(names) > 1 else ""
                report(names[number], f"{name}{counted}")

            yield _Display(step, finished.append)
        return
    from rich.markup import escape
    from rich.progress import Progress, SpinnerColumn, TaskID, TextColumn, TimeElapsedColumn

    columns = SpinnerColumn(), TextColumn("{task.description}"), TextColumn("{task.fields[stage]}"), TimeElapsedColumn()
    with Progress(*columns, **live_options()) as progress:
        whole = progress.add_task("baked", total=len(names), stage=f"0 of {len(names)}", visible=len(names) > 1)
        lines: dict[int, TaskID] = {}

        def stage(number: int, name: str) -> None:
            if number not in lines:
                lines[number] = progress.add_task(escape(printable(names[number])), stage=name)
            progress.update(lines[number], stage=name)

        def done(number: int) -> None:
            if number in lines:
                progress.remove_task(lines.pop(number))
            progress.advance(whole)
            progress.update(whole, stage=f"{progress.tasks[0].completed:.0f} of {len(names)}")

        yield _Display(stage, done)
