"""Define a loaded scene: its assets, and the objects that its nodes flatten into.

Its objects move in two ways: a node is placed anew (`set_node_transform`), or time passes (`show_moment`).
"""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from depthwalk.errors import InputError
from depthwalk.scene.arrays import Camera, Nodes, Objects, place_nodes, place_objects
from depthwalk.scene.environment import Environment, WalkParams
from depthwalk.scene.render_settings import RenderSettings
from depthwalk.scene.schema import DpciParams, IntrinsicsParams, PanoramaParams
from depthwalk.scene.similarity import Similarity, from_angles

if TYPE_CHECKING:
    from depthwalk.scene.advice import Advice
    from depthwalk.scene.animation import Animations


@dataclass(frozen=True, kw_only=True)
class MeshAsset:
    """Describe an asset that is read from a mesh file.

    Attributes
    ----------
    name
        Name of the asset in the scene file.
    mesh, texture
        Absolute paths. The texture replaces the mesh file's own; None keeps those.
    up
        The file's upward axis.
    height
        Height in metres to which the asset is scaled; None keeps the file's size.
    dpci
        How to bake its depth images; None for an asset without depth images.
    up_is_given
        Whether the user set `up`; if not, a model that is shown alone is turned upright by a guess.
    place
        Where the scene file names it, `file:line:column: assets.name`, for errors; "" for a model without a scene file,
        and where an option says what it is.
    """

    name: str
    mesh: Path
    texture: Path | None
    up: Literal["y", "z"]
    height: float | None
    dpci: DpciParams | None
    up_is_given: bool = False
    place: str = field(default="", compare=False)


@dataclass(frozen=True, kw_only=True)
class DepthImageAsset:
    """Describe an asset that is read from a depth image.

    It is one of three: a relief, which has a `size`; a range image, which has `intrinsics`; or a `panorama`.

    Attributes
    ----------
    name
        Name of the asset in the scene file.
    depth, colour, normal
        Absolute paths; None for a colour or normal map that is not given.
    size
        Width and height of a relief, metres; None for others.
    range
        Metres between white, in front, and black; None if the file has a unit or holds floats.
    unit
        Metres per unit of the depth file; None: floats are metres.
    intrinsics
        The camera of a range image; None for others.
    panorama
        How a panorama is seen; None for others.
    method
        "cut" where the surface is cut at jumps in depth, "paper" where it is not.
    place
        Where the scene file names it, `file:line:column: assets.name`, for errors; "" for a model without a scene file,
        and where an option says what it is.
    """

    name: str
    depth: Path
    colour: Path | None
    normal: Path | None
    size: tuple[float, float] | None
    range: float | None
    unit: float | None
    intrinsics: IntrinsicsParams | None
    panorama: PanoramaParams | None = None
    method: Literal["cut", "paper"] = "cut"
    place: str = field(default="", compare=False)


@dataclass(frozen=True, kw_only=True)
class BakedAsset:
    """Describe an asset whose depth images are read from a file.

    Attributes
    ----------
    name
        Name of the asset in the scene file.
    baked
        Absolute path of the depth images, cooked or not.
    source
        The mesh that they were made from, with `dpci` None; None if there is no mesh.
    place
        Where the scene file names it, `file:line:column: assets.name`, for errors; "" for a model without a scene file,
        and where an option says what it is.
    """

    name: str
    baked: Path
    source: MeshAsset | None
    place: str = field(default="", compare=False)


Asset = MeshAsset | DepthImageAsset | BakedAsset


@contextmanager
def told_at(asset: Asset) -> Iterator[None]:
    """Add to InputErrors of a `with` block, which are about the files of an `asset`, where the scene names it."""
    try:
        yield
    except InputError as error:
        if not asset.place:
            raise
        raise error.at(asset.place) from error


