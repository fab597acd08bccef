"""Measure many files one after the other, or on a cluster, and continue an interrupted run of the same command."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from pydantic import ConfigDict, TypeAdapter, ValidationError

from depthwalk.cluster.address import ClusterAddress
from depthwalk.cluster.connection import open_cluster
from depthwalk.cluster.tasks import Task, TaskError, run_tasks
from depthwalk.commands.cluster_progress import cluster_progress
from depthwalk.commands.journal import Journal
from depthwalk.commands.progress import log
from depthwalk.errors import InputError

T = TypeVar("T")

# Results are written so that reading them back gives equal values, including numbers that are not finite.
_JSON = ConfigDict(ser_json_inf_nan="constants", ser_json_bytes="base64", val_json_bytes="base64")


@dataclass(frozen=True, kw_only=True)
class Measurements(Generic[T]):
    """Describe what to measure.

    Attributes
    ----------
    what
        What is measured, such as "meshes".
    names
        Names of what is measured, for messages.
    tasks
        How a worker measures each. The keys must change with the files that are read.
    here
        Provides, for a `with` block, a function that measures the thing of a given number in this process.
    named
        Returns a worker's result with the names that the user gave, if workers know others; it is given the number.
    kind
        The type of the results, which pydantic can write and read.
    journal
        Stores the results until all are there.
    """

    what: str
    names: Sequence[str]
    tasks: Sequence[Task]
    here: Callable[[], AbstractContextManager[Callable[[int], T]]]
    named: Callable[[int, Any], T]
    kind: Any
    journal: Journal


@contextmanager
def measured(job: Measurements[T], cluster: ClusterAddress | None) -> Iterator[list[T]]:
    """Measure what an interrupted earlier run has not measured; store the results until a report is written.

    Parameters
    ----------
    job
        What to measure.
    cluster
        Cluster on which to measure, one thing at a time per worker; None for this process, one after the other.

    Yields
    ------
    list
        The results, in the order of the tasks. When the block ends without an error, the journal is removed.

    Raises
    ------
    InputError, GpuError
        If a thing cannot be measured.
    TaskError, ClusterError
        If it cannot be measured on the cluster for another reason, or the cluster is lost for good.
    """
    results: TypeAdapter[tuple[T]] = TypeAdapter(tuple[job.kind], config=_JSON)  # type: ignore[name-defined]
    found = _known(job, results)
    rest = [number for number in range(len(job.tasks)) if number not in found]
    if found:
        log.warning("%d of %d %s: results reused from an interrupted run", len(found), len(job.tasks), job.what)
    if rest:
        for number, result in _here(job, rest) if cluster is None else _on_cluster(job, rest, cluster):
            found[number] = result
            job.journal.add(job.tasks[number].key, results.dump_json((result,)))
    yield [found[number] for number in range(len(job.tasks))]
    job.journal.remove()


def _known(job: Measurements[T], results: "TypeAdapter[tuple[T]]") -> dict[int, T]:
    """Return the results of an earlier run, by the number of the thing."""
    entries, found = job.journal.read(), {}
    for number, task in enumerate(job.tasks):
        if task.key in entries:
            try:
                (found[number],) = results.validate_json(entries[task.key])
            except ValidationError as error:  # its checksum is right, so another version wrote it
                log.warning(
                    "%s: %s: the stored result cannot be used, measuring again: %s",
                    job.journal.path,
                    job.names[number],
                    error.errors()[0]["msg"],
                )
    return found


def _here(job: Measurements[T], numbers: Sequence[int]) -> Iterator[tuple[int, T]]:
    with job.here() as measure:
        for number in numbers:
            yield number, measure(number)


def _on_cluster(job: Measurements[T], numbers: Sequence[int], address: ClusterAddress) -> Iterator[tuple[int, T]]:
    tasks = [job.tasks[number] for number in numbers]
    with open_cluster(address) as cluster, cluster_progress(job.what, len(tasks), cluster) as display:
        for index, outcome in run_tasks(cluster, tasks, display.progress, display.show):
            if isinstance(outcome, TaskError):
                raise TaskError(f"{job.names[numbers[index]]}: {outcome}")
            if isinstance(outcome, InputError):
                raise outcome
            display.done(1)
            yield numbers[index], job.named(numbers[index], outcome)
