"""Run the tasks of a manifest on a pool and yield one result each, whatever happens to a job, a worker or the run."""

from __future__ import annotations

import os
import time
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, CancelledError, Future, wait
from dataclasses import dataclass
from typing import Any

from ...errors import InputError
from .. import files
from . import journal
from .journal import Journal
from .manifest import ManifestError, Task
from .pools import Pool

SCHEMA = "iccm.result/1"
POLL = 0.2  # seconds within which a signal or an expired job is noticed
GOOD = ("done",)


@dataclass(frozen=True)
class Policy:
    """How a batch behaves when things go wrong.

    Attributes:
        retries: how often a job is run again after its worker died.
        timeout: seconds a job may take, None for no limit.
        fail_fast: after the first job that is not done, begin no other.
        threads: threads of each worker.
    """

    retries: int = 1
    timeout: float | None = None
    fail_fast: bool = False
    threads: int = 1


@dataclass
class _Running:
    task: Task
    attempt: int
    began: float


def prepared(tasks: list[Task], book: Journal, *, resume: bool, make: bool = True) -> list[Task]:
    """The tasks with their outputs checked; with `resume`, this batch's own may be replaced, and `make` makes folders.

    Raises:
        ManifestError: every output that cannot be written.
    """
    ready, found = [], []
    for task in tasks:
        job = task.job
        if resume and all(book.wrote(path) or not os.path.lexists(path) for path in job.outputs):
            job = job.model_copy(update={"force": True})
        found += [
            f"{task.place}: {wrong}" for path in job.outputs if (wrong := _unwritable(path, job.force, make))
        ]
        ready.append(task.holding(job))
    if found:
        raise ManifestError(found)
    return ready


def _unwritable(path: str, force: bool, make: bool) -> str | None:
    """Why an output cannot be written, after making its folder, or looking whether it can be made."""
    folder = os.path.dirname(path) or "."
    try:
        if make:
            os.makedirs(folder, exist_ok=True)
        else:
            while not os.path.lexists(folder):
                folder, path = os.path.dirname(folder) or ".", folder
        files.check_output(path, force=force)
    except InputError as error:
        return str(error)
    except OSError as error:
        return f"{error.filename}: {error.strerror}"
    return None


def execute(
    tasks: list[Task],
    pool: Pool,
    book: Journal,
    policy: Policy,
    *,
    resume: bool = False,
    stopping: Callable[[], bool] = lambda: False,
    warn: Callable[[str], None] = lambda message: None,
) -> Iterator[dict[str, Any]]:
    """The result of each task, as it ends: `iccm.result/1`, see the README.

    When `stopping` turns true nothing is begun any more, what runs is ended, and the rest is reported as cancelled.
    """
    pending = deque(_Running(task, 1, 0.0) for task in tasks)
    running: dict[Future, _Running] = {}
    keys: dict[int, str] = {}
    failed = False
    while pending or running:
        if stopping():
            pool.abandon(list(running))
            yield from (
                _record(r, _ended("cancelled", "stopped by a signal")) for r in [*running.values(), *pending]
            )
            return
        if failed and policy.fail_fast:
            yield from (
                _record(r, _ended("cancelled", "an earlier job failed (--fail-fast)")) for r in pending
            )
            pending.clear()
        while pending and len(running) < pool.size:
            item = pending.popleft()
            known = _begin(item, book, keys, resume, warn, unasked=pool.runs_again)
            if known is not None:
                failed |= known["status"] not in GOOD
                yield known
                break  # so that signals are seen between two skipped jobs
            running[pool.submit(_payload(item, pool, policy))] = item
            item.began = time.monotonic()
        for item, result in _ended_ones(running, pool, policy):
            if result is None:
                files.sweep(item.task.job.outputs)
            if result is None and item.attempt <= policy.retries:
                warn(f"{item.task.place}: its worker died; running it again")
                pending.appendleft(_Running(item.task, item.attempt + 1, 0.0))
                continue
            record = _record(item, result or _ended("killed", "its worker died, killed or out of memory"))
            failed |= record["status"] not in GOOD
            _finish(keys.pop(item.task.number, None), record, book, warn)
            yield record
    if pool.runs_again:  # nobody told which workers were lost
        files.sweep(path for task in tasks for path in task.job.outputs)


