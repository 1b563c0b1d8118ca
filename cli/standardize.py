"""`iccm standardize`."""

from __future__ import annotations

import gc
from collections import Counter
from typing import Any

import click

from . import logs, options, process, status
from .batch import caught_signals, processes
from .options import FILE


@click.command("standardize", cls=options.Command)
@click.argument("specimens", type=FILE, nargs=-1, required=True, metavar="SPECIMEN...")
@options.of("standardize")
def command(specimens: tuple[str, ...], workers: int | None, **arguments: Any) -> int:
    """Map specimens with landmarks onto their mean shape, and summarise their pictures there.

    SPECIMENs are pictures (whose silhouette or whole area is the outline), drawings, patterns in quotes, or folders.
    Landmarks are superimposed by generalised Procrustes analysis. The outline of the mean shape is the mean of the
    outlines between landmarks that lie on them. Each specimen is mapped onto it with its landmarks as pins.

    OUT then contains the mean shape (shape.svg, landmarks.csv), the pictures and maps of specimens in folders, their
    mean and standard deviation at each pixel (mean.png, mean.tif, spread.png, spread.tif, count.tif), and a table of
    figures (specimens.csv, report.json). A specimen that fails is reported, and the others continue.

    \b
    iccm standardize wings/*.jpg --landmarks landmarks -o OUT
    iccm standardize wings/*.jpg --landmarks wings.tps --reflect -o OUT
    iccm standardize leaves --landmarks 'lm/{stem}.csv' --reference leaf-7 -o OUT

    Exit code: 0 all specimens done, 1 some failed or are not good enough, 2 wrong input, 129, 130 or 143 stopped by a
    signal.
    """
    from ..io.standardize import run

    gc.enable()  # it runs for a long time
    plan = run.Plan(specimens, **arguments)
    with caught_signals() as caught, status.show_status():
        summary = run.run(
            plan,
            lambda count: processes(count, workers, plan.threads),
            tell=logs.log.warning,
            stopping=lambda: bool(caught) or process.unread(),
        )
    if caught:
        return 128 + caught[0]
    for row in summary.rows:
        if row["status"] != "done":
            logs.log.warning(f"{row['specimen']}: {row['status']}: {row['message']}")
    for name in summary.written:
        logs.log.info(f"wrote {name}")
    counts = Counter(row["status"] for row in summary.rows)
    logs.log.info(", ".join(f"{number} {word}" for word, number in counts.most_common()))
    return 0 if summary.ok else 1
