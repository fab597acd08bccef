"""Divide what a glTF scene shows into models of their own and the rest, the surroundings.

A node of glTF may stretch, shear or mirror its mesh, an object of a scene only turn and scale it. So placements of one
mesh in several shapes become several models, each with the shape in its mesh file. What moves is never merged with
anything.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from depthwalk.ingest.gltf_animations import Movement
from depthwalk.ingest.gltf_channels import FARTHEST
from depthwalk.ingest.gltf_models import PlacedModel
from depthwalk.limits import MAX_ASSETS
from depthwalk.scene.fields import MAX_SCALE, MIN_SCALE
from depthwalk.types import Mask

HEAVY = 13_000
"""Triangles from which depth images are faster than the mesh, see docs/measurements.md."""

_SURROUNDINGS = 1_000_000  # triangles of a mesh file of surroundings, at most, unless a single mesh has more
_SAME_SHAPE = 1e-3  # relative difference of stretches that is not seen: 1 mm per metre
_SAME_UP = 0.9  # length of the mean of unit vectors that point the same way, more or less
_MIRROR = np.diag([-1.0, 1.0, 1.0])

_Matrices = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Model:
    """Hold a model and where it stands.

    Attributes
    ----------
    name
        As in the file, "" if it has none.
    meshes
        Numbers of the k meshes in the file's header.
    matrices : (k, 4, 4) float64
        Where each stands in the model's file, which has the size and shape that the scene shows.
    position : (n, 3) float64
        Where the file's origin is in the scene.
    rotation : (n, 3, 3) float64
        Rotation matrices, scene from file, for column vectors.
    scale : (n,) float64
        Size relative to the file's.
    movements
        n movements of the file's frame, None for copies that stand still.
    names
        n names of nodes, "" for those without.
    triangles
        Of the model.
    """

    name: str
    meshes: tuple[int, ...]
    matrices: _Matrices
    position: NDArray[np.float64]
    rotation: _Matrices
    scale: NDArray[np.float64]
    movements: tuple[Movement | None, ...]
    names: tuple[str, ...]
    triangles: int

    @property
    def moves(self) -> Mask:
        """Which of the n copies move."""
        return np.array([movement is not None for movement in self.movements], bool)

    def some(self, which: Mask) -> "Model":
        """Return the model with the copies that `which` (n,) says."""
        if which.all():
            return self
        rows = np.flatnonzero(which)
        return replace(
            self,
            position=self.position[rows],
            rotation=self.rotation[rows],
            scale=self.scale[rows],
            movements=tuple(self.movements[row] for row in rows),
            names=tuple(self.names[row] for row in rows),
        )


@dataclass(frozen=True, kw_only=True)
class Division:
    """Hold what a scene is divided into.

    Attributes
    ----------
    own
        Models of their own: at most MAX_ASSETS less as many as there are surroundings, in the order of the file.
    surroundings
        Models of about a million triangles each, which stand at the origin.
    flat
        How many placements were left out, since they have no volume: their matrices are singular.
    stopped
        How many placements would move, but are surroundings since there are too many models.
    merged
        How many placements are surroundings since nodes stretch, shear or mirror them, each in another way: together
        with all copies of their mesh, they would have been heavy enough for a model.
    """

    own: list[Model]
    surroundings: list[Model]
    flat: int
    stopped: int
    merged: int


def divide(models: Iterable[PlacedModel]) -> Division:
    """Divide the models of a scene.

    A model is on its own if all its copies have HEAVY triangles or more together, or for those of its copies that move.
    All others are surroundings, which are merged as they stand: walls, floors, and things too light for a draw call of
    their own.

    Parameters
    ----------
    models
        What the file places.

    Returns
    -------
    Division
        The models.
    """
    shaped: list[Model] = []
    all_copies: list[int] = []
    flat = 0
    for given in models:
        model = replace(given, placements=_at_largest(given))
        solid = _is_solid(model.placements)
        flat += int(np.count_nonzero(~solid))
        if solid.any():
            shaped += [part for shape in _by_shape(_some(model, solid)) for part in _by_movement(shape)]
            all_copies += [int(np.count_nonzero(solid)) * model.triangles] * (len(shaped) - len(all_copies))
    shown = [len(model.scale) * model.triangles for model in shaped]
    worthy = [number for number, model in enumerate(shaped) if shown[number] >= HEAVY or model.moves.any()]
    most = MAX_ASSETS - 1 - sum(shown) // _SURROUNDINGS
    chosen = set(sorted(worthy, key=lambda number: -shown[number])[: max(most, 1)])
    others = [model for number, model in enumerate(shaped) if number not in chosen]
    return Division(
        own=[model for number, model in enumerate(shaped) if number in chosen],
        surroundings=_merged(others),
        flat=flat,
        stopped=sum(int(model.moves.sum()) for model in others),
        merged=sum(
            len(model.scale)
            for number, model in enumerate(shaped)
            if number not in chosen and shown[number] < HEAVY <= all_copies[number]
        ),
    )


def _is_solid(placements: _Matrices) -> Mask:
    """Return which matrices (n, 4, 4) keep a volume."""
    linear = placements[:, :3, :3]
    size = np.maximum(np.abs(linear).max(axis=(1, 2)), 1e-30)
    return np.asarray(np.abs(np.linalg.det(linear / size[:, None, None])) > 1e-9)


def _some(model: PlacedModel, which: Mask) -> PlacedModel:
    """Return a model with some of its placements."""
    if which.all():
        return model
    rows = np.flatnonzero(which)
    return replace(
        model,
        placements=model.placements[rows],
        movements=tuple(model.movements[row] for row in rows),
        names=tuple(model.names[row] for row in rows),
    )


def _at_largest(model: PlacedModel) -> _Matrices:
    """Return the placements (n, 4, 4) of a model; of those that move, one at which they are not much smaller than ever.

    What is shrunk to nothing until it appears has its shape only then.
    """
    placements = model.placements
    for row, movement in enumerate(model.movements):
        if movement is None:
            continue
        tried = np.concatenate([placements[[row]], movement.sizes()])
        if not (np.abs(tried) < FARTHEST).all():
            raise ValueError(f"node {model.names[row]!r} moves out of reach")
        volume = np.abs(np.linalg.det(tried[:, :3, :3]))
        if volume[0] < volume.max() / 8:
            placements = placements.copy() if placements is model.placements else placements
            placements[row] = tried[volume.argmax()]
    return placements


def _by_movement(model: Model) -> list[Model]:
    """Return a light model as two, if some of its copies move and others do not; these will be merged."""
    moves = model.moves
    if len(moves) * model.triangles >= HEAVY or moves.all() or not moves.any():
        return [model]
    return [model.some(moves), model.some(~moves)]


def _by_shape(model: PlacedModel) -> list[Model]:
    """Return a model for each of the shapes in which a scene shows `model`, whose placements are not singular."""
    rotation, scale, shape = _factors(model.placements[:, :3, :3])
    _, group = np.unique(np.rint(shape.reshape(-1, 9) / _SAME_SHAPE).astype(np.int64), axis=0, return_inverse=True)
    models = []
    for number in range(int(group.max()) + 1):
        rows = np.flatnonzero(group.ravel() == number)
        usual = float(np.median(scale[rows]))
        relative = scale[rows] / usual
        fits = (relative >= MIN_SCALE) & (relative <= MAX_SCALE)
        models.append(_shaped(model, rows[fits], rotation, relative[fits], usual * shape[rows].mean(axis=0)))
        models += [  # so much smaller or larger than the others that a scene file cannot say it
            _shaped(model, rows[[row]], rotation, np.ones(1), scale[rows[row]] * shape[rows[row]])
            for row in np.flatnonzero(~fits)
        ]
    return models


def _shaped(
    model: PlacedModel, rows: NDArray[np.int64], rotation: _Matrices, scale: NDArray[np.float64], shape: _Matrices
) -> Model:
    """Return the model of the placements `rows` (m,), in one shape (3, 3), upright as most of them stand."""
    upright = _upright(rotation[rows])
    shaped, inverse = np.eye(4), np.eye(4)
    shaped[:3, :3] = upright @ shape
    inverse[:3, :3] = np.linalg.inv(shaped[:3, :3])
    movements = [model.movements[row] for row in rows]
    return Model(
        name=model.name,
        meshes=model.meshes,
        matrices=shaped @ model.matrices,
        position=model.placements[rows, :3, 3],
        rotation=rotation[rows] @ upright.T,
        scale=scale,
        movements=tuple(None if movement is None else movement.of(inverse) for movement in movements),
        names=tuple(model.names[row] for row in rows),
        triangles=model.triangles,
    )


def _factors(linear: _Matrices) -> tuple[_Matrices, NDArray[np.float64], _Matrices]:
    """Divide matrices (n, 3, 3) into rotations (n, 3, 3), scales (n,) and shapes (n, 3, 3) of determinant ±1.

    They are the product of the three, in this order. The shape is the identity where a matrix turns and scales alone:
    by the polar decomposition (Higham, *Computing the Polar Decomposition*, 1986), and for mirrored ones with a mirror
    of x, which keeps upright what is upright.
    """
    left, stretch, right = np.linalg.svd(linear)
    rotation = left @ right
    shape = np.swapaxes(right, 1, 2) @ (stretch[:, :, None] * right)
    mirrored = np.linalg.det(rotation) < 0
    rotation[mirrored] = rotation[mirrored] @ _MIRROR
    shape[mirrored] = _MIRROR @ shape[mirrored]
    scale = np.cbrt(stretch.prod(axis=1))
    return rotation, scale, shape / scale[:, None, None]


def _upright(rotation: _Matrices) -> _Matrices:
    """Return the rotation (3, 3) after which most things that stand by the rotations (n, 3, 3) have y upward.

    Exporters turn models whose z axis points upward in each of their nodes. Depth images are those of a cylinder about
    y, so the turn belongs into the mesh. The identity, if things stand anyhow.
    """
    up = rotation[:, 1, :].mean(axis=0)  # of the scene, in the frame of each thing
    if (length := float(np.linalg.norm(up))) < _SAME_UP:
        return np.eye(3)
    up /= length
    axis, cosine = np.cross(up, [0.0, 1.0, 0.0]), float(up[1])
    if cosine > 1 - 1e-6:
        return np.eye(3)
    if cosine < -1 + 1e-6:
        return np.diag([1.0, -1.0, -1.0])
    cross = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    return np.asarray(np.eye(3) + cross + cross @ cross / (1 + cosine))


def _merged(models: Iterable[Model]) -> list[Model]:
    """Return models that hold all placements of `models`, about a million triangles each."""
    merged: list[Model] = []
    meshes: list[int] = []
    matrices: list[_Matrices] = []
    triangles = 0

    def finish() -> None:
        nonlocal triangles
        if meshes:
            merged.append(_at_origin(tuple(meshes), np.array(matrices), triangles))
        meshes.clear()
        matrices.clear()
        triangles = 0

    for model in models:
        for position, rotation, scale in zip(model.position, model.rotation, model.scale, strict=True):
            if triangles + model.triangles > _SURROUNDINGS:
                finish()
            place = np.eye(4)
            place[:3, :3], place[:3, 3] = scale * rotation, position
            meshes += model.meshes
            matrices += list(place @ model.matrices)
            triangles += model.triangles
    finish()
    return merged


def _at_origin(meshes: tuple[int, ...], matrices: _Matrices, triangles: int) -> Model:
    return Model(
        name="surroundings",
        meshes=meshes,
        matrices=matrices,
        position=np.zeros((1, 3)),
        rotation=np.eye(3)[None],
        scale=np.ones(1),
        movements=(None,),
        names=("",),
        triangles=triangles,
    )
