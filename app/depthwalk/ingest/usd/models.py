"""Find the meshes of a USD stage and their copies, and the cameras and lights beside them."""

from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pxr import Usd, UsdGeom, UsdShade

from depthwalk.geometry.quaternions import matrices
from depthwalk.ingest.usd.lights import Stands
from depthwalk.ingest.usd.meshes import Piece
from depthwalk.ingest.usd.problems import Unread, UsdError
from depthwalk.limits import MAX_INSTANCES

_Matrices = NDArray[np.float64]  # (…, 4, 4), for column vectors
_MOST_MOVING = 10_000  # copies with movements of their own, as many as a scene file can hold
_DEPTH = 64  # copies within copies
_SHOWN = ("default", "render")  # purposes; "proxy" and "guide" are for those who edit
_UNREAD = {  # by the name of the type
    "BasisCurves": ("set of curves", "sets of curves"),
    "NurbsCurves": ("set of curves", "sets of curves"),
    "HermiteCurves": ("set of curves", "sets of curves"),
    "Points": ("set of points", "sets of points"),
    "NurbsPatch": ("NURBS patch", "NURBS patches"),
    "TetMesh": ("tetrahedral mesh", "tetrahedral meshes"),
}


@dataclass(eq=False, kw_only=True)
class Model:
    """Hold what is shown together: the meshes of a prototype with the copies in it, or a single mesh.

    Attributes
    ----------
    name
        The name of its prim in the layer that it comes from.
    where
        The path of its prim in the stage.
    pieces
        Its meshes.
    copies
        Other models in it, each with its places (n, 4, 4), model from other.
    """

    name: str
    where: str
    pieces: list[Piece] = field(default_factory=list)
    copies: "list[tuple[Model, _Matrices]]" = field(default_factory=list)


@dataclass(frozen=True, kw_only=True)
class Placed:
    """Hold a model and its place (4, 4) in the stage, its name, and the prim that it moves with if it does."""

    model: Model
    matrix: _Matrices
    name: str
    mover: Any = None


class _State(NamedTuple):
    """What prims get from those above them: a purpose, whether they move, and what their instance is bound to."""

    purpose: str = "default"
    moves: bool = False
    material: Any = None
    colour: Any = None


