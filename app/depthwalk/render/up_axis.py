"""Guess which axis of a model's file points upward, and turn the model accordingly, without reading it again."""

import math
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from depthwalk.geometry.quaternions import conjugate, rotate
from depthwalk.ingest.formats import GLTF_SUFFIXES, is_baked_file, is_model_file
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


def model_points(renderer: Renderer) -> Array:
    """Return points (n, 3), metres, asset frame, of the only object that `renderer` draws, before it is turned.

    They are the vertices of its mesh or, where it is drawn by depth images, of their geometry.
    """
    objects, whole = renderer.world.objects(), renderer.world.scene_objects
    found = [
        scale * rotate(rotation, renderer.world.points(asset)) + position
        for asset, rotation, position, scale in zip(
            objects.asset.tolist(), objects.rotation, objects.position, objects.scale, strict=True
        )
    ]
    points: Array = rotate(conjugate(whole.rotation[0]), np.concatenate(found) - whole.position[0]) / whole.scale[0]
    return points


def turn_model(scene: Scene, renderer: Renderer, points: Array, up: Up) -> None:
    """Turn the only object of a scene so that the axis `up` of its file points upward, and stand it on its origin.

    What its node says of its place is heeded: a model that is to lean leans after it was turned upright.

    Parameters
    ----------
    scene
        The scene, whose object is moved.
    renderer
        The renderer that draws the scene.
    points
        (n, 3) what `model_points` returns, metres, asset frame.
    up
        The axis that shall point upward.
    """
    turned = rotate(_TURNS[up], points)
    low, high = turned.min(0), turned.max(0)
    base = np.array([(low[0] + high[0]) / 2, low[1], (low[2] + high[2]) / 2])
    upright = Similarity(-base[None], _TURNS[up][None].astype(np.float64), np.ones(1))
    placed = compose(scene.nodes.world, upright)
    scene.objects.rotation[:], scene.objects.position[:] = placed.rotation, placed.position
    renderer.world.moved()


class ModelTurn:
    """Turn a model that is shown without a scene: first by a guess, then as the user says.

    Attributes
    ----------
    renderer
        Draws the model; may be replaced.
    guess
        A message to the user about the turn that was guessed; "" where the model was left as it is.
    unit_hint
        A line that ends the sentence "The model is …" if it seems not to be in metres; "" otherwise.
    """

    def __init__(self, scene: Scene, renderer: Renderer) -> None:
        """Guess how the model of `scene` stands, and turn it upright in `renderer`; leave scenes from a file alone."""
        self._scene, self.renderer = scene, renderer
        self._points: Array | None = None
        self._up: Up = "y"
        self.guess = self.unit_hint = ""
        if not is_model_file(scene.path) or len(scene.objects) != 1 or getattr(scene.assets[0], "up", "y") != "y":
            return
        self._points = model_points(renderer)
        if not is_baked_file(scene.path) and getattr(scene.assets[0], "height", None) is None:
            self.unit_hint = unit_hint(scene.path, np.ptp(self._points, axis=0), "--set assets.model.height=…")
        # In glTF y is up by definition (2.0, §3.4), in depth images since they were baked; other formats say nothing.
        defined = scene.path.suffix.lower() in GLTF_SUFFIXES or is_baked_file(scene.path)
        if not defined and not getattr(scene.assets[0], "up_is_given", False) and guess_up(self._points) == "z":
            self.turn()
            self.guess = "The model seems to be z-up and was turned upright; U turns it back"

    @property
    def message(self) -> str:
        """Return what to tell the user of the model in a window, a line for each thing; "" for nothing."""
        return "\n".join(filter(None, (self.guess, self.unit_hint and f"The model is {self.unit_hint}")))

    def turn(self) -> str | None:
        """Switch the upward axis between y and z, and return a message to the user.

        None, and nothing is turned, for a scene that is not a single model.
        """
        if self._points is None:
            return None
        self._up = "z" if self._up == "y" else "y"
        turn_model(self._scene, self.renderer, self._points, self._up)
        how = f"bake with --up {self._up}" if is_baked_file(self._scene.path) else f"in a scene file: up: {self._up}"
        return f"{self._up} points upward; {how}"


def stand_upright(scene: Scene, renderer: Renderer) -> list[str]:
    """Turn a model that is drawn without a scene as `ModelTurn` does, for pictures.

    Returns
    -------
    list[str]
        Lines that tell the user of the turn, and that the model seems not to be in metres.
    """
    turn, notes = ModelTurn(scene, renderer), []
    if turn.guess:
        notes.append("the model seems to be z-up and was turned upright; --set assets.model.up=y prevents this")
    if turn.unit_hint:
        notes.append(turn.unit_hint)
    return [f"{scene.path}: {note}" for note in notes]
