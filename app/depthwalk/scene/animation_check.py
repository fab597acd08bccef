"""Check what a scene file says about the movement of its nodes, and turn it into arrays."""

from collections.abc import Sequence

import numpy as np

from depthwalk.errors import InputError
from depthwalk.scene.animation import Animations, animations
from depthwalk.scene.flatten import (
    MAX_WORLD_COORDINATE,
    MAX_WORLD_SCALE,
    MIN_WORLD_SCALE,
    Flat,
    ListedItem,
)
from depthwalk.scene.path import order_errors
from depthwalk.scene.schema import AnimationParams, GroupParams, ObjectParams
from depthwalk.scene.validate import Source, raise_all


def load_animations(rows: Sequence[ListedItem], flat: Flat, source: Source) -> Animations:
    """Return the animations of a scene file.

    Parameters
    ----------
    rows
        The items of the file, at least one of which is animated.
    flat
        The nodes and objects that they make.
    source
        Origin of the values, to locate errors.

    Returns
    -------
    Animations
        Their keyframes as arrays, and what they move.

    Raises
    ------
    InputError
        With one located line per mistake: keyframes that are not in order, a scale where there can be none, and
        movements that leave the range of the arrays.
    """
    specs = [(number, row.spec.animation) for number, row in enumerate(rows) if row.spec.animation is not None]
    raise_all([error for number, spec in specs for error in _mistakes(rows[number], spec, source)])
    animated = animations(specs, flat.nodes)
    _check_reach(rows, flat, animated, source)
    return animated


def _mistakes(row: ListedItem, spec: AnimationParams, source: Source) -> list[InputError]:
    """Return the mistakes in the keyframes of one item."""
    loc = *row.loc, "animation", "keyframes"
    found = order_errors(np.array([key.time for key in spec.keyframes]), loc, source)
    if not isinstance(row.spec, ObjectParams | GroupParams):
        found += [
            source.error((*loc, number, "scale"), "only objects and groups change their size; put this into a group")
            for number, key in enumerate(spec.keyframes)
            if key.scale is not None
        ]
    return found


def _check_reach(rows: Sequence[ListedItem], flat: Flat, animated: Animations, source: Source) -> None:
    """Raise InputError if a movement, through nested groups, may come near the limits of float32.

    This adds up the farthest that each group reaches, so that no moment need be tried.
    """
    nodes = flat.nodes
    reach = np.linalg.norm(nodes.local.position, axis=1)
    least, most = nodes.local.scale.copy(), nodes.local.scale.copy()
    reach[animated.node], least[animated.node], most[animated.node] = animated.extents()
    for depth in range(1, int(nodes.depth.max(initial=0)) + 1):
        at = np.flatnonzero(nodes.depth == depth)
        above = nodes.parent[at]
        reach[at] = reach[above] + most[above] * reach[at]
        least[at] *= least[above]
        most[at] *= most[above]
    within = np.zeros(len(rows))
    np.maximum.at(within, flat.owner, np.linalg.norm(flat.instances.position, axis=1).astype(float))
    reach += most * within
    for node in animated.moved_nodes.tolist():
        if least[node] < MIN_WORLD_SCALE or most[node] > MAX_WORLD_SCALE:
            limits = f"{MIN_WORLD_SCALE:g} to {MAX_WORLD_SCALE:g}"
            raise source.error(rows[node].loc, f"may have a scale that is not {limits}, as it moves with its groups")
        if reach[node] > MAX_WORLD_COORDINATE:
            raise source.error(
                rows[node].loc, f"may move farther than {MAX_WORLD_COORDINATE:g} m from the origin, with its groups"
            )
