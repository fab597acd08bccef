"""What README and docs name exists: files, folders, modules, commands with their options, settings and their values.

`test_project_files.py` follows the links between the pages.
"""

import ast
import importlib
import json
import re
import runpy
import shlex
from functools import cache
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest
import typer
from typer.core import TyperGroup

from depthwalk.commands.cli import app
from depthwalk.params import Params
from depthwalk.scene.render_settings import RenderSettings

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "app" / "depthwalk"
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
TEXTS = {page.name: page.read_text(encoding="utf-8") for page in PAGES}
STAGES = (
    *("scene", "ingest", "bake", "assets", "cook", "gpu", "geometry"),
    *("render", "reference", "walk", "quality", "bench", "commands"),
)
# Names in examples of what a user writes, and of what a command writes.
EXAMPLES = {
    "vignette.frag",
    "vignette/vignette.frag",
    "render/passes/vignette.py",
    "shaders/vignette/",
    "common/x.glsl",
}
WRITTEN = {"depthwalk-demo/", "court.yaml"}


def code_spans(text: str) -> list[str]:
    """Return what stands between backticks, without the indented and the fenced blocks."""
    text = re.sub(r"```.*?```", "", text, flags=re.DOTALL)
    lines = [line for line in text.split("\n") if not re.match(r" {4}(?! *-)", line)]
    return [" ".join(span.split()) for span in re.findall(r"`([^`]+)`", "\n".join(lines))]


def named_paths(page: str) -> list[str]:
    """Return the files and folders that a page names."""
    paths = []
    for span in code_spans(TEXTS[page]):
        name = re.fullmatch(r"([\w./-]+\.(?:py|glsl|vert|frag|toml)|(?:[\w-]+/)+[\w-]*)(?::.*)?", span)
        if name and "NAME" not in span:
            paths.append(name[1])
    return [path for path in paths if path not in EXAMPLES | WRITTEN]


@cache
def file_names() -> set[str]:
    """Return the names, without folders, of all files of package, shaders, docs and tools."""
    folders = PACKAGE, ROOT / "shaders", ROOT / "docs", ROOT / "tools"
    return {path.name for folder in folders for path in folder.rglob("*.*")}


@pytest.mark.parametrize("page", TEXTS)
def test_named_files_exist(page: str) -> None:
    roots = ROOT, PACKAGE, PACKAGE / "render", ROOT / "shaders", ROOT / "docs"
    missing = [
        path
        for path in named_paths(page)
        if not any((root / path).exists() for root in roots) and not ("/" not in path and path in file_names())
    ]
    assert not missing


def test_every_module_of_the_renderer_has_its_place() -> None:
    """Those that lie in no folder of their own stand by name in the tree that architecture.md shows."""
    named = {span.rpartition("/")[2] for span in code_spans(TEXTS["architecture.md"])}
    modules = {path.name for folder in (PACKAGE, PACKAGE / "render") for path in folder.glob("[!_]*.py")}
    folders = {f"{path.name}/" for path in (PACKAGE / "render").iterdir() if (path / "__init__.py").exists()}
    text = TEXTS["architecture.md"]
    assert not (modules - named) and not [folder for folder in folders if f"`{folder}`" not in text]


def module_defines(dotted: str) -> bool:
    """Whether a dotted name such as `bake.images.DepthImage` is a module, or is defined at the top of one."""
    *parents, last = dotted.split(".")
    if (PACKAGE.joinpath(*parents, last).is_dir()) or PACKAGE.joinpath(*parents, f"{last}.py").is_file():
        return True
    file = PACKAGE.joinpath(*parents).with_suffix(".py")
    if not file.is_file():
        return False
    names = set()
    for node in ast.parse(file.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.ClassDef | ast.FunctionDef):
            names.add(node.name)
        elif isinstance(node, ast.Assign):
            names |= {target.id for target in node.targets if isinstance(target, ast.Name)}
        elif isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
            names.add(node.target.id)
    return last in names


def settings_accept(key: str, value: str | None) -> bool:
    """Whether `key` is a render setting or a group of them, and takes `value` where one is given."""
    model: type[Params] = RenderSettings
    *groups, last = key.split(".")[1:]
    for group in groups:
        field = model.model_fields.get(group)
        if field is None or not (isinstance(field.annotation, type) and issubclass(field.annotation, Params)):
            return False
        model = field.annotation
    if last not in model.model_fields:
        return False
    if value is not None:
        is_plain = re.fullmatch(r"[\d.+-]+|true|false", value)
        model.model_validate({last: json.loads(value) if is_plain else value})
    return True


