"""glTF files whose nodes move, and where their nodes are at a moment, computed by hand."""

import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glb_files import Glb

# No two of its corners and edges are alike, so that no turn or mirror maps it to itself.
WEDGE = np.array([(0, 0, 0), (1, 0, 0), (0, 2, 0), (0, 0, 3)], float)
FACES = (0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3)

Nodes = list[dict[str, Any]]
Curves = dict[tuple[int, str], tuple[str, list[float], NDArray[np.float64]]]
"""By node and property: the interpolation, times (k,), and values, (k, w) or of splines (3 k, w)."""


def write(path: Path, nodes: Nodes, curves: Curves, **more: Any) -> Path:
    """A file of two wedges, whose nodes move by `curves`."""
    glb = Glb()
    for size in (1.0, 0.5):
        glb.mesh({"POSITION": glb.accessor(WEDGE * size)}, FACES)
    if curves:
        samplers = [
            {"input": glb.accessor(times), "output": glb.accessor(values), "interpolation": kind}
            for kind, times, values in curves.values()
        ]
        targets = [{"node": node, "path": name} for node, name in curves]
        channels = [{"sampler": number, "target": target} for number, target in enumerate(targets)]
        glb.header["animations"] = [{"samplers": samplers, "channels": channels}]
    glb.header |= more
    children = {child for node in nodes for child in node.get("children", [])}
    return glb.write(path, *nodes, roots=[number for number in range(len(nodes)) if number not in children])


def posed(nodes: Nodes, curves: Curves, moment: float) -> Nodes:
    """The nodes as they are at a moment, computed by hand after appendix C of glTF 2.0."""
    placed = [dict(node) for node in nodes]
    for (node, name), curve in curves.items():
        placed[node][name] = value_of(*curve, name == "rotation", moment).tolist()
    return placed


def value_of(
    kind: str, times: list[float], values: NDArray[np.float64], turns: bool, moment: float
) -> NDArray[np.float64]:
    rows = values.reshape(len(times), -1, values.shape[1])  # of splines: tangent, value, tangent
    points = rows[:, 1 if kind == "CUBICSPLINE" else 0]
    after = sum(time <= moment for time in times)
    if after == 0 or after == len(times):
        found = points[min(after, len(times) - 1)]
    else:
        one, other, length = points[after - 1], points[after], times[after] - times[after - 1]
        part = (moment - times[after - 1]) / length
        if kind == "STEP":
            found = one
        elif kind == "CUBICSPLINE":
            square, cube = part**2, part**3
            found = (2 * cube - 3 * square + 1) * one + length * (cube - 2 * square + part) * rows[after - 1, 2]
            found = found + (-2 * cube + 3 * square) * other + length * (cube - square) * rows[after, 0]
        elif turns:
            cosine = float(one @ other)
            angle = math.acos(min(abs(cosine), 1.0))
            whole = np.array([one, other if cosine >= 0 else -other])
            weights = [math.sin((1 - part) * angle), math.sin(part * angle)] if angle > 1e-6 else [1 - part, part]
            found = weights @ whole
        else:
            found = (1 - part) * one + part * other
    return np.asarray(found / np.linalg.norm(found) if turns else found)
