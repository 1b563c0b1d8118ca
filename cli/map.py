"""`iccm map`."""

from __future__ import annotations

import gc
import os
import sys
import time
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import click

from .. import deadline
from ..errors import IccmError, InputError
from . import logs, options, status
from .logs import explain
from .options import FILE

WATCH_SECONDS = 0.3  # seconds between two checks of the inputs
Stamps = dict[str, tuple[int, int] | None]


class MapCommand(options.Command):
    """The command `iccm map`, which takes two files."""

    several = (
        "iccm map takes one SOURCE and one TARGET; to map many sources, run: iccm batch 'icons/*.svg' "
        "TARGET -o 'out/{source.stem}.png' (with the quotes)"
    )


@click.command("map", cls=MapCommand)
@click.argument("source", type=FILE, required=False, metavar="SOURCE")
@click.argument("target", type=FILE, required=False, metavar="TARGET")
@options.of("map")
def command(
    text: str | None,
    target_text: str | None,
    font: str | None,
    font_variation: str | None,
    **arguments: Any,
) -> int:
    """Map the shape SOURCE onto the shape TARGET and carry a texture through the map.

    SOURCE and TARGET are files (SVG, a picture with a silhouette, OBJ, GLB, GeoJSON, DXF), or file#id for one element
    of a file; or an object to show a picture on, such as cylinder:82x95. --text or --target-text sets a text in place
    of one of them. Coordinates are in the files' own units. Without -o, a picture named after both files is written to
    the current folder.

    \b
    iccm map rose.svg leaf.svg
    iccm map rose.svg leaf.svg --texture petals.jpg -o rose-leaf.png --size 2048
    iccm map rose.svg leaf.svg --pin 256,256:256,300 --pin 256,80:256,80
    iccm map rose.svg leaf.svg -o rose-leaf.svg -o rose-leaf.npz
    iccm map --text Hello leaf.svg --fit box -o hello-leaf.svg

    A logo on a mug that stays visible, the texture of one mesh on another, and a page in a photo, made flat by its
    corners:

    \b
    iccm map badge.svg mug.svg#body --background target -o badge-mug.png
    iccm map old.obj new.obj -o new-textured.obj
    iccm map page.png#plane=155,15:360,95:260,130:65,40 sheet:300x50 -o flat.png

    The label of a bottle is unrolled by its diameter x height and six points of its edges:

    \b
    iccm map bottle.jpg#cylinder=82x95:12,8:20,11:28,8:27,22:20,24:14,22 sheet

    Exit code: 0 done, 1 the result is not good enough, 2 wrong input.
    """
    shapes = _shapes(arguments["source"], arguments["target"], text, target_text, font, font_variation)
    return execute(arguments | shapes)


def _shapes(
    source: str | None,
    target: str | None,
    text: str | None,
    target_text: str | None,
    font: str | None,
    variation: str | None,
) -> dict[str, str]:
    """Return the specs of both shapes, where texts take the place of files.

    Raises:
        click.UsageError: there are too few or too many files.
        InputError: there is no such font.
    """
    if font is not None and text is None and target_text is None:
        raise InputError("--font: only works with --text or --target-text")
    if variation is not None and font is None:
        raise InputError("--font-variation: needs a variable font; name its file with --font")
    files = [file for file in (source, target) if file is not None]
    needed = [name for name, value in (("SOURCE", text), ("TARGET", target_text)) if value is None]
    if len(files) < len(needed):
        missing = f"Missing argument '{needed[len(files)]}'."
        if not files and text is not None:
            missing += f" --text is the source; to fill letters with a picture, use --target-text {text!r}."
        raise click.UsageError(missing, click.get_current_context())
    if len(files) > len(needed):
        options = [
            name for name, value in (("--text", text), ("--target-text", target_text)) if value is not None
        ]
        raise InputError(
            f"{files[len(needed)]}: too many files; leave it out, because {' and '.join(options)} "
            f"{'take their places' if not needed else 'takes its place'}"
        )
    from ..io.outlines import lettering

    return {
        "source": files.pop(0) if text is None else lettering.spec(text, font, variation),
        "target": files.pop(0) if target_text is None else lettering.spec(target_text, font, variation),
    }


def execute(arguments: dict[str, Any]) -> int:
    """Run the job of these options, report on stderr, and return the exit code; with --watch, repeat it."""
    limit = deadline.current()
    seconds = limit.seconds if limit else None  # for each map
    run_options = {
        name: arguments.pop(name, None) for name in ("threads", "dry_run", "watch", "open", "resume")
    }
    if arguments.get("sequence"):
        return _sequence(arguments, run_options, seconds)
    if run_options["resume"]:
        raise InputError("--resume: only works with --sequence")
    if not run_options["watch"]:
        return _run(arguments, run_options)[0]
    if arguments.get("constraints") == "-":
        raise InputError("--watch: stdin can be read only once; pass a file to --constraints")
    gc.enable()  # it runs long
    with deadline.limited(None):
        return _watch(arguments, run_options, seconds)


