"""Threads over slices of a fixed size, so that the result of a slice does not depend on the number of threads."""

import os
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from typing import TypeVar

from . import deadline

MOST_DIGITS = 9  # of a number of threads; longer ones name none
SLICE_ITEMS = 4096  # items that a thread takes at a time: enough for the cost of a call not to matter
Item = TypeVar("Item")
Result = TypeVar("Result")


def thread_count(threads: int | None = None) -> int:
    """Return the number of threads to use: as requested, or one per available processor, at most OMP_NUM_THREADS."""
    if threads is not None:
        return max(1, threads)
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    most = os.environ.get("OMP_NUM_THREADS", "").partition(",")[0]
    is_count = most.isdecimal() and len(most) <= MOST_DIGITS
    return min(cores, int(most) or cores) if is_count else cores


def over_slices(
    work: Callable[[slice], None], count: int, threads: int | None = None, step: int = SLICE_ITEMS
) -> None:
    """Call work(slice) for slices of `step` items that cover range(count).

    The work has to release the GIL to run in parallel.
    """
    parts = [slice(k, min(k + step, count)) for k in range(0, count, step)]
    workers = min(thread_count(threads), len(parts))
    work = within_time(work)
    if workers <= 1:
        for part in parts:
            work(part)
        return
    with ThreadPoolExecutor(workers) as pool:
        for _ in pool.map(work, parts):
            pass


def within_time(work: Callable[[Item], Result]) -> Callable[[Item], Result]:
    """Return the same work, limited in other threads too by the time limit of this thread.

    See `deadline`.
    """
    limit = deadline.current()

    def checked(item: Item) -> Result:
        if limit is not None:
            limit.check()
        return work(item)

    return checked


def in_background(work: Callable[[], Result]) -> Future[Result]:
    """Start work in a separate thread, and return its future."""
    with_one = ThreadPoolExecutor(1)
    future = with_one.submit(work)
    with_one.shutdown(wait=False)
    return future


def in_order(
    work: Callable[[Item], Result], items: Iterable[Item], threads: int | None = None
) -> Iterator[Result]:
    """Yield work(item) for every item, in order, with at most one finished result waiting per thread."""
    workers = thread_count(threads)
    work = within_time(work)
    if workers == 1:
        yield from map(work, items)
        return
    with ThreadPoolExecutor(workers) as pool:
        waiting: deque[Future[Result]] = deque()
        for item in items:
            waiting.append(pool.submit(work, item))
            if len(waiting) > workers:
                yield waiting.popleft().result()
        while waiting:
            yield waiting.popleft().result()
