"""`iccm batch`."""

from __future__ import annotations

import gc
import json
import logging
import os
import signal
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import click

from ..errors import InputError
from ..io.options import of_command, options_of
from . import logs, options, process, status
from .options import FILE

if TYPE_CHECKING:
    from ..io.batch.digest import Digest

OWN = of_command("batch").keys()
PASSED_ON = tuple(
    name for name, (_, option) in options_of().items() if "map" in option.commands and name not in OWN
)
"""Options of `iccm map` that apply to jobs whose files are named on the command line."""


class BatchCommand(options.Command):
    """The command `iccm batch`, with a manifest or with source files."""

    missing = (
        "name source files and a target (iccm batch 'icons/*.svg' shield.svg -o "
        "'out/{source.stem}.png'), or a manifest (iccm init writes an example)"
    )
    passed_on = PASSED_ON
    shown_of_passed_on = MappingProxyType(
        {
            "output": "File for each job, such as 'out/{source.stem}.png', or a folder, such as out/.",
            "texture": "",
            "size": "",
        }
    )


@click.command("batch", cls=BatchCommand)
@click.argument("jobs", type=FILE, nargs=-1, required=True, metavar="MANIFEST | SOURCES... TARGET")
@options.of("batch", *PASSED_ON)
def command(jobs: tuple[str, ...], root: str | None, dry_run: bool, **arguments: Any) -> int:
    """Run the jobs of a MANIFEST, or map each of SOURCES onto TARGET.

    SOURCES are files, patterns ('icons/*.svg', in quotes) or folders, and TARGET may be a pattern, too; options of
    `iccm map` apply to all of them. The name after -o contains {source.stem} or {target.stem}, or is a folder. For
    anything more complex write a manifest (TOML, or JSON Lines; - for stdin); `iccm init` writes an example:

    \b
    [defaults]
    texture = "petals.jpg"
    output = "out/{source.stem}-{target.stem}.png"
    [[job]]
    source = "icons/*.svg"
    target = "shield.svg"

    On a terminal each result is one line of text; otherwise it is one line of JSON on stdout. A job that fails is
    reported, and the other jobs continue.

    \b
    iccm batch 'icons/*.svg' shield.svg -o 'out/{source.stem}.svg'
    iccm batch heart.svg 'icons/*.svg' -o 'out/{target.stem}.svg'
    iccm batch icons shield.svg --size 256 -o out/
    iccm batch jobs.toml --root out
    iccm batch jobs.toml --resume | jq -r 'select(.status != "done") | .name'

    Exit code: 0 all jobs done, 1 some failed or are not good enough, 2 wrong input, 129, 130 or 143 stopped by a
    signal.
    """
    from ..io import files
    from ..io.batch import dispatch, overview
    from ..io.batch.digest import Digest
    from ..io.batch.journal import Journal

    gc.enable()  # it runs for a long time

    if arguments["html"]:
        files.check_output(arguments["html"], force=True)
    job_arguments = {name: arguments.pop(name) for name in PASSED_ON}
    job_options = options.values(
        {name: value for name, value in job_arguments.items() if value not in ((), False)}
    )
    name = jobs[0] if len(jobs) == 1 else "batch"
    if len(jobs) > 1:
        folder = Path(root if root is not None else ".")
        tasks = _from_patterns(jobs, job_options, folder, force=arguments["force"])
        folder = Path(files.common_folder([os.path.dirname(path) for path in _outputs(tasks)] or ["."]))
        if not dry_run:
            files.make_folder(folder)
    elif job_options or os.path.isdir(name) or _is_shape(name):
        raise InputError(_lacking(name, job_options))
    else:
        folder = Path(root if root is not None else os.path.dirname(name) or ".")
        tasks = _tasks(name, folder, outside=arguments["allow_outside"], force=arguments["force"])
    book = Journal(folder)
    if (
        arguments["resume"]
        and not dry_run
        and (swept := book.sweep(path for task in tasks for path in task.job.outputs))
    ):
        logs.log.info(f"removed {len(swept)} temporary files left by a batch that was killed")
    tasks = dispatch.prepare(tasks, book, resume=arguments["resume"], make=not dry_run)
    if dry_run:
        logs.log.info(f"{len(tasks)} jobs checked, no errors")
        return 0
    policy = dispatch.Policy(
        arguments["retries"], arguments["timeout"], arguments["fail_fast"], arguments["threads"]
    )
    start = time.perf_counter()
    with caught_signals() as caught, _pool(len(tasks), arguments) as pool:
        watch = {"resume": arguments["resume"], "warn": logs.log.warning}
        watch["stopping"] = lambda: bool(caught) or process.unread()
        results: list[dict[str, Any]] | None = [] if arguments["html"] else None
        digest = Digest({task.number: task for task in tasks})
        counts, idle = _report(
            dispatch.execute(tasks, pool, book, policy, **watch), len(tasks), results, digest
        )
    if results is not None:
        page = overview.html(results, name, os.path.dirname(arguments["html"]) or ".")
        files.write_bytes(arguments["html"], page, force=True)
    _summary(counts, time.perf_counter() - start)
    if caught:
        return 128 + caught[0]
    return 0 if set(counts) <= {"done", "unchanged"} and not idle else 1


