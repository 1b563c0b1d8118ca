"""Cost of very many jobs for the process that distributes them: python -m tests.bench.many [--jobs 100000]

The jobs are trivial: each writes a small file in the same process. So the manifest, the journal, memory, and resuming
from a journal are measured.
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
import tempfile
import time
from concurrent.futures import Future
from pathlib import Path

import numpy as np

from iccm.io import files
from iccm.io.batch import dispatch, manifest
from iccm.io.batch.journal import Journal
from iccm.io.run.report import as_json

from .batch import jobs
from .goals import goal

FIGURES = {
    "boundary": {"hausdorff": 0.0123456789, "mean": 0.0012345678, "given": 0.00345678901},
    "dilatation": {"p50": 1.2345678901, "p95": 2.3456789012, "max": 3.4567890123},
    "log10_area": {"p05": -0.1234567890, "median": 0.0123456789, "p95": 0.2345678901},
    "injective": {"certified": True, "depth": 0.0, "share": 1.0, "zeros": 0, "obstacle": None},
}  # as long as those of a real job


class Trivial:
    """A pool whose jobs are done immediately."""

    size, ahead, runs_again = 2, 0, False

    def together(self, left: int) -> int:
        """Return 1."""
        return 1

    def submit(self, payloads: list[dict]) -> Future:
        """Write a few bytes."""
        path = payloads[0]["job"]["output"][0]
        Path(path).write_bytes(path.encode())
        outputs = [{"path": path, "sha256": files.sha256(path)}]
        future: Future = Future()
        future.set_result(
            [
                {"status": "done", "message": "The energy has settled.", "outputs": outputs}
                | {"figures": FIGURES, "notes": [], "seconds": 0.0123}
            ]
        )
        return future

    def abandon(self, futures: list[Future]) -> None:
        """Do nothing."""

    def close(self) -> None:
        """Do nothing."""


def peak() -> float:
    """Return the peak memory of this process in MiB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (2**20 if sys.platform == "darwin" else 2**10)


def hand_out(name: str, resume: bool) -> None:
    """Run a manifest as `iccm batch` does, and print the time of each part."""
    root, clock = Path(name).parent / "out", [time.process_time()]
    figures: dict[str, float] = {"MiB at first": peak()}

    def took(stage: str) -> None:
        clock.append(time.process_time())
        figures[f"s {stage}"] = clock[-1] - clock[-2]
        figures[f"MiB {stage}"] = peak()

    tasks = manifest.read(manifest.load(name), name, root=root)
    took("manifest")
    book = Journal(root)
    book.sweep()
    took("journal")
    tasks = dispatch.prepare(tasks, book, resume=resume)
    took("outputs")
    for result in dispatch.execute(tasks, Trivial(), book, dispatch.Policy(), resume=resume):
        json.dumps(as_json(result), ensure_ascii=False)
    took("jobs")
    print(json.dumps(figures))


def table(rows: list[tuple[int, dict[str, float]]], title: str) -> None:
    """Print seconds and memory against the number of jobs."""
    print(f"{title}: CPU-s for manifest, journal, outputs, jobs (ms a job); most MiB after each")
    for count, figures in rows:
        parts = ("manifest", "journal", "outputs", "jobs")
        seconds = " ".join(f"{figures[f's {part}']:8.2f}" for part in parts)
        memory = " ".join(f"{figures[f'MiB {part}']:6.0f}" for part in parts)
        print(f"{count:8} {seconds} ({1000 * figures['s jobs'] / count:.2f})   {memory}", flush=True)


def main() -> None:
    """Print the tables, for a tenth of the jobs and for all."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--jobs", type=int, default=100_000)
    options = parser.parse_args()
    fresh, again, sizes = [], [], []
    for count in (options.jobs // 10, options.jobs):
        with tempfile.TemporaryDirectory() as name:
            path = jobs(Path(name), count)
            journal = path.parent / "out" / manifest.JOURNAL
            fresh.append((count, measured(path, False)))
            again.append((count, measured(path, True)))
            sizes.append((path.stat().st_size / count, journal.stat().st_size / count))
    table(fresh, "from scratch")
    table(again, "with --resume, all done")
    print(f"bytes a job: {sizes[-1][0]:.0f} of the manifest, {sizes[-1][1]:.0f} of the journal")
    goals(fresh, sizes[-1][1])


def measured(path: Path, resume: bool) -> dict[str, float]:
    """Measure a manifest in its own process."""
    line = [sys.executable, "-c", f"from tests.bench.many import *; hand_out({str(path)!r}, {resume})"]
    return json.loads(subprocess.run(line, capture_output=True, text=True, check=True).stdout)


def goals(rows: list[tuple[int, dict[str, float]]], journal: float) -> None:
    """Print the ratio for ten times as many jobs, since a million is ten times more."""
    (few, some), (count, all_of_them) = rows
    spent = [sum(v for k, v in figures.items() if k.startswith("s ")) for figures in (some, all_of_them)]
    grown = np.log(spent[1] / spent[0]) / np.log(count / few)
    kib_per_job = (all_of_them["MiB jobs"] - some["MiB jobs"]) * 1024 / (count - few)
    print(
        f"for each job more {kib_per_job:.2f} KiB in the process, {1e3 * spent[1] / count:.2f} ms of processor time"
    )
    goal(f"many jobs, time, exponent from {few:,} to {count:,}", grown, 1.05)
    goal("many jobs, memory of the process, a job", kib_per_job, 2, "KiB")
    goal("many jobs, journal, a job", journal / 1024, 1, "KiB")
    goal("many jobs, manifest read, a job", 1e3 * all_of_them["s manifest"] / count, 0.5, "CPU-ms")


if __name__ == "__main__":
    main()
