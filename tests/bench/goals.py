"""Goals for the figures of benches, one line each, which `python -m tests.bench` repeats at its end."""

from collections.abc import Iterator

MARK = "GOAL"
GOALS = (  # beginnings of the lines, in the order in which they are listed
    "the first run",
    "imports beyond numpy",
    "balanced solve, 50%",
    "balanced solve, 90%",
    "time against outline vertices",
    "time against triangles",
    "coordinates, all inside",
    "coordinates, with the border",
    "whole warp by cv2.remap and encode, wall clock",
    "whole warp by cv2.remap and encode, CPU",
    "PNG encoding",
    "memory of 16384²",
    "large meshes: processor time",
    "large meshes: memory",
    "iccm map 1024²",
    "iccm map 4096²",
    "a job of a batch by gdalwarp's default, wall clock",
    "a job of a batch by gdalwarp's default, CPU",
    "time on Dask's two workers by that of -j 2, small jobs",
    "time on Dask's two workers by that of -j 2, usual jobs",
    "jobs lost with a worker",
    "many jobs, time",
    "many jobs, memory",
    "many jobs, journal",
    "many jobs, manifest",
)


def goal(name: str, value: float, most: float, unit: str = "") -> None:
    """Print whether a figure is at most its goal."""
    met = "met    " if value <= most else "NOT MET"
    print(f"{MARK} {met} {name}: {value:.3g} of at most {most:.3g}{unit and ' ' + unit}", flush=True)


def unmeasured(name: str, why: str) -> None:
    """Print why a figure is missing, for example because a peer is not installed."""
    print(f"{MARK} ?       {name}: {why}", flush=True)


def listed(output_lines: list[str]) -> Iterator[str]:
    """Yield every goal with the lines printed for it, or that there were none, and the number of goals met."""
    lines, all_of_them = [line.rstrip("\n") for line in output_lines], []
    for name in GOALS:
        goal_lines = [line for line in lines if _named(line, name)]
        all_of_them += goal_lines or [f"{MARK} ?       {name}: not measured in this run"]
    all_of_them += [line for line in lines if not any(_named(line, name) for name in GOALS)]
    yield from all_of_them
    yield f"{sum(line.startswith(f'{MARK} met') for line in all_of_them)} of {len(all_of_them)} met"


def _named(line: str, name: str) -> bool:
    return line[len(MARK) + len(" NOT MET ") :].startswith(name)
