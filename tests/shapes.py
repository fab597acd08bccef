"""Meshes of known shape and a library of them, for tests that need no files."""

import hashlib
import pickle
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache, lru_cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Literal, NoReturn, TypedDict, TypeVar, Unpack, cast, overload

import numpy as np
from numpy.typing import NDArray
from tools.make_models.model import Model, vertex_normals

from depthwalk.assets.cooked import cooked_objects
from depthwalk.bake.baker import bake_object
from depthwalk.bake.capture import capture_views
from depthwalk.bake.captured_views import CapturedViews, CaptureParams
from depthwalk.bake.division import Cell, part_faces
from depthwalk.bake.images import BakedObject
from depthwalk.bake.levels import mesh_levels
from depthwalk.bake.model import BakedModel
from depthwalk.bake.params import BakeParams, ModelParams
from depthwalk.bake.parts import bake_model, submesh
from depthwalk.cache import cache_folder
from depthwalk.cook.cluster_builder import build_clusters
from depthwalk.cook.cook import CookedObject, CookOptions
from depthwalk.cook.mesh_clusters import MeshClusters
from depthwalk.files import write_bytes
from depthwalk.ingest.mesh import Material, Mesh, MeshLevel, Part
from depthwalk.ingest.sky_image import load_sky_image
from depthwalk.scene.arrays import Objects, Representation
from depthwalk.scene.environment import Environment
from depthwalk.scene.render_settings import RenderSettings
from depthwalk.scene.scene import Scene
from depthwalk.types import Array, Rows

T = TypeVar("T")


class Look(TypedDict, total=False):
    """How a mesh looks: its colour, 0 to 255, and how strongly it mirrors light."""

    colour: tuple[int, int, int]
    specular: float


def mesh_of(
    positions: Array | Sequence[Array | Sequence[float]],
    faces: Rows | Sequence[Sequence[int]],
    normals: Array | Sequence[Array | Sequence[float]],
    colour: tuple[int, int, int] = (200, 120, 80),
    specular: float = 0.15,
) -> Mesh:
    count = len(positions)
    return Mesh(
        positions=np.asarray(positions, np.float32),
        normals=np.asarray(normals, np.float32),
        colours=np.tile(np.array(colour, np.uint8), (count, 1)),
        uv=np.zeros((count, 2), np.float32),
        faces=np.asarray(faces, np.int32),
        parts=(Part(0, len(faces), 0),),
        materials=(Material((1.0, 1.0, 1.0), specular=specular),),
    )


def lattice(columns: int, rows: int) -> Rows:
    """Quads of a (rows + 1) × (columns + 1) lattice as triangles, counter-clockwise where column × row points out."""
    i, j = np.meshgrid(np.arange(columns), np.arange(rows))
    a = (j * (columns + 1) + i).ravel()
    b, c, d = a + 1, a + columns + 1, a + columns + 2
    return np.concatenate([np.stack([a, b, d], -1), np.stack([a, d, c], -1)])


def sphere(radius: float = 1.0, columns: int = 256, rows: int = 128, **look: Unpack[Look]) -> Mesh:
    """A sphere that stands on the origin."""
    phi, theta = np.meshgrid(np.linspace(0, 2 * np.pi, columns + 1), np.linspace(-np.pi / 2, np.pi / 2, rows + 1))
    normals = np.stack([np.cos(theta) * np.sin(phi), np.sin(theta), np.cos(theta) * np.cos(phi)], -1).reshape(-1, 3)
    faces = lattice(columns, rows)
    corners = normals[faces]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    return mesh_of(normals * radius + [0, radius, 0], faces[area > 1e-9], normals, **look)


def box(
    width: float,
    height: float,
    depth: float,
    centre: tuple[float, float, float] = (0.0, 0.0, 0.0),
    **look: Unpack[Look],
) -> Mesh:
    """A box around `centre` with hard edges."""
    positions: list[Array] = []
    normals: list[Array] = []
    faces: list[list[int]] = []
    for axis in range(3):
        for sign in (-1, 1):
            normal = np.zeros(3)
            normal[axis] = sign
            u = np.roll([1.0, 0, 0], axis + 1)
            v = np.cross(normal, u)
            first = len(positions)
            for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1)):
                positions.append((normal + a * u + b * v) * np.array([width, height, depth]) / 2 + centre)
                normals.append(normal)
            faces += [[first, first + 1, first + 2], [first, first + 2, first + 3]]
    return mesh_of(positions, faces, normals, **look)


