"""Run the tasks of a manifest on a pool and yield one result each, whatever happens to a job, a worker or the run."""

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
from ...errors import InputError
from .. import files, formats
from . import journal
from .journal import Journal
from .manifest import ManifestError, Task
from .pools import Pool

SCHEMA = "iccm.result/1"
EARLY = 0.8  # of --timeout, after which a job ends on its own: killed it leaves nothing (by hand)
POLL = 0.2  # seconds within which a signal or an expired job is noticed
NAMED = 3  # jobs under way whose names are shown
GOOD = ("done",)


@dataclass(frozen=True)
class Policy:
    """How a batch behaves when things go wrong.

    Attributes:
        retries: how often a job is run again after its worker died.
        timeout: seconds a job may take, None for no limit.
        fail_fast: after the first job that is not done, begin no other.
        threads: threads of each worker.
        time_limit: seconds after which a job ends on its own, with the best map so far if there is one; None: as long
        as
            a command by default, or what leaves it some time before `timeout`.
    """

    retries: int = 1
    timeout: float | None = None
    fail_fast: bool = False
    threads: int | None = 1
    time_limit: float | None = None

    @property
    def seconds(self) -> float:
        """The time limit of a job."""
        if self.time_limit is not None:
            return self.time_limit
        return deadline.DEFAULT_SECONDS if self.timeout is None else EARLY * self.timeout


@dataclass
class _Running:
    task: Task
    attempt: int = 1
    began: float = 0.0
    alone: bool = False  # its worker died, or that of a bundle that it was in
    before: str = ""  # the map of the frame before


def prepare(tasks: list[Task], book: Journal, *, resume: bool, make: bool = True) -> list[Task]:
    """Return the tasks with their outputs checked; with `resume`, this batch's own may be replaced, and `make` makes
    folders.

    Raises:
        ManifestError: every output that cannot be written.
    """
    ready, found = [], []
    for task in tasks:
        job = task.job
        if resume and all(book.wrote(path) or not os.path.lexists(path) for path in job.outputs):
            job = job.model_copy(update={"force": True})
        found += [
            f"{task.place}: {wrong}"
            for path in job.outputs
            if (wrong := _why_unwritable(path, job.force, make))
        ]
        ready.append(task.with_job(job))
    if found:
        raise ManifestError(found)
    return ready


def _why_unwritable(path: str, force: bool, make: bool) -> str | None:
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
    """Yield the result of each task, as it ends: `iccm.result/1`, see docs/reference/batch.md.

    When `stopping` turns true nothing is begun any more, what runs is ended, and the rest is reported as cancelled.
    """
    # A job is in one of these at a time: it is pending until a worker has room, running until its worker answers. A
    # frame of a sequence waits for the frame before it, by whose number it is found; when that ends it is pending.
    pending = deque(_Running(task) for task in tasks if not task.after)
    waiting = {
        task.after: _Running(task, before=_map_of(tasks[task.after - 1])) for task in tasks if task.after
    }
    running: dict[Future, list[_Running]] = {}
    keys: dict[int, str] = {}  # of jobs that were begun, in the journal, by their numbers
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

        # Give jobs to workers while there is room. `known` is the result of one that need not run: it was completed
        # by an earlier run, or its inputs are gone. The loop ends with it, so that signals are seen between two such
        # jobs.
        known = None
        while pending and known is None and len(running) < _capacity(pool, running, pending):
            items = []
            for item in _bundle(pending, pool.together(len(pending))):
                known = _begin(item, book, keys, resume, warn, unasked=pool.runs_again)
                if known is not None:
                    break
                items.append(item)
            if items:
                running[pool.submit([_payload(item, pool, policy) for item in items])] = items
                items[0].began = time.monotonic()
        _tell(running, len(pending) + len(waiting), len(tasks))
        if known is not None:
            failed |= known["status"] not in GOOD
            _release(known, waiting, pending, warn)
            yield known

        # Wait a moment for answers; not at all if there was a result, since more may be known at once. A worker that
        # died answers nothing. One that was given a bundle answers for the first jobs of it if these took long: the
        # others go back to the front of the queue, in their order.
        for items, answers in _collect(running, pool, policy, 0.0 if known else POLL):
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
    """Yield the results of jobs that are not run, or not to their ends."""
    for item in items:
        yield _record(item, _answer("cancelled", why))


