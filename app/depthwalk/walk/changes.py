"""Find what differs between the scene as its file gave it and the scene as keys and panel have changed it.

What differs is a nested mapping in the notation of scene files, so that it can be shown, copied and saved.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from depthwalk.params import Params
from depthwalk.scene.effect_settings import DofParams
from depthwalk.scene.environment import GroundParams, SkyParams
from depthwalk.scene.saved_values import leaves
from depthwalk.scene.scene import Scene
from depthwalk.scene.yaml_edit import Place
from depthwalk.scene.yaml_text import float32_value
from depthwalk.walk.fields import Control, controls_of

_FOV = "camera", "fov"


@dataclass(frozen=True)
class _Group:
    """Hold a group of parameters, where it stands in a scene file, and the values that the file gave."""

    place: Place
    params: Params
    given: dict[str, Any]

    @property
    def is_changed(self) -> bool:
        """Return whether any of its values is another object or number; groups within it do not count."""
        return vars(self.params) != self.given


class FileValues:
    """Remember the values that a scene's file gave, and tell which of them are others now.

    These are the render settings, what the panel shows of the environment, how the user walks, and the field of view
    of a scene with a camera. Values of `--set` count as the file's.

    Parameters
    ----------
    scene
        The scene, just loaded.
    """

    def __init__(self, scene: Scene) -> None:
        parts = {"environment": scene.environment, "walk": scene.walk, "render": scene.render}
        self._groups = tuple(group for name, part in parts.items() for group in _groups((name,), part))
        self.fov = None if scene.camera is None else scene.camera.fov
        self._known: tuple[list[dict[str, Any]], dict[str, Any]] = [], {}  # values, and which of them `changed` found

    def changed(self, fov: float | None = None) -> dict[str, Any]:
        """Return the values that differ from the file's.

        Parameters
        ----------
        fov
            The vertical field of view that the user has chosen, radians; None for none.

        Returns
        -------
        dict
            Nested mappings as in a scene file: angles in degrees, colours as `"#rrggbb"` where that is exact, numbers
            with the fewest digits that float32 distinguishes. Empty where nothing differs.
        """
        groups = [group for group in self._groups if group.is_changed]
        if self._known[0] != (values := [vars(group.params) for group in groups]):  # the panel asks in every frame
            self._known = [dict(each) for each in values], _nested(groups)
        found = self._known[1]
        if fov is None or self.fov is None or _degrees(fov) == _degrees(self.fov):
            return found
        return {"camera": {"fov": _degrees(fov)}, **found}

    def restore(self) -> None:
        """Give the scene the values of its file again, except for the field of view."""
        for group in self._groups:
            # Not one after the other through `setattr`: together they are valid, on the way they need not be.
            vars(group.params).update(group.given)

    def accept(self, values: Mapping[str, Any], fov: float | None = None) -> None:
        """Count changed values as the file's from now on, where they have been saved.

        Parameters
        ----------
        values
            What `changed` returned.
        fov
            As for `changed`.
        """
        self._known = [], {}
        groups = {group.place: group for group in self._groups}
        for place, _ in leaves(values):
            if place == _FOV:
                self.fov = fov
            else:
                group = groups[place[:-1]]
                group.given[place[-1]] = getattr(group.params, place[-1])


def _groups(place: Place, params: Params) -> Iterator[_Group]:
    """Yield a group of parameters, and those within it that the panel shows."""
    yield _Group(place, params, dict(vars(params)))
    for name, value in params:
        if isinstance(value, Params) and not isinstance(value, GroundParams):
            yield from _groups((*place, name), value)


def _nested(groups: Sequence[_Group]) -> dict[str, Any]:
    """Return the values of groups that differ from the file's, in nested mappings."""
    found: dict[str, Any] = {}
    for group in groups:
        values = dict(_differing(group))
        inner = found
        for key in group.place if values else ():
            inner = inner.setdefault(key, {})
        inner.update(values)
    return found


def _differing(group: _Group) -> Iterator[tuple[str, Any]]:
    """Yield the names of a group's values that differ from the file's, and the values as a scene file holds them."""
    params = group.params
    unused = _unused(params)
    for control in controls_of(type(params)):
        if control.kind == "other" or control.name in unused:
            continue
        value, given = getattr(params, control.name), group.given[control.name]
        if value != given and (written := _written(control, value)) != _written(control, given):
            yield control.name, written


def _unused(params: Params) -> frozenset[str]:
    """Return the keys of a group that say nothing now."""
    if isinstance(params, SkyParams):  # and a file must not have those that are for other models
        return frozenset(type(params).model_fields) - params.used_keys
    if isinstance(params, DofParams) and params.autofocus:  # follows what is in the middle of the picture
        return frozenset({"focus_distance"})
    return frozenset()


def _written(control: Control, value: Any) -> Any:
    """Return the value of a parameter as a scene file holds it."""
    if isinstance(value, Sequence) and not isinstance(value, str):
        numbers = [float32_value(part) for part in value]
        return _colour(numbers) if control.kind == "colour" else numbers
    return float32_value(value) if isinstance(value, float) else value


def _colour(parts: Sequence[float]) -> str | list[float]:
    """Return a colour, three numbers from 0 to 1, as `#rrggbb` if that is exact."""
    levels = [round(255 * part) for part in parts]
    exact = [float32_value(level / 255) for level in levels] == list(parts)
    return "#" + "".join(f"{level:02x}" for level in levels) if exact else list(parts)


def _degrees(angle: float) -> float:
    return float32_value(math.degrees(angle))