def panes(*placed: tuple[float, Material], width: float = 2.0) -> Mesh:
    """Upright squares that face +z at some z, each of a material, translucent or not as that says."""
    corners = np.array([[-0.5, 0, 0], [0.5, 0, 0], [0.5, 1, 0], [-0.5, 1, 0]]) * width
    positions = np.concatenate([corners + np.array([0, 0, z]) for z, _ in placed])
    whole = mesh_of(positions, np.zeros((0, 3), np.int32), np.tile([0.0, 0, 1], (len(positions), 1)), (255, 255, 255))
    whole.uv[:] = np.tile([[0, 0], [1, 0], [1, 1], [0, 1]], (len(placed), 1))
    faces: dict[bool, list[Rows]] = {True: [np.zeros((0, 3), np.int32)], False: [np.zeros((0, 3), np.int32)]}
    parts: dict[bool, list[Part]] = {True: [], False: []}
    for number, (_, material) in enumerate(placed):
        through = material.opacity is not None
        parts[through].append(Part(2 * len(parts[through]), 2, number))
        faces[through].append(np.array([[0, 1, 2], [0, 2, 3]], np.int32) + np.int32(4 * number))
    return replace(
        whole,
        faces=np.concatenate(faces[False]),
        parts=tuple(parts[False]),
        translucent_faces=np.concatenate(faces[True]),
        translucent_parts=tuple(parts[True]),
        materials=tuple(material for _, material in placed),
    )


def leaves(count: int, length: float, seed: int = 0, **look: Unpack[Look]) -> Mesh:
    """So many open rectangles, half as wide, at random in a ball of diameter 1 that stands on the origin."""
    random = np.random.default_rng(seed)
    outward, along, across = random.normal(size=(3, count, 3))
    normal = np.cross(along, across)
    across = np.cross(normal, along)
    outward, along, across, normal = (
        axis / np.linalg.norm(axis, axis=1, keepdims=True) for axis in (outward, along, across, normal)
    )
    ends, sides = np.array([-1, 1, 1, -1])[:, None], np.array([-1, -1, 1, 1])[:, None]
    corners = ends * along[:, None] + sides * across[:, None] / 2
    middle = outward * random.uniform(0.2, 0.5, (count, 1)) + [0, 0.5, 0]
    faces = np.array([[0, 1, 2], [0, 2, 3]]) + 4 * np.arange(count)[:, None, None]
    positions = (middle[:, None] + length / 2 * corners).reshape(-1, 3)
    return mesh_of(positions, faces.reshape(-1, 3), np.repeat(normal, 4, axis=0), **look)


def joined(*meshes: Mesh) -> Mesh:
    """Several meshes as one, with the first one's material."""
    starts = np.cumsum([0] + [len(m.positions) for m in meshes[:-1]])
    faces = np.concatenate([m.faces + start for m, start in zip(meshes, starts, strict=True)])
    whole = mesh_of(np.concatenate([m.positions for m in meshes]), faces, np.concatenate([m.normals for m in meshes]))
    whole.colours[:] = np.concatenate([m.colours for m in meshes])
    return whole


def of_model(model: Model) -> Mesh:
    """A generated model (`tools.make_models`) as a mesh."""
    mesh = mesh_of(model.positions, model.faces, vertex_normals(model))
    mesh.colours[:] = np.round(255 * model.colours)
    return mesh


shared_folder: Path | None = None  # where all processes of a test run find what one has made; None: each makes its own


def shared(function: Callable[..., T], *arguments: object) -> T:
    """What a function of the package returns for these arguments: made by one process, read by all others."""
    return _shared(function, pickle.dumps(arguments))


def _shared(function: Callable[..., T], call: bytes) -> T:
    """`shared`, for the arguments that `call` holds, pickled."""
    if shared_folder is None:
        return function(*pickle.loads(call))
    file = shared_folder / f"{function.__name__}-{hashlib.sha256(call).hexdigest()}.pickle"
    if not file.exists():
        write_bytes(file, pickle.dumps(function(*pickle.loads(call))))
    return cast(T, pickle.loads(file.read_bytes()))


def bake(mesh: Mesh, resolution: int = 64, layers: int | Literal["auto"] = 2) -> BakedObject:
    """The depth images of a mesh; of an equal one as before, those."""
    return _baked(pickle.dumps((mesh, BakeParams(resolution=resolution, layers=layers), "test")))


