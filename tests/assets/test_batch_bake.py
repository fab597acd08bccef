"""Bakes in several processes: what is there already is left, what is interrupted leaves whole files and nobody."""

import errno
import os
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any, NoReturn

import pytest

import shapes
from depthwalk.assets.asset_files import clusters_key, levels_key, mesh_key, mesh_source, views_key
from depthwalk.assets.bake_job import Baked, Job, Kept, UnwritableError, bake_whole
from depthwalk.assets.batch_bake import bake_all
from depthwalk.assets.library import SceneLibrary
from depthwalk.bake.cache import BAKED
from depthwalk.bake.capture_file import CAPTURES
from depthwalk.bake.captured_views import CaptureParams
from depthwalk.bake.file import SUFFIX, read_baked
from depthwalk.bake.level_file import LEVELS
from depthwalk.bake.params import ModelParams
from depthwalk.cook.cluster_file import CLUSTERS
from depthwalk.errors import InputError
from depthwalk.scene.loader import load_scene
from depthwalk.scene.scene import MeshAsset
from files import write_ply

PARAMS = ModelParams(resolution=16, layers=1)
CAPTURED = [CaptureParams(directions="azimuths", count=count, resolution=8) for count in (2, 4)]


def ignore(number: int, stage: str) -> None:
    pass


@pytest.fixture
def meshes(tmp_path: Path) -> list[Path]:
    names = [tmp_path / f"ball{k}.ply" for k in range(4)]
    return [write_ply(name, shapes.sphere(1 + k, columns=32, rows=16)) for k, name in enumerate(names)]


def jobs_of(meshes: list[Path]) -> list[Job]:
    return [
        Job(
            spec=MeshAsset(name=mesh.stem, mesh=mesh, texture=None, up="y", height=None, dpci=None),
            params=PARAMS,
            out=mesh.with_suffix(SUFFIX),
        )
        for mesh in meshes
    ]


@pytest.mark.slow
@pytest.mark.parametrize("processes", [1, 2])
def test_what_is_baked_already_is_left(meshes: list[Path], processes: int) -> None:
    """One that is up to date, one of another mesh by the same name, one that is asked for again, and a new one."""
    jobs = jobs_of(meshes)
    first = dict(bake_all(jobs[:3], 1, ignore))
    assert all(isinstance(outcome, Baked) for outcome in first.values())
    written = [job.out.stat().st_mtime_ns for job in jobs[:3]]
    write_ply(meshes[1], shapes.sphere(9.0, columns=32, rows=16))
    jobs[2] = replace(jobs[2], force=True)
    again = dict(bake_all(jobs, processes, ignore))
    assert again.pop(0) == Kept(jobs[0].out, cached=False)
    assert sorted(again) == [1, 2, 3] and all(isinstance(outcome, Baked) for outcome in again.values())
    assert [job.out.stat().st_mtime_ns > before for job, before in zip(jobs, written, strict=False)] == [0, 1, 1]


