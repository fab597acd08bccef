"""Check a document against a pydantic model, with the `--set` options applied and every mistake located.

pydantic finds the mistakes; this module words them so that they name the key as written in the file, its line and
column or the `--set` option that gave the value, and what would be right.
"""

import logging
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from depthwalk.errors import InputError, suggest
from depthwalk.params import plain_message, shown
from depthwalk.scene.document import Document, Loc, label, parse_document
from depthwalk.scene.fields import KIND
from depthwalk.scene.renamed_keys import Report, present_place, rename_keys

log = logging.getLogger(__name__)

MAX_MESSAGES = 20
_VERSION = ("version",)

Model = TypeVar("Model", bound=BaseModel)


@dataclass(frozen=True)
class Source:
    """Record where the values of a pydantic model came from: a document and the `--set` options laid over it.

    A location is a tuple of keys and list indices from the root of the document.

    Attributes
    ----------
    document
        The parsed file.
    overrides
        The key of each `--set` option as the user wrote it, by the location that it sets.
    renamed
        The location of each key that the file has under a former name, by the present location of its value.
    """

    document: Document
    overrides: dict[Loc, str] = field(default_factory=dict)
    renamed: dict[Loc, Loc] = field(default_factory=dict)

    def error(self, loc: Loc, message: str, *, at_key: bool = False) -> InputError:
        """Return an error about a value, which cites the `--set` option that gave it, or else the line and column.

        Parameters
        ----------
        loc
            The location of the value.
        message
            What is wrong with it.
        at_key
            Whether to cite line and column of the value's key instead of its own.

        Returns
        -------
        InputError
            `file:line:column: place: message`, or `--set key: message`.
        """
        for place, key in reversed(self.overrides.items()):
            if loc[: len(place)] == place:
                rest = label(loc[len(place) :])
                return InputError(f"--set {key}: {rest}: {message}" if rest else f"--set {key}: {message}")
            if place[: len(loc)] == loc and not self.document.holds(self.as_written(loc)):
                beside = "" if "; " in message else self._beside(loc)
                return InputError(f"--set {key}: {label(loc)}: {message}{beside}")
        return self.document.error(self.as_written(loc), message, at_key=at_key)

    def rename_keys(self) -> None:
        """Give the document's keys their present names, with a warning for each former one.

        Raises InputError if a key is given under both names.
        """

        def report(former: Loc, present: Loc, taken: bool) -> None:
            if taken:
                raise self.error(former, f"is the former name of {label(present)}, which is given too", at_key=True)
            self.renamed[present] = former
            where = self.document.where(former, at_key=True)
            log.warning("%s: %s is now called %s", where, label(former), label(present))

        rename_keys(self.document.value, (), report)

    def override(self, key: str, text: str) -> None:
        """Set the value at the dotted path `key` of the document to the YAML `text`, as `--set key=text` asks.

        Raises InputError if the path or the text is invalid.
        """
        self.overrides[_override(self.document.value, key, text)] = key

    def as_written(self, loc: Loc) -> Loc:
        """Return the location in the file's text, which may use former names, of the value at `loc`."""
        for present, former in self.renamed.items():
            if loc[: len(present)] == present:
                return former + loc[len(present) :]
        return loc

    def _beside(self, loc: Loc) -> str:
        """Return a hint at the key in the file that an option may have meant when it added another one at `loc`."""
        from depthwalk.scene.key_hints import MAX_KEYS_NAMED  # here, since only mistakes need it

        among = self.document.value
        for part in loc[:-1]:
            among = among[part]
        keys = among if isinstance(among, dict) else ()
        written = [key for key in keys if self.document.holds((*loc[:-1], key))]
        few = written[:MAX_KEYS_NAMED] + ["..."] * (len(written) > MAX_KEYS_NAMED)
        names = f"; the file has {', '.join(few)}" if few and len(loc) > 1 else ""  # those that its author gave
        return suggest(str(loc[-1]), written) or names


