"""Load a scene, move its nodes, and look up which object belongs to which node."""

import json
import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from weakref import WeakMethod

import numpy as np

from depthwalk.errors import InputError, suggest
from depthwalk.scene import loader
from depthwalk.scene.arrays import Camera
from depthwalk.scene.environment import Environment
from depthwalk.scene.render_settings import RenderSettings
from depthwalk.scene.scene import Scene as LoadedScene
from depthwalk.scene.scene import set_node_transform

PathLike = str | os.PathLike[str]


class Scene:
    """Hold a scene loaded by `load_scene`: a tree of nodes with their objects.

    A node is an entry of the file's `objects`, named or not; one node may hold many objects, as a `grid` does. Objects
    are numbered from 0 in the order of the file, and `Image.object_id` holds these numbers.

    Examples
    --------
    >>> scene = dw.load_scene("scene.yaml")
    >>> scene.nodes
    ('ball', 'row', '')
    >>> scene.objects_of("row")
    range(1, 4)
    >>> scene.nodes[scene.node_of(2)]
    'row'
    """

    def __init__(self, loaded: LoadedScene) -> None:
        """Wrap the arrays `loaded` of a scene. Users call `load_scene`."""
        self._loaded = loaded
        self._watchers: list[WeakMethod[Callable[[slice], None]]] = []

    @property
    def loaded(self) -> LoadedScene:
        """Return the arrays behind the scene, for the package's own modules."""
        return self._loaded

    @property
    def path(self) -> Path:
        """Return the path of the file, as it was given to `load_scene`."""
        return self._loaded.path

    @property
    def camera(self) -> Camera | None:
        """Return the file's camera; None if it has none, and `Renderer.render` then shows every object."""
        return self._loaded.camera

    @property
    def settings(self) -> RenderSettings:
        """Return the render settings, the file's `render`. They may be changed; the next frame uses the new values."""
        return self._loaded.render

    @property
    def environment(self) -> Environment:
        """Return sun, sky, lamps, ground and fog. They may be changed; the next frame uses the new values."""
        return self._loaded.environment

    @property
    def nodes(self) -> tuple[str, ...]:
        """Return the name of every node in the order of the file, "" for unnamed ones."""
        return self._loaded.nodes.name

    @property
    def object_count(self) -> int:
        """Return the number of objects in the scene."""
        return len(self._loaded.objects)

    def objects_of(self, node: int | str) -> range:
        """Return the numbers of all objects of a node and of the nodes below it.

        Parameters
        ----------
        node
            The node's number, that is its row in `nodes`, or its name.

        Returns
        -------
        range
            The numbers of the objects.

        Raises
        ------
        InputError
            For a node that does not exist, and for a name that several nodes share.
        """
        number, nodes = self._number(node), self._loaded.nodes
        first = int(nodes.first_object[number])
        return range(first, first + int(nodes.object_count[number]))

    def node_of(self, object_id: int) -> int:
        """Return the number of the node that holds an object.

        Parameters
        ----------
        object_id
            Number of the object, as in `Image.object_id`.

        Returns
        -------
        int
            The node's row in `nodes`.

        Raises
        ------
        InputError
            If there is no such object; this includes the −1 that `Image.object_id` holds for the background.
        """
        if not 0 <= object_id < self.object_count:
            raise InputError(f"no object {object_id}: the scene has {self.object_count}")
        return int(self._loaded.owner[object_id])

    def position_of(self, node: int | str) -> tuple[float, float, float]:
        """Return the position of a node: x, y and z in its parent's frame, metres.

        Parameters
        ----------
        node
            The node's number, that is its row in `nodes`, or its name.

        Raises
        ------
        InputError
            For a node that does not exist, and for a name that several nodes share.
        """
        x, y, z = self._loaded.nodes.local.position[self._number(node)].tolist()
        return x, y, z

    def move(
        self,
        node: int | str,
        *,
        position: tuple[float, float, float] | None = None,
        yaw: float | None = None,
        pitch: float | None = None,
        roll: float | None = None,
        scale: float | None = None,
    ) -> None:
        """Move, turn or scale a node within its parent, together with everything below it.

        A value of None leaves that part of the transform unchanged. Every renderer of the scene shows the change in its
        next frame.

        Parameters
        ----------
        node
            The node's number, that is its row in `nodes`, or its name.
        position
            (3,) metres, in the parent's frame.
        yaw
            Radians about +Y, counter-clockwise seen from above.
        pitch
            Radians about +X, applied before `yaw`; a quarter turn lays what stands forward, its top towards +Z.
        roll
            Radians about +Z, applied before `pitch`; half a turn is upside down.
        scale
            Scale relative to the parent, above 0.

        Raises
        ------
        InputError
            For a node that does not exist, a name that several share, and values out of range.

        Examples
        --------
        >>> scene = dw.load_scene("scene.yaml")
        >>> scene.move("ball", position=(0.0, 0.5, 0.0), yaw=1.5)
        >>> scene.move("bell", scale=2.0)
        Traceback (most recent call last):
        depthwalk.errors.InputError: no node 'bell'; did you mean 'ball'?
        """
        number, nodes = self._number(node), self._loaded.nodes
        place = self.position_of(number) if position is None else position
        if np.shape(place) != (3,):
            raise InputError(f"node {node!r}: position {place} must be three numbers")
        kept = nodes.angles[number].tolist()
        turn, tip, lean = (old if new is None else new for old, new in zip(kept, (yaw, pitch, roll), strict=True))
        factor = float(nodes.local.scale[number]) if scale is None else scale
        for name, value in (("yaw", turn), ("pitch", tip), ("roll", lean), ("scale", factor)):
            if np.shape(value) or isinstance(value, str):
                raise InputError(f"node {node!r}: {name} {value!r} must be a number")
        try:
            changed = set_node_transform(self._loaded, number, place, (turn, tip, lean), factor)
        except ValueError as error:
            raise InputError(f"node {node!r}: {error}") from None
        for watcher in self._watchers:
            if (notify := watcher()) is not None:
                notify(changed)

    def watch(self, notify: Callable[[slice], None]) -> None:
        """Call a bound method with each run of objects that `move` moves, for as long as the method's object lives.

        Parameters
        ----------
        notify
            The method; it receives a slice of the scene's objects.
        """
        self._watchers = [watcher for watcher in self._watchers if watcher() is not None]
        self._watchers.append(WeakMethod(notify))

    def _number(self, node: int | str) -> int:
        """Return a node's number."""
        if isinstance(node, str):
            found = [number for number, name in enumerate(self.nodes) if name == node]
            if not node or not found:
                names = [name for name in self.nodes if name]
                raise InputError(f"no node {node!r}{suggest(node, names)}")
            if len(found) > 1:
                raise InputError(f"{len(found)} nodes are named {node!r}: give a number, one of {found}")
            return found[0]
        if not 0 <= node < len(self.nodes):
            raise InputError(f"no node {node}: the scene has {len(self.nodes)}")
        return node