def _tasks(jobs: str, folder: Path, *, outside: bool, force: bool) -> list[Any]:
    from ..io.batch import manifest

    try:
        text = sys.stdin.read() if jobs == "-" else manifest.load(jobs)
    except UnicodeDecodeError as error:
        raise InputError(f"-: stdin is not UTF-8 (byte {error.start}); pass the manifest as UTF-8") from None
    tasks = manifest.read(text, jobs, root=folder, outside=outside, tell=logs.log.warning)
    if not force:
        return tasks
    return [task.with_job(task.job.model_copy(update={"force": True})) for task in tasks]


def _from_patterns(names: tuple[str, ...], values: dict[str, Any], folder: Path, *, force: bool) -> list[Any]:
    from ..io.batch import manifest

    *sources, target = names
    return manifest.from_patterns(sources, target, values | ({"force": True} if force else {}), root=folder)


def _outputs(tasks: list[Any]) -> list[str]:
    return [os.path.abspath(path) for task in tasks for path in task.job.outputs]


def _is_shape(name: str) -> bool:
    """Return whether a name is that of a drawing, a picture or a mesh, and therefore not of a manifest."""
    from ..io import formats

    format = formats.of(name)
    return bool(format.drawing or format.picture or format.mesh)


def _lacking(name: str, job_options: dict[str, Any]) -> str:
    """Explain what to do about a single name that is not a manifest, or options that belong in the manifest."""
    if job_options and (name.endswith((".toml", ".jsonl", ".json")) or name == "-"):
        option = next(iter(job_options))
        return (
            f"--{option.replace('_', '-')}: not an option for a manifest; add {option} = … to "
            f"[defaults] in {name}"
        )
    kind = "is a folder" if os.path.isdir(name) else "is not a manifest"
    return f"{name}: {kind}; to map it, add a target: iccm batch '{name}' shield.svg -o 'out/{{source.stem}}.png'"


@contextmanager
def _pool(count: int, arguments: dict[str, Any]) -> Iterator[Any]:
    from ..io.batch import pools

    if arguments["dask"]:
        # A job that waits at a worker would lose time to --timeout, and begin after a failure.
        prompt = arguments["timeout"] is not None or arguments["fail_fast"]
        with closing(pools.Dask(arguments["dask"], ahead=not prompt)) as cluster:
            yield cluster
    else:
        with processes(count, arguments["workers"], arguments["threads"]) as pool:
            yield pool


@contextmanager
def processes(count: int, workers: int | None, threads: int) -> Iterator[Any]:
    """Open a pool of processes for a number of jobs.

    Args:
        count: number of jobs, and the largest number of processes.
        workers: number of processes; None for one per core.
        threads: threads of each process.
    """
    from ..io.batch import pools

    with closing(pools.Processes(max(1, min(workers or os.cpu_count() or 1, count)), threads)) as pool:
        yield pool


