"""Reproduce table 1 of the paper: two heads as depth images and as polygons (Liu, Liu and Wu 2007, §4).

The paper's heads have 67,170 and 78,157 triangles; those here, `assets/*_of_the_paper.ply`, have the same numbers. Each
is drawn alone, nearby as in the paper, and from increasing distances.
"""

from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass, replace

import numpy as np

from depthwalk.assets.library import SceneLibrary
from depthwalk.assets.mesh_library import Report
from depthwalk.bench.equal import SUPERSAMPLING
from depthwalk.bench.ratio import paired_ratio
from depthwalk.bench.tables.table import Cell, Table
from depthwalk.bench.tables.walks import near_distance, quality, truth, walk_past
from depthwalk.render import kernels
from depthwalk.render.headless import HeadlessRenderer
from depthwalk.resources import scene_root
from depthwalk.scene.arrays import Representation
from depthwalk.scene.loader import load_scene
from depthwalk.scene.scene import Scene

SIZE = 1024, 768
HEIGHT = 1.8  # of the heads, metres, as in the scene
CENTRE = 0.0, HEIGHT / 2, 0.0
FARTHER = 1.45  # ratio of each distance to the one before
DISTANCES = 11  # nearby, and ten more
# By name: the triangles, and how many times as fast as polygons the paper drew 512² and 256².
PAPER = {"venus": (67_170, 67.514 / 32.351, 185.795 / 32.351), "man": (78_157, 67.514 / 28.346, 185.795 / 28.346)}


@dataclass(frozen=True, kw_only=True)
class Way:
    """Describe how a head is drawn.

    Attributes
    ----------
    resolution
        Texels along an edge of the depth images, 512 or 256.
    representation
        Its representation.
    remembers
        Whether impostors are reused as long as they are good enough; otherwise all are re-warped in every frame.
    """

    resolution: int = 512
    representation: Representation = Representation.DPCI
    remembers: bool = True


WAYS = {
    "512²": Way(),
    "256²": Way(resolution=256),
    "512² re-warped": Way(remembers=False),
    "256² re-warped": Way(resolution=256, remembers=False),
    "polygons": Way(representation=Representation.MESH),
    "mesh-lod": Way(representation=Representation.MESH_LOD),
    "mesh-clusters": Way(representation=Representation.MESH_CLUSTERS),
}
_COMPARED = ("512²", "256²", "512² re-warped", "256² re-warped", "mesh-lod", "mesh-clusters")


def measured(report: Report, distances: int = DISTANCES) -> Table:
    """Measure the table.

    Parameters
    ----------
    report
        Called with the name of a head and the stage that begins.
    distances
        Number of distances.

    Returns
    -------
    Table
        A row for each head and distance.

    Raises
    ------
    GpuError
        If no OpenGL 3.3 context can be created.
    """
    kernels.load()
    return Table(
        name="heads",
        title="Table 1: heads, depth images against polygons",
        source="Liu, Liu and Wu 2007, table 1: 2.09 and 5.74 × (Venus), 2.38 and 6.55 × (man's head)",
        columns=(
            *("head", "triangles", "pixels high", "polygons, ms"),
            *(f"polygons ÷ {name}" for name in _COMPARED),
            *(f"{name}: PSNR, FLIP" for name in ("512²", "256²", "polygons")),
        ),
        rows=tuple(row for head in PAPER for row in _rows(head, distances, report)),
        notes=(
            "The camera walks past at 1.4 m/s and 30 frames per second; all ways to draw the head alternate frame by "
            "frame. Ratios are medians over the frames, with the bounds of 95 % confidence in brackets. The first row "
            "of each head is the paper's: the head fills the picture.",
            "re-warped: no impostor is reused from an earlier frame, as in the paper. mesh-lod and mesh-clusters: "
            "simplified, with an error of at most half a pixel.",
            "PSNR and FLIP: compared with polygons at 16 samples per pixel, where either shows the head.",
        ),
    )


def _rows(head: str, distances: int, report: Report) -> Iterator[tuple[Cell, ...]]:
    with ExitStack() as opened:

        def open_way(way: Way, size: tuple[int, int]) -> HeadlessRenderer:
            scene = _alone(f"{head}-{way.resolution}")
            library = SceneLibrary(scene.assets, report)
            return opened.enter_context(HeadlessRenderer(scene, library, size, way.representation))

        drawn = {name: open_way(way, SIZE) for name, way in WAYS.items()}
        for name, headless in drawn.items():
            headless.renderer.remembers = WAYS[name].remembers
        true = open_way(WAYS["polygons"], (SIZE[0] * SUPERSAMPLING, SIZE[1] * SUPERSAMPLING))
        for number in range(distances):
            distance = near_distance(HEIGHT) * FARTHER**number
            report(head, f"{number + 1} of {distances} distances")
            runs = walk_past(drawn, CENTRE, distance)
            reference = truth(true, CENTRE, distance)
            polygons = runs["polygons"].frame_times
            yield (
                head,
                f"{PAPER[head][0]:,}",
                f"{SIZE[1] * 0.8 / FARTHER**number:.0f}",
                runs["polygons"].frame_ms.p50,
                *(paired_ratio(polygons, runs[name].frame_times) for name in _COMPARED),
                *(str(quality(drawn[name], reference, CENTRE, distance)) for name in ("512²", "256²", "polygons")),
            )


def _alone(asset: str) -> Scene:
    """Return the scene of the table with one of its assets, and nothing else to be baked."""
    scene = load_scene(scene_root() / "paper" / "table-1-heads.yaml", overrides={"objects.0.asset": asset})
    wanted = int(scene.objects.asset[0])
    objects = replace(scene.objects, asset=np.zeros_like(scene.objects.asset))
    return replace(scene, assets=scene.assets[wanted : wanted + 1], objects=objects)
