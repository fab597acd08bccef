"""A cluster of this machine: what it makes is what one process makes, and nobody else can reach it."""

import os
import signal
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import nullcontext, suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import psutil
import pytest
from typer.testing import CliRunner

import shapes
from depthwalk.assets.bake_job import Baked, Job, Kept
from depthwalk.assets.batch_bake import bake_all
from depthwalk.assets.cluster_bake import bake_on
from depthwalk.bake.params import ModelParams
from depthwalk.cluster.address import ClusterAddress
from depthwalk.cluster.connection import Cluster, open_cluster
from depthwalk.cluster.tasks import Progress
from depthwalk.commands.cli import app
from depthwalk.errors import InputError
from depthwalk.scene.scene import MeshAsset
from files import write_ply

pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("ignore::ResourceWarning")]
SMALL = "--resolution", "48,36"


@pytest.fixture(scope="module")
def cluster() -> Iterator[Cluster]:
    with open_cluster(ClusterAddress(workers=1)) as opened:
        yield opened


def pids(cluster: Cluster) -> list[int]:
    return list(cluster._client.run(os.getpid).values())


def has_other(cluster: Cluster, pid: int) -> bool:
    """Return whether there is another worker than the one that was killed."""
    with suppress(OSError):  # it is asked, too, until the scheduler knows
        return any(other != pid for other in pids(cluster))
    return False


def no_heed() -> None:
    pass


def test_only_the_loopback_device_listens(cluster: Cluster) -> None:
    """In this process, where the scheduler is, and in the workers; each of them does listen somewhere."""
    for pid in [os.getpid(), *pids(cluster)]:
        sockets = psutil.Process(pid).net_connections("inet")
        hosts = {socket.laddr.ip for socket in sockets if socket.status == psutil.CONN_LISTEN}
        assert hosts == {"127.0.0.1"}


@pytest.mark.skipif(not hasattr(os, "fork") or sys.platform == "darwin", reason="workers are not forked here")
def test_workers_are_forked_from_a_process_that_has_imported_what_they_need(cluster: Cluster) -> None:
    """One without threads, since a lock that a thread holds would never be released in what is forked."""
    (worker,) = (psutil.Process(pid) for pid in pids(cluster))
    parent = worker.parent()
    assert parent is not None and "multiprocessing.forkserver" in " ".join(parent.cmdline())
    assert parent.num_threads() == 1 and parent.parent() == psutil.Process()
    assert all(cluster._client.run(_imported).values())


def _imported() -> bool:
    import sys

    from depthwalk.cluster.nanny import PRELOADED

    return sys.modules.keys() >= set(PRELOADED)


def test_strangers_of_this_machine_are_refused(cluster: Cluster) -> None:
    from distributed import Client, Security

    for security in (None, Security.temporary()):
        address = cluster.name if security else cluster.name.replace("tls:", "tcp:")
        with pytest.raises(OSError):
            Client(address, security=security, timeout=0.5, set_as_default=False)


def test_a_killed_worker_changes_no_byte(cluster: Cluster, tmp_path: Path) -> None:
    folders = [tmp_path / name for name in ("one", "many")]
    for folder in folders:
        folder.mkdir()
    meshes = [write_ply(tmp_path / f"b{k}.ply", shapes.sphere(1 + k, columns=16, rows=8)) for k in range(4)]
    meshes.append(tmp_path / "bad.ply")
    meshes[-1].write_text("ply\n")
    specs = [MeshAsset(name=mesh.stem, mesh=mesh, texture=None, up="y", height=None, dpci=None) for mesh in meshes]
    jobs = [
        Job(spec=spec, params=ModelParams(resolution=16, layers=1), out=folders[0] / f"{spec.name}.dpci.exr")
        for spec in specs
    ]
    alone = dict(bake_all(jobs, 1, lambda number, stage: None))
    jobs = [replace(job, out=folders[1] / job.out.name) for job in jobs]
    many: dict[int, Any] = {}
    for number, outcome in bake_on(cluster, jobs, Progress(), no_heed):
        if not many:
            os.kill(pids(cluster)[0], signal.SIGKILL)
        many[number] = outcome
    assert sorted(many) == sorted(alone) and all(isinstance(many[number], Baked) for number in range(4))
    assert isinstance(many[4], InputError) and str(many[4]) == str(alone[4]) and str(meshes[-1]) in str(many[4])
    contents = [{file.name: file.read_bytes() for file in folder.glob("b*")} for folder in folders]
    assert contents[0] == contents[1] and len(contents[0]) == 4
    again = dict(bake_on(cluster, jobs[:4], Progress(), no_heed))
    assert set(map(type, again.values())) == {Kept}


@pytest.mark.gl
def test_frames_are_the_same_on_any_worker_and_are_drawn_once(
    cluster: Cluster, gl_device: object, tiny_scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("depthwalk.commands.cluster_render.open_cluster", lambda where: nullcontext(cluster))
    monkeypatch.setattr("depthwalk.render.tile_atlas.ATLAS_TEXELS", 1 << 23)  # as in the workers: it decides last bits
    walk = tiny_scene.with_name("walk.yaml")
    walk.write_text(walk.read_text().replace("fps: 1", "fps: 4"))

    def render(folder: str, *options: str) -> Any:
        (tmp_path / folder).mkdir(exist_ok=True)
        target = str(tmp_path / folder / "f{frame:2}.png")
        return CliRunner().invoke(app, ["render", str(tiny_scene), "--path", str(walk), "-o", target, *SMALL, *options])

    def files(folder: str) -> dict[str, bytes]:
        return {file.name: file.read_bytes() for file in (tmp_path / folder).iterdir()}

    assert render("one").exit_code == 0
    first = render("many", "--cluster", "local:1", "--frames", "2-5")
    assert first.exit_code == 0, first.stderr
    assert sorted(first.stdout.split()) == [str(tmp_path / "many" / f"f{k:02}.png") for k in range(2, 6)]
    drawn = {name: (tmp_path / "many" / name).stat().st_mtime_ns for name in files("many")}
    assert render("many", "--cluster", "local:1").exit_code == 0
    assert files("one") == files("many") and len(files("one")) == 9
    assert all((tmp_path / "many" / name).stat().st_mtime_ns == before for name, before in drawn.items())
    assert all(cluster._client.run(_closed).values())  # the renderer was kept from chunk to chunk

    (before,) = pids(cluster)
    os.kill(before, signal.SIGKILL)
    wait_until(lambda: has_other(cluster, before))
    assert all(cluster._client.run(_inherits).values()) or sys.platform == "darwin"  # where nothing is forked
    (parent,) = {psutil.Process(pid).parent() for pid in pids(cluster)}
    assert parent is not None and (parent.num_threads() == 1 or sys.platform == "darwin")  # though it has read a scene
    (tmp_path / "many" / "f03.png").unlink()
    assert render("many", "--cluster", "local:1").exit_code == 0
    assert not any(cluster._client.run(_inherits).values()) and files("one") == files("many")


def _inherits() -> bool:
    from depthwalk.cluster import zygote

    return zygote._value is not None


def _closed() -> bool:
    from depthwalk.cluster import worker

    had = worker._open_for is not None
    worker.close()
    return had


def wait_until(is_so: Callable[[], bool]) -> None:
    last = time.monotonic() + 20
    while not is_so():
        assert time.monotonic() < last
        time.sleep(0.05)


def test_workers_are_counted(cluster: Cluster) -> None:
    wait_until(lambda: cluster.workers() == 1)  # the one that was killed has been started again
    assert cluster.room() >= 2
