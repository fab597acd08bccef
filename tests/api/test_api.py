"""The public names: few, typed, and imported when they are first used."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import depthwalk as dw

SOURCE = Path(dw.__file__)


def in_a_process(code: str) -> str:
    environment = {"PYTHONPATH": ":".join(filter(None, sys.path))}
    command = [sys.executable, "-c", code]
    return subprocess.run(command, env=environment, capture_output=True, text=True, check=True).stdout


def test_there_are_few_names_and_each_is_found() -> None:
    assert len(dw.__all__) <= 15
    assert set(dw.__all__) <= set(dir(dw))
    for name in dw.__all__:
        value = getattr(dw, name)
        assert value.__name__ == name and value.__doc__, name


def test_type_checkers_see_the_same_names() -> None:
    (block,) = [node for node in ast.parse(SOURCE.read_text()).body if isinstance(node, ast.If)]
    imports = [node for node in block.body if isinstance(node, ast.ImportFrom)]
    seen = {alias.name: node.module for node in imports for alias in node.names}
    assert len(imports) == len(block.body)
    assert seen == dw._MODULES and sorted(seen) == sorted(dw.__all__)
    assert SOURCE.with_name("py.typed").is_file()


def test_a_name_that_is_none() -> None:
    with pytest.raises(AttributeError, match="has no attribute 'Teapot'"):
        dw.Teapot  # noqa: B018


def test_importing_costs_nothing() -> None:
    code = (
        "import sys, time; start = time.process_time(); import depthwalk; "  # other programs do not count
        "print(time.process_time() - start, 'numpy' in sys.modules)"
    )
    seconds, with_numpy = in_a_process(code).split()
    assert float(seconds) < 0.1 and with_numpy == "False"


@pytest.mark.slow
def test_reading_a_scene_loads_no_graphics() -> None:
    code = "import depthwalk as dw, sys; dw.load_scene; dw.Camera; print('moderngl' in sys.modules)"
    assert in_a_process(code) == "False\n"