def check_model(
    document: Document,
    model: type[Model],
    overrides: Mapping[str, str] | None = None,
    unversioned: list[InputError] | None = None,
) -> tuple[Model, Source]:
    """Apply overrides to a document and check it.

    Keys under a former name are given their present one, with a warning (see `renamed_keys`).

    Parameters
    ----------
    document
        The parsed file; its values are changed in place.
    model
        The pydantic model of what the file must hold.
    overrides
        Values to replace: YAML text by dotted path in the document; None replaces none.
    unversioned
        Gets the mistake that the version is missing, if that is the only one, so that the caller can look for others
        before it raises it; None has it raised here.

    Returns
    -------
    tuple
        The document's values as a `model`, and their origin, for errors that are found later.

    Raises
    ------
    InputError
        With one located line per mistake.
    """
    if not isinstance(document.value, dict):
        raise document.error((), f"the file must be a mapping of keys, not {shown(document.value)}")
    source = Source(document)
    source.rename_keys()
    for key, text in (overrides or {}).items():
        source.override(key, text)
    _check_empty(model, source)
    try:
        return model.model_validate(document.value), source
    except ValidationError as error:
        complaints = _complaints(error, model, source)
        only_version = [(detail["loc"], detail["type"]) for detail in error.errors()] == [(_VERSION, "missing")]
        if unversioned is None or not only_version:
            raise complaints from None
        unversioned.append(complaints)
        return model.model_validate({**document.value, "version": 1}), source


def _check_empty(model: type[BaseModel], source: Source) -> None:
    """Raise InputError if nothing stands after keys that should be followed by keys of their own.

    To YAML this is null, as if the key were left out. Who writes `sky:` wants one, and who does not indent what belongs
    to `grid:` wants that.
    """
    problems = []
    for loc in source.document.empty:
        if any(loc[: len(place)] == place or place[: len(loc)] == loc for place in source.overrides):
            continue  # an option gives its value
        from depthwalk.scene.key_hints import defaults_hint, known_keys  # here, since only mistakes need them

        if known_keys(model, loc):
            hint = defaults_hint(None, model, loc)
            message = "is empty; indent its keys below it" + (f", or {hint}" if hint else "")
            problems.append(source.error(loc, message, at_key=True))
    raise_all(problems)


def raise_all(errors: list[InputError]) -> None:
    """Raise the collected `errors` as one InputError with a line for each; do nothing if there are none."""
    if errors:
        lines = list(dict.fromkeys(str(error) for error in errors))
        more = [f"... and {len(lines) - MAX_MESSAGES} more"] if len(lines) > MAX_MESSAGES else []
        raise InputError(*lines[:MAX_MESSAGES], *more)


def _override(value: dict[str, Any], key: str, text: str) -> Loc:
    """Set the value at the dotted path `key`, creating mappings on the way; return its location."""
    parts = tuple(key.replace("[", ".").replace("]", "").split("."))
    if not all(parts) or not key.isprintable():
        raise InputError(f"--set {key}: must be a dotted path such as render.lod.bias")
    present = present_place(parts)
    if present != parts:
        log.warning("--set %s: %s is now called %s", key, ".".join(parts), ".".join(map(str, present)))
    here: Any = value
    place: list[str | int] = []
    *groups, last = map(str, present)
    for part in groups:
        index = _index(here, part, key, place)
        if isinstance(here, dict) and here.get(part) is None:
            here[part] = {}
        here = here[index]
        place.append(index)
    index = _index(here, last, key, place)
    # YAML would read a bare #rrggbb as a comment.
    new = text if text.startswith("#") else _override_value(text, key)
    rename_keys(new, (*place, index), _option_report(key))
    here[index] = new
    return (*place, index)


def _option_report(key: str) -> Report:
    """Return the callback that reports former names of keys within the value of the option `--set key=…`."""

    def report(former: Loc, present: Loc, taken: bool) -> None:
        if taken:
            raise InputError(
                f"--set {key}: {label(former)}: is the former name of {label(present)}, which is given too"
            )
        log.warning("--set %s: %s is now called %s", key, label(former), label(present))

    return report


