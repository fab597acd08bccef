"""Guess which axis of a model's file points upward, and turn the model accordingly, without reading it again."""

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from depthwalk.geometry.quaternions import conjugate, rotate
from depthwalk.ingest.formats import UPRIGHT_SUFFIXES, is_baked_file, is_model_file
from depthwalk.ingest.texture_beside import texture_hint
from depthwalk.ingest.units import unit_hint
from depthwalk.render.renderer import Renderer
from depthwalk.scene.scene import Scene
from depthwalk.scene.similarity import Similarity, compose
from depthwalk.types import Array

Up = Literal["y", "z"]

_SLICE = 0.02  # part of a model's height, from the lowest point up, that counts as its lower end
_CELLS = 16  # across a model seen from above, to see whether it is a sheet
_SHEET = 0.25  # part of a model's height: a sheet, such as a terrain, is lower in most cells
_COVERED = 0.8  # part of the cells that a sheet covers
_FLAT = 1e-3  # part of the largest extent: a thinner model is a picture
_KEEP = "Models keep the places of their files; --side-by-side puts them in a row"
# Turns (x, y, z) into (x, z, −y), so that z points upward.
_TURNS: dict[Up, NDArray[np.float32]] = {
    "y": np.array([0, 0, 0, 1], np.float32),
    "z": np.array([-np.sqrt(0.5), 0, 0, np.sqrt(0.5)], np.float32),
}


def guess_up(points: Array) -> Up:
    """Guess the axis along which a model stands: the one along which its lower end is broad.

    Busts, statues, buildings and things on feet touch the ground at places that are far apart, while their sides end in
    curves. The answer is "y", which points upward in most files, unless the lower end along z is clearly the broader.
    A picture, flat along z, hangs upright. A terrain, whose lower end is a valley while its sides are straight, lies.

    Parameters
    ----------
    points
        (n, 3) vertices of the model, n ≥ 1, in any unit and in the axes of its file.

    Returns
    -------
    Up
        "y" or "z".
    """
    if np.ptp(points[:, 2]) <= _FLAT * np.ptp(points, axis=0).max():
        return "y"
    if _is_sheet(points):
        return "y"
    return "z" if _stands(points[:, [0, 2, 1]]) > _stands(points) + 0.1 else "y"


