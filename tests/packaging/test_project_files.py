"""The files around the code: versions, pins, pages and what must not be in any of them."""

import ast
import itertools
import re
import runpy
import shlex
import subprocess
import sys
import tomllib
from collections.abc import Sequence
from importlib import metadata
from pathlib import Path
from typing import Any

import pytest
import typer
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name
from typer.core import TyperGroup

import depthwalk
from depthwalk import resources
from depthwalk.commands.cli import app
from depthwalk.render.passes import PASSES
from depthwalk.scene.loader import load_scene
from depthwalk.scene.path import load_path
from depthwalk.walk.hud import HELP

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]


@pytest.fixture(scope="module")
def project() -> dict[str, Any]:
    return tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def tracked() -> list[Path]:
    """Every file that git knows, as git names it."""
    listing = subprocess.run(["git", "-C", str(ROOT), "ls-files", "-z"], capture_output=True, text=True)
    if listing.returncode:
        pytest.skip("not a checkout")
    return [ROOT / name for name in listing.stdout.split("\0") if name and (ROOT / name).is_file()]


def test_one_version(project: dict[str, Any]) -> None:
    assert project["project"]["dynamic"] == ["version"]
    assert ROOT / project["tool"]["hatch"]["version"]["path"] == Path(depthwalk.__file__)
    assert re.fullmatch(r"\d+\.\d+\.\d+", depthwalk.__version__)


def test_the_installation_has_that_version() -> None:
    try:
        installed = metadata.version("depthwalk")
    except metadata.PackageNotFoundError:
        pytest.skip("runs from the checkout, not installed")
    assert installed == depthwalk.__version__


def test_every_dependency_is_pinned_within_its_bounds(project: dict[str, Any]) -> None:
    lines = (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines()
    pins = dict(line.split("==") for line in lines if not line.startswith("#"))
    assert list(pins) == sorted(map(canonicalize_name, pins))
    extras = project["project"]["optional-dependencies"].values()
    wanted = [*project["project"]["dependencies"], *itertools.chain(*extras), *project["build-system"]["requires"]]
    for requirement in map(Requirement, wanted):
        if requirement.name == project["project"]["name"]:  # an extra that takes in another one
            continue
        assert requirement.specifier.contains(pins[canonicalize_name(requirement.name)]), requirement


@pytest.mark.slow
def test_every_imported_library_is_declared(project: dict[str, Any]) -> None:
    needed, extras = project["project"]["dependencies"], project["project"]["optional-dependencies"]
    # Folders and modules that do without theirs.
    optional = {"kernels": extras["fast"], **{name: extras[name] for name in ("cluster", "las", "usd")}}
    optional |= dict.fromkeys(("draco", "gltf_meshopt", "ktx2_worker"), extras["gltf"])
    providers = {**metadata.packages_distributions(), "pydantic_core": ["pydantic"], "pxr": ["usd-core"]}
    for file in (ROOT / "app").rglob("*.py"):
        wanted = needed + optional.get(file.parent.name, []) + optional.get(file.stem, [])
        declared = {canonicalize_name(Requirement(each).name) for each in wanted}
        nodes = list(ast.walk(ast.parse(file.read_text(encoding="utf-8"))))
        names = [alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names]
        names += [node.module or "" for node in nodes if isinstance(node, ast.ImportFrom)]
        for name in {name.split(".")[0] for name in names} - sys.stdlib_module_names - {"depthwalk"}:
            assert declared & set(map(canonicalize_name, providers.get(name, [name]))), f"{file.name} imports {name}"


def test_resources_are_found() -> None:
    for each in PASSES:
        assert list((resources.shader_root() / each.name).glob("*.[fg]*")), each.name  # .frag, or of pixel passes .glsl
    scenes = sorted(resources.scene_root().glob("*.yaml"))
    assert "garden.yaml" in [scene.name for scene in scenes]
    for scene in scenes:
        assert load_scene(scene).assets
    assert list(resources.asset_root().glob("*.ply"))


def test_all_resources_travel_with_the_wheel(project: dict[str, Any]) -> None:
    included = project["tool"]["hatch"]["build"]["targets"]["wheel"]["force-include"]
    roots = resources.shader_root(), resources.scene_root(), resources.asset_root()
    assert included == {root.name: f"depthwalk/_data/{root.name}" for root in roots}


def test_no_machine_or_package_host_is_named(tracked: Sequence[Path]) -> None:
    # In pieces, so that this file does not name them itself.
    names = [name.encode() for name in ("/" + "work/", "/" + "root/", "pypi" + ".org", "python" + "hosted.org")]
    forbidden = re.compile(rb"(?<![.\w])(" + b"|".join(map(re.escape, names)) + b")")  # ../root/ is like any other
    suspects = [path for path in tracked if any(map(path.read_bytes().__contains__, names))]  # far faster to tell
    hits = {path: forbidden.search(path.read_bytes()) for path in suspects}
    assert not [f"{path.relative_to(ROOT)}: {hit[0]!r}" for path, hit in hits.items() if hit]


def test_generated_pages_are_up_to_date(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(ROOT / "docs")
    pages = runpy.run_path(str(ROOT / "docs" / "generate.py"))["pages"]()
    for name, text in pages.items():
        assert (ROOT / "docs" / name).read_text(encoding="utf-8") == text, f"{name}: run python docs/generate.py"


LINKS = [(page, link) for page in PAGES for link in re.findall(r"\]\(([^)]+)\)", page.read_text(encoding="utf-8"))]


@pytest.mark.parametrize(("page", "link"), LINKS, ids=[f"{page.name}:{link}" for page, link in LINKS])
def test_links_lead_somewhere(page: Path, link: str) -> None:
    name, _, anchor = link.partition("#")
    target = (page.parent / name).resolve() if name else page
    assert target.exists()
    if anchor:
        headings = re.findall(r"^#+ (.+)$", target.read_text(encoding="utf-8"), re.MULTILINE)
        # As the sites that show Markdown name them.
        assert anchor in [re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings]


def test_the_readme_shows_every_command_as_it_is() -> None:
    commands = typer.main.get_command(app)
    assert isinstance(commands, TyperGroup)
    shown = re.findall(r"`depthwalk ([^`]+)`", README)
    seen = set()
    for line in shown:
        name, *arguments = shlex.split(line.replace("|", ""))
        with commands.commands[name].make_context(name, arguments):  # raises for options that are none
            seen.add(name)
    assert seen == set(commands.commands)


def test_the_page_on_the_window_shows_every_key() -> None:
    page = (ROOT / "docs" / "walking.md").read_text(encoding="utf-8")
    for key, meaning in HELP:
        assert f"| {key} | {meaning} |\n" in page


def test_the_scenes_of_readme_and_tutorial_load(tmp_path: Path) -> None:
    tutorial = (ROOT / "docs" / "tutorial.md").read_text(encoding="utf-8")
    file, loaded = tmp_path / "court.yaml", []
    *shown, walk = re.findall(r"```yaml\n(.+?)```", README + tutorial, re.DOTALL)
    for number, text in enumerate(shown):
        if text.startswith("  - "):  # a further object
            text = shown[1].replace("objects:\n", f"objects:\n{text}", 1)
            assert number > 1
        file.write_text(text, encoding="utf-8")
        loaded.append(load_scene(file))
    assert [len(scene.objects) for scene in loaded] == [15 + 60, 100, 1, 101]
    assert [scene.animations is not None for scene in loaded] == [False, False, False, True]
    assert {"corner", "pot"} <= set(loaded[1].nodes.name)
    file.write_text(walk, encoding="utf-8")
    assert len(load_path(file).frames()) == 61