def _override_value(text: str, key: str) -> Any:
    if not text.strip():
        return None
    try:
        return parse_document(text, "value").value
    except InputError as error:
        raise InputError(f"--set {key}: {error}") from None


def _index(here: Any, part: str, key: str, place: list[str | int]) -> str | int:
    if isinstance(here, dict):
        return part
    if not isinstance(here, list):
        raise InputError(f"--set {key}: {label(tuple(place))} is {shown(here)}, it has no keys")
    if not (part.isascii() and part.isdigit() and len(part) < 10 and int(part) < len(here)):
        raise InputError(f"--set {key}: {label(tuple(place))} has no item {part!r}, it has {len(here)}")
    return int(part)


def _complaints(error: ValidationError, model: type[BaseModel], source: Source) -> InputError:
    details = error.errors(include_url=False)
    # For a file of another version, report only the version: every other complaint would be noise. A file without one
    # is taken for one of this version.
    other = [detail for detail in details if detail["loc"] == _VERSION and detail["type"] != "missing"]
    details = other or details
    # Locating a mistake and its likely spelling takes time: of a thousand, only those that are reported get this.
    messages: dict[str, None] = {}
    for number, detail in enumerate(details, 1):
        messages[str(_complaint(detail, model, source))] = None
        if len(messages) == MAX_MESSAGES and number < len(details):
            return InputError(*messages, f"... and {len(details) - number} more")
    return InputError(*messages)


def _complaint(detail: ErrorDetails, model: type[BaseModel], source: Source) -> InputError:
    from depthwalk.scene import key_hints  # here, since only mistakes need it

    loc: Loc = tuple(part for part in detail["loc"] if not str(part).startswith(KIND))
    value = detail["input"]
    match detail["type"]:
        case "extra_forbidden":
            hint = key_hints.place_hint(loc, model) or key_hints.meant_key(
                str(loc[-1]), key_hints.known_keys(model, detail["loc"][:-1])
            )
            return source.error(loc, f"unknown key{hint}", at_key=True)
        case "missing":
            misspelt = _misspelt(value, loc[:-1], [str(loc[-1])], model, source)
            first = "; begin the file with 'version: 1'" if loc == _VERSION else ""
            return misspelt or source.error(loc[:-1], f"missing key {loc[-1]!r}{first}")
        case "no_kind" if isinstance(value, dict):
            misspelt = _misspelt(value, loc, None, model, source)
            return misspelt or source.error(loc, detail["msg"])
        case "no_kind" | "model_type" | "model_attributes_type" | "dict_type":
            hint = key_hints.space_hint(value, key_hints.known_keys(model, loc))
            if isinstance(value, bool | None) and (defaults := key_hints.defaults_hint(value, model, loc)):
                hint = f"; {defaults}"
            return source.error(loc, f"must be a mapping of keys, not {shown(value)}{hint}")
        case "path_type":
            return source.error(loc, f"must be the name of a file, not {shown(value)}")
        case "too_short" | "too_long":
            least, most = (detail["ctx"].get(name) for name in ("min_length", "max_length"))
            bound = f"at least {least}" if most is None else f"at most {most}"
            return source.error(loc, f"must hold {bound}, not {len(value)}")
    return source.error(loc, plain_message(detail))


def _misspelt(
    value: dict[str, Any], loc: Loc, meant: list[str] | None, model: type[BaseModel], source: Source
) -> InputError | None:
    """Return the error about the first unknown key of mapping `value` at `loc` that looks like one of `meant`.

    meant: None stands for all keys that are known there.
    """
    from depthwalk.scene.key_hints import known_keys, spelling_hint

    if not value:
        return None
    known = known_keys(model, loc)
    for key in value:
        if key not in known and (hint := spelling_hint(key, known if meant is None else meant)):
            return source.error((*loc, key), f"unknown key{hint}", at_key=True)
    return None
