"""Bake one mesh to a file or a URL, unless it is up to date; the file is written atomically."""

import contextlib
import os
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from depthwalk.assets.asset_files import clusters_key, levels_key, mesh_key, mesh_source, read_body, views_key
from depthwalk.bake.cache import BAKED, find_cached, read_model
from depthwalk.bake.coverage import measure_left_out
from depthwalk.bake.file import write_baked
from depthwalk.bake.params import ModelParams
from depthwalk.bake.parts import bake_model
from depthwalk.cache import forget
from depthwalk.cluster.store import fetch_file, send_file
from depthwalk.cook.cook import GRID_TEXELS, CookOptions, cook_object
from depthwalk.cook.cooked_file import cooked_key, read_cooked, write_cooked
from depthwalk.errors import InputError
from depthwalk.files import check_folder, copy, staging_folder, temporary_folder
from depthwalk.ingest.formats import is_cooked_file
from depthwalk.ingest.sources import Sources
from depthwalk.scene.scene import MeshAsset


@dataclass(frozen=True, kw_only=True)
class Job:
    """Describe which mesh to bake, and to which file.

    Attributes
    ----------
    spec
        The asset whose mesh is baked.
    params
        Parameters of the bake.
    out
        The file, which is replaced if it exists; it holds cooked depth images if its name ends in `.dpci.npz`.
    url
        URL at which the file is stored instead, through fsspec; `out` then is a bare name. "" stores it at `out`.
    force
        Whether to bake even if the file, or one in the cache, is up to date; the cached file is then removed, too.
    """

    spec: MeshAsset
    params: ModelParams
    out: Path
    url: str = ""
    force: bool = False

    @property
    def target(self) -> Path | str:
        """Return the path or URL of the file."""
        return self.url or self.out

    @property
    def folder(self) -> Path | None:
        """Return the folder in which the file appears; None if it is not on this machine."""
        return None if self.url else self.out.parent


@dataclass(frozen=True, kw_only=True)
class Baked:
    """Report that a job baked its mesh.

    Attributes
    ----------
    out
        The file, or its URL.
    triangles
        Number of triangles of the mesh.
    extent
        Lengths along x, y and z of the mesh, metres, asset frame.
    parts
        Number of parts that the mesh was divided into.
    images
        Number of depth images that hold samples.
    seconds
        Duration of each stage, seconds, in the order of the stages.
    bytes
        Size of the file.
    left_out
        The part of the visible surface that no image holds, 0 to 1.
    """

    out: Path | str
    triangles: int
    extent: tuple[float, float, float]
    parts: int
    images: int
    seconds: dict[str, float]
    bytes: int
    left_out: float


@dataclass(frozen=True)
class Kept:
    """Report that a job needed no bake.

    Attributes
    ----------
    out
        The file, or its URL.
    cached
        Whether the file was copied from the user's cache folder; otherwise it existed and was up to date.
    """

    out: Path | str
    cached: bool


class UnwritableError(OSError):
    """Report that the file of a job cannot be written, for example to a full disk; other jobs can continue."""


def bake_whole(job: Job, workers: int | None = None) -> Baked | Kept:
    """Do a job so that its file is written atomically; `workers` and errors are those of `bake_job`."""
    with staging(job) as staged:
        outcome = bake_job(job, staged, lambda stage: None, workers)
        try:
            if staged.is_file():
                os.replace(staged, job.out)
        except OSError as error:
            raise unwritable(job.target, error) from error
        return outcome


def bake_job(job: Job, staged: Path, stage: Callable[[str], None], workers: int | None = None) -> Baked | Kept:
    """Bake a mesh to a file, unless the file is up to date or can be copied from the cache.

    Parameters
    ----------
    job
        The job.
    staged
        Where to write the file; the caller moves it to `job.out` when it is complete. Nothing is written if `job.out`
        is up to date, and nothing is left if the file is stored at a URL.
    stage
        Called with the name of each stage as it begins.
    workers
        Number of threads to use; None: the number that `default_workers` returns.

    Returns
    -------
    Baked | Kept
        The outcome.

    Raises
    ------
    InputError
        If the mesh cannot be used.
    UnwritableError
        If the file cannot be written.
    OSError
        If a URL cannot be reached.
    """
    outcome = _make(job, staged, stage, workers)
    if job.url and staged.is_file():
        stage("store")
        try:
            send_file(staged, job.url)
        finally:  # otherwise the caller would move it
            staged.unlink()
    return outcome


