"""Draw widgets from declarations: a parameter's type, range, unit and help text determine its widget in the panel.

So a new setting appears in the panel without any code here.
"""

import math
from collections.abc import Collection
from dataclasses import dataclass
from functools import cache
from typing import Any, Literal

from depthwalk.errors import InputError
from depthwalk.params import Params
from depthwalk.scene.fields import COLOUR_TEXT
from depthwalk.walk.native_imgui import imgui

LABEL_WIDTH = 132.0  # at the right of each widget, widget coordinates
_TOOLTIP_WIDTH = 420.0
Kind = Literal["switch", "number", "integer", "choice", "colour", "vector", "other"]
_KINDS: dict[str, Kind] = {"boolean": "switch", "number": "number", "integer": "integer"}


@dataclass(frozen=True, kw_only=True)
class Control:
    """Describe the widget that shows one parameter.

    Attributes
    ----------
    name
        The name of the parameter in its group.
    kind
        The kind of widget.
    help
        What the parameter does: one sentence without its full stop.
    unit
        The unit of the value; "" if it has none.
    low, high
        The smallest and the largest value of a number; None for no limit.
    choices
        The values to choose from; empty for other kinds of widget.
    optional
        Whether the value may be None, shown by a check box that is off.
    default
        The value that a right click sets.
    """

    name: str
    kind: Kind
    help: str
    unit: str = ""
    low: float | None = None
    high: float | None = None
    choices: tuple[Any, ...] = ()
    optional: bool = False
    default: Any = None

    @property
    def label(self) -> str:
        """Return the parameter's name as the panel writes it."""
        return self.name.replace("_", " ")

    @property
    def tooltip(self) -> str:
        """Return the text of the tooltip: what the parameter does, its range, and how to reset it."""
        unit = f" {self.unit}" if self.unit else ""
        bounded = self.low is not None and self.high is not None
        span = f"\n{self.low:g} to {self.high:g}{unit}" if bounded else ""
        reset = "Right click resets it"
        if self.kind in ("number", "integer", "vector", "colour"):
            reset = "Ctrl+click types a value, right click resets it"
        return f"{self.help}.{span}\n{reset}"


@cache
def controls_of(params: type[Params]) -> tuple[Control, ...]:
    """Return the controls of all parameters of the class `params`, in the order of their declaration."""
    schema = params.model_json_schema()
    specs, definitions = schema["properties"], schema.get("$defs", {})
    return tuple(
        _control(name, specs[name], definitions, field.get_default(call_default_factory=True))
        for name, field in params.model_fields.items()
    )


def _control(name: str, spec: dict[str, Any], definitions: dict[str, Any], default: Any) -> Control:
    branches = [_resolved(branch, definitions) for branch in spec.get("anyOf", [spec])]
    value = next((branch for branch in branches if branch.get("type") != "null"), {})
    choices = tuple(value.get("enum", ()))
    numbers = value.get("type") == "array" and value.get("minItems") == 3
    kind: Kind = "choice" if choices else _KINDS.get(value.get("type", ""), "other")
    if any(branch.get("pattern") == COLOUR_TEXT for branch in branches):
        kind = "colour"
    elif numbers:
        kind = "vector"
    return Control(
        name=name,
        kind=kind,
        help=spec.get("description", name).rstrip("."),
        unit=spec.get("unit", ""),
        low=value.get("minimum", value.get("exclusiveMinimum")),
        high=value.get("maximum", value.get("exclusiveMaximum")),
        choices=choices,
        optional=any(branch.get("type") == "null" for branch in branches),
        default=default,
    )


def _resolved(branch: dict[str, Any], definitions: dict[str, Any]) -> dict[str, Any]:
    reference = branch.get("$ref")
    return definitions.get(reference.rsplit("/", 1)[-1], {}) if reference else branch


def draw_group(group: Params, declared: type[Params] | None = None, only: Collection[str] = ()) -> str:
    """Draw the controls of a group of parameters, and apply the user's changes to the group.

    Parameters
    ----------
    group
        The parameters.
    declared
        A base class of the group's class; only parameters of the base class are drawn. None draws all.
    only
        The names of the parameters to draw; empty draws all.

    Returns
    -------
    str
        Why a value was refused, or an empty string.
    """
    refusal = ""
    for control in controls_of(declared or type(group)):
        if only and control.name not in only:
            continue
        before = getattr(group, control.name)
        after = _draw(control, before)
        if after != before:
            try:
                setattr(group, control.name, after)
            except InputError as error:
                refusal = str(error)
    return refusal


