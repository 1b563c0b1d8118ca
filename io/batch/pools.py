"""Pools of workers: processes of this machine, or an existing Dask cluster, behind `concurrent.futures` executors."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Iterator
from concurrent.futures import BrokenExecutor, Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from statistics import median
from typing import Any, Protocol

from ...errors import InputError
from .. import extras
from . import worker

GRACE_SECONDS = 3.0  # seconds that a worker has to end on its own, before it is killed
WAITING_TASKS = 1
"""Tasks that wait at each thread of a cluster, so that it is never idle: 200 tasks of 50 ms on two workers took 48 to
101 ms each with 0, 29 and 32 with 1, 27 and 64 with 2 (on a busy machine; at least 25)."""
TASK_SECONDS = 0.5
"""Seconds that short jobs in one task take together; Dask's overhead (8.6 ms) is 2 % of that."""
MOST_TASK_JOBS = 64  # jobs in a task at most, so that no thread waits for another long
RECENT_JOBS = 15
"""Jobs from whose times the next ones' are predicted: recent ones, since manifests are sorted."""
CLUSTER_TIMEOUT = "10s"  # time for a cluster to answer, after which the address is probably wrong


class Pool(Protocol):
    """A pool that runs bundles of jobs.

    Attributes:
        size: number of bundles that run at the same time.
        ahead: number of further bundles that may wait for one of them to end.
        runs_again: whether the bundle of a lost worker may be run a second time without notice.
    """

    size: int
    ahead: int
    runs_again: bool

    def together(self, left: int) -> int:
        """Return the number of the remaining jobs to put into a bundle."""

    def submit(self, payloads: list[dict[str, Any]]) -> Future:
        """Start jobs, one after another on one worker.

        The future holds the answers of as many of the first jobs as there was time for; an exception means that the
        worker died.
        """

    def abandon(self, futures: list[Future]) -> None:
        """Stop running jobs, by force if necessary."""

    def close(self) -> None:
        """Release the workers."""


class InProcess:
    """A pool that runs jobs in this process, at the time when they are submitted."""

    size, ahead = 1, 0
    runs_again = False

    def together(self, left: int) -> int:
        """Return 1: jobs are not bundled."""
        return 1

    def submit(self, payloads: list[dict[str, Any]]) -> Future:
        """Run jobs, and return a completed future."""
        future: Future = Future()
        future.set_result(worker.run_bundle(payloads))
        return future

    def abandon(self, futures: list[Future]) -> None:
        """Do nothing, since submitted jobs have ended."""

    def close(self) -> None:
        """Do nothing, since there are no workers."""


class Processes:
    """A pool of processes of this machine, each with its own executor.

    A pool of one process is broken only by its own job, and can be killed when its time is up; a pool of many would
    lose every pending job when any worker dies. pebble's pool (5.2.3) is as fast, but is lost as a whole if a worker
    dies before it has begun a job. It also stops workers one by one: 4 workers in compiled code take 12.2 s, these 3.1
    s.
    """

    ahead = 0
    runs_again = False

    def __init__(self, size: int, threads: int) -> None:
        """Start `size` workers, each with `threads` threads."""
        self.size, self._threads = size, threads
        self._lanes = [_Lane(threads) for _ in range(size)]

    def together(self, left: int) -> int:
        """Return 1: a job that dies or is stopped takes its process with it."""
        return 1

    def submit(self, payloads: list[dict[str, Any]]) -> Future:
        """Start jobs on an idle process, or on a new one; waits for a process that is still starting."""
        for lane in [lane for lane in self._lanes if lane.broken]:
            self._drop(lane)
        idle = [lane for lane in self._lanes if lane.idle]
        if not idle:
            idle = [_Lane(self._threads)]
            self._lanes += idle
        return idle[0].submit(payloads)

    def abandon(self, futures: list[Future]) -> None:
        """Terminate the processes that run these jobs, all at once, and kill those that do not end."""
        lanes = [lane for lane in self._lanes if lane.future in futures]
        for lane in lanes:
            lane.signal(signal.SIGTERM)
        deadline = time.monotonic() + GRACE_SECONDS
        for lane in lanes:
            while not lane.broken and time.monotonic() < deadline:
                time.sleep(0.02)
            lane.signal(getattr(signal, "SIGKILL", signal.SIGTERM))
            self._drop(lane)

    def close(self) -> None:
        """End the workers.

        Idle workers are waited for, because Python's own shutdown would race with theirs. Workers that are still
        running a job, whose result nobody will read, are stopped, because Python's shutdown would wait for them.
        """
        self.abandon([lane.future for lane in self._lanes if not lane.idle])
        lanes = list(self._lanes)
        with ThreadPoolExecutor(len(lanes) or 1) as closing:
            list(closing.map(lambda lane: self._drop(lane, wait=lane.idle), lanes))

    def _drop(self, lane: _Lane, wait: bool = False) -> None:
        self._lanes.remove(lane)
        lane.executor.shutdown(wait=wait, cancel_futures=True)


