"""Which commit a program runs from."""

import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import pytest

import depthwalk
from depthwalk import provenance


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., object]:
    """A package of one file inside a checkout of one commit, and the checkout's git."""
    if shutil.which("git") is None:
        pytest.skip("no git here")
    folder = tmp_path / "app" / "depthwalk"
    folder.mkdir(parents=True)
    (folder / "errors.py").write_text("")
    (tmp_path / "readme").write_text("")
    monkeypatch.setattr(provenance, "depthwalk", SimpleNamespace(__file__=str(folder / "__init__.py")))

    def git(*words: str) -> str:
        identity = ["-c", "user.name=a", "-c", "user.email=a@example.org"]
        command = ["git", "-C", str(tmp_path), *identity, *words]
        return subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()

    git("init")
    return git


def test_a_checkout_tells_its_commit(package: Callable[..., object]) -> None:
    package("add", ".")
    package("commit", "-m", "first")
    assert provenance.commit() == package("rev-parse", "HEAD")


def test_a_package_inside_a_checkout_of_something_else_tells_none(package: Callable[..., object]) -> None:
    package("add", "readme")
    package("commit", "-m", "first")
    assert provenance.commit() is None


def test_commit_is_that_of_our_own_checkout_only(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(depthwalk, "__file__", str(tmp_path / "depthwalk" / "__init__.py"))
    assert provenance.commit() is None