@lru_cache(maxsize=24)
def _baked(call: bytes) -> BakedObject:
    return _shared(bake_object, call)


def simplified(mesh: Mesh) -> tuple[MeshLevel, ...]:
    """The levels of a mesh; of an equal one as before, those."""
    return shared(mesh_levels, mesh)


def clusters_of(mesh: Mesh) -> MeshClusters:
    """The clusters of a mesh; of an equal one as before, those."""
    return shared(build_clusters, mesh)


def captured(mesh: Mesh, params: CaptureParams) -> CapturedViews:
    """Pictures of a mesh from many directions; of an equal one as before, those."""
    return shared(capture_views, mesh, params)


@overload
def model_of(baked: BakedObject | BakedModel) -> BakedModel: ...
@overload
def model_of(baked: BakedObject | BakedModel | None) -> BakedModel | None: ...
def model_of(baked: BakedObject | BakedModel | None) -> BakedModel | None:
    """One object, or a model already, as a model; None stays."""
    return baked if baked is None or isinstance(baked, BakedModel) else BakedModel(parts=(baked,))


def cache_key(model: BakedModel | None, cooked_as: str = "") -> str:
    """The key by which the cache keeps what is cooked of a model; "" for one with a relief, which files leave out.

    cooked_as: a name for another way to cook than the package's, the results of which are kept apart.
    """
    if model is not None and any(part.meso is not None for part in model.parts):
        return ""
    return hashlib.sha256(pickle.dumps(model) + cooked_as.encode()).hexdigest()


_recent: dict[object, tuple[CookedObject, ...]] = {}  # what was found in the cache last, the latest at the end


def _found(cook: Callable[[], tuple[CookedObject, ...]], key: str, options: CookOptions) -> tuple[CookedObject, ...]:
    """What `cook` finds in the cache of the test, which is read once while it is among the latest."""
    place = key, options, cache_folder()
    if place in _recent:
        _recent[place] = _recent.pop(place)
    else:
        _recent[place] = tuple(replace(cooked, load=cache(cooked.load)) for cooked in cook())
    if len(_recent) > 24:
        del _recent[next(iter(_recent))]
    return _recent[place]


class ShapeLibrary:
    """Meshes and their depth images by number; either may be None.

    kept: what renderers prepare of these is kept in the tests' cache, which spares the second and later ones seconds;
    not to be had where a test changes how it is prepared, unless `cooked_as` names that way: then it is kept apart.
    """

    def __init__(
        self,
        meshes: Sequence[Mesh | None],
        baked: Sequence[BakedObject | BakedModel | None] | None = None,
        kept: bool = True,
        resolution: int = 64,
        layers: int | Literal["auto"] = 2,
        cooked_as: str = "",
    ) -> None:
        self._meshes = meshes
        if not baked:
            baked = [bake(mesh, resolution, layers) for mesh in meshes if mesh is not None]
        self._baked = [model_of(each) for each in baked]
        self._levels: dict[int, tuple[MeshLevel, ...]] = {}
        self._clusters: dict[int, MeshClusters | None] = {}
        self._cooked: dict[tuple[int, CookOptions], tuple[CookedObject, ...]] | None = {} if kept else None
        self._keys = [cache_key(each, cooked_as) if kept else "" for each in self._baked]

    def __len__(self) -> int:
        return len(self._baked)

    def has_baked(self, asset: int) -> bool:
        return self._baked[asset] is not None

    def is_shipped_cooked(self, asset: int) -> bool:
        return False

    def has_height_field(self, asset: int) -> bool:
        model = self._baked[asset]
        images = () if model is None else model.parts[0].images
        return [image.name for image in images] == ["top.0"]

    def has_mesh(self, asset: int) -> bool:
        return self._meshes[asset] is not None

    def bake_missing(self, assets: Sequence[int]) -> None:
        """All is there."""

    def key(self, asset: int) -> str:
        return self._keys[asset]

    def baked(self, asset: int) -> BakedModel | None:
        return self._baked[asset]

    def cooked(self, asset: int, options: CookOptions, *, again: bool = False) -> tuple[CookedObject, ...]:
        def cook() -> tuple[CookedObject, ...]:
            return cooked_objects(lambda: self.key(asset), lambda: self.baked(asset), options, again=again)

        if again or self._cooked is None:
            return cook()
        if key := self.key(asset):
            return _found(cook, key, options)
        if (asset, options) not in self._cooked:  # no file holds it: with a relief
            self._cooked[asset, options] = cook()
        return self._cooked[asset, options]

    def preview(self, asset: int) -> Mesh | None:
        return None

    def forget_preview(self, asset: int) -> None:
        pass

    def drawn_mesh(self, asset: int) -> Mesh | None:
        return self.mesh(asset)

    def mesh(self, asset: int) -> Mesh | None:
        return self._meshes[asset]

    def mesh_levels(self, asset: int) -> tuple[MeshLevel, ...]:
        if asset not in self._levels:
            mesh = self._meshes[asset]
            self._levels[asset] = () if mesh is None else simplified(mesh)
        return self._levels[asset]

    def mesh_clusters(self, asset: int) -> MeshClusters | None:
        if asset not in self._clusters:
            mesh = self._meshes[asset]
            self._clusters[asset] = None if mesh is None else clusters_of(mesh)
        return self._clusters[asset]

    def captured_views(self, asset: int, params: CaptureParams) -> CapturedViews | None:
        mesh = self._meshes[asset]
        return None if mesh is None else captured(mesh, params)

    def translucent_mesh(self, asset: int) -> Mesh | None:
        mesh = self._meshes[asset]
        return mesh if mesh is not None and mesh.is_translucent else None

    def forget_mesh(self, asset: int) -> None:
        """It stays."""

    def texture(self, path: Path) -> NoReturn:
        raise AssertionError(f"no texture in this test: {path}")

    def sky_image(self, path: Path) -> NDArray[np.float32]:
        return load_sky_image(path)


