"""Run the tasks of a manifest on a pool; each has one result, whatever happens to a job, a worker or the run."""

from __future__ import annotations

import os
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, CancelledError, Future, wait
from dataclasses import dataclass, replace
from itertools import chain
from typing import Any

from ... import deadline, progress
from ...errors import InputError, first_names
from .. import files, formats
from . import journal
from .journal import Journal
from .manifest import ManifestError, Task
from .pools import Pool

SCHEMA = "iccm.result/1"
# relative to --timeout: time limit of the solver, since a job that is killed leaves no output
EARLY_TIMEOUT_SHARE = 0.8
POLL_SECONDS = 0.2  # seconds until a signal or an expired job is noticed at the latest
NAMED_JOBS = 3  # running jobs whose names are shown
GOOD = ("done",)


@dataclass(frozen=True)
class Policy:
    """How a batch reacts to failures.

    Attributes:
        retries: how often a job is run again after its worker has died.
        timeout: seconds that a job may take; None for no limit.
        fail_fast: whether to start no further jobs after one has failed.
        threads: threads of each worker.
        time_limit: seconds after which the solver stops with the best map so far; None: the default of the commands, or
            a share of `timeout`.
    """

    retries: int = 1
    timeout: float | None = None
    fail_fast: bool = False
    threads: int | None = 1
    time_limit: float | None = None

    @property
    def seconds(self) -> float:
        """The time limit of a job in seconds."""
        if self.time_limit is not None:
            return self.time_limit
        return deadline.DEFAULT_SECONDS if self.timeout is None else EARLY_TIMEOUT_SHARE * self.timeout


@dataclass
class _Running:
    task: Task
    attempt: int = 1
    began: float = 0.0
    alone: bool = False  # after its worker, or that of its bundle, has died
    previous_map: str = ""  # the map of the previous frame


def prepare(tasks: list[Task], book: Journal, *, resume: bool, make: bool = True) -> list[Task]:
    """Return the tasks with their outputs checked.

    With `resume`, outputs of this batch may be replaced; with `make`, missing folders are created.

    Raises:
        ManifestError: lists every output that cannot be written.
    """
    ready, mistakes = [], []
    for task in tasks:
        job = task.job
        if resume and all(book.wrote(path) or not os.path.lexists(path) for path in job.outputs):
            job = job.model_copy(update={"force": True})
        mistakes += [
            f"{task.place}: {wrong}"
            for path in job.outputs
            if (wrong := _why_unwritable(path, job.force, make))
        ]
        ready.append(task.with_job(job))
    if mistakes:
        raise ManifestError(mistakes)
    return ready


def idle_in_all(idle: set[str] | None, result: dict[str, Any]) -> set[str] | None:
    """Return the options without effect in all jobs that were written, given those before `result`; None before any.

    >>> idle_in_all({"exact_pins", "size"}, {"status": "done", "idle": ["size"]})
    {'size'}
    """
    if result["status"] not in ("done", "poor"):
        return idle
    return set(result["idle"]) if idle is None else idle & set(result["idle"])


