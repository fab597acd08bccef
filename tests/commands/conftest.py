"""Running commands in this process."""

import math
from collections.abc import Callable

import pytest
from typer.testing import CliRunner

from depthwalk.commands import progress
from depthwalk.commands.cli import app


@pytest.fixture
def run() -> Callable[..., object]:
    """run("check", path) → the command's exit_code, stdout, stderr and stdout_bytes."""
    return lambda *arguments: CliRunner().invoke(app, [str(argument) for argument in arguments])


@pytest.fixture(autouse=True)
def plain_seconds(monkeypatch: pytest.MonkeyPatch) -> None:
    """Keeps commands silent about what takes long, which on a busy machine is anything."""
    monkeypatch.setattr(progress, "PLAIN_SECONDS", math.inf)