@pytest.mark.parametrize("page", [page for page in TEXTS if page != "api.md"])  # where `scene.…` is a variable's
def test_named_modules_and_settings_exist(page: str) -> None:
    wrong = []
    for span in code_spans(TEXTS[page]):
        name = re.fullmatch(rf"((?:{'|'.join(STAGES)})(?:\.\w+)+)(?:(?:: |=)(\S+))?", span)
        if not name or name[1].endswith(".py"):
            continue
        is_setting = name[1].startswith("render.") and settings_accept(name[1], name[2])
        if not is_setting and not module_defines(name[1]) and "vignette" not in span:
            wrong.append(span)
    assert not wrong


@pytest.mark.parametrize("page", TEXTS)
def test_settings_on_command_lines_exist(page: str) -> None:
    settings = re.findall(r"--set (render(?:\.\w+)+)(?:=([^\s`)]+))?", TEXTS[page])
    assert not [key for key, value in settings if "vignette" not in key and not settings_accept(key, value or None)]


def command_lines(page: str) -> list[str]:
    """Return the command lines of a page: those of indented blocks, and those between backticks."""
    text = TEXTS[page].replace("\\\n", " ")
    lines = re.findall(r"^ {4,}((?:depthwalk|python -m) .+)$", text, re.MULTILINE)
    return lines + [span for span in code_spans(text) if re.match(r"(depthwalk|python -m) [a-z]", span)]


def command(words: list[str]) -> tuple[Any, list[str]] | None:
    """Return the command that runs, as click knows it, and its arguments; None where it takes no options to check."""
    if words[0] == "depthwalk":
        commands = typer.main.get_command(app)
        assert isinstance(commands, TyperGroup)
        return commands.commands[words[1]], words[2:]
    assert words[:2] == ["python", "-m"]
    if words[2].split(".")[0] in ("tools", "fuzz"):
        tool = ROOT / words[2].replace(".", "/")
        assert tool.is_dir() or tool.with_suffix(".py").is_file(), words[2]
        return None
    module = importlib.import_module(words[2])
    if len(words) == 3:
        return None
    runner = typer.Typer()
    runner.command()(module.main)
    return typer.main.get_command(runner), words[3:]


@pytest.mark.parametrize("page", [page for page in TEXTS if command_lines(page)])
def test_command_lines_are_known(page: str) -> None:
    for line in command_lines(page):
        found = command(shlex.split(re.sub(r"[\[\]|…]|\.\.\.", " ", line)))
        if found is not None:
            known = {option for param in found[0].params for option in param.opts} | {"--help"}
            unknown = [word for word in found[1] if word.startswith("-") and word.split("=")[0] not in known]
            assert not unknown, line


def test_pages_that_the_code_names_exist() -> None:
    sources = [*PACKAGE.rglob("*.py"), *(ROOT / "shaders").rglob("*.*")]
    named = {
        (source.name, page)
        for source in sources
        for page in re.findall(r"docs/([\w-]+\.(?:md|py))", source.read_text(encoding="utf-8"))
    }
    assert not [(source, page) for source, page in named if not (ROOT / "docs" / page).is_file()]


def test_shaders_and_twins_that_the_code_names_exist() -> None:
    """A shader names its twin as a path within the package; everything else names shaders from the root."""
    shaders, missing = ROOT / "shaders", []
    for source in [*PACKAGE.rglob("*.py"), *shaders.rglob("*.*")]:
        text = " ".join(line.strip(" /") for line in source.read_text(encoding="utf-8").splitlines())
        named = [ROOT / path for path in re.findall(r"shaders/\w+/\w+\.(?:glsl|vert|frag)", text)]
        if source.is_relative_to(shaders):
            named += [PACKAGE / path for path in re.findall(r"[Tt]win: (?:`\w+` of )?([\w/]+\.py)", text)]
        missing += [(source.name, path) for path in named if not path.is_file()]
    assert not missing


@pytest.mark.parametrize("page", TEXTS)
def test_names_that_stand_behind_a_file_are_in_it(page: str) -> None:
    """As in `reprojection_error.py: due`."""
    wrong = []
    for file, names in re.findall(r"`([\w/]+\.py): ([\w., ]+)`", TEXTS[page]):
        texts = [path.read_text(encoding="utf-8") for path in PACKAGE.rglob(Path(file).name)]
        wrong += [name for name in re.findall(r"\w+", names) if not any(re.search(rf"\b{name}\b", t) for t in texts)]
    assert not wrong


@pytest.mark.parametrize("name", ["cylinder", "shift", "impostor", "cases"])
def test_figures_are_up_to_date(name: str) -> None:
    figures = runpy.run_path(str(ROOT / "docs" / "figures.py"))
    drawn = (ROOT / "docs" / "images" / f"{name}.svg").read_text(encoding="utf-8")
    assert drawn == figures[name](), f"run python docs/make_images.py {name}"
    ElementTree.fromstring(drawn)