def _why_unwritable(path: str, force: bool, make: bool) -> str | None:
    """Return why an output cannot be written, or None; with `make`, create its folder."""
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
    """Yield the result of each task as it ends: `iccm.result/1`, see docs/reference/batch.md.

    When `stopping` returns True, no further job is started, running jobs are stopped, and the rest is reported as
    cancelled.
    """
    # Each job is in one of these collections: pending until a worker is free, running until its worker answers. A frame
    # of a sequence waits for the previous frame, by whose number it is found, and becomes pending when that ends.
    pending = deque(_Running(task) for task in tasks if not task.after)
    waiting = {
        task.after: _Running(task, previous_map=_map_of(tasks[task.after - 1]))
        for task in tasks
        if task.after
    }
    running: dict[Future, list[_Running]] = {}
    keys: dict[int, str] = {}  # journal keys of the jobs that have begun, by number
    failed = False
    while pending or running:
        if stopping():
            pool.abandon(list(running))
            yield from _cancel(chain(*running.values(), pending, waiting.values()), "stopped by a signal")
            return
        if failed and policy.fail_fast:
            why = "not started, because an earlier job failed (--fail-fast)"
            yield from _cancel(chain(pending, waiting.values()), why)
            pending.clear()
            waiting.clear()

        # Give jobs to workers while there is room. `ready_result` is the result of a job that need not run, because an
        # earlier run completed it or its inputs are gone. The loop ends at each such job, so that signals are noticed
        # in between.
        ready_result = None
        while pending and ready_result is None and len(running) < _capacity(pool, running, pending):
            items = []
            for item in _bundle(pending, pool.together(len(pending))):
                ready_result = _begin(item, book, keys, resume, warn, unasked=pool.runs_again)
                if ready_result is not None:
                    break
                items.append(item)
            if items:
                running[pool.submit([_payload(item, pool, policy) for item in items])] = items
                items[0].began = time.monotonic()
        _tell(running, len(pending) + len(waiting), len(tasks))
        if ready_result is not None:
            failed |= ready_result["status"] not in GOOD
            _release(ready_result, waiting, pending, warn)
            yield ready_result

        # Wait a moment for answers, or not at all if there was a result, since further results may be known
        # immediately. A worker that has died gives no answer. One that was given a bundle answers for the first of its
        # jobs if these took long; the others go back to the front of the queue, in order.
        for items, answers in _collect(running, pool, policy, 0.0 if ready_result else POLL_SECONDS):
            if answers is None:
                again, answers = _retry(items, policy, warn)
            else:
                again = items[len(answers) :]
            pending.extendleft(reversed(again))
            for item, answer in zip(items, answers):
                record = _record(item, answer)
                failed |= record["status"] not in GOOD
                _finish(keys.pop(item.task.number, None), record, book, warn)
                _release(record, waiting, pending, warn)
                yield record
    if pool.runs_again:  # nobody reported which workers were lost
        files.sweep(path for task in tasks for path in task.job.outputs)


def _cancel(items: Iterable[_Running], why: str) -> Iterator[dict[str, Any]]:
    """Yield the results of jobs that are not run, or are stopped."""
    for item in items:
        yield _record(item, _answer("cancelled", why))


def _release(
    record: dict[str, Any],
    waiting: dict[int, _Running],
    pending: deque[_Running],
    warn: Callable[[str], None],
) -> None:
    """Let the next frame continue from the map of a frame that has ended; start from scratch, with a warning, if there
    is none.
    """
    item = waiting.pop(record["job"], None)
    if item is None:
        return
    if record["outputs"] and item.previous_map:
        item.task = item.task.with_job(item.task.job.model_copy(update={"start": item.previous_map}))
    else:
        warn(
            f"{item.task.place}: {item.task.name}: the previous frame has no map, so this one is "
            "computed without it"
        )
    pending.appendleft(item)


def _map_of(task: Task) -> str:
    """Return the map that a frame writes."""
    return next((name for name in task.job.outputs if formats.of(name).map), "")


def _tell(running: dict[Future, list[_Running]], pending: int, count: int) -> None:
    """Report the names of running jobs, and the number of completed ones."""
    names = [item.task.name for items in running.values() for item in items]
    progress.tell(first_names(names, NAMED_JOBS) or "jobs", count - pending - len(names), count)


def _capacity(pool: Pool, running: dict[Future, list[_Running]], pending: deque[_Running]) -> int:
    """Return the number of bundles that may be at the workers.

    If a worker dies, the jobs waiting there are lost and would be suspected, too. So none wait while a job is suspected
    of having killed a worker.
    """
    suspicious = pending[0].alone or any(items[0].alone for items in running.values())
    return pool.size + (0 if suspicious else pool.ahead)


def _bundle(pending: deque[_Running], count: int) -> Iterator[_Running]:
    """Yield up to `count` of the next jobs that may be sent to a worker together."""
    alone = pending[0].alone
    yield pending.popleft()
    while not alone and (count := count - 1) > 0 and pending and not pending[0].alone:
        yield pending.popleft()