def _begin(
    item: _Running,
    book: Journal,
    keys: dict[int, str],
    resume: bool,
    warn: Callable[[str], None],
    *,
    unasked: bool,
) -> dict[str, Any] | None:
    """Note the beginning of a job; its result when there is no need to run it. Where it may be run again `unasked`, it
    cannot tell its own files from others' when it writes them: that is looked at here."""
    task = item.task
    try:
        key = journal.key(task.job)
    except (InputError, OSError) as error:
        return _record(item, _ended("failed", f"an input went away: {error}"))
    if unasked and item.attempt == 1:
        wrong = next(
            (w for path in task.job.outputs if (w := _unwritable(path, task.job.force, False))), None
        )
        if wrong:
            return _record(item, _ended("failed", wrong))
    old = book.finished(key) if resume else None
    if old is not None:
        outputs = [{**o, "path": book.place(o["path"])} for o in old["outputs"]]
        return _record(item, {**old, "outputs": outputs}, resumed=True)
    keys[task.number] = key
    try:
        book.begin(key, task.job)
    except OSError as error:
        warn(
            f"{book.path}: the journal cannot be written ({error.strerror}); --resume will not know this job"
        )
    return None


def _finish(key: str | None, record: dict[str, Any], book: Journal, warn: Callable[[str], None]) -> None:
    if key is None or record["status"] not in ("done", "poor"):
        return
    try:
        book.finish(
            key,
            {k: v for k, v in record.items() if k in ("status", "message", "outputs", "figures", "notes")},
        )
    except OSError as error:
        warn(
            f"{book.path}: the journal cannot be written ({error.strerror}); --resume will run this job again"
        )


def _ended_ones(
    running: dict[Future, _Running], pool: Pool, policy: Policy
) -> Iterator[tuple[_Running, dict[str, Any] | None]]:
    """What ended within POLL seconds, by itself or by the clock; None for a result when the worker died."""
    if not running:
        return
    done, _ = wait(running, timeout=POLL, return_when=FIRST_COMPLETED)
    for future in done:
        yield running.pop(future), _answer(future)
    if policy.timeout is None:
        return
    late = [
        f for f, item in running.items() if time.monotonic() - item.began > policy.timeout and not f.done()
    ]
    pool.abandon(late)
    for future in late:
        yield running.pop(future), _ended("timeout", f"took longer than {policy.timeout:g} s (--timeout)")


def _answer(future: Future) -> dict[str, Any] | None:
    try:
        return future.result()
    except (Exception, CancelledError):  # a broken pool, or whatever a cluster says when a worker dies
        return None


def _payload(item: _Running, pool: Pool, policy: Policy) -> dict[str, Any]:
    job = item.task.job.model_dump(mode="json")
    if pool.runs_again or item.attempt > 1:
        job["force"] = True  # a worker that is lost may have written its files before
    return {"job": job, "threads": policy.threads, "folder": os.getcwd()}


def _ended(status: str, message: str) -> dict[str, Any]:
    return {"status": status, "message": message, "outputs": [], "figures": {}, "notes": [], "seconds": 0.0}


def _record(item: _Running, result: dict[str, Any], *, resumed: bool = False) -> dict[str, Any]:
    task = item.task
    start = {"schema": SCHEMA, "job": task.number, "name": task.name, "place": task.place}
    rest = {"seconds": 0.0, **result, "attempts": 0 if resumed else item.attempt, "resumed": resumed}
    return start | {"status": rest.pop("status")} | rest
