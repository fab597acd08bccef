"""The commands that install optional libraries."""

import re
import tomllib
from pathlib import Path

import pytest

from depthwalk.extras import install_command

ROOT = Path(__file__).parent.parent
EXTRAS = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]
NAMED = re.compile(r"install_command\(['\"](\w+)['\"]\)")


def test_in_a_checkout_the_command_is_that_of_the_readme_from_any_folder() -> None:
    assert install_command("las", ROOT) == f'pip install -e "{ROOT}[las]"'


def test_without_a_checkout_the_libraries_are_named(tmp_path: Path) -> None:
    assert install_command("las", tmp_path) == 'pip install "laspy[lazrs]>=2.5"'
    assert set(install_command("cluster", tmp_path).split(" ")[2:]) == {f'"{name}"' for name in EXTRAS["cluster"]}


def test_markers_are_read_however_they_are_quoted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("importlib.metadata.requires", lambda name: ["a>=1", "b>=2; extra == 'las'", 'c ; extra=="x"'])
    assert install_command("las", tmp_path) == 'pip install "b>=2"'


def test_every_hint_of_the_program_names_an_extra_that_exists_and_is_made_by_this_function() -> None:
    sources = {file: file.read_text() for file in sorted((ROOT / "app").rglob("*.py")) if file.name != "extras.py"}
    named = {name for text in sources.values() for name in NAMED.findall(text)}
    assert {"las", "gltf", "cluster"} <= named <= EXTRAS.keys()
    assert not [file for file, text in sources.items() if re.search(r"pip install [\"'\\]*depthwalk", text)]


def test_no_page_tells_to_install_from_a_registry() -> None:
    pages = [*ROOT.glob("*.md"), *(ROOT / "docs").glob("*.md")]
    assert not [page for page in pages if re.search(r"pip install [\"']*depthwalk", page.read_text())]
