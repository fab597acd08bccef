"""The list of commands, and what it says about each."""

from collections.abc import Callable
from importlib import import_module
from typing import Any

import pytest

from depthwalk.commands.cli import SUMMARIES


@pytest.mark.parametrize("name", SUMMARIES)
def test_the_list_says_what_the_command_itself_says(name: str) -> None:
    summary = import_module(f"depthwalk.commands.{name}").main.__doc__.splitlines()[0]
    assert summary == SUMMARIES[name]


def test_help_lists_every_command(run: Callable[..., Any]) -> None:
    result = run("--help")
    assert "Begin with `depthwalk demo`" in result.stdout
    assert result.exit_code == 0
    listed = result.stdout.partition("Commands:")[2].splitlines()
    assert [line.split()[0] for line in listed if line.startswith("  ") and line[2] != " "] == list(SUMMARIES)


@pytest.mark.parametrize("name", SUMMARIES)
def test_every_option_says_what_it_is_for(run: Callable[..., Any], name: str) -> None:
    """In sentences: a capital first, a full stop last."""
    result = run(name, "--help")
    assert (result.exit_code == 0 and result.stdout.startswith(f"Usage: root {name} ")) or name in result.stdout
    module = import_module(f"depthwalk.commands.{name}")
    for option, annotation in module.main.__annotations__.items():
        if option != "return":
            (declared,) = annotation.__metadata__
            assert (declared.help and declared.help[0].isupper()) or option == "out", option
            assert declared.help.endswith((".", "stdout.")), option


@pytest.mark.parametrize("arguments", [["-h"], ["render", "-h"]])
def test_the_short_option_for_help(run: Callable[..., Any], arguments: list[str]) -> None:
    result = run(*arguments)
    assert (result.exit_code, result.stderr) == (0, "") and result.stdout.startswith("Usage: ")


def test_arguments_are_called_by_their_names_alone(run: Callable[..., Any]) -> None:
    lines = run("render", "--help").stdout.splitlines()
    assert lines[0].endswith(" render [OPTIONS] FILE...")
    assert lines[lines.index("Arguments:") + 1].split()[:3] == ["FILE", "Scene", "file,"]


def test_a_file_in_the_place_of_a_command(run: Callable[..., Any]) -> None:
    """As other viewers take it."""
    result = run("bust.glb", "--fullscreen")
    assert result.exit_code == 2
    assert "; to open a file: depthwalk view bust.glb (" in result.stderr and result.stderr.count("\n") == 1
