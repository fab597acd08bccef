"""Reproduce the table of edge-optimised GPAA: how long it takes to find the edges that are smoothed.

The paper (基于边缘优化的几何体信息反走样, table 1) counts 8, 10, 44 and 102 vertices for its cube, wheel cover, wing
and canopy; `quality.edges.SHAPES` are such models.
"""

from depthwalk.assets.mesh_library import Report
from depthwalk.bench.tables.table import Table
from depthwalk.quality.edges import MANY, SHAPES, shape_cost
from depthwalk.render import kernels

SIZE = 1024, 768
PAPER = 0.76, 0.88, 0.75, 0.71  # time for silhouettes and creases over that for all edges


def measured(report: Report) -> Table:
    """Measure the table; `report` is called with the name of a shape and the stage that begins."""
    kernels.load()
    rows = []
    for (name, shape), paper in zip(SHAPES.items(), PAPER, strict=True):
        report(name, "edges")
        alone, many = shape_cost(shape, 1, SIZE), shape_cost(shape, MANY, SIZE)
        (all_lines, chosen), times = alone.lines.tolist(), [cost.milliseconds.tolist() for cost in (alone, many)]
        rows.append(
            (
                name,
                f"{all_lines:.0f} → {chosen:.0f}",
                *(cell for every, few in times for cell in (every, few, few / every)),
                paper,
            )
        )
    return Table(
        name="edges",
        title="GPAA: silhouettes and creases compared with all edges",
        source="基于边缘优化的几何体信息反走样, table 1: 0.76, 0.88, 0.75 and 0.71 of the time",
        columns=(
            *("shape", "lines", "one object: all, ms", "chosen, ms", "chosen ÷ all"),
            *(f"{MANY} objects: all, ms", "chosen, ms", "chosen ÷ all", "the paper's"),
        ),
        rows=tuple(rows),
        notes=("Time to find the lines of a frame on one core: the shortest of many runs, which alternate.",),
    )
