"""A digest of the code that cooks, recorded beside the version of what it yields.

    python tests/cook_digest.py

records the digest of today's code for today's COOK_VERSION in `cook_digest.txt`. It covers every definition that
`cook_object` can reach, in whatever module it is, but no comments, docstrings, layout or names of modules.
"""

import ast
import hashlib
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path

RECORD = Path(__file__).with_name("cook_digest.txt")
APP = Path(__file__).parents[1] / "app"


def cook_digest() -> str:
    """Digest of all that `cook_object` reaches."""
    from depthwalk.cook.cook import cook_object

    return digest(APP, cook_object.__module__, cook_object.__name__)


def record_line() -> str:
    """What the record holds when it is up to date: version and digest."""
    from depthwalk.cook.cook import COOK_VERSION

    return f"{COOK_VERSION} {cook_digest()}\n"


def digest(root: Path, module: str, name: str) -> str:
    """Hex digest over the definition `name` of a module below `root`, and all definitions there that it reaches."""
    found: dict[tuple[str, str], list[str]] = {}
    open_ends = [(module, name)]
    while open_ends:
        place = open_ends.pop()
        if place not in found:
            source = _Module.read(root, place[0])
            statements = source.definitions.get(place[1], [])
            found[place] = [dumped(statement) for statement in statements]
            if place[1] in source.others:
                found[place].append(source.others[place[1]])
            if place[1] in source.imports:
                open_ends.append(source.imports[place[1]])
            for statement in statements:
                open_ends += source.reached(statement)
    # Sorted and without their modules: what moves to another file stays what it is.
    whole = sorted(text for texts in found.values() for text in texts)
    return hashlib.sha256("\n".join(whole).encode()).hexdigest()[:16]


class _Module:
    """definitions: statements by the names that they bind; imports: where names come from that the package defines;
    others: what other imported names stand for."""

    def __init__(self, root: Path, name: str) -> None:
        self.definitions: dict[str, list[ast.stmt]] = {}
        self.imports: dict[str, tuple[str, str]] = {}
        self.others: dict[str, str] = {}
        self._name = name
        self._submodules: dict[str, str] = {}
        tree = ast.parse(module_file(root, name).read_text(encoding="utf-8"))
        for statement in ast.walk(tree):
            if isinstance(statement, ast.ImportFrom):
                assert statement.module and not statement.level, "the package uses absolute imports only"
                for alias in statement.names:
                    self._note(root, statement.module, alias.name, alias.asname or alias.name)
            elif isinstance(statement, ast.Import):
                for alias in statement.names:
                    self.others[alias.asname or alias.name.split(".")[0]] = f"import {alias.name}"
        for statement in _top_level(tree.body):
            for bound in _bound(statement):
                self.definitions.setdefault(bound, []).append(statement)

    @staticmethod
    @cache
    def read(root: Path, name: str) -> "_Module":
        return _Module(root, name)

    def _note(self, root: Path, module: str, name: str, known_as: str) -> None:
        if module_file(root, f"{module}.{name}").is_file():
            self._submodules[known_as] = f"{module}.{name}"
        elif module_file(root, module).is_file():
            self.imports[known_as] = module, name
        else:
            self.others[known_as] = f"from {module} import {name}"

    def reached(self, statement: ast.stmt) -> Iterator[tuple[str, str]]:
        """Module and name of what a statement of this module may use."""
        for node in ast.walk(statement):
            match node:
                case ast.Attribute(value=ast.Name(id=name)) if name in self._submodules:
                    yield self._submodules[name], node.attr
            if isinstance(node, ast.Name):
                if node.id in self.imports:
                    yield self.imports[node.id]
                if node.id in self.definitions or node.id in self.others:
                    yield self._name, node.id


def module_file(root: Path, name: str) -> Path:
    return root.joinpath(*name.split(".")).with_suffix(".py")


def dumped(node: object) -> str:
    """The statement as text that neither comments nor docstrings show in, nor which Python parsed it."""
    if isinstance(node, list):
        return "[" + ",".join(dumped(each) for each in node) + "]"
    if not isinstance(node, ast.AST):
        return repr(node)
    fields = {name: value for name, value in ast.iter_fields(node) if value is not None and value != []}
    if "body" in fields and isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
        fields["body"] = [each for each in node.body if not _is_text(each) and not isinstance(each, ast.ImportFrom)]
    return f"{type(node).__name__}({','.join(f'{name}={dumped(value)}' for name, value in fields.items())})"


def _is_text(statement: ast.stmt) -> bool:
    """Whether it is a docstring, or any other text that nothing comes of."""
    return (
        isinstance(statement, ast.Expr)
        and isinstance(statement.value, ast.Constant)
        and isinstance(statement.value.value, str)
    )


def _top_level(body: list[ast.stmt]) -> Iterator[ast.stmt]:
    """Statements of a module, those within `if` and `try` too."""
    for statement in body:
        if isinstance(statement, ast.If | ast.Try | ast.With):
            for inner in ("body", "orelse", "finalbody"):
                yield from _top_level(getattr(statement, inner, []))
        else:
            yield statement


def _bound(statement: ast.stmt) -> set[str]:
    """The names that a statement of a module defines or changes."""
    if isinstance(statement, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
        return {statement.name}
    if isinstance(statement, ast.Assign | ast.AnnAssign | ast.AugAssign):
        targets = statement.targets if isinstance(statement, ast.Assign) else [statement.target]
        return {node.id for target in targets for node in ast.walk(target) if isinstance(node, ast.Name)}
    return set()


if __name__ == "__main__":
    sys.path.insert(0, str(APP))
    RECORD.write_text(record_line(), encoding="utf-8")
    print(f"{RECORD}: {RECORD.read_text(encoding='utf-8').strip()}")