def _release(
    record: dict[str, Any],
    waiting: dict[int, _Running],
    pending: deque[_Running],
    warn: Callable[[str], None],
) -> None:
    """Let the frame after one that ended continue from its map; anew, and say so, where there is none."""
    item = waiting.pop(record["job"], None)
    if item is None:
        return
    if record["outputs"] and item.before:
        item.task = item.task.with_job(item.task.job.model_copy(update={"start": item.before}))
    else:
        warn(
            f"{item.task.place}: {item.task.name}: the previous frame has no map, so this one is "
            "computed without it"
        )
    pending.appendleft(item)


def _map_of(task: Task) -> str:
    """Return the map that a frame keeps."""
    return next((name for name in task.job.outputs if formats.of(name).map), "")


def _tell(running: dict[Future, list[_Running]], pending: int, count: int) -> None:
    """Tell which jobs are under way, and how many are over."""
    names = [item.task.name for items in running.values() for item in items]
    more = f" and {len(names) - NAMED} more" if len(names) > NAMED else ""
    progress.tell(", ".join(names[:NAMED]) + more or "jobs", count - pending - len(names), count)


def _capacity(pool: Pool, running: dict[Future, list[_Running]], pending: deque[_Running]) -> int:
    """Return how many bundles may be under way. What waits at a worker goes down with it, and would be blamed as well:
    where a job may have killed one, none waits.
    """
    suspicious = pending[0].alone or any(items[0].alone for items in running.values())
    return pool.size + (0 if suspicious else pool.ahead)


def _bundle(pending: deque[_Running], count: int) -> Iterator[_Running]:
    """Yield the next jobs, up to so many, that may go to a worker together."""
    alone = pending[0].alone
    yield pending.popleft()
    while not alone and (count := count - 1) > 0 and pending and not pending[0].alone:
        yield pending.popleft()


def _retry(
    items: list[_Running], policy: Policy, warn: Callable[[str], None]
) -> tuple[list[_Running], list[dict[str, Any]]]:
    """Return what is run again after a worker died, and the answer for what is not. Of several jobs nobody knows which
    one it was: each is run alone.
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
    """Note the beginning of a job; its result when there is no need to run it. Where it may be run again
    `unasked`, it cannot tell its own files from others' when it writes them: that is looked at here."""
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
    """Yield what ended within some seconds, on its own or by the clock; None for answers when the worker died."""
    if not running:
        return
    done, _ = wait(running, timeout=patience, return_when=FIRST_COMPLETED)
    for future in done:
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
    except (Exception, CancelledError):  # a broken pool, or whatever a cluster says when a worker dies
        return None


def _payload(item: _Running, pool: Pool, policy: Policy) -> dict[str, Any]:
    job = item.task.values
    if pool.runs_again or item.attempt > 1:
        job["force"] = True  # a worker that is lost may have written its files before
    return {"job": job, "threads": policy.threads, "folder": os.getcwd(), "seconds": policy.seconds}


def _answer(status: str, message: str) -> dict[str, Any]:
    return {"status": status, "message": message, "outputs": [], "figures": {}, "notes": [], "seconds": 0.0}


def _record(item: _Running, result: dict[str, Any], *, resumed: bool = False) -> dict[str, Any]:
    task = item.task
    start = {"schema": SCHEMA, "job": task.number, "name": task.name, "place": task.place}
    rest = {"seconds": 0.0, **result, "attempts": 0 if resumed else item.attempt, "resumed": resumed}
    return start | {"status": rest.pop("status")} | rest