def _retry(
    items: list[_Running], policy: Policy, warn: Callable[[str], None]
) -> tuple[list[_Running], list[dict[str, Any]]]:
    """Return what to run again after a worker has died, and the answers for the rest.

    If a bundle of jobs was running, it is not known which of them was the cause, so each is run alone.
    """
    files.sweep(path for item in items for path in item.task.job.outputs)
    first = items[0]
    if len(items) > 1:
        warn(f"{first.task.place} and {len(items) - 1} more: the worker died; running the jobs one by one")
        return [replace(item, alone=True) for item in items], []
    if first.attempt <= policy.retries:
        warn(f"{first.task.place}: the worker died; running the job again")
        return [replace(first, attempt=first.attempt + 1, alone=True)], []
    return [], [_answer("killed", "the worker died: it was killed, or ran out of memory")]


def _begin(
    item: _Running,
    book: Journal,
    keys: dict[int, str],
    resume: bool,
    warn: Callable[[str], None],
    *,
    unasked: bool,
) -> dict[str, Any] | None:
    """Record the start of a job; return its result if it need not run.

    If the pool may run it again `unasked`, a second attempt could not distinguish its own files from others when it
    writes them, so existing outputs are checked here.
    """
    if item.task.number in keys:
        return None
    job = item.task.job
    try:
        key = journal.key(job)
    except (InputError, OSError) as error:
        return _record(item, _answer("failed", f"an input disappeared: {error}"))
    if unasked:
        wrong = next((w for path in job.outputs if (w := _why_unwritable(path, job.force, False))), None)
        if wrong:
            return _record(item, _answer("failed", wrong))
    old = book.finished(key, job) if resume else None
    if old is not None:
        outputs = [{**o, "path": book.place(o["path"])} for o in old["outputs"]]
        return _record(item, {**old, "outputs": outputs}, resumed=True)
    keys[item.task.number] = key
    try:
        book.begin(key, job)
    except OSError as error:
        warn(f"{book.path}: cannot write the journal ({error.strerror}); --resume will run this job again")
    return None


def _finish(key: str | None, record: dict[str, Any], book: Journal, warn: Callable[[str], None]) -> None:
    if key is None or record["status"] not in ("done", "poor"):
        return
    try:
        book.finish(key, {name: record[name] for name in journal.RESULT})
    except OSError as error:
        warn(f"{book.path}: cannot write the journal ({error.strerror}); --resume will run this job again")


def _collect(
    running: dict[Future, list[_Running]], pool: Pool, policy: Policy, patience: float
) -> Iterator[tuple[list[_Running], list[dict[str, Any]] | None]]:
    """Yield bundles that ended within some seconds, on their own or by --timeout; answers are None if the worker
    died.
    """
    if not running:
        return
    finished, _ = wait(running, timeout=patience, return_when=FIRST_COMPLETED)
    for future in finished:
        yield running.pop(future), _answers(future)
    if policy.timeout is None:
        return
    late = [
        f
        for f, items in running.items()
        if time.monotonic() - items[0].began > policy.timeout and not f.done()
    ]
    pool.abandon(late)
    for future in late:
        items = running.pop(future)
        yield items, [_answer("timeout", f"took longer than {policy.timeout:g} s (--timeout)") for _ in items]


def _answers(future: Future) -> list[dict[str, Any]] | None:
    try:
        return future.result()
    # a broken pool, or whatever exception a cluster raises when a worker dies
    except (Exception, CancelledError):
        return None


def _payload(item: _Running, pool: Pool, policy: Policy) -> dict[str, Any]:
    job = item.task.values
    if pool.runs_again or item.attempt > 1:
        job["force"] = True  # a lost worker may already have written its files
    return {"job": job, "threads": policy.threads, "folder": os.getcwd(), "seconds": policy.seconds}


def _answer(status: str, message: str) -> dict[str, Any]:
    return {"status": status, "message": message, "outputs": [], "figures": {}, "notes": [], "seconds": 0.0}


def _record(item: _Running, result: dict[str, Any], *, resumed: bool = False) -> dict[str, Any]:
    task = item.task
    start = {"schema": SCHEMA, "job": task.number, "name": task.name, "place": task.place}
    details = {
        "seconds": 0.0,
        "idle": [],
        **result,
        "attempts": 0 if resumed else item.attempt,
        "resumed": resumed,
    }
    return start | {"status": details.pop("status")} | details
