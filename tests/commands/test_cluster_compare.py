"""A comparison on a cluster reports as one in this process does: in the order of the meshes, by their names."""

import math
from collections.abc import Callable
from concurrent.futures import Future
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from depthwalk.cluster.address import ClusterAddress
from depthwalk.cluster.connection import Cluster
from depthwalk.cluster.tasks import TaskError
from depthwalk.commands import comparison, measuring
from depthwalk.commands.comparison import Compared, Plan, run_compare
from depthwalk.commands.subjects import Choices, Subject, find_subjects
from depthwalk.errors import InputError
from depthwalk.quality.candidate import Candidate
from depthwalk.quality.measure import ViewQuality
from depthwalk.quality.page import WorstView
from depthwalk.quality.report import Costs, ModelReport
from depthwalk.quality.views import Viewpoint
from depthwalk.scene.render_settings import RenderSettings


class Backwards(Cluster):
    """A cluster that does its last task first."""

    dashboard = ""

    def __init__(self) -> None:
        self.held: list[tuple[Future[object], Callable[..., object], tuple[object, ...]]] = []

    def submit(self, key: str, function: Callable[..., object], *arguments: object) -> "Future[object]":
        self.held.append((Future(), function, arguments))
        return self.held[-1][0]

    def workers(self) -> int:
        if self.held:
            future, function, arguments = self.held.pop()
            try:
                future.set_result(function(*arguments))
            except Exception as error:
                future.set_exception(error)
        return 1

    def is_connected(self) -> bool:
        return True

    def room(self) -> int:
        return 9


def report_on(subject: Subject) -> Compared:
    """What comparing a mesh could find, numbers that are not finite included."""
    view = ViewQuality(
        viewpoint=Viewpoint(elevation=5.0, azimuth=0.1, close=True),
        pixels=7,
        psnr=math.inf,
        iou=0.1 + 0.2,
        flip=0.0,
        holes=0.0,
        depth_median=math.nan,
        depth_p99=1e-300,
    )
    model = ModelReport(
        name=subject.name,
        mesh=str(subject.spec.mesh),
        triangles=12,
        params=subject.params,
        objects=1,
        deepest=1,
        costs=Costs(bake_seconds=1.5, bake_peak_bytes=None, bytes_disk=3, bytes_gpu=4),
        views=(view,),
        close=(),
        candidate=Candidate(coverage=1.0, thin=0.0, parts=1, texel=0.01),
        warnings=("thin",),
        recommendation=None,
    )
    return model, [WorstView(view, ("PSNR",), {"mesh": b"\x89PNG\0\xff\n"})], "a driver"


@dataclass
class Trial:
    """Compares two meshes, each of which a function compares in a worker, or in this process."""

    monkeypatch: pytest.MonkeyPatch
    plan: Plan

    def __call__(self, one: Callable[[Subject], Compared], is_cluster: bool = True) -> Any:
        patch = self.monkeypatch.setattr
        patch(measuring, "open_cluster", lambda address: nullcontext(Backwards()))
        patch(comparison, "compare_alone", lambda subject, plan: one(subject))
        patch(comparison, "_compare", lambda subject, plan, pool: one(subject))
        patch(comparison, "flip_workers", nullcontext)
        patch("depthwalk.cluster.tasks._POLL_SECONDS", 1e-3)
        patch("depthwalk.cluster.tasks.FIRST_PAUSE", 1e-4)
        with run_compare(self.plan, ClusterAddress() if is_cluster else None) as found:
            return found


@pytest.fixture
def compared(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Trial:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.chdir(tmp_path)
    for name in ("a.ply", "b.ply"):
        (tmp_path / name).write_text("ply\n")
    subjects = find_subjects([Path("a.ply"), Path("b.ply")], [], Choices())
    return Trial(
        monkeypatch, Plan(subjects=subjects, settings=RenderSettings(), size=(64, 48), wanted=None, pictures=False)
    )


def test_the_report_is_in_order_and_names_meshes_as_the_user_did(compared: Trial) -> None:
    seen: list[Path] = []

    def one(subject: Subject) -> Compared:
        seen.append(subject.spec.mesh)
        return report_on(subject)

    report, worst = compared(one)
    assert [file.name for file in seen] == ["b.ply", "a.ply"] and all(file.is_absolute() for file in seen)
    assert [model.mesh for model in report.models] == ["a.ply", "b.ply"]
    assert report.renderer == "a driver" and len(worst) == 2


@pytest.mark.parametrize(
    ("raised", "kind", "told"),
    [(InputError("a.ply: bad"), InputError, r"^a\.ply: bad$"), (OSError("no disk"), TaskError, r"^a\.ply: .*no disk")],
)
@pytest.mark.parametrize("is_cluster", [False, True])
def test_the_same_command_goes_on_where_one_was_ended(
    compared: Trial, raised: Exception, kind: type[Exception], told: str, is_cluster: bool
) -> None:
    """On the cluster b is compared first; here a is."""
    fails = "a.ply" if is_cluster else "b.ply"
    seen: list[str] = []

    def broken(subject: Subject) -> Compared:
        if subject.spec.mesh.name == fails:
            raise raised
        return report_on(subject)

    def one(subject: Subject) -> Compared:
        seen.append(subject.spec.mesh.name)
        return report_on(subject)

    with pytest.raises(kind if is_cluster else type(raised), match=told if is_cluster else None):
        compared(broken, is_cluster)
    resumed = compared(one, not is_cluster)  # what a cluster has found counts here, and the other way round
    assert seen == [fails]
    whole = compared(one, is_cluster)
    assert len(seen) == 3  # a command that ended well leaves nothing behind
    assert repr(resumed) == repr(whole)


def test_what_was_measured_is_not_taken_for_a_mesh_that_has_changed(compared: Trial, tmp_path: Path) -> None:
    def ended(subject: Subject) -> Compared:
        if subject.spec.mesh.name == "b.ply":
            raise KeyboardInterrupt
        return report_on(subject)

    seen: list[str] = []

    def one(subject: Subject) -> Compared:
        seen.append(subject.spec.mesh.name)
        return report_on(subject)

    with pytest.raises(KeyboardInterrupt):
        compared(ended, is_cluster=False)
    (tmp_path / "a.ply").write_text("ply\nformat")
    compared(one, is_cluster=False)
    assert seen == ["a.ply", "b.ply"]
