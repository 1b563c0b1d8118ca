"""What very many jobs cost the process that hands them out: python -m tests.bench.many [--jobs 100000]

The jobs themselves are trivial: each writes a small file in the same process, so that what is measured is the
manifest, the journal, memory, and going on from a journal.
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
from iccm.io.run.report import plain

from .batch import jobs

FIGURES = {
    "boundary": {"hausdorff": 0.0123456789, "mean": 0.0012345678, "given": 0.00345678901},
    "dilatation": {"p50": 1.2345678901, "p95": 2.3456789012, "max": 3.4567890123},
    "log10_area": {"p05": -0.1234567890, "median": 0.0123456789, "p95": 0.2345678901},
    "injective": {"certified": True, "depth": 0.0, "share": 1.0, "zeros": 0, "obstacle": None},
}  # as long as those of a real job


class Trivial:
    """A pool that is done at once."""

    size = 2

    def submit(self, payload: dict) -> Future:
        """Write a few bytes."""
        path = payload["job"]["output"][0]
        Path(path).write_bytes(path.encode())
        outputs = [{"path": path, "sha256": files.sha256(path)}]
        future: Future = Future()
        future.set_result(
            {"status": "done", "message": "The energy has settled.", "outputs": outputs, "figures": FIGURES}
            | {"notes": [], "seconds": 0.0123}
        )
        return future

    def abandon(self, futures: list[Future]) -> None:
        """Nothing runs."""

    def close(self) -> None:
        """Nothing is open."""


def peak() -> float:
    """MiB that this process has held at most."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (2**20 if sys.platform == "darwin" else 2**10)


def hand_out(name: str, resume: bool) -> None:
    """Run a manifest as `iccm batch` does, and print what each part took."""
    root, clock = Path(name).parent / "out", [time.process_time()]
    said: dict[str, float] = {"MiB at first": peak()}

    def took(what: str) -> None:
        clock.append(time.process_time())
        said[f"s {what}"] = clock[-1] - clock[-2]
        said[f"MiB {what}"] = peak()

    tasks = manifest.read(manifest.load(name), name, root=root)
    took("manifest")
    book = Journal(root)
    book.sweep()
    took("journal")
    tasks = dispatch.prepared(tasks, book, resume=resume)
    took("outputs")
    for result in dispatch.execute(tasks, Trivial(), book, dispatch.Policy(), resume=resume):
        json.dumps(plain(result), ensure_ascii=False)
    took("jobs")
    print(json.dumps(said))


def table(rows: list[tuple[int, dict[str, float]]], what: str) -> None:
    """Seconds and memory against the number of jobs."""
    print(f"{what}: CPU-s for manifest, journal, outputs, jobs (ms a job); most MiB after each")
    for count, said in rows:
        parts = ("manifest", "journal", "outputs", "jobs")
        seconds = " ".join(f"{said[f's {part}']:8.2f}" for part in parts)
        memory = " ".join(f"{said[f'MiB {part}']:6.0f}" for part in parts)
        print(f"{count:8} {seconds} ({1000 * said['s jobs'] / count:.2f})   {memory}", flush=True)


def main() -> None:
    """Print the tables, for a tenth and for all."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--jobs", type=int, default=100_000)
    given = parser.parse_args()
    fresh, again, sizes = [], [], []
    for count in (given.jobs // 10, given.jobs):
        with tempfile.TemporaryDirectory() as name:
            path = jobs(Path(name), count)
            for rows, resume in ((fresh, False), (again, True)):
                line = [
                    sys.executable,
                    "-c",
                    f"from tests.bench.many import *; hand_out({str(path)!r}, {resume})",
                ]
                rows.append((count, json.loads(subprocess.run(line, capture_output=True, text=True).stdout)))
            sizes.append(
                (path.stat().st_size / count, (path.parent / "out" / manifest.JOURNAL).stat().st_size / count)
            )
    table(fresh, "from scratch")
    table(again, "with --resume, all done")
    print(f"bytes a job: {sizes[-1][0]:.0f} of the manifest, {sizes[-1][1]:.0f} of the journal")
    (few, small), (count, large) = fresh
    grown = np.log(
        sum(v for k, v in large.items() if k[0] == "s") / sum(v for k, v in small.items() if k[0] == "s")
    )
    print(f"time grows with the power {grown / np.log(count / few):.2f} of the jobs")


if __name__ == "__main__":
    main()