def check_scene(scene: Scene) -> None:
    """Raise TypeError if `scene` is not a `Scene`, but for example the name of a file."""
    if not isinstance(scene, Scene):
        raise TypeError(f"scene: must be a Scene, as load_scene returns it, not {scene!r}")


def load_scene(
    path: PathLike, asset_roots: Sequence[PathLike] = (), overrides: Mapping[str, object] | None = None
) -> Scene:
    """Load a scene file; a mesh or a file of depth images is loaded as a scene that holds nothing else.

    This only checks that assets exist; a `Renderer` reads them.

    Parameters
    ----------
    path
        A scene file (docs/scene-file.md), a mesh, or a file of depth images.
    asset_roots
        Folders, besides the scene's own, in which to look for its files.
    overrides
        Values to replace, by dotted key, as the option `--set` takes them: numbers, booleans, lists and mappings, or
        text, which is read as YAML; None replaces none.

    Returns
    -------
    Scene
        The scene.

    Raises
    ------
    InputError
        With one line per mistake, each with its position in the file.
    TypeError
        If `asset_roots` is a single folder instead of a list, or the mapping meant for `overrides`.

    Examples
    --------
    >>> scene = dw.load_scene("scene.yaml", overrides={"render.aa": "smaa"})
    >>> scene.object_count
    5
    >>> dw.load_scene("secne.yaml")
    Traceback (most recent call last):
    depthwalk.errors.InputError: secne.yaml: no such file; did you mean 'scene.yaml'?
    """
    if isinstance(asset_roots, str | os.PathLike | Mapping):
        raise TypeError(f"asset_roots: must be a list of folders, not {asset_roots!r}")
    roots = [Path(root) for root in asset_roots]
    texts = {key: _yaml_text(key, value) for key, value in (overrides or {}).items()}
    return Scene(loader.load_scene(Path(path), roots, texts))


def _yaml_text(key: str, value: object) -> str:
    """Return YAML text for the override `value` of `key`: text as it is, anything else as JSON, which YAML includes."""
    try:
        return value if isinstance(value, str) else json.dumps(value)
    except (TypeError, ValueError):
        kinds = "text, a number, a boolean, a list or a mapping"
        raise InputError(f"overrides: {key}: must be {kinds}, not {type(value).__name__}") from None