def test_what_the_cache_holds_is_copied(tiny_scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    spec = load_scene(tiny_scene, overrides={"assets.ball.dpci.resolution": "16"}).assets[0]
    assert isinstance(spec, MeshAsset)
    SceneLibrary((spec,)).baked(0)
    out = tmp_path / ("copy" + SUFFIX)
    assert dict(bake_all([Job(spec=spec, params=PARAMS, out=out)], 1, ignore)) == {0: Kept(out, cached=True)}
    assert read_baked(out).key == mesh_key(spec, PARAMS)


def test_a_forced_bake_forgets_what_the_cache_holds_of_the_mesh(
    meshes: list[Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By whatever parameters it was made; what is of other meshes stays."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    job, other = jobs_of(meshes[:2])
    kept = [
        cache.file(key)
        for spec in (job.spec, other.spec)
        for cache, key in (
            (BAKED, mesh_key(spec, PARAMS)),
            (LEVELS, levels_key(spec, mesh_source(spec))),
            (CLUSTERS, clusters_key(spec, mesh_source(spec))),
            *((CAPTURES, views_key(spec, mesh_source(spec), params)) for params in CAPTURED),
        )
    ]
    assert len({file.name for file in kept}) == 10
    kept[0].parent.mkdir(parents=True)
    for file in kept:
        file.touch()
    bake_whole(replace(job, force=True), workers=1)
    assert [file.exists() for file in kept] == 5 * [False] + 5 * [True]


@pytest.mark.slow
def test_a_url_takes_the_place_of_a_file(meshes: list[Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What is stored there is left while it is right, and baked again where it is damaged; it is the same file."""
    store = tmp_path / "store"
    store.mkdir()
    monkeypatch.chdir(tmp_path)
    before = sorted(path.name for path in tmp_path.iterdir())
    (local,) = jobs_of(meshes[:1])
    job = replace(local, out=Path(local.out.name), url=f"file://{store}/{local.out.name}")
    stored = store / local.out.name
    (first,) = dict(bake_all([job], 1, ignore)).values()
    assert isinstance(first, Baked) and first.out == job.url and list(first.seconds)[-1] == "write"
    whole = stored.read_bytes()
    assert dict(bake_all([job], 1, ignore)) == {0: Kept(job.url, cached=False)}
    stored.write_bytes(whole[:-9] + bytes(9))
    assert bake_whole(job) != Kept(job.url, cached=False)
    assert stored.read_bytes() == whole and [path.name for path in store.iterdir()] == [stored.name]
    nowhere = replace(job, url=f"file://{tmp_path}/none/a{SUFFIX}")
    (failed,) = dict(bake_all([nowhere], 1, ignore)).values()
    assert str(failed) == f"{nowhere.url}: cannot be written: No such file or directory"
    assert sorted(path.name for path in tmp_path.iterdir()) == before
    bake_whole(local)
    assert local.out.read_bytes() == whole


@pytest.mark.slow
def test_a_scene_bakes_what_is_missing_at_once(
    tiny_scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    baked = ", ".join(f"b{k}: {{mesh: ball.ply, height: {k}, dpci: {{resolution: 32, layers: 1}}}}" for k in (1, 2))
    tiny_scene.write_text(
        f"version: 1\nassets: {{{baked}, m: {{mesh: ball.ply}}, bad: {{mesh: bad.ply, dpci: {{}}}}}}\n"
    )
    tiny_scene.with_name("bad.ply").write_text("ply\n")
    assets = load_scene(tiny_scene).assets
    told: list[str] = []
    library = SceneLibrary(assets, lambda name, stage: told.append(name), processes=2)
    library.bake_missing([0, 1, 2, 3])
    assert set(told) == {"b1", "b2", "bad"}
    assert sorted(path.name.count(".") for path in (tmp_path / "cache").rglob("*.exr")) == [2, 2]
    monkeypatch.setattr("depthwalk.bake.parts.bake_model", None)  # baking once more would fail
    first, second = library.baked(0), library.baked(1)
    assert first is not None and second is not None and first.key != second.key
    with pytest.raises(InputError, match=r"bad\.ply"):
        library.baked(3)


@pytest.mark.slow
@pytest.mark.skipif(not os.path.isdir("/proc"), reason="only Linux says whose child a process is")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_an_interrupted_bake_leaves_whole_files_and_no_process(
    tmp_path: Path, cache_home: Path, number: signal.Signals
) -> None:
    meshes = [write_ply(tmp_path / f"b{k:02}.ply", shapes.sphere(1 + k, columns=64, rows=32)) for k in range(20)]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(path for path in sys.path if path)}
    command = [
        sys.executable,
        "-c",
        "from depthwalk.commands.cli import main; main()",
        "bake",
        "--jobs",
        "2",
        *map(str, meshes),
    ]
    with subprocess.Popen(
        [*command, "--dpci-resolution", "64"],
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        assert process.stdout is not None
        line = process.stdout.readline()
        workers = children(process.pid)
        process.send_signal(number)
        process.communicate(timeout=60)
    assert line.startswith(str(tmp_path)) and len(workers) >= 2
    deadline = time.monotonic() + 20
    while any(map(alive, workers)) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not any(map(alive, workers))
    whole = list(tmp_path.glob("*.exr"))
    assert 1 <= len(whole) < len(meshes) and all(read_baked(path).key for path in whole)
    if number != signal.SIGKILL:
        assert process.returncode == 130 if number == signal.SIGINT else 143
        assert not [path for path in tmp_path.iterdir() if path.name.startswith(".")]


def children(pid: int) -> list[int]:
    """The processes that `pid` started."""
    found = []
    for folder in os.listdir("/proc"):
        if folder.isdigit():
            try:
                with open(f"/proc/{folder}/stat") as stat:
                    if int(stat.read().rsplit(")", 1)[1].split()[1]) == pid:
                        found.append(int(folder))
            except OSError:
                continue
    return found


def alive(pid: int) -> bool:
    try:
        with open(f"/proc/{pid}/stat") as stat:
            return stat.read().rsplit(")", 1)[1].split()[0] != "Z"
    except OSError:
        return False


def test_a_cached_file_that_vanishes_before_it_is_copied_is_baked(
    meshes: list[Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    job = jobs_of(meshes)[0]
    list(bake_all([job], 1, ignore))
    cached = BAKED.file(mesh_key(job.spec, PARAMS))
    cached.parent.mkdir(parents=True)
    job.out.rename(cached)

    def vanished(source: Path, target: Path) -> NoReturn:
        target.write_bytes(b"half a file")
        raise FileNotFoundError(source)

    monkeypatch.setattr(shutil, "copyfile", vanished)
    assert isinstance(dict(bake_all([job], 1, ignore))[0], Baked)
    assert read_baked(job.out).key == mesh_key(job.spec, PARAMS)


@pytest.mark.parametrize("place", ["depthwalk.assets.bake_job.write_baked", "os.replace"])
def test_a_file_that_cannot_be_written_fails_its_own_job_only(
    meshes: list[Path], monkeypatch: pytest.MonkeyPatch, place: str
) -> None:
    owner, name = place.rsplit(".", 1)
    module = sys.modules[owner]
    original = getattr(module, name)

    def full(*arguments: Any) -> Any:
        if any(Path(what).name == "ball0" + SUFFIX for what in arguments if isinstance(what, Path)):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return original(*arguments)

    monkeypatch.setattr(module, name, full)
    jobs = jobs_of(meshes)[:2]
    outcomes = dict(bake_all(jobs, 1, ignore))
    assert str(outcomes[0]) == f"{jobs[0].out}: cannot be written: {os.strerror(errno.ENOSPC)}"
    assert isinstance(outcomes[0], UnwritableError) and isinstance(outcomes[1], Baked) and not jobs[0].out.exists()
