"""Count what each occlusion phase of a frame draws, for HUD and benchmark."""

import numpy as np

from depthwalk.cook.cases import Case, drawn_cases
from depthwalk.render.draw.draw_lists import Counts, DrawList, ImpostorQuads
from depthwalk.render.impostors.tile_scheduler import TileWork
from depthwalk.types import Array


def phase_counts(
    total: int, warp: DrawList, composite: ImpostorQuads, dmesh: DrawList, mesh: DrawList, work: TileWork, step: Array
) -> Counts:
    """Return the counts of a phase by name; counts that later steps fill in are 0.

    Parameters
    ----------
    total : how many objects the scene has.
    warp : what pass 1 warps.
    composite : what pass 2 draws.
    dmesh : depth images that are drawn straight into the picture.
    mesh : meshes that are drawn.
    work : the tiles that are warped and drawn.
    step : (d,) the paper's Iter_step of each object that a tile shows, see `iter_step`.

    Returns
    -------
    A number for each name.
    """
    warped = sum(batch.count * length for batch in warp.batches + dmesh.batches for _, length in batch.indices) // 3
    drawn: Counts = {
        "objects": total,
        "occluded": 0,
        "dpci": len(composite.records),
        "clusters": 0,
        "dmesh": len(dmesh.records),
        "mesh": len(mesh.records),
        "height_fields": 0,
        "mesh_fallbacks": 0,
        "shadow_maps": 0,
        "shadow_maps_waiting": 0,
        "shadow_triangles": 0,
        "warped": len(warp.records),
        "warped_triangles": warped,
        "draw_batches": len(warp.batches),
        "provisional": work.provisional,
    }
    levels = {f"level_{level}": int(n) for level, n in enumerate(np.bincount(work.level)) if n}
    halvings = np.floor(np.log2(step)).astype(np.int64)
    steps = {f"step_{1 << halving}": int(n) for halving, n in enumerate(np.bincount(halvings)) if n}
    cases = {f"case_{Case(k).name.lower()}": int(n) for k, n in enumerate(np.bincount(drawn_cases(work.pieces))) if n}
    atlas = {
        "atlas_used": work.atlas_used,
        "tile_resolution": float(work.resolution.min(initial=1)),
        "tile_error": float(work.error.max(initial=0)),
    }
    return drawn | levels | steps | cases | atlas
