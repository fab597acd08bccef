"""Provide what is derived from a mesh: from the cache, or made now and kept there.

Simplified levels, clusters and captured views have one life: what the cache holds is found by its key; what it does not
hold is made, by modules that are imported then, and kept. A full or read-only disk costs the next start time, not this
one.
"""

import logging
from collections.abc import Callable
from typing import TypeVar

from depthwalk.assets.asset_files import clusters_key, levels_key, views_key
from depthwalk.bake.capture_file import find_views, keep_views
from depthwalk.bake.captured_views import CapturedViews, CaptureParams
from depthwalk.bake.level_file import find_levels, keep_levels
from depthwalk.cook.cluster_file import find_clusters, keep_clusters
from depthwalk.cook.mesh_clusters import MeshClusters
from depthwalk.ingest.mesh import Mesh, MeshLevel
from depthwalk.parallel import thread_map
from depthwalk.scene.scene import MeshAsset

log = logging.getLogger(__name__)

_T = TypeVar("_T")


def simplified_levels(spec: MeshAsset, mesh: Mesh, source: str, report: Callable[[str], None]) -> tuple[MeshLevel, ...]:
    """Return a mesh and its simplified levels, the finest first.

    Parameters
    ----------
    spec
        The asset that the mesh belongs to.
    mesh
        The mesh.
    source
        Hash of the bytes that it was read from.
    report
        Called with what is being done, where something is made.
    """

    def make() -> tuple[MeshLevel, ...]:
        from depthwalk.bake.levels import mesh_levels

        report("simplifying")
        return mesh_levels(mesh)

    key = levels_key(spec, source)
    kept = f"simplified meshes of {spec.name}"
    return _found_or_made(find_levels(mesh, key), make, lambda levels: keep_levels(levels, key), kept)


def clusters(spec: MeshAsset, mesh: Mesh, source: str, report: Callable[[str], None]) -> MeshClusters:
    """Return the clusters of a mesh; the parameters are as of `simplified_levels`."""

    def make() -> MeshClusters:
        report("dividing into clusters")
        from depthwalk.cook.cluster_builder import build_clusters

        return build_clusters(mesh)

    key = clusters_key(spec, source)
    kept = f"mesh clusters of {spec.name}"
    return _found_or_made(find_clusters(mesh, key), make, lambda made: keep_clusters(made, key), kept)


def captured_views(
    spec: MeshAsset, mesh: Mesh, source: str, params: CaptureParams, report: Callable[[str], None]
) -> CapturedViews:
    """Return views of a mesh, captured as `params` say; the other parameters are as of `simplified_levels`."""

    def make() -> CapturedViews:
        report("capturing views")
        from depthwalk.bake.capture import capture_views

        with thread_map() as parallel_map:
            return capture_views(mesh, params, parallel_map)

    key = views_key(spec, source, params)
    kept = f"captured views of {spec.name}"
    return _found_or_made(find_views(params, key), make, lambda views: keep_views(views, key), kept)


def _found_or_made(found: _T | None, make: Callable[[], _T], keep: Callable[[_T], object], name: str) -> _T:
    """Return what was `found` in the cache; else make it, and keep it there, or warn that the `name` cannot be kept."""
    if found is not None:
        return found
    made = make()
    try:
        keep(made)
    except OSError as error:
        log.warning("cannot keep the %s: %s", name, error)
    return made