def _make(job: Job, staged: Path, stage: Callable[[str], None], workers: int | None) -> Baked | Kept:
    """Write the file of a job to `staged`, unless it is up to date; see `bake_job`."""
    cooked = is_cooked_file(job.out)
    clock = _Stopwatch(stage)
    clock.start("read")
    sources = Sources()
    source = mesh_source(job.spec, sources)
    key = mesh_key(job.spec, job.params, source)
    if not job.url:
        check_folder(job.out)
    if job.force:
        for made_of_it in (
            key,
            levels_key(job.spec, source),
            clusters_key(job.spec, source),
            views_key(job.spec, source),
        ):
            forget(made_of_it)
    elif _is_stored(job, staged, key):
        return Kept(job.target, cached=False)
    elif not cooked and find_cached(key) is not None and _copied(BAKED.file(key), staged):
        return Kept(job.target, cached=True)
    mesh = read_body(job.spec, sources)
    del sources  # frees the bytes of the files
    clock.start("ray structure")  # the search tree for ray casting
    # Cooking makes its own coarse levels of larger images, from the finest grids.
    max_stepped = GRID_TEXELS if cooked else None
    model = bake_model(mesh, job.params, key, clock.start, workers, max_stepped)
    clock.start("coverage")
    left_out = measure_left_out(mesh, model)
    clock.start("cook" if cooked else "write")
    try:
        if cooked:
            write_cooked(staged, key, tuple(cook_object(part, CookOptions()) for part in model.parts), left_out)
        else:
            write_baked(staged, replace(model, left_out=left_out))
    except OSError as error:
        raise unwritable(job.target, error) from error
    return Baked(
        out=job.target,
        triangles=len(mesh.faces),
        extent=tuple(np.subtract(*mesh.bounds[::-1]).tolist()),
        parts=len(model.parts),
        images=sum(len(part.images) for part in model.parts),
        seconds=clock.stop(),
        bytes=staged.stat().st_size,
        left_out=left_out,
    )


def _copied(cached: Path, staged: Path) -> bool:
    """Copy a file from the cache, and return whether that worked: another process may have removed it to make room."""
    try:
        copy(cached, staged)
    except OSError:
        return False
    return True


def unwritable(out: Path | str, error: OSError) -> UnwritableError:
    """Return the error that the file `out` of a job cannot be written."""
    return UnwritableError(f"{out}: cannot be written: {error.strerror or error}")


def _is_stored(job: Job, staged: Path, key: str) -> bool:
    """Return whether the file of a job is up to date; one at a URL is fetched to a name beside `staged` and read."""
    if not job.url:
        return _is_up_to_date(job.out, key)
    fetched = staged.with_name(f"stored-{staged.name}")
    try:
        return fetch_file(job.url, fetched) and _is_up_to_date(fetched, key)
    finally:
        fetched.unlink(missing_ok=True)


def _is_up_to_date(file: Path, key: str) -> bool:
    """Return whether a file holds the depth images of `key`, cooked or not, undamaged."""
    # Read completely: its pixels may be damaged even if its header is not.
    if not is_cooked_file(file):
        return read_model(file, key) is not None
    try:
        return cooked_key(file) == key and all(cooked.load() for cooked in read_cooked(file))
    except InputError:
        return False


class _Stopwatch:
    """Measure the stages of a job; a stage ends where the next begins."""

    def __init__(self, announce: Callable[[str], None]) -> None:
        """Start without a stage. announce: called with the name of each stage that begins."""
        self._announce = announce
        self._seconds: dict[str, float] = {}
        self._stage = ""

    def start(self, stage: str) -> None:
        """Begin a stage, which may have been measured before."""
        self.stop()
        self._announce(stage)
        self._stage, self._began = stage, time.perf_counter()

    def stop(self) -> dict[str, float]:
        """End the last stage; return the duration of each, seconds."""
        if self._stage:
            elapsed = time.perf_counter() - self._began
            self._seconds[self._stage] = self._seconds.get(self._stage, 0.0) + elapsed
            self._stage = ""
        return self._seconds


@contextlib.contextmanager
def staging(job: Job) -> Iterator[Path]:
    """Provide a file name in a new folder: beside the job's file, on the same disk, or for temporary files.

    The folder is removed with anything that a terminated worker left in it. If this process is killed, the next bake to
    the same place removes it.
    """
    try:
        folder = staging_folder(job.folder) if job.folder else temporary_folder()
    except OSError:  # for example, the folder does not exist: the job will report it
        yield job.out.with_name(f".{job.out.name}")
        return
    with folder as name:
        yield Path(name) / job.out.name
