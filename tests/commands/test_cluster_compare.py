"""A comparison on a cluster reports as one in this process does: in the order of the meshes, by their names."""

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
from depthwalk.commands import comparison
from depthwalk.commands.comparison import Plan, run_compare
from depthwalk.commands.subjects import Choices, Subject, find_subjects
from depthwalk.errors import InputError
from depthwalk.scene.render_settings import RenderSettings


@dataclass(frozen=True)
class Model:
    mesh: str


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

    def room(self) -> int:
        return 9


@pytest.fixture
def compared(monkeypatch: pytest.MonkeyPatch) -> Callable[[Callable[[Subject, Plan], object]], Any]:
    """Runs a comparison of two meshes, each of which a function compares in a worker."""
    subjects = find_subjects([Path("a.ply"), Path("b.ply")], [], Choices())
    plan = Plan(subjects=subjects, settings=RenderSettings(), size=(64, 48), wanted=None, pictures=False)

    def run(one: Callable[[Subject, Plan], object]) -> Any:
        monkeypatch.setattr(comparison, "open_cluster", lambda address: nullcontext(Backwards()))
        monkeypatch.setattr(comparison, "compare_alone", one)
        monkeypatch.setattr("depthwalk.cluster.tasks._POLL_SECONDS", 1e-3)
        monkeypatch.setattr("depthwalk.cluster.tasks.FIRST_PAUSE", 1e-4)
        return run_compare(plan, ClusterAddress())

    return run


def test_the_report_is_in_order_and_names_meshes_as_the_user_did(compared: Callable[..., Any]) -> None:
    seen: list[Path] = []

    def one(subject: Subject, plan: Plan) -> object:
        seen.append(subject.spec.mesh)
        return Model(str(subject.spec.mesh)), [], "a driver"

    report, worst = compared(one)
    assert [file.name for file in seen] == ["b.ply", "a.ply"] and all(file.is_absolute() for file in seen)
    assert [model.mesh for model in report.models] == ["a.ply", "b.ply"]
    assert report.renderer == "a driver" and worst == [[], []]


@pytest.mark.parametrize(
    ("raised", "kind", "told"),
    [(InputError("b.ply: bad"), InputError, r"^b\.ply: bad$"), (OSError("no disk"), TaskError, r"^b\.ply: .*no disk")],
)
def test_what_fails_ends_the_comparison(
    compared: Callable[..., Any], raised: Exception, kind: type[Exception], told: str
) -> None:
    def one(subject: Subject, plan: Plan) -> object:
        if subject.spec.mesh.name == "b.ply":
            raise raised
        return Model(""), [], ""

    with pytest.raises(kind, match=told):
        compared(one)
