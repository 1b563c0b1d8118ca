"""`iccm cartogram`."""

from __future__ import annotations

import time

import click

from . import logs, options, status
from .options import FILE


@click.command("cartogram", cls=options.Command)
@click.argument("regions", type=FILE)
@options.of("cartogram")
def command(
    regions: str,
    by: str,
    output: str,
    values: str | None,
    key: str | None,
    max_points: int,
    save: str | None,
    report: str | None,
    force: bool,
) -> int:
    """Write a map in which the area of each region is in proportion to a value, such as its population.

    REGIONS is GeoJSON or TopoJSON. All regions are mapped together, without folds, and shared borders stay shared.
    Longitudes and latitudes are projected to equal areas first; the crs of the output names the projection.

    \b
    iccm cartogram africa.geojson --by population -o people.geojson
    iccm cartogram africa.geojson --by trade --values table.csv -o out.json

    Exit code: 0 done, 1 the area of a region is off by more than 2 %, 2 wrong input.
    """
    from ..io import cartogram

    begin = time.perf_counter()
    with status.show_phases("cartogram"):
        result = cartogram.write(
            regions,
            output,
            by=by,
            values=values,
            key=key,
            max_points=max_points,
            save=save,
            report=report,
            force=force,
            tell=logs.log.warning,
        )
    seconds = time.perf_counter() - begin
    logs.log.info(f"wrote {output}")
    error, is_sound = result.errors, result.folds == 0
    is_met = error.max() <= cartogram.LARGEST_ERROR_SHARE
    folds = "no folds" if is_sound else f"{result.folds} folds"
    figures = f"areas within {error.max():.2%} (mean {error.mean():.3%}) · {folds} · {seconds:.1f} s"
    (logs.log.info if is_met and is_sound else logs.log.warning)(f"{len(error)} regions · {figures}")
    return 0 if is_met and is_sound else 1
