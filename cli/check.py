"""`iccm check`."""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import Any

import click

from ..progress import tell
from . import logs, options, status
from .options import FILE

SHOWN_FAILURES = 5  # largest number of differences that are listed for a file


@click.command("check", cls=options.Command)
@click.argument("run", type=FILE)
@click.argument("baselines", type=FILE)
@options.of("check")
def command(run: str, baselines: str, update: bool, **arguments: Any) -> int:
    """Compare the results in the folder RUN with those in BASELINES, file by file.

    Pictures are compared by their largest and root mean square difference and their structural similarity, sizes and
    channels exactly; reports figure by figure; other files byte by byte. A missing or additional file is a regression.

    \b
    iccm batch jobs.toml --root out && iccm check out baselines --diff diff
    iccm check out baselines --html check.html --summary "$GITHUB_STEP_SUMMARY"
    iccm check out baselines --update --only 'bell*'

    Exit code: 0 no regression, 1 regressions, 2 wrong input.
    """
    if update:
        return _update(Path(run), Path(baselines), arguments["only"])
    return _check(Path(run), Path(baselines), arguments)


def _update(run: Path, baselines: Path, only: tuple[str, ...]) -> int:
    from ..io.check import regression

    new, removed = regression.update(run, baselines, only)
    logs.log.info(f"{len(new)} baselines stored in {baselines}, {len(removed)} removed")
    return 0


def _check(run: Path, baselines: Path, arguments: dict[str, Any]) -> int:
    from ..io import files
    from ..io.check import compare, regression, reports
    from ..io.run.report import as_json

    start = time.perf_counter()
    usual = baselines / regression.SETTINGS
    settings = usual if usual.is_file() else None
    if arguments["tolerances"]:
        settings = Path(arguments["tolerances"])
    for name in (arguments["junit"], arguments["html"], arguments["summary"]):
        if name and name != "-":
            files.check_output(name, force=True)
    with status.show_status():
        tell(f"compare {run} with {baselines}")
        verdicts = regression.check(run, baselines, compare.tolerances(settings), arguments["only"])
    for verdict in verdicts:
        _tell(verdict)
        if arguments["diff"] and not verdict.ok:
            path = regression.diff(verdict, run, baselines, Path(arguments["diff"]))
            logs.log.debug(f"wrote {path}" if path else f"{verdict.name}: no difference picture")
    if arguments["junit"]:
        xml = regression.junit(verdicts, time.perf_counter() - start)
        files.write_bytes(arguments["junit"], xml, force=True)
    if arguments["html"]:
        files.write_bytes(arguments["html"], reports.html(verdicts, run, baselines), force=True)
    if arguments["summary"]:
        with files.writing(arguments["summary"], force=True, suffix=".md") as path:
            path.write_text(reports.markdown(verdicts), encoding="utf-8")
    if arguments["json"]:
        for verdict in verdicts:
            click.echo(json.dumps(as_json(reports.record(verdict)), ensure_ascii=False))
    bad = sum(not verdict.ok for verdict in verdicts)
    logs.log.info(reports.summary(verdicts))
    return 1 if bad else 0


def _tell(verdict: Any) -> None:
    for note in verdict.notes:
        logs.tell(f"{verdict.name}: {note}")
    if verdict.ok:
        figures = ", ".join(f"{name} {value:.4g}" for name, value in verdict.figures.items())
        logs.log.debug(f"{verdict.name}: matches its baseline" + (f" ({figures})" if figures else ""))
    for problem in verdict.problems[:SHOWN_FAILURES]:
        logs.log.error(f"{verdict.name}: {problem}")
    if len(verdict.problems) > SHOWN_FAILURES:
        logs.log.error(f"{verdict.name}: and {len(verdict.problems) - SHOWN_FAILURES} more differences")
