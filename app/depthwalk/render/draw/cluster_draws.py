"""Select the mesh clusters that a phase of a frame draws, as pairs of objects and clusters."""

import numpy as np

from depthwalk.cook.mesh_clusters import MeshClusters
from depthwalk.geometry.quaternions import rotate
from depthwalk.render.draw.draw_lists import ClusterDraws, DrawList, draw_batches
from depthwalk.render.lod.cluster_selection import ClusterCut, select_clusters
from depthwalk.render.lod.mesh_lod import mesh_level
from depthwalk.render.lod.selection import stretch
from depthwalk.render.resources.placed_records import placed_records
from depthwalk.render.view.bounds import Bounds
from depthwalk.render.view.view import View, viewer_in_object
from depthwalk.render.world.asset_table import AssetTable
from depthwalk.scene.arrays import Objects
from depthwalk.types import Array, Rows


def cluster_draws(view: View, scene: Objects, rows: Rows, table: AssetTable, error: float) -> ClusterDraws:
    """Return the clusters to draw for the objects `rows`, without those that are out of sight or face away.

    The loop runs over assets.

    Parameters
    ----------
    view : the view of the picture.
    scene : all objects of the scene.
    rows : (n,) rows of the objects to draw, nearest first.
    table : the assets' bounds, clusters and levels.
    error : geometric error that clusters may have, pixels.

    Returns
    -------
    The pairs of objects and clusters to draw.
    """
    if not len(rows):  # as in nearly every scene
        return ClusterDraws.none()
    objects = scene.take(rows)
    viewer = viewer_in_object(view, objects.position, objects.rotation, objects.scale)
    nearest = table.nearest(objects.asset, viewer) / stretch(view, objects.position)
    level = mesh_level(view, objects, nearest, table.meshes.error, error)
    order = np.lexsort((level, objects.asset))
    objects, viewer, nearest, level = objects.take(order), viewer[order], nearest[order], level[order]
    assets, first = np.unique(objects.asset, return_index=True)
    cuts = []
    for asset, start, end in zip(assets.tolist(), first, [*first[1:], len(objects)], strict=True):
        clusters, own = table.clusters[asset], slice(start, end)
        cut = select_clusters(clusters, viewer[own], nearest[own], error / view.detail_pixels)
        cuts.append(_in_sight(view, clusters, objects.take(own), viewer[own], cut, start))
    count = [len(cut.objects) for cut in cuts]
    return ClusterDraws(
        objects=DrawList(
            records=placed_records(view.position, objects), batches=draw_batches(table, objects.asset, level)
        ),
        asset=assets,
        first=np.append(0, np.cumsum(count)),
        record=np.concatenate([cut.objects for cut in cuts]),
        cluster=np.concatenate([cut.clusters for cut in cuts]),
    )


def cluster_triangles(draws: ClusterDraws, table: AssetTable) -> int:
    """Return how many triangles of the assets in `table` are drawn by `draws`."""
    return sum(
        int(np.diff(table.clusters[asset].first)[draws.cluster[first:last]].sum())
        for asset, first, last in zip(draws.asset.tolist(), draws.first, draws.first[1:], strict=False)
    )


def _in_sight(
    view: View, clusters: MeshClusters, objects: Objects, viewer: Array, cut: ClusterCut, first: int
) -> ClusterCut:
    """Return those pairs of a `cut` that may be seen, nearest first; their rows count from `first`.

    viewer: (n, 3) the viewer in the frames of the `objects`, metres.
    """
    row, cluster = cut
    if clusters.solid:
        to_centre = clusters.centre[cluster] - viewer[row]
        along = np.einsum("ij,ij->i", to_centre, clusters.axis[cluster])
        away = clusters.sine[cluster] * np.linalg.norm(to_centre, axis=1) + clusters.radius[cluster]
        facing = np.flatnonzero(along < away)
        row, cluster = row[facing], cluster[facing]
    placed = objects.take(row)
    middle = placed.position + placed.scale[:, None] * rotate(placed.rotation, clusters.centre[cluster])
    seen, _ = Bounds(middle, placed.scale * clusters.radius[cluster]).visible(view)
    return ClusterCut(first + row[seen], cluster[seen])
