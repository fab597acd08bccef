"""The examples in docstrings and in docs/api.md do what they say, and show every public name."""

import doctest
import re
from doctest import DocTest
from importlib import import_module
from pathlib import Path

import pytest

import depthwalk as dw
from balls import write_balls
from depthwalk import walk
from depthwalk.gpu.device import Device

PAGE = Path(__file__).parents[2] / "docs" / "api.md"
MODULES = ["depthwalk.api.mesh", "depthwalk.api.renderer", "depthwalk.api.scene", "depthwalk.api.window"]


def page_examples() -> doctest.DocTest:
    text = "\n".join(re.findall(r"```pycon\n(.+?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL))
    return doctest.DocTestParser().get_doctest(text, {}, PAGE.name, str(PAGE), 0)


def sources(*examples: doctest.DocTest) -> str:
    return "".join(step.source for example in examples for step in example.examples)


def needs_gl(example: doctest.DocTest) -> bool:
    return re.search(r"dw\.(Renderer|compare)\(", sources(example)) is not None


EXAMPLES = [page_examples()]
for name in MODULES:
    EXAMPLES += [found for found in doctest.DocTestFinder().find(import_module(name)) if found.examples]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The current folder, with what the examples read, and no window that waits for somebody."""
    write_balls(tmp_path)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(walk, "run", lambda scene, library, options, **window: None)
    return tmp_path


def run(example: doctest.DocTest) -> None:
    runner = doctest.DocTestRunner(verbose=False)
    report: list[str] = []
    example.globs = {"dw": dw}
    assert runner.run(example, out=report.append, clear_globs=False).failed == 0, "".join(report)


def name_of(example: doctest.DocTest) -> str:
    return example.name.removeprefix("depthwalk.api.")


@pytest.mark.parametrize("example", [example for example in EXAMPLES if not needs_gl(example)], ids=name_of)
def test_examples(example: DocTest, folder: Path) -> None:
    run(example)


@pytest.mark.parametrize("example", [example for example in EXAMPLES if needs_gl(example)], ids=name_of)
def test_examples_that_render(example: DocTest, folder: Path, gl_device: Device) -> None:
    run(example)


def test_every_public_name_is_shown() -> None:
    shown = sources(*EXAMPLES)
    assert not [name for name in dw.__all__ if f"dw.{name}" not in shown]