def _draw(control: Control, value: Any) -> Any:
    imgui.push_id(control.name)
    if control.optional:
        value = _draw_presence(control, value)
    if value is not None or not control.optional:
        value = _DRAW[control.kind](control, value)
    if imgui.is_item_hovered(imgui.HoveredFlags_.delay_normal):
        draw_tooltip(control.tooltip)
    if imgui.is_item_clicked(imgui.MouseButton_.right):
        value = control.default
    imgui.pop_id()
    return value


def draw_slider(label: str, value: float, low: float, high: float, form: str, flags: int = 0) -> tuple[bool, float]:
    """Draw a slider from `low` to `high`; return whether the user changed the value, and the value, which is finite.

    Parameters
    ----------
    label
        The text at its right.
    value
        The present value.
    low, high
        The ends of the slider; Ctrl+click lets the user type values beyond them, unless `flags` have `always_clamp`.
    form
        How the value is written, as in C.
    flags
        imgui's flags of sliders.
    """
    changed, number = imgui.slider_float(label, value, low, high, form, flags)
    is_number = math.isfinite(number)  # not if "nan" or "1e99" is typed
    return changed and is_number, number if is_number else value


def draw_tooltip(text: str) -> None:
    """Draw a text under the mouse, wrapped to fit the window; `imgui.set_tooltip` does not wrap."""
    if imgui.begin_tooltip():
        imgui.push_text_wrap_pos(min(_TOOLTIP_WIDTH, 0.8 * imgui.get_io().display_size.x))
        imgui.text_unformatted(text)
        imgui.pop_text_wrap_pos()
        imgui.end_tooltip()


def _draw_presence(control: Control, value: Any) -> Any:
    """Draw the check box before an optional control and return the value; off is None."""
    changed, on = imgui.checkbox("##on" if value is not None else control.label, value is not None)
    if value is not None:
        imgui.same_line()
    if not changed:
        return value
    return (control.default if control.default is not None else control.low or 0) if on else None


def _draw_number(control: Control, value: Any) -> Any:
    low, high = control.low, control.high
    form = "%.3g" + (f" {control.unit}".replace("%", "%%") if control.unit else "")
    if low is None or high is None:
        return _changed(imgui.drag_float(control.label, value, 0.05, format=form), value)
    wide = low > 0 and high / low >= 100
    flags = imgui.SliderFlags_.always_clamp | (imgui.SliderFlags_.logarithmic if wide else 0)
    changed, number = draw_slider(control.label, value, low, high, form, flags)
    return min(max(number, low), high) if changed else value  # rounded to float32, an end may be outside the range


def _draw_integer(control: Control, value: Any) -> Any:
    form = "%d" + (f" {control.unit}".replace("%", "%%") if control.unit else "")
    if control.low is None or control.high is None:
        return _changed(imgui.drag_int(control.label, value, format=form), value)
    flags = imgui.SliderFlags_.always_clamp
    return _changed(imgui.slider_int(control.label, value, int(control.low), int(control.high), form, flags), value)


def _draw_choice(control: Control, value: Any) -> Any:
    names = [str(choice) for choice in control.choices]
    current = control.choices.index(value) if value in control.choices else 0
    changed, index = imgui.combo(control.label, current, names)
    return control.choices[index] if changed else value


def _draw_colour(control: Control, value: Any) -> Any:
    changed, colour = imgui.color_edit3(control.label, list(value), imgui.ColorEditFlags_.float)
    return tuple(min(max(part, 0.0), 1.0) for part in colour) if changed else value


def _draw_vector(control: Control, value: Any) -> Any:
    changed, vector = imgui.drag_float3(control.label, list(value), 0.05)
    return tuple(vector) if changed else value


def _draw_switch(control: Control, value: Any) -> Any:
    return _changed(imgui.checkbox(control.label, value), value)


def _draw_other(control: Control, value: Any) -> Any:
    imgui.text_disabled(f"{value}  {control.label}")
    return value


def _changed(answer: tuple[bool, Any], value: Any) -> Any:
    """Return imgui's value only if the user changed it, since imgui rounds numbers to float32."""
    return answer[1] if answer[0] else value


_DRAW = {
    "switch": _draw_switch,
    "number": _draw_number,
    "integer": _draw_integer,
    "choice": _draw_choice,
    "colour": _draw_colour,
    "vector": _draw_vector,
    "other": _draw_other,
}