class ModelReader:
    """Walk through a stage, and collect what it shows.

    Attributes
    ----------
    placed
        What stands in the stage.
    models
        All models, each after those that it has copies of.
    """

    def __init__(self, stands: Stands, time: Any, unread: Unread) -> None:
        """Prepare to read what is shown at a time."""
        self._stands, self._time, self._unread = stands, time, unread
        self._known: dict[object, Model | None] = {}  # None: it is being read
        self._moving, self._depth = 0, 0
        self.placed: list[Placed] = []
        self.models: list[Model] = []

    def read(self, root: Any) -> None:
        """Read all below the root of a stage."""
        for child in root.GetFilteredChildren(Usd.PrimDefaultPredicate):
            self._walk(child, Usd.PrimDefaultPredicate, np.eye(4), _State(), None)

    def _walk(self, start: Any, predicate: Any, above: _Matrices, state: _State, model: Model | None) -> None:
        """Read a prim and all below it into a model; None: into the stage."""
        waiting = [(start, above, state)]
        while waiting:
            prim, matrix, state = waiting.pop()
            if prim.IsA(UsdGeom.Imageable):
                imageable = UsdGeom.Imageable(prim)
                if imageable.GetVisibilityAttr().Get(self._time) == UsdGeom.Tokens.invisible:
                    continue
                purpose = imageable.GetPurposeAttr()
                if purpose.HasAuthoredValue():
                    state = state._replace(purpose=str(purpose.Get(self._time)))
            if prim.IsA(UsdGeom.Xformable):
                own = UsdGeom.Xformable(prim)
                if own.GetResetXformStack() and model is None:
                    matrix, state = np.eye(4), state._replace(moves=False)
                matrix = matrix @ np.array(own.GetLocalTransformation(self._time)).T
                state = state._replace(moves=state.moves or own.TransformMightBeTimeVarying())
            if self._read(prim, matrix, state, model):
                waiting += [(child, matrix, state) for child in reversed(prim.GetFilteredChildren(predicate))]

    def _read(self, prim: Any, matrix: _Matrices, state: _State, model: Model | None) -> bool:
        """Read a prim into a model, or the stage; return whether what is below it is to be read, too."""
        if prim.HasVariantSets():
            self._unread.count("set of variants but for the selected one", "sets of variants but for the selected ones")
        shown = state.purpose in _SHOWN
        if prim.IsInstance():
            self._add_instance(prim, matrix, state, model)
        elif prim.IsA(UsdGeom.PointInstancer):
            self._add_instancer(UsdGeom.PointInstancer(prim), matrix, state, model)
            return False
        elif prim.IsA(UsdGeom.Mesh) and shown:
            self._add_mesh(prim, matrix, state, model)
        elif model is None and self._stands.add(prim, matrix):
            return True
        elif model is not None and not prim.IsA(UsdGeom.Gprim):
            self._stands.note_copied(prim)
        elif shown and prim.IsA(UsdGeom.Gprim):
            name = str(prim.GetTypeName())
            self._unread.count(*_UNREAD.get(name, (name.split("_")[0].lower(),)))
        return True

    def _add_mesh(self, prim: Any, matrix: _Matrices, state: _State, model: Model | None) -> None:
        if model is not None:
            piece = Piece(prim=prim, matrix=matrix, material=state.material, colour=state.colour)
            model.pieces.append(piece)
            return
        own = Model(name=prim.GetName(), where=str(prim.GetPath()), pieces=[Piece(prim=prim, matrix=np.eye(4))])
        self.models.append(own)
        self._place(own, matrix, prim, state)

    def _place(self, model: Model, matrix: _Matrices, prim: Any, state: _State) -> None:
        mover = prim if state.moves else None
        self._moving += mover is not None
        if mover is not None and self._moving > _MOST_MOVING:
            mover = None
            self._unread.count(f"movement beyond {_MOST_MOVING:,}", f"movements beyond {_MOST_MOVING:,}")
        self.placed.append(Placed(model=model, matrix=matrix, name=prim.GetName(), mover=mover))
        if len(self.placed) > MAX_INSTANCES:
            raise UsdError(f"{prim.GetPath()}: more than {MAX_INSTANCES} objects")

    def _add_instance(self, prim: Any, matrix: _Matrices, state: _State, model: Model | None) -> None:
        """Add a copy of the prototype of an instance."""
        bound = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()[0]
        colour = UsdGeom.PrimvarsAPI(prim).FindPrimvarWithInheritance("displayColor")
        state = state._replace(
            material=bound if bound else state.material, colour=colour if colour.HasValue() else state.colour
        )
        prototype = self._prototype(prim.GetPrototype(), prim, state)
        if model is not None:
            model.copies.append((prototype, matrix[None]))
        else:
            self._place(prototype, matrix, prim, state)

    def _add_instancer(self, instancer: Any, matrix: _Matrices, state: _State, model: Model | None) -> None:
        """Add the copies of a PointInstancer. Raises UsdError for prototypes that are missing."""
        prim = instancer.GetPrim()
        where = str(prim.GetPath())
        numbers = np.asarray(instancer.GetProtoIndicesAttr().Get(self._time) or (), np.int64)
        targets = instancer.GetPrototypesRel().GetForwardedTargets()
        if len(numbers) > MAX_INSTANCES:
            raise UsdError(f"{where}: {len(numbers)} copies, the limit is {MAX_INSTANCES}")
        if outside := np.flatnonzero((numbers < 0) | (numbers >= len(targets))).tolist():
            raise UsdError(f"{where}: protoIndices refers to prototype {numbers[outside[0]]} of {len(targets)}")
        if UsdGeom.PrimvarsAPI(prim).GetPrimvar("displayColor").HasAuthoredValue():
            self._unread.count("set of colours of copies", "sets of colours of copies")
        if instancer.GetPositionsAttr().ValueMightBeTimeVarying() or instancer.GetVelocitiesAttr().HasAuthoredValue():
            self._unread.count("PointInstancer that moves its copies", "PointInstancers that move their copies")
        every = self._instances(instancer, len(numbers))
        mask = np.asarray(instancer.ComputeMaskAtTime(self._time), bool)
        shown = mask if len(mask) == len(numbers) else np.ones(len(numbers), bool)
        copies = []
        for number, target in enumerate(targets):
            of_target = every[shown & (numbers == number)]
            prototype = prim.GetStage().GetPrimAtPath(target)
            if not prototype:
                raise UsdError(f"{where}: its prototype {target} is missing")
            if len(of_target):
                copies.append((self._prototype(prototype, prototype, state, whole=True), of_target))
        if model is not None:
            model.copies += [(each, matrix @ places) for each, places in copies]
            return
        own = Model(name=prim.GetName(), where=where, copies=copies)
        self.models.append(own)
        self._place(own, matrix, prim, state)

    def _instances(self, instancer: Any, count: int) -> _Matrices:
        """Return the places (n, 4, 4) of the copies of a PointInstancer, which are so many, in its frame.

        As usd-core computes them, but by unit quaternions: those of 16 bits would stretch each copy in another way.
        """
        every = np.tile(np.eye(4), (count, 1, 1))
        values = {"positions": instancer.GetPositionsAttr(), "scales": instancer.GetScalesAttr()}
        fine = instancer.GetOrientationsfAttr()
        values["orientations"] = fine if fine.HasAuthoredValue() else instancer.GetOrientationsAttr()
        given = {name: np.asarray(attribute.Get(self._time) or (), np.float64) for name, attribute in values.items()}
        for name, rows in given.items():
            if len(rows) != count and (len(rows) or name == "positions"):
                where = instancer.GetPrim().GetPath()
                raise UsdError(f"{where}: protoIndices lists {count} copies, {name} {len(rows)}")
        if len(turn := given["orientations"]):
            length = np.linalg.norm(turn, axis=1, keepdims=True)
            every[:, :3, :3] = matrices(np.where(length > 0, turn / np.maximum(length, 1e-9), [0.0, 0.0, 0.0, 1.0]))
        if len(scales := given["scales"]):
            every[:, :3, :3] *= scales[:, None, :]
        every[:, :3, 3] = given["positions"].reshape(-1, 3)
        return every

    def _prototype(self, root: Any, instance: Any, state: _State, *, whole: bool = False) -> Model:
        """Return the model of a prototype, read when it is first asked for.

        Parameters
        ----------
        root
            The prim of the prototype.
        instance
            A prim that shows it, for its name.
        state
            What the prims in it get from the instance.
        whole
            Whether the root itself is shown by its own place, as for PointInstancers.

        Raises
        ------
        UsdError
            If it shows itself, or copies are within copies too often.
        """
        colour = str(state.colour.GetAttr().GetPath()) if state.colour else ""
        key = root.GetPath(), str(state.material.GetPath()) if state.material else "", colour, state.purpose
        known = self._known.get(key)
        if known is not None:
            return known
        where = str(instance.GetPath())
        if key in self._known or self._depth > _DEPTH:
            raise UsdError(f"{where}: is a copy within itself, or within more than {_DEPTH} others")
        self._known[key], self._depth = None, self._depth + 1
        specs = instance.GetPrimStack()
        model = Model(name=specs[-1].name if specs else instance.GetName(), where=where)
        predicate = Usd.PrimIsActive & Usd.PrimIsLoaded
        inner = state._replace(moves=False)
        for child in [root] if whole else root.GetFilteredChildren(predicate):
            self._walk(child, predicate, np.eye(4), inner, model)
        self._known[key], self._depth = model, self._depth - 1
        self.models.append(model)
        return model