@contextmanager
def caught_signals() -> Iterator[list[int]]:
    """Collect the signals that ask to stop while the block runs; a second Ctrl-C stops at once."""
    caught: list[int] = []
    process.leave_signals()

    def note(number: int, frame: object) -> None:
        if caught and number == signal.SIGINT:
            raise KeyboardInterrupt
        caught.append(number)

    ends = [
        getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK") if hasattr(signal, name)
    ]
    names = [name for name in ends if signal.getsignal(name) is not signal.SIG_IGN]  # as nohup has them
    _start_tracker()
    handlers: dict[signal.Signals, Callable | int | None] = {
        name: signal.signal(name, note) for name in names
    }
    try:
        yield caught
    finally:
        for name, handler in handlers.items():
            signal.signal(name, handler)


def _start_tracker() -> None:
    """Start the process that tracks the workers' semaphores so that it ignores SIGHUP, as it ignores Ctrl-C.
    Otherwise it ends with a traceback when the terminal is closed.
    """
    from multiprocessing import resource_tracker

    # If this process is killed, the tracker cleans up and prints a warning, unless it inherits this filter.
    sys.warnoptions.append("ignore:resource_tracker")
    if hasattr(signal, "SIGHUP"):
        handler = signal.signal(signal.SIGHUP, signal.SIG_IGN)
        resource_tracker.ensure_running()
        signal.signal(signal.SIGHUP, handler)


def _report(
    results: Iterator[dict[str, Any]],
    count: int,
    collected: list[dict[str, Any]] | None,
    digest: Digest,
) -> tuple[Counter[str], set[str]]:
    """Write results to stdout and to a list, problems, progress and a digest of the notes to stderr.

    Returns the number of jobs by status, and the options that have no effect in any of them.
    """
    from .. import progress
    from ..io.batch.dispatch import idle_in_all
    from ..io.run.report import as_json

    counts: Counter[str] = Counter()
    idle: set[str] | None = None
    people = sys.stdout.isatty()
    level = {"done": logging.DEBUG, "poor": logs.POOR_LEVEL, "cancelled": logging.DEBUG}
    with status.show_status():
        progress.tell("jobs", 0, count)
        for result in results:
            progress.tell("")
            if not people:
                sys.stdout.write(json.dumps(as_json(result), ensure_ascii=False) + "\n")
                sys.stdout.flush()
            elif result["status"] == "done":
                logs.log.info(_line(result))
            unchanged = result["resumed"] and result["status"] == "done"
            counts["unchanged" if unchanged else result["status"]] += 1
            idle = idle_in_all(idle, result)
            digest.add(result)
            if collected is not None:
                collected.append(result)
            tell = level.get(result["status"], logging.ERROR)
            extra = {"fields": {key: result[key] for key in ("job", "name", "status", "seconds")}}
            message = f"{result['place']}: {result['name']}: {result['status']}: {result['message']}"
            logs.log.log(tell, message, extra=extra)
    logs.explain_idle(idle or set())
    for line in digest.lines():
        logs.tell(line)
    return counts, idle or set()


def _line(result: dict[str, Any]) -> str:
    """Describe a completed job in one line: what it wrote, and how long it took."""
    paths = [entry["path"] for entry in result["outputs"]]
    others = f" and {len(paths) - 1} more" if len(paths) > 1 else ""
    took = "unchanged" if result["resumed"] else f"{result['seconds']:.1f} s"
    return f"{os.path.normpath(paths[0]) if paths else result['name']}{others}  {took}"


def _summary(counts: Counter[str], seconds: float) -> None:
    ways = ", ".join(f"{number} {status}" for status, number in counts.most_common()) or "nothing to do"
    extra = {"fields": {"counts": dict(counts), "seconds": round(seconds, 3)}}
    logs.log.info(f"{ways} in {seconds:.1f} s", extra=extra)
