"""Running commands in this process."""

import logging
from collections.abc import Callable, Iterator

import pytest
from typer.testing import CliRunner

from depthwalk.commands.cli import app


@pytest.fixture(autouse=True)
def _logger_as_it_was() -> Iterator[None]:
    """A command sets up the package's logger for its own process."""
    log = logging.getLogger("depthwalk")
    before = log.handlers, log.propagate, log.level
    yield
    log.handlers, log.propagate, log.level = before


@pytest.fixture
def run() -> Callable[..., object]:
    """run("check", path) → the command's exit_code, stdout, stderr and stdout_bytes."""
    return lambda *arguments: CliRunner().invoke(app, [str(argument) for argument in arguments])
