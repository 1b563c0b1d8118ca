"""The worker process of a batch. Heavy modules are imported late, because threads must be limited before NumPy
loads.
"""

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
GRACE_SECONDS = 5.0  # seconds for a worker that has lost its parent to clean up, before it is killed
PR_SET_PDEATHSIG = 1  # option of prctl, from linux/prctl.h
# seconds after which the remaining jobs of a bundle are returned, if one took longer than expected,
# since another worker may be idle
RETURN_SECONDS = 1.0
KEPT_NOTES = 5  # notes of a job in its line of the journal at most, in order of importance


_state = {"busy": False}  # whether a job is running


class Stopped(BaseException):
    """Raised when the parent asks the worker to stop, so that temporary files are removed."""


def terminal_signals() -> list[signal.Signals]:
    """Return the signals of Ctrl-C, Ctrl-Break and a closed terminal, which reach a whole process group."""
    names = ("SIGINT", "SIGHUP", "SIGBREAK")
    return [getattr(signal, name) for name in names if hasattr(signal, name)]


def prepare(threads: int, of_main_thread: bool) -> None:
    """Set up a new worker process: thread limits, signals, and its end when the parent ends.

    Args:
        threads: number of threads it may use.
        of_main_thread: whether it was started by the parent's main thread, which only ends with the parent.
    """
    for name in THREADS:
        os.environ[name] = "1" if name.startswith(("OPENBLAS", "MKL")) else str(threads)
    for number in terminal_signals():  # the parent decides
        signal.signal(number, signal.SIG_IGN)
    if hasattr(signal, "pthread_sigmask"):  # blocked while it was started
        signal.pthread_sigmask(signal.SIG_UNBLOCK, terminal_signals())
    signal.signal(signal.SIGTERM, _stop)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    if of_main_thread and sys.platform == "linux":
        _have_kernel_end_it()
    warnings.simplefilter("ignore")  # what a worker reports is in its answer
    logging.getLogger().addHandler(logging.NullHandler())
    from ...pixels import warp  # noqa: F401 imported now, so that it does not count for the first job's time
    from ..pictures import image_files  # noqa: F401


def run_bundle(payloads: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Run jobs one after another; start none after `RETURN_SECONDS` seconds. Return the answers of those that were
    run."""
    end, answers = time.monotonic() + RETURN_SECONDS, list[dict[str, Any]]()
    while len(answers) < len(payloads) and (not answers or time.monotonic() < end):
        answers.append(run_job(payloads[len(answers)]))
    return answers


def run_job(payload: dict[str, Any]) -> dict[str, Any]:
    """Run one job and return its result; only a dying process returns none.

    Args:
        payload: `job` as JSON, `threads`, `folder` (the current directory of relative paths), and the limit in
            `seconds`.
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
    from ..figure_table import BATCH_FIGURES
    from . import commands

    with deadline.limited(payload.get("seconds", deadline.DEFAULT_SECONDS)):
        outcome = commands.run(commands.job_of(payload["job"]), payload["threads"])
    return {
        "status": "timeout" if outcome.report.get("not_written") else "done" if outcome.ok else "poor",
        "message": outcome.message,
        "outputs": [{"path": path, "sha256": files.sha256(path)} for path in outcome.written],
        "figures": {k: v for k, v in outcome.report.items() if k in BATCH_FIGURES},
        "notes": _first_notes(outcome.notes),
        "idle": list(outcome.idle),
    }


def _first_notes(notes: tuple[str, ...]) -> list[str]:
    """Return the first notes, since a drawing with a thousand strokes would otherwise flood the results."""
    return [
        *notes[:KEPT_NOTES],
        *([f"and {len(notes) - KEPT_NOTES} more"] if len(notes) > KEPT_NOTES else []),
    ]


def _failure(error: Exception) -> dict[str, Any]:
    """Return the messages that the command line shows, without importing it."""
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
        os._exit(128 + signal.SIGTERM)  # there is nothing to clean up, and nobody to catch an exception
    raise Stopped


def _end_with_parent() -> None:
    """End with the parent, however that ends; otherwise an orphan would wait for jobs forever."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os.kill(os.getpid(), signal.SIGTERM)
        time.sleep(GRACE_SECONDS)
        os._exit(1)


def _have_kernel_end_it() -> None:
    """Let Linux end this process soon after its parent, even in native code that holds Python's global lock.

    SIGUSR1 is sent when the thread that started the process ends. Its handler is C's `alarm`, which takes the number of
    the signal as seconds: after ten seconds (sixteen on MIPS), SIGALRM ends the process if it still exists.
    """
    libc = ctypes.CDLL(None)
    libc.signal.argtypes = [ctypes.c_int, ctypes.c_void_p]
    libc.signal(signal.SIGUSR1, ctypes.cast(libc.alarm, ctypes.c_void_p))
    libc.prctl(PR_SET_PDEATHSIG, signal.SIGUSR1, 0, 0, 0)
