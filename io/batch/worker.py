"""The worker of a batch. Nothing heavy is imported at the top: threads are capped before numpy loads."""

from __future__ import annotations

import ctypes
import logging
import multiprocessing
import os
import signal
import sys
import threading
import time
import traceback
import warnings
from typing import Any, NoReturn

THREADS = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "OPENCV_FOR_THREADS_NUM",
)
GRACE = 5.0  # seconds in which a worker that has lost its parent tidies up (by hand)
PR_SET_PDEATHSIG = 1  # of prctl, as in linux/prctl.h
SPAN = 1.0  # seconds after which the jobs that came with one that took longer than expected go back (by hand)
FIGURES = (
    *("boundary", "dilatation", "log10_area", "injective", "shown", "covered", "cracks"),
    *("uv", "distance", "same_triangles"),
)
NOTES = 5  # of a job that its line in the journal keeps (by hand)


_state = {"busy": False}  # whether a job is being run


class Stopped(BaseException):
    """The parent asked the worker to stop: temporary files are removed on the way out."""


def prepare(threads: int, of_main_thread: bool) -> None:
    """Make a fresh process a worker: threads capped, signals set, and an end when the parent ends.

    Args:
        threads: how many it may use.
        of_main_thread: whether the parent's main thread started it, which ends only with the parent.
    """
    for name in THREADS:
        os.environ[name] = "1" if name.startswith(("OPENBLAS", "MKL")) else str(threads)
    for name in (
        "SIGINT",
        "SIGHUP",
    ):  # Ctrl-C and a closed terminal reach the whole group; the parent decides
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), signal.SIG_IGN)
    signal.signal(signal.SIGTERM, _stop)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    if of_main_thread and sys.platform == "linux":
        _have_kernel_end_it()
    warnings.simplefilter("ignore")  # what a worker has to say is in its answer
    logging.getLogger().addHandler(logging.NullHandler())
    from ...pixels import warp  # noqa: F401  now, so that the first job's time is its own
    from ..pictures import image_files  # noqa: F401


def run_bundle(payloads: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Run jobs one after another, and begin none after SPAN seconds; what came of those that were begun."""
    end, answers = time.monotonic() + SPAN, list[dict[str, Any]]()
    while len(answers) < len(payloads) and (not answers or time.monotonic() < end):
        answers.append(run_job(payloads[len(answers)]))
    return answers


def run_job(payload: dict[str, Any]) -> dict[str, Any]:
    """Run one job and describe what came of it; only a dying process does not answer.

    Args:
        payload: `job` as JSON, `threads`, `folder`, which relative paths start from, and the `seconds` it may take.
    """
    start = time.perf_counter()
    _state["busy"] = True
    try:
        if os.getcwd() != payload["folder"]:
            os.chdir(payload["folder"])
        result = _run(payload)
    except Stopped:
        os._exit(128 + signal.SIGTERM)
    except Exception as error:
        result = _failure(error)
    finally:
        _state["busy"] = False
    return {**result, "seconds": round(time.perf_counter() - start, 4)}


def _run(payload: dict[str, Any]) -> dict[str, Any]:
    from ... import deadline
    from .. import files
    from . import commands

    with deadline.limited(payload.get("seconds", deadline.DEFAULT_SECONDS)):
        outcome = commands.run(commands.job_of(payload["job"]), payload["threads"])
    return {
        "status": "done" if outcome.ok else "poor",
        "message": outcome.message,
        "outputs": [{"path": path, "sha256": files.sha256(path)} for path in outcome.written],
        "figures": {k: v for k, v in outcome.report.items() if k in FIGURES},
        "notes": _first_notes(outcome.notes),
    }


def _first_notes(notes: tuple[str, ...]) -> list[str]:
    """Return the first notes; a drawing with a thousand strokes would otherwise drown the results."""
    return [*notes[:NOTES], *([f"and {len(notes) - NOTES} more"] if len(notes) > NOTES else [])]


def _failure(error: Exception) -> dict[str, Any]:
    """Return the same sentences as the command line's, without importing it."""
    from ...deadline import TimeUp
    from ...errors import IccmError, lacks_memory

    # a job ends on its own shortly before its worker would be stopped
    if isinstance(error, TimeUp):
        status, message = "timeout", str(error)
    elif isinstance(error, IccmError):
        status, message = "failed", str(error)
    elif lacks_memory(error):
        status, message = "failed", "out of memory; choose a smaller size or fewer vertices"
    elif isinstance(error, OSError) and error.strerror:
        status, message = (
            "failed",
            f"{error.filename}: {error.strerror}" if error.filename else error.strerror,
        )
    else:
        where = traceback.extract_tb(error.__traceback__)[-1]
        place = f"{os.path.basename(where.filename)}:{where.lineno}"
        status, message = (
            "error",
            f"internal error, please report it ({type(error).__name__}: {error}, {place})",
        )
    return {"status": status, "message": " ".join(message.split()), "outputs": [], "figures": {}, "notes": []}


def _stop(number: int, frame: object) -> NoReturn:
    if not _state["busy"]:
        os._exit(128 + signal.SIGTERM)  # there is nothing to tidy up, and nobody to hear of an exception
    raise Stopped


def _end_with_parent() -> None:
    """End with the parent, however it ends: an orphan would wait for jobs for ever."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os.kill(os.getpid(), signal.SIGTERM)
        time.sleep(GRACE)
        os._exit(1)


def _have_kernel_end_it() -> None:
    """Have Linux end this process soon after its parent, even in native code that lets no other thread of Python run.

    SIGUSR1 is sent when the thread ends that started the process. Its handler is C's `alarm`, which takes the number
    of the signal as seconds: in ten of them (sixteen on MIPS) SIGALRM ends a process that is not gone by then.
    """
    libc = ctypes.CDLL(None)
    libc.signal.argtypes = [ctypes.c_int, ctypes.c_void_p]
    libc.signal(signal.SIGUSR1, ctypes.cast(libc.alarm, ctypes.c_void_p))
    libc.prctl(PR_SET_PDEATHSIG, signal.SIGUSR1, 0, 0, 0)