def _is_sheet(points: Array) -> bool:
    """Return whether points (n, 3) are a single surface above the plane of x and z, with one height at each place.

    Seen from above, their bounds are divided into cells of some four points each. A solid body has a lower and an upper
    surface in most cells, and an upright one leaves cells empty.
    """
    cells = min(_CELLS, math.isqrt(len(points)) // 2)
    if cells < 2:
        return False
    low = points.min(0)
    size = np.ptp(points, axis=0)
    size = np.maximum(size, 1e-9 * size.max(initial=1e-30))
    x, _, z = np.minimum(cells * (points - low) / size, cells - 1).astype(int).T
    highest, lowest = np.full(cells**2, -np.inf), np.full(cells**2, np.inf)
    np.maximum.at(highest, x * cells + z, points[:, 1])
    np.minimum.at(lowest, x * cells + z, points[:, 1])
    heights = (highest - lowest)[np.isfinite(highest)]
    return bool(len(heights) >= _COVERED * cells**2 and np.median(heights) < _SHEET * size[1])


def _stands(points: Array) -> float:
    """Return how broad the lower end along y of points (n, 3) is, as a part of their bounds seen from above."""
    low, high = points.min(0), points.max(0)
    size = np.maximum(high - low, 1e-9 * (high - low).max(initial=1e-30))
    lowest = points[points[:, 1] <= low[1] + _SLICE * size[1]]
    return float(np.prod((np.ptp(lowest, axis=0) / size)[[0, 2]]))


@dataclass(frozen=True, kw_only=True)
class Body:
    """Hold objects that are turned together, and stand on one place.

    Attributes
    ----------
    rows
        The objects of the scene.
    points
        (n, 3) their points, metres, as the files have them: in the asset frame of a single object, otherwise in the
        world before anything was turned.
    placed
        The objects in the world before anything was turned; None for a single object, which stands where its node is.
    """

    rows: slice
    points: Array
    placed: Similarity | None = None


def _bodies(scene: Scene, renderer: Renderer) -> list[Body]:
    """Return what is turned together of models that `renderer` draws: all, or each that stands beside others."""
    if scene.beside and not scene.side_by_side:
        objects = scene.objects
        placed = Similarity(objects.position.astype(np.float64), objects.rotation.astype(np.float64), objects.scale)
        return [Body(rows=slice(0, len(objects)), points=np.concatenate(_world_points(renderer)), placed=placed)]
    return [
        Body(rows=slice(number, number + 1), points=model_points(renderer, number))
        for number in range(len(scene.objects))
    ]


def _world_points(renderer: Renderer, number: int | None = None) -> list[Array]:
    """Return points (n, 3), metres, world, of each row that is drawn of all objects, or of one of the scene's."""
    objects = renderer.world.objects()
    rows = range(len(objects.asset)) if number is None else np.flatnonzero(renderer.world.owners() == number).tolist()
    asset = objects.asset.tolist()
    return [
        objects.scale[row] * rotate(objects.rotation[row], renderer.world.points(asset[row])) + objects.position[row]
        for row in rows
    ]


def model_points(renderer: Renderer, number: int) -> Array:
    """Return points (n, 3), metres, asset frame, of an object of the scene that `renderer` draws, before it is turned.

    They are the vertices of its mesh or, where it is drawn by depth images, of their geometry.
    """
    whole, found = renderer.world.scene_objects, np.concatenate(_world_points(renderer, number))
    points: Array = rotate(conjugate(whole.rotation[number]), found - whole.position[number]) / whole.scale[number]
    return points


def turn_body(scene: Scene, body: Body, up: Up) -> None:
    """Turn objects of a scene so that the axis `up` of their files points upward, and stand them on their place.

    What the node of a single object says of its place is heeded: a model that is to lean leans after it was turned
    upright. Objects that are turned together stand on the origin.
    """
    turned = rotate(_TURNS[up], body.points)
    low, high = turned.min(0), turned.max(0)
    base = np.array([(low[0] + high[0]) / 2, low[1], (low[2] + high[2]) / 2])
    count = body.rows.stop - body.rows.start
    upright = Similarity(np.tile(-base, (count, 1)), np.tile(_TURNS[up].astype(np.float64), (count, 1)), np.ones(count))
    placed = compose(scene.nodes.world[body.rows], upright) if body.placed is None else compose(upright, body.placed)
    scene.objects.rotation[body.rows], scene.objects.position[body.rows] = placed.rotation, placed.position


class ModelTurn:
    """Turn models that are shown without a scene: first by a guess, then as the user says.

    Attributes
    ----------
    renderer
        Draws the models; may be replaced.
    guess
        A message to the user about the turn that was guessed; "" where the models were left as they are.
    unit_hint
        A line that ends the sentence "The model is …" if it seems not to be in metres; "" otherwise.
    texture_hint
        A line that ends the sentence "FILE …" if a picture beside the first such model may be its texture, and the name
        of its file; "" otherwise.
    """

    def __init__(self, scene: Scene, renderer: Renderer) -> None:
        """Guess how the models of `scene` stand, and turn them upright in `renderer`; leave scene files alone."""
        self._scene, self.renderer = scene, renderer
        self._bodies: list[Body] = []
        self._up: Up = "y"
        self.guess = self.unit_hint = self.texture_hint = ""
        if not is_model_file(scene.path) or len(scene.objects) != len(scene.files):
            return
        self.texture_hint = _texture_hint(scene)
        if any(getattr(asset, "up", "y") != "y" for asset in scene.assets):
            return
        self._bodies = _bodies(scene, renderer)
        if not (scene.beside or is_baked_file(scene.path) or getattr(scene.assets[0], "height", None)):
            extent = np.ptp(self._bodies[0].points, axis=0)
            self.unit_hint = unit_hint(scene.path, extent, "--set assets.model.height=…")
        self._guess()

    def _guess(self) -> None:
        """Turn the models upright that seem to lie, unless their files say how they stand."""
        # In glTF y is up by definition (2.0, §3.4), LAS is read so, and depth images were baked so; other formats say
        # nothing.
        scene = self._scene
        if any(file.suffix.lower() in UPRIGHT_SUFFIXES or is_baked_file(file) for file in scene.files):
            return
        if any(getattr(asset, "up_is_given", False) for asset in scene.assets):
            return
        lying = [body for body in self._bodies if guess_up(body.points) == "z"]
        for body in lying:
            turn_body(scene, body, "z")
        if lying:
            self._up = "z"
            self.renderer.world.moved()
            several = len(self._bodies) > 1 or bool(scene.beside)
            what = "Models seem to be z-up and were" if several else "The model seems to be z-up and was"
            self.guess = f"{what} turned upright; U turns {'them' if several else 'it'} back"

    @property
    def message(self) -> str:
        """Return what to tell the user of the models in a window, a line for each thing; "" for nothing."""
        keep = _KEEP if self._scene.beside and not self._scene.side_by_side else ""
        unit = self.unit_hint and f"The model is {self.unit_hint}"
        return "\n".join(filter(None, (self.guess, unit, self.texture_hint, keep)))

    def turn(self) -> str | None:
        """Switch the upward axis between y and z, and return a message to the user.

        None, and nothing is turned, for a scene file.
        """
        if not self._bodies:
            return None
        self._up = "z" if self._up == "y" else "y"
        for body in self._bodies:
            turn_body(self._scene, body, self._up)
        self.renderer.world.moved()
        how = f"bake with --up {self._up}" if is_baked_file(self._scene.path) else f"in a scene file: up: {self._up}"
        return f"{self._up} points upward; {how}"


def stand_upright(scene: Scene, renderer: Renderer) -> list[str]:
    """Turn models that are drawn without a scene as `ModelTurn` does, for pictures.

    Returns
    -------
    list[str]
        Lines that tell the user of the turn, and that the model seems not to be in metres.
    """
    turn, notes = ModelTurn(scene, renderer), []
    if turn.guess:
        what = "models seem to be z-up and were" if scene.beside else "the model seems to be z-up and was"
        name = "NAME" if scene.beside else "model"
        notes.append(f"{what} turned upright; --set assets.{name}.up=y prevents this")
    if turn.unit_hint:
        notes.append(turn.unit_hint)
    return [f"{scene.path}: {note}" for note in notes] + [turn.texture_hint] * bool(turn.texture_hint)


def _texture_hint(scene: Scene) -> str:
    """Return a line about a picture that may be the texture of one of the models; "" if there is none."""
    for file, asset in zip(scene.files, scene.assets, strict=True):
        option = f"--set assets.{asset.name}.texture=" if scene.beside else "--texture "
        if getattr(asset, "texture", None) is None and (hint := texture_hint(file, option)):
            return f"{file.name if scene.beside else file}: {hint}"
    return ""
