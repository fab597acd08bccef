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
