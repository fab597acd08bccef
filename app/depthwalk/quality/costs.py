"""Measure the cost of baking an object, in a separate process."""

import logging
import multiprocessing
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from depthwalk.assets.asset_files import read_mesh
from depthwalk.bake.file import write_baked
from depthwalk.bake.params import ModelParams
from depthwalk.bake.parts import bake_model
from depthwalk.scene.scene import MeshAsset


@dataclass(frozen=True)
class BakeCosts:
    """Hold the time and memory of a bake.

    Attributes
    ----------
    seconds
        Time from the mesh in memory to depth images in memory, seconds.
    peak_bytes
        Peak memory of the process until then, bytes, including interpreter, libraries and mesh; None if the system
        does not report it.
    bytes_disk
        Size of the file, bytes.
    """

    seconds: float
    peak_bytes: int | None
    bytes_disk: int


def measured_bake(spec: MeshAsset, params: ModelParams, file: Path) -> BakeCosts:
    """Bake a mesh to a file in a fresh process, so that its peak memory is that of the bake.

    Parameters
    ----------
    spec
        The asset whose mesh is baked.
    params
        How the mesh is baked.
    file
        The baked file to write.

    Returns
    -------
    BakeCosts
        Time and memory of the bake.

    Raises
    ------
    InputError
        For meshes that cannot be baked.
    """
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
        return pool.submit(_bake, spec, params, file).result()


def peak_memory() -> int | None:
    """Return the peak memory of this process so far, bytes; None on systems other than Linux.

    `getrusage` is unsuitable: with it, a new process starts with its parent's value.
    """
    status = Path("/proc/self/status")
    if not status.is_file():
        return None
    kilobytes = next(line.split()[1] for line in status.read_text().splitlines() if line.startswith("VmHWM:"))
    return 1024 * int(kilobytes)


def _bake(spec: MeshAsset, params: ModelParams, file: Path) -> BakeCosts:
    logging.disable()  # the caller has read the mesh as well, and logged its warnings
    mesh = read_mesh(spec)
    start = time.perf_counter()
    baked = bake_model(mesh, params, "compare")
    seconds, peak = time.perf_counter() - start, peak_memory()
    write_baked(file, baked)
    return BakeCosts(seconds, peak, file.stat().st_size)
