"""A loaded scene: assets, the node table, and the objects it flattens into."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from depthwalk.scene.arrays import Camera, Objects
from depthwalk.scene.environment import Environment, WalkParams
from depthwalk.scene.render_settings import RenderSettings
from depthwalk.scene.schema import DpciParams, IntrinsicsParams
from depthwalk.scene.similarity import Similarity, compose, quaternions


@dataclass(frozen=True)
class MeshAsset:
    """A mesh file. height: metres, None keeps the file's size; dpci: the depth images to bake, or None."""

    name: str
    mesh: Path
    texture: Path | None
    up: Literal["y", "z"]
    height: float | None
    dpci: DpciParams | None


@dataclass(frozen=True)
class DepthImageAsset:
    """A relief, or what a depth camera saw: the one has a size, the other intrinsics.

    size: width and height, metres; range: metres between white (in front) and black; unit: metres per count of the
    file. None where the scene does not say.
    """

    name: str
    depth: Path
    colour: Path | None
    normal: Path | None
    size: tuple[float, float] | None
    range: float | None
    unit: float | None
    intrinsics: IntrinsicsParams | None


Asset = MeshAsset | DepthImageAsset


@dataclass(frozen=True)
class Nodes:
    """m nodes in the order of the file, a group before what it holds: a subtree is one run of nodes and of objects.

    name:         m names, "" where the file gives none.
    parent:       (m,) int32, −1 at the top.
    depth:        (m,) int32, 0 at the top.
    end:          (m,) int32, one past the last node of the subtree.
    first_object: (m,) int32, and object_count: (m,) int32: the subtree's slice of the objects.
    local:        m transforms float64: the node in its parent.
    world:        m transforms float64: the node in the world, kept by `set_node_transform`.
    """

    name: tuple[str, ...]
    parent: NDArray[np.int32]
    depth: NDArray[np.int32]
    end: NDArray[np.int32]
    first_object: NDArray[np.int32]
    object_count: NDArray[np.int32]
    local: Similarity
    world: Similarity

    def __len__(self) -> int:
        return len(self.name)


@dataclass(frozen=True)
class Scene:
    """Everything a scene file says, checked and resolved; its arrays change through `set_node_transform` only.

    path:      the scene file, as the user gave it.
    instances: n transforms float32: each object in its node; owner: (n,) int32, that node.
    camera:    the first view, or None: the renderer frames the objects, whose bounds it knows.
    """

    path: Path
    assets: tuple[Asset, ...]
    objects: Objects
    nodes: Nodes
    instances: Similarity
    owner: NDArray[np.int32]
    environment: Environment
    camera: Camera | None
    render: RenderSettings
    walk: WalkParams = field(default_factory=WalkParams)


def set_node_transform(
    scene: Scene, node: int, position: tuple[float, float, float], yaw: float, scale: float
) -> slice:
    """Place a node in its parent and recompute what hangs below it, and nothing else, in place.

    position: metres; yaw: radians about +Y; scale: > 0.
    Returns the slice of `scene.objects` that changed. Raises IndexError for a node that is none, ValueError for
    values that are not finite or a scale that is not positive.
    """
    if not 0 <= node < len(scene.nodes):
        raise IndexError(f"no node {node}: the scene has {len(scene.nodes)}")
    if not (np.isfinite([*position, yaw, scale]).all() and scale > 0):
        raise ValueError("a node's transform must be finite, its scale positive")
    local = scene.nodes.local
    local.position[node], local.yaw[node], local.scale[node] = position, yaw, scale
    place_nodes(scene.nodes, node, int(scene.nodes.end[node]))
    first = int(scene.nodes.first_object[node])
    changed = slice(first, first + int(scene.nodes.object_count[node]))
    place_objects(scene.objects, scene.nodes, scene.instances, scene.owner, changed)
    return changed


def place_nodes(nodes: Nodes, first: int, end: int) -> None:
    """Recompute the world transforms of the nodes `first` to `end − 1`, whole subtrees, level by level."""
    depth = nodes.depth[first:end]
    for level in range(int(depth.min(initial=0)), int(depth.max(initial=-1)) + 1):
        here = first + np.flatnonzero(depth == level)
        local = nodes.local[here]
        nodes.world[here] = compose(nodes.world[nodes.parent[here]], local) if level else local


def place_objects(
    objects: Objects, nodes: Nodes, instances: Similarity, owner: NDArray[np.int32], which: slice
) -> None:
    """Recompute position, rotation and scale of a slice of the objects from their nodes."""
    world = compose(nodes.world[owner[which]], instances[which])
    objects.position[which] = world.position
    objects.rotation[which] = quaternions(world.yaw)
    objects.scale[which] = world.scale
