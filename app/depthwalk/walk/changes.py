"""Find what differs between the scene as its file gave it and the scene as keys and panel have changed it.

What differs is a nested mapping in the notation of scene files, so that it can be shown, copied and saved.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from depthwalk.params import Memo, Params
from depthwalk.scene.effect_settings import DofParams
from depthwalk.scene.environment import OF_IMAGE, GroundParams, SkyParams
from depthwalk.scene.saved_values import leaves
from depthwalk.scene.scene import Scene
from depthwalk.scene.yaml_edit import Place
from depthwalk.scene.yaml_text import float32_value
from depthwalk.walk.fields import Control, controls_of

_FOV = "camera", "fov"


class _Group:
    """Hold a group of parameters, where it stands in a scene file, and the values that the file gave."""

    def __init__(self, place: Place, params: Params) -> None:
        self.place, self.params, self.given = place, params, dict(vars(params))
        self._memo = self._new_memo()

    def _new_memo(self) -> Memo[Params, dict[str, Any]]:
        return Memo(lambda params: dict(_differing(params[0], self.given)))

    def differing(self) -> dict[str, Any]:
        """Return the values that differ from the file's; those of groups within it do not count."""
        return self._memo.of([self.params]) if vars(self.params) != self.given else {}

    def accept(self, name: str, written: Any) -> None:
        """Count a value, which the file has as it was `written`, as the file's from now on."""
        left_over = isinstance(self.params, SkyParams) and name in _unused(self.params)
        self.given[name] = written if left_over else getattr(self.params, name)
        self._memo = self._new_memo()

    def restore(self) -> None:
        """Give the group the values of the file again."""
        # Not one after the other through `setattr`: together they are valid, on the way they need not be.
        vars(self.params).update(self.given)


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
        found: dict[str, Any] = {}
        if fov is not None and self.fov is not None and _degrees(fov) != _degrees(self.fov):
            found["camera"] = {"fov": _degrees(fov)}
        for group in self._groups:
            if values := group.differing():
                inner = found
                for key in group.place:
                    inner = inner.setdefault(key, {})
                inner.update(values)
        return found

    def restore(self) -> None:
        """Give the scene the values of its file again, except for the field of view."""
        for group in self._groups:
            group.restore()

    def accept(self, values: Mapping[str, Any], fov: float | None = None) -> None:
        """Count changed values as the file's from now on, where they have been saved.

        Parameters
        ----------
        values
            What `changed` returned.
        fov
            As for `changed`.
        """
        groups = {group.place: group for group in self._groups}
        for place, written in leaves(values):
            if place == _FOV:
                self.fov = fov
            else:
                groups[place[:-1]].accept(place[-1], written)


def _groups(place: Place, params: Params) -> Iterator[_Group]:
    """Yield a group of parameters, and those within it that the panel shows."""
    yield _Group(place, params)
    for name, value in params:
        if isinstance(value, Params) and not isinstance(value, GroundParams):
            yield from _groups((*place, name), value)


def _differing(params: Params, given: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """Yield the names of a group's values that differ from the file's, and the values as a scene file holds them."""
    unused = _unused(params)
    for control in controls_of(type(params)):
        if control.kind == "other" or control.name in unused:
            continue
        value, before = getattr(params, control.name), given[control.name]
        if value != before and (written := _written(control, value)) != _written(control, before):
            yield control.name, written
    if isinstance(params, SkyParams):
        yield from _left_over(params, given)


def _left_over(sky: SkyParams, given: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """Yield the keys that the file has for the picture of a sky that shows none any more, at their defaults.

    With other values the file would be no valid scene.
    """
    if given["model"] == "image" != sky.model:
        for name in OF_IMAGE:
            if given[name] != (default := type(sky).model_fields[name].default):
                yield name, default


def _unused(params: Params) -> frozenset[str]:
    """Return the keys of a group that say nothing now."""
    if isinstance(params, SkyParams):  # and a file must not have those that are for other models
        return frozenset(type(params).model_fields) - params.used_keys
    if isinstance(params, DofParams) and params.autofocus and params.mode != "none":  # it focuses by itself
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
