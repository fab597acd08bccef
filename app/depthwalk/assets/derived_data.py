"""Provide data derived from a mesh: from the cache, or made now and stored there.

Simplified levels, clusters and captured views are all handled alike: they are looked up in the cache by key; if
missing, they are made, by modules imported only then, and stored. A full or read-only disk costs the next start time,
not this one.
"""

import logging
from collections.abc import Callable
from typing import TypeVar

from depthwalk.assets.asset_files import clusters_key, levels_key, views_key
from depthwalk.bake.capture_file import CAPTURES
from depthwalk.bake.captured_views import CapturedViews, CaptureParams
from depthwalk.bake.level_file import LEVELS
from depthwalk.cache import ArrayCache
from depthwalk.cook.cluster_file import CLUSTERS
from depthwalk.cook.mesh_clusters import MeshClusters
from depthwalk.files import reason
from depthwalk.ingest.mesh import Mesh, MeshLevel
from depthwalk.parallel import thread_map
from depthwalk.scene.scene import MeshAsset

log = logging.getLogger(__name__)

_T = TypeVar("_T")
_Origin = TypeVar("_Origin")


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
        Called with the name of the stage, if something is made.
    """

    def make() -> tuple[MeshLevel, ...]:
        from depthwalk.bake.levels import mesh_levels

        report("simplifying")
        return mesh_levels(mesh)

    return _found_or_made(LEVELS, levels_key(spec, source), mesh, make, spec.name)


def clusters(spec: MeshAsset, mesh: Mesh, source: str, report: Callable[[str], None]) -> MeshClusters:
    """Return the clusters of a mesh; parameters as in `simplified_levels`."""

    def make() -> MeshClusters:
        report("dividing into clusters")
        from depthwalk.cook.cluster_builder import build_clusters

        return build_clusters(mesh)

    return _found_or_made(CLUSTERS, clusters_key(spec, source), mesh, make, spec.name)


def captured_views(
    spec: MeshAsset, mesh: Mesh, source: str, params: CaptureParams, report: Callable[[str], None]
) -> CapturedViews:
    """Return views of a mesh, captured with `params`; other parameters as in `simplified_levels`."""

    def make() -> CapturedViews:
        report("capturing views")
        from depthwalk.bake.capture import capture_views

        with thread_map() as parallel_map:
            return capture_views(mesh, params, parallel_map)

    return _found_or_made(CAPTURES, views_key(spec, source, params), params, make, spec.name)


def _found_or_made(cache: ArrayCache[_T, _Origin], key: str, origin: _Origin, make: Callable[[], _T], name: str) -> _T:
    """Return the cache's entry for `key`; if there is none, make and store it, or warn if that fails.

    origin: the data that it is derived from. name: of the asset.
    """
    if (found := cache.find_value(origin, key)) is not None:
        return found
    made = make()
    try:
        cache.keep_value(made, key)
    except OSError as error:
        log.warning("cannot store the %s of %s in the cache: %s", cache.content, name, reason(error))
    return made