@dataclass(frozen=True, kw_only=True)
class Scene:
    """Hold everything that a scene file says, checked and resolved.

    Its arrays change only through `set_node_transform` and `show_moment`.

    Attributes
    ----------
    path : Path
        The scene file, as the user gave it.
    assets : tuple of Asset
        The models; objects refer to them by index.
    objects : Objects
        The n objects, in the world.
    nodes : Nodes
        The m nodes that hold them.
    instances : n transforms, float32
        Placement of each object in the frame of its node, metres.
    owner : (n,) int32
        The row in `nodes` of the node that holds each object.
    environment : Environment
        Sky, ground, lights and fog.
    picture_places : dict
        Where the scene names the pictures of its sky and ground, by their paths, as errors about them begin.
    camera : Camera or None
        The first view; None for one that shows all objects, which the renderer computes since it knows their bounds.
    render : RenderSettings
        How the picture is drawn.
    walk : WalkParams
        How the camera moves in the window.
    advice : dict of Advice
        The findings of `depthwalk advise`, by name of the asset.
    advice_file : Path or None
        The file that held them.
    places_files : tuple of Path
        The files of its `places` items.
    animations : Animations or None
        How nodes move over time; None where none does.
    beside : tuple of Path
        Further models that are shown together with the one at `path`, without a scene file.
    side_by_side : bool
        Whether these stand in a row; otherwise they are at the coordinates of their files.
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
    advice: "Mapping[str, Advice]" = field(default_factory=dict)
    advice_file: Path | None = None
    places_files: tuple[Path, ...] = ()
    animations: "Animations | None" = None
    picture_places: Mapping[Path, str] = field(default_factory=dict)
    beside: tuple[Path, ...] = ()
    side_by_side: bool = False

    @property
    def files(self) -> tuple[Path, ...]:
        """Return the scene file, or the models that are shown without one."""
        return (self.path, *self.beside)

    @property
    def title(self) -> str:
        """Return what to call the scene in a line for the user: the name of its file, or `a.obj and 2 more`."""
        return self.path.name + (f" and {len(self.beside)} more" if self.beside else "")


def set_node_transform(
    scene: Scene,
    node: int,
    position: tuple[float, float, float],
    angles: tuple[float, float, float],
    scale: float,
) -> slice:
    """Move a node within its parent, and recompute the nodes and objects below it, in place.

    Parameters
    ----------
    scene
        The scene, which is changed.
    node
        Index of the node in `scene.nodes`.
    position
        (3,) metres, in the parent's frame.
    angles
        (3,) yaw about +Y, pitch about +X and roll about +Z, radians; roll is applied first, yaw last.
    scale
        Scale relative to the parent, > 0.

    Returns
    -------
    slice
        The run of `scene.objects` that changed.

    Raises
    ------
    IndexError
        If there is no such node.
    ValueError
        If a value is not finite, or the scale is not positive; the scene is then unchanged.
    """
    if not 0 <= node < len(scene.nodes):
        raise IndexError(f"no node {node}: the scene has {len(scene.nodes)}")
    if not (np.isfinite([*position, *angles, scale]).all() and scale > 0):
        raise ValueError("a node's transform must be finite, its scale positive")
    local = scene.nodes.local
    local.position[node], scene.nodes.angles[node], local.scale[node] = position, angles, scale
    local.rotation[node] = from_angles(*np.array(angles, float)[:, None])[0]
    place_nodes(scene.nodes, np.arange(node, int(scene.nodes.end[node])))
    first = int(scene.nodes.first_object[node])
    changed = slice(first, first + int(scene.nodes.object_count[node]))
    place_objects(scene.objects, scene.nodes, scene.instances, scene.owner, changed)
    return changed


def show_moment(scene: Scene, seconds: float) -> NDArray[np.int64]:
    """Place all animated nodes of a scene, and the objects below them, as they are at a moment, in place.

    Parameters
    ----------
    scene
        The scene, which is changed.
    seconds
        The moment, seconds since the scene began.

    Returns
    -------
    (n,) int64
        Rows of `scene.objects` that were placed; empty for a scene without animations.
    """
    if scene.animations is None:
        return np.zeros(0, np.int64)
    scene.animations.place(scene.nodes, seconds)
    moved = scene.animations.moved_objects
    place_objects(scene.objects, scene.nodes, scene.instances, scene.owner, moved)
    return moved
