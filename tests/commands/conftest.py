"""Running commands in this process."""

from collections.abc import Callable

import pytest
from typer.testing import CliRunner

from depthwalk.commands.cli import app


@pytest.fixture
def run() -> Callable[..., object]:
    """run("check", path) → the command's exit_code, stdout, stderr and stdout_bytes."""
    return lambda *arguments: CliRunner().invoke(app, [str(argument) for argument in arguments])