def scene_of(
    *placed: tuple[int, Sequence[float], float, float],
    representation: Representation = Representation.DPCI,
    **environment: Any,
) -> Scene:
    """A scene of (asset, position, yaw, scale) with default lights. Meshes stand in for no depth images."""
    asset, position, angle, scale = zip(*placed, strict=True)
    yaw = np.asarray(angle, np.float32)
    rotation = np.stack([0 * yaw, np.sin(yaw / 2), 0 * yaw, np.cos(yaw / 2)], -1)
    objects = Objects(
        asset=np.asarray(asset, np.int32),
        position=np.asarray(position, np.float32).reshape(-1, 3),
        rotation=rotation.astype(np.float32),
        scale=np.asarray(scale, np.float32),
        representation=np.full(len(asset), representation, np.uint8),
    )
    render = RenderSettings.model_validate({"lod": {"magnification": 0}})
    names = [SimpleNamespace(name=f"asset {number}") for number in range(int(np.max(asset, initial=-1)) + 1)]
    scene = SimpleNamespace(
        objects=objects,
        environment=Environment(**environment),
        render=render,
        assets=names,
        advice={},
        animations=None,
    )
    return cast(Scene, scene)


def two_halves(mesh: Mesh, resolution: int = 64) -> BakedModel:
    """`mesh` in two parts left and right of x = 0, about x."""
    cells = Cell().cut(np.array([1.0, 0, 0, 0]))
    pieces = [submesh(mesh, part_faces(mesh, cell, 0.02)) for cell in cells]
    params = ModelParams(resolution=resolution, layers=1, axis="x")
    return BakedModel(parts=tuple(shared(bake_model, piece, params, "halves").parts[0] for piece in pieces))


def globe(texture: NDArray[np.uint8], columns: int = 256, rows: int = 128, turns: float = 1.0) -> Mesh:
    """A sphere of radius 1 that stands on the origin, white, wrapped `turns` times in a texture (h, w, 4), sRGB.

    Its vertices are those of `sphere`: u rises with the angle about +Y from +z toward +x, v with the latitude.
    """
    mesh = sphere(1.0, columns, rows, colour=(255, 255, 255))
    u, v = np.meshgrid(turns * np.linspace(0, 1, columns + 1), np.linspace(0, 1, rows + 1))
    uv = np.stack([u, v], -1).reshape(-1, 2).astype(np.float32)
    return replace(mesh, uv=uv, materials=(Material((1.0, 1.0, 1.0), texture=texture),))


def checkers(size: int, square: int) -> NDArray[np.uint8]:
    """A texture of two colours, (size, size, 4): checkers of so many texels a side."""
    row, column = np.mgrid[:size, :size] // square
    colours = np.array([(230, 60, 40, 255), (235, 235, 200, 255)], np.uint8)
    return colours[(row + column) % 2]
