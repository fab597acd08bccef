"""What fuzzing begins with, and what it has found, is read as it should be; and the command that fuzzes works."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from depthwalk import limits
from fuzz import seeds
from fuzz.case import Target
from fuzz.judge import judge
from fuzz.small_limits import LOWERED
from fuzz.targets import TARGETS

ROOT = Path(__file__).parents[2]
FOUND = [(target, folder) for target in TARGETS for folder in sorted((seeds.FINDINGS / target.name).glob("*"))]


@pytest.fixture(autouse=True)
def _cache(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))  # targets set it for themselves


@pytest.mark.parametrize(("target", "folder"), FOUND, ids=[folder.name for _, folder in FOUND])
def test_findings_stay_mended(target: Target, folder: Path, tmp_path: Path) -> None:
    fault = judge(target, seeds.read_folder(folder), tmp_path)
    assert fault is None, f"{fault.kind}\n{fault.detail}"


def test_every_finding_belongs_to_a_target() -> None:
    assert {path.name for path in seeds.FINDINGS.iterdir()} <= {target.name for target in TARGETS}
    assert all(folder.name.startswith(next(iter(seeds.read_folder(folder)))) for _, folder in FOUND)


@pytest.mark.parametrize(
    "name", ["obj", "ply", "stl", "off", "gltf", "fbx", "dae", "3ds", "3mf", "texture", "range", "places", "path"]
)
def test_seeds_are_read(name: str, tmp_path: Path) -> None:
    (target,) = (target for target in TARGETS if target.name == name)
    for number, files in enumerate(target.seeds()):
        (folder := tmp_path / str(number)).mkdir()
        fault = judge(target, files, folder)
        assert fault is None, f"{next(iter(files))}: {fault.kind}\n{fault.detail}"


def test_lowered_limits_are_limits() -> None:
    assert all(value < getattr(limits, name) for name, value in LOWERED.items())


def fuzz(*arguments: str) -> "subprocess.CompletedProcess[str]":
    paths = os.pathsep.join([str(ROOT / "app"), str(ROOT)])
    return subprocess.run(
        [sys.executable, "-m", "fuzz", *arguments],
        capture_output=True,
        text=True,
        timeout=300,
        env=os.environ | {"PYTHONPATH": paths},
    )


@pytest.mark.slow
def test_the_command(tmp_path: Path) -> None:
    done = fuzz("places", "--seconds", "1", "--jobs", "1", "--seed", "0", "--findings", str(tmp_path))
    assert done.returncode == 0, done.stdout + done.stderr
    assert "lines of depthwalk.ingest that were reached" in done.stdout and "0 found" in done.stdout
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_a_target_that_does_not_exist() -> None:
    done = fuzz("plates")
    assert done.returncode == 2 and "unknown target 'plates'" in done.stderr