def _watch(arguments: dict[str, Any], run_options: dict[str, Any], seconds: float | None) -> int:
    """Run the job again whenever an input changes, with a time limit for each run."""
    with deadline.limited(seconds):
        code, stamps = _run(arguments, run_options)
    arguments["force"] = True  # its own files are replaced
    run_options["open"] = False  # viewers update automatically
    logs.log.info(f"watching {', '.join(stamps)}; press Ctrl-C to stop")
    try:
        while True:
            time.sleep(WATCH_SECONDS)
            new_stamps = _stamps(stamps)
            if new_stamps == stamps:
                continue
            while (later := _wait(new_stamps)) != new_stamps:  # it is still being written
                new_stamps = later
            try:
                with deadline.limited(seconds):
                    code, stamps = _run(arguments, run_options)
            except (IccmError, OSError) as error:
                code, stamps = explain(error), new_stamps
    except KeyboardInterrupt:
        return code


def _sequence(arguments: dict[str, Any], run_options: dict[str, Any], seconds: float | None) -> int:
    """Map frames one after another, each starting from the map of the previous one, and return the exit code."""
    from ..io import files
    from ..io.batch import dispatch, manifest, pools
    from ..io.batch.journal import Journal

    if used := [name for name in ("watch", "open") if run_options[name]]:
        raise InputError(f"--{used[0]}: cannot be combined with --sequence")
    tasks = manifest.frames(options.values(arguments), root=Path("."))
    folders = {os.path.dirname(os.path.abspath(name)) for task in tasks for name in task.job.outputs}
    os.makedirs(home := files.common_folder(folders), exist_ok=True)
    book = Journal(Path(home))
    tasks = dispatch.prepare(tasks, book, resume=run_options["resume"], make=not run_options["dry_run"])
    if run_options["dry_run"]:
        for name in (name for task in tasks for name in task.job.outputs):
            logs.log.info(f"would write {name}")
        return 0
    policy, failed = dispatch.Policy(threads=run_options["threads"], time_limit=seconds), False
    idle: set[str] | None = None
    with status.show_status(), deadline.limited(None):
        watch = {"resume": run_options["resume"], "warn": logs.log.warning}
        for result in dispatch.execute(tasks, pools.InProcess(), book, policy, **watch):
            failed |= result["status"] != "done"
            idle = dispatch.idle_in_all(idle, result)
            tell = logs.log.info if result["status"] == "done" else logs.log.error
            took = "unchanged" if result["resumed"] else f"{result['seconds']:.1f} s"
            tell(f"{result['name']}: {result['status']}, {took}: {result['message']}")
            for note in result["notes"]:
                logs.tell(f"{result['name']}: {note}")
    logs.explain_idle(idle or set())
    return int(failed or bool(idle))


def _run(arguments: dict[str, Any], run_options: dict[str, Any]) -> tuple[int, Stamps]:
    """Return the exit code of a run, and the files that it read with their state before the run."""
    with status.show_status() as listener:
        from ..io.run.execute import run
        from ..io.run.job import make
        from ..maps.summary import in_short, summary
        from ..status import ROUTINE

        job, dry = make(options.values(arguments)), run_options["dry_run"]
        stamps = _stamps(job.inputs)
        outcome = run(
            job, threads=run_options["threads"], tell=logs.tell, listener=listener, dry=dry, again=True
        )
    read = _stamps(entry["path"] for entry in outcome.report.get("inputs", [])) | stamps
    for line in summary(outcome.report):
        logs.log.debug(line)
    if dry:
        for name in outcome.written:
            logs.log.info(f"would write {name}")
        return 0, read
    for name in outcome.written[1:]:
        logs.log.info(f"wrote {name}")
    logs.log.info("  ".join([*outcome.written[:1], in_short(outcome.report)]))
    if run_options["open"]:
        _show(outcome.written)
    if not outcome.ok:
        logs.log.error(outcome.message)
    elif outcome.message not in ROUTINE:
        logs.log.info(outcome.message)
    return int(not outcome.ok), read


def _stamps(paths: Iterable[str]) -> Stamps:
    """Return modification time and size of each file; None for files that do not exist."""
    stamps = Stamps()
    for path in paths:
        try:
            state = os.stat(path)
            stamps[path] = state.st_mtime_ns, state.st_size
        except OSError:
            stamps[path] = None
    return stamps


def _wait(stamps: Stamps) -> Stamps:
    time.sleep(WATCH_SECONDS)
    return _stamps(stamps)


def _show(written: Sequence[str]) -> None:
    """Open the first file in the system's viewer, or report why that is not possible."""
    if not written:
        logs.log.warning("--open: no file was written")
        return
    display = (
        sys.platform in ("darwin", "win32") or "DISPLAY" in os.environ or "WAYLAND_DISPLAY" in os.environ
    )
    if not display or click.launch(written[0]):
        lacks = "no program for this type of file was found" if display else "this computer has no display"
        logs.log.warning(f"--open: cannot show {written[0]}: {lacks}")