@contextlib.contextmanager
def _terminal_signals_blocked() -> Iterator[None]:
    """Block the signals of a terminal in this thread, and in processes that it starts in the meantime.

    They reach the whole process group. Python would end with a traceback if it got one while it imports modules;
    a worker unblocks them when it ignores them.
    """
    if not hasattr(signal, "pthread_sigmask"):  # Windows
        yield
        return
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, worker.terminal_signals())
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)


class _Lane:
    """A worker process and its current jobs."""

    def __init__(self, threads: int) -> None:
        spawn = multiprocessing.get_context("spawn")  # a fork while threads are running may hang
        of_main_thread = threading.current_thread() is threading.main_thread()
        self.executor: Executor = ProcessPoolExecutor(1, spawn, worker.prepare, (threads, of_main_thread))
        with _terminal_signals_blocked():
            self._pid = self.executor.submit(os.getpid)
        self.future: Future = self._pid

    @property
    def idle(self) -> bool:
        """Whether the process can take jobs."""
        return self.future is self._pid or (self.future.done() and not self.broken)

    @property
    def broken(self) -> bool:
        """Whether its process is gone."""
        return self.future.done() and not self.future.cancelled() and self.future.exception() is not None

    def submit(self, payloads: list[dict[str, Any]]) -> Future:
        """Start jobs once the process is ready, so that start-up does not count for their time. If it has died, the
        future holds that.
        """
        try:
            self._pid.result()
            self.future = self.executor.submit(worker.run_bundle, payloads)
        except BrokenExecutor as error:
            self.future = Future()
            self.future.set_exception(error)
        return self.future

    def signal(self, number: int) -> None:
        """Send a signal to the process if it is alive."""
        if self.broken:
            return
        with contextlib.suppress(Exception):
            os.kill(self._pid.result(timeout=GRACE_SECONDS), number)


class Dask:
    """A pool on an existing Dask cluster, on which running jobs cannot be killed.

    `size` is the number of its threads. If jobs may be submitted ahead, short ones are bundled into one task, whose
    overhead for client, scheduler and worker is that of a single job.
    """

    runs_again = True

    def __init__(self, address: str, *, ahead: bool = False) -> None:
        """Connect to a scheduler; `ahead` if jobs may be submitted before a thread is free for them.

        Raises:
            InputError: distributed is not installed, or the scheduler does not answer.
        """
        distributed = extras.load("--dask", "distributed")
        try:
            self._client = distributed.Client(address, timeout=CLUSTER_TIMEOUT)
        except (OSError, ValueError) as error:
            raise InputError(
                f"--dask: no scheduler answers at {address}: {' '.join(str(error).split())}"
            ) from None
        self.size = sum(self._client.nthreads().values())
        if not self.size:
            self._client.close()
            raise InputError(
                f"--dask: the scheduler at {address} has no workers; start some with `dask worker {address}`"
            )
        self.ahead = WAITING_TASKS * self.size if ahead else 0
        self._recent: tuple[float, ...] = ()  # seconds of the jobs that ended last
        self._executor = self._client.get_executor(pure=False, retries=0)

    def together(self, left: int) -> int:
        """Return the number of jobs that take about `TASK_SECONDS` seconds, judging by those that ended last.

        It is smaller towards the end, so that all threads have work.
        """
        if not (self.ahead and self._recent):
            return 1
        short = int(TASK_SECONDS / max(median(self._recent), TASK_SECONDS / MOST_TASK_JOBS))
        return max(1, min(short, left // (self.size + self.ahead)))

    def submit(self, payloads: list[dict[str, Any]]) -> Future:
        """Start jobs on any worker."""
        future = self._executor.submit(worker.run_bundle, payloads)
        future.add_done_callback(self._learn)
        return future

    def _learn(self, future: Future) -> None:
        with contextlib.suppress(Exception):  # jobs that died report nothing
            seconds = [answer["seconds"] for answer in future.result()]
            self._recent = (*self._recent, *seconds)[-RECENT_JOBS:]

    def abandon(self, futures: list[Future]) -> None:
        """Cancel jobs that have not started; running ones end in their own time."""
        for future in futures:
            future.cancel()

    def close(self) -> None:
        """Disconnect from the cluster."""
        self._executor.shutdown(wait=False)
        self._client.close()
