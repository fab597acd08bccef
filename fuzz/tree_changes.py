"""Change documents, JSON or YAML, as trees of values: what is written is always well-formed."""

import json
import random
from collections import deque
from typing import Any

import yaml

VALUES: tuple[Any, ...] = (
    None, True, False, 0, 1, -1, 2, 3, 64, 255, 5121, 5123, 5125, 5126, 65536, 2**31, 2**53, 2**64, 1e-9, 0.5, 1e6, 1e7,
    -1e7, 1e30, 1e308, "", "x", "../x", "\x1b[2J\nforged", "nan", "é", [], {}, [0, 0, 0], [1, 1, 1], [0, 0], {"x": 1},
)  # fmt: skip

_MOST_PLACES = 2_000
_MOST_VALUES = 20_000  # with each alias written out

Place = tuple[Any, Any]  # a list or dict, and an index or key of it


def change_json(data: bytes, rng: random.Random, keys: tuple[str, ...] = ()) -> bytes:
    """Return the JSON document `data` with a value replaced, left out, doubled, or one put in under one of `keys`."""
    return json.dumps(changed_tree(json.loads(data), rng, keys)).encode("utf-8", "surrogatepass")


def change_yaml(data: bytes, rng: random.Random, keys: tuple[str, ...] = ()) -> bytes:
    """Return what `change_json` returns, of a YAML document; JSON is YAML, too.

    Raises ValueError where its aliases make so many values of it that they cannot be written out.
    """
    tree = yaml.load(data, Loader=yaml.CSafeLoader)
    if _values(tree, {}) > _MOST_VALUES:
        raise ValueError("aliases make too many values")
    return json.dumps(changed_tree(tree, rng, keys), default=str).encode("utf-8", "surrogatepass")


def changed_tree(tree: Any, rng: random.Random, keys: tuple[str, ...]) -> Any:
    """Return a tree of lists and dicts with one to three changes, made in place."""
    holder = [tree]
    for _ in range(rng.choice((1, 1, 2, 3))):
        places = list(_places(holder))
        parent, key = rng.choice(places)
        match rng.randrange(7):
            case 0 | 1:
                parent[key] = _new_value(parent[key], rng)
            case 2:
                other, place = rng.choice(places)
                parent[key] = json.loads(json.dumps(other[place], default=str))  # a copy: no value holds itself
            case 3 if parent is not holder:
                del parent[key]
            case 4 if isinstance(parent, list) and parent is not holder:
                parent[key:key] = [parent[key]] * (
                    1 if isinstance(parent[key], list | dict) else rng.choice((1, 2, 30))
                )
            case 5 if isinstance(parent[key], dict) and keys:
                parent[key][rng.choice(keys)] = _new_value(0, rng)
            case 6:
                depth = rng.choice((1, 5, 70, 300))
                for _ in range(depth):
                    parent[key] = [parent[key]]
    return holder[0]


def _values(node: Any, known: dict[int, int]) -> int:
    """Return how many values a tree has with each alias written out; each list or dict is looked at once."""
    if not isinstance(node, list | dict):
        return 1
    if id(node) not in known:
        known[id(node)] = _MOST_VALUES  # where it holds itself
        children = node.values() if isinstance(node, dict) else node
        known[id(node)] = 1 + sum(_values(child, known) for child in children)
    return known[id(node)]


def _new_value(old: Any, rng: random.Random) -> Any:
    if isinstance(old, int | float) and not isinstance(old, bool) and rng.random() < 0.4:
        return rng.choice((old + 1, old - 1, -old, old * 2, old * 1000, old / 1000))
    return rng.choice(VALUES)


def _places(node: Any) -> list[Place]:
    """Return the first places of a tree, breadth first: aliases may make one of any depth."""
    found: list[Place] = []
    pending = deque([node])
    while pending and len(found) < _MOST_PLACES:
        parent = pending.popleft()
        items = parent.items() if isinstance(parent, dict) else enumerate(parent)
        for key, value in items:
            found.append((parent, key))
            if isinstance(value, list | dict):
                pending.append(value)
    return found
