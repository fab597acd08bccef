"""Every key of a scene file is named by a test that also names its group, so that none may do nothing unnoticed."""

import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple, get_args

from pydantic import BaseModel

from depthwalk.scene.schema import SceneFile

TESTS = Path(__file__).parent.parent


class Key(NamedTuple):
    """A key of a scene file, the key that holds it, and the class that declares it."""

    name: str
    group: str
    model: str


def models_in(annotation: Any) -> Iterator[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for inner in get_args(annotation):
        yield from models_in(inner)


def keys_of(model: type[BaseModel], group: str, above: tuple[type[BaseModel], ...] = ()) -> Iterator[Key]:
    """The keys of a model and of all models in it; of groups in groups, once."""
    for name, field in model.model_fields.items():
        yield Key(name, group, model.__name__)
        for inner in models_in(field.annotation):
            if inner not in (*above, model):
                yield from keys_of(inner, name, (*above, model))


@cache
def words_of_tests() -> tuple[frozenset[str], ...]:
    files = (file for file in TESTS.rglob("test_*.py") if file != Path(__file__))
    return tuple(frozenset(re.findall(r"\w+", file.read_text())) for file in files)


def is_named(key: Key) -> bool:
    """Whether a test file has the key's name, and that of its group or of its class."""
    return any(key.name in words and (key.group in words or key.model in words) for words in words_of_tests())


def test_every_key_is_named_by_a_test() -> None:
    keys = set(keys_of(SceneFile, "scene"))
    assert len(keys) > 150
    assert sorted(".".join(key[1::-1]) for key in keys if not is_named(key)) == []


def test_a_key_that_no_test_names_is_found() -> None:
    assert not is_named(Key("no_such" + "_key", "render", "RenderSettings"))
    assert is_named(Key("max_search_distance", "smaa", "SmaaParams"))
