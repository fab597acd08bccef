"""Find assets that lack depth images, and bake these into the cache, several at a time."""

import logging
from collections.abc import Callable, Iterable
from concurrent.futures import BrokenExecutor
from contextlib import closing

from depthwalk.assets.asset_files import mesh_key, model_params
from depthwalk.bake.cache import BAKED, has_key, sidecar
from depthwalk.bake.params import ModelParams
from depthwalk.cache import make_room
from depthwalk.files import reason
from depthwalk.scene.scene import Asset, MeshAsset

log = logging.getLogger(__name__)


def bake_missing(assets: Iterable[Asset], processes: int | None, report: Callable[[str, str], None]) -> None:
    """Bake into the cache the depth images of assets for which none are found, if there are at least two.

    Failures are not reported here: they occur again, with an error, when the asset is requested.

    Parameters
    ----------
    assets
        The assets to check.
    processes
        Number of bakes at a time; None: as many as there are cores.
    report
        Called with the name of an asset and the stage that begins.
    """
    unbaked = _unbaked_meshes(assets)
    if len(unbaked) < 2:
        return
    from depthwalk.assets.bake_job import Baked, Job, Kept
    from depthwalk.assets.batch_bake import bake_all

    missing = [Job(spec=spec, params=params, out=BAKED.file(key)) for key, (spec, params) in unbaked.items()]
    names, done = [job.spec.name for job in missing], 0

    def stage(number: int, name: str) -> None:
        report(names[number], f"{name} ({done} of {len(missing)} baked)")

    try:
        missing[0].out.parent.mkdir(parents=True, exist_ok=True)
        with closing(bake_all(missing, processes, stage)) as outcomes:
            for number, outcome in outcomes:
                done += 1
                if isinstance(outcome, Baked | Kept):
                    make_room(missing[number].out)
    except OSError as error:
        log.warning("cannot store depth images in the cache: %s", reason(error))
    except BrokenExecutor:  # the system ended a process, for example for lack of memory: one at a time needs less
        log.warning(
            "a baking process was killed, perhaps for lack of memory; baking the remaining depth images one at a time"
        )


def _unbaked_meshes(assets: Iterable[Asset]) -> dict[str, tuple[MeshAsset, ModelParams]]:
    """Return the meshes, by key, whose depth images `assets` need and are found nowhere, and how to bake them."""
    found: dict[str, tuple[MeshAsset, ModelParams]] = {}  # by key, since assets may share one
    for spec in assets:
        if isinstance(spec, MeshAsset) and spec.dpci is not None:
            params = model_params(spec.dpci)
            key = mesh_key(spec, params)
            if not (has_key(sidecar(spec.mesh), key) or has_key(BAKED.file(key), key)):
                found[key] = spec, params
    return found
