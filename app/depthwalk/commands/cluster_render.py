"""Render the frames of a camera path on a cluster, and report on them."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from depthwalk.assets.library import SceneLibrary
from depthwalk.cluster.address import ClusterAddress
from depthwalk.cluster.connection import open_cluster
from depthwalk.commands.cluster_progress import cluster_progress
from depthwalk.commands.frame_chunks import RenderJob, draw_on
from depthwalk.commands.progress import asset_progress, log
from depthwalk.errors import InputError
from depthwalk.scene.scene import Scene


def render_on_cluster(where: ClusterAddress, loaded: Scene, frames: Sequence[int], job: RenderJob) -> bool:
    """Render frames on a cluster, and print the name of each file.

    Parameters
    ----------
    where
        The cluster.
    loaded
        The scene, with its render settings as the frames are drawn.
    frames
        The numbers of the frames.
    job
        What to draw; names of files may be relative, and the key is not needed.

    Returns
    -------
    bool
        Whether all frames exist; missing ones have been reported on stderr.

    Raises
    ------
    InputError
        If the frames cannot be drawn this way.
    ClusterError
        If the cluster cannot be reached or is lost for good.
    """
    output = job.output
    if not output.is_series:
        raise InputError(f"{output.name}: --cluster needs a file for each frame; put {{frame:4}} into the name")
    scene = job.scene  # as the user named it, for messages
    job = replace(
        job,
        scene=scene.resolve(),
        path=job.path.resolve(),
        asset_roots=tuple(root.resolve() for root in job.asset_roots),
        sky=job.sky and job.sky.resolve(),
        output=output if output.is_remote else replace(output, name=str(Path(output.name).absolute())),
        key=job.keys(loaded).scene,
    )
    missing: list[int] = []
    if where.url is None:  # otherwise all of its workers would bake the same at once
        with asset_progress() as report:
            SceneLibrary(loaded.assets, report, processes=None).bake_missing(range(len(loaded.assets)))
    with open_cluster(where) as cluster, cluster_progress("frames", len(frames), cluster) as display:
        cluster.folders |= set() if output.is_remote else {output.file(frame).parent for frame in frames}
        for chunk, failure in draw_on(cluster, job, frames, display.progress, display.show):
            display.done(len(chunk))
            if failure is None:
                print("\n".join(output.target(frame) for frame in chunk), flush=True)
            else:
                log.error("%s: frames %s: %s", scene, spans(chunk), failure)
                missing += chunk
    if missing:
        log.error("%s: frames not drawn: %s; run the same command again to draw them", scene, spans(missing))
    return not missing


def spans(numbers: Sequence[int]) -> str:
    """Return numbers in the notation of --frames, separated by commas: 3-7,12-12."""
    texts: list[str] = []
    ordered = sorted(numbers)
    first = 0
    for index in range(1, len(ordered) + 1):
        if index == len(ordered) or ordered[index] != ordered[index - 1] + 1:
            texts.append(f"{ordered[first]}-{ordered[index - 1]}")
            first = index
    return ",".join(texts)
