"""Tasks are done until each is done or has failed for good, whatever becomes of workers and scheduler."""

from collections.abc import Callable
from concurrent.futures import Future

import pytest

from depthwalk.cluster import connection, tasks
from depthwalk.cluster.connection import Cluster, ClusterError
from depthwalk.cluster.tasks import MAX_ATTEMPTS, Progress, Task, TaskError, run_tasks
from depthwalk.errors import InputError


class Here(Cluster):
    """A cluster that does tasks at once, and loses its scheduler when told so."""

    def __init__(self, lost_at: tuple[int, ...] = (), closed_at: int = -1, mute_at: int = -1) -> None:
        self.keys: list[str] = []
        self.lost_at, self.closed_at, self.mute_at, self.returned = lost_at, closed_at, mute_at, 0
        self.most = 0

    def submit(self, key: str, function: Callable[..., object], *arguments: object) -> "Future[object]":
        name, _, attempt = key.split("-")  # between them what tells runs apart
        self.keys.append(f"{name}-{attempt}")
        future: Future[object] = Future()
        if len(self.keys) - 1 == self.closed_at:
            raise ClusterError("closed")
        if len(self.keys) - 1 in self.lost_at:
            future.cancel()
            future.set_running_or_notify_cancel()
            return future
        if len(self.keys) - 1 == self.mute_at:
            return future
        try:
            future.set_result(function(*arguments))
        except Exception as error:
            future.set_exception(error)
        return future

    def workers(self) -> int:
        return 2

    def room(self) -> int:
        return 3

    def is_connected(self) -> bool:
        return self.mute_at < 0 or self.returned > 0

    def reconnect(self, check_interrupt: Callable[[], None]) -> None:
        self.returned += 1


@pytest.fixture(autouse=True)
def _hurried(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tasks, "FIRST_PAUSE", 1e-4)
    monkeypatch.setattr(tasks, "_POLL_SECONDS", 1e-3)


def doubled(number: int) -> int:
    return 2 * number


def some(count: int, function: Callable[..., object] = doubled) -> list[Task]:
    return [Task(key=f"t{number}", function=function, arguments=(number,)) for number in range(count)]


def all_of(cluster: Cluster, todo: list[Task], progress: Progress | None = None) -> dict[int, object]:
    found = list(run_tasks(cluster, todo, progress or Progress(), lambda: None))
    assert len(found) == len(dict(found)) == len(todo)  # each once
    return dict(found)


def test_every_task_is_done_once() -> None:
    cluster = Here()
    assert all_of(cluster, some(10)) == {number: 2 * number for number in range(10)}
    assert len(cluster.keys) == len(set(cluster.keys)) == 10


def test_what_fails_is_tried_again_under_another_key() -> None:
    failures = [0, 0, 2, 0]

    def unsteady(number: int) -> int:
        if failures[number]:
            failures[number] -= 1
            raise OSError("the disk is full")
        return number

    cluster, progress = Here(), Progress()
    assert all_of(cluster, some(4, unsteady), progress) == {0: 0, 1: 1, 2: 2, 3: 3}
    assert [key for key in cluster.keys if key.startswith("t2")] == ["t2-0", "t2-1", "t2-2"]
    assert progress.again == 2


def test_what_fails_for_good_is_told_of_and_the_rest_is_done() -> None:
    def fails(number: int) -> int:
        if number == 1:
            raise InputError("b.obj: holds no triangle")
        if number == 2:
            raise ValueError("two\nlines")
        return number

    cluster = Here()
    outcomes = all_of(cluster, some(4, fails))
    assert outcomes[0] == 0 and outcomes[3] == 3
    assert isinstance(outcomes[1], InputError) and cluster.keys.count("t1-0") == 1 and "t1-1" not in cluster.keys
    assert isinstance(outcomes[2], TaskError)
    assert str(outcomes[2]) == f"failed {MAX_ATTEMPTS} times, last: ValueError: two lines"


@pytest.mark.parametrize("lost", [{"lost_at": (1, 2)}, {"closed_at": 4}, {"mute_at": 7}])
def test_what_a_lost_scheduler_had_is_handed_over_again(lost: dict[str, object]) -> None:
    cluster = Here(**lost)  # type: ignore[arg-type]
    assert all_of(cluster, some(8)) == {number: 2 * number for number in range(8)}
    assert cluster.returned == 1


def test_a_scheduler_that_stays_away_ends_the_command(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(connection, "PATIENCE", -1.0)

    class Client:
        scheduler = None
        scheduler_comm = None
        dashboard_link = ""

        def get_executor(self, pure: bool) -> None:
            pass

    made: list[Client] = []

    def connect() -> Client:
        if made:
            raise OSError("refused")
        made.append(Client())
        return made[0]

    with pytest.raises(ClusterError, match="has not come back"):
        Cluster(connect, None).reconnect(lambda: None)  # type: ignore[arg-type]


def test_whoever_leaves_early_ends_all() -> None:
    class LeftError(Exception):
        pass

    def leave() -> None:
        raise LeftError

    with pytest.raises(LeftError):
        list(run_tasks(Here(), some(3), Progress(), leave))
