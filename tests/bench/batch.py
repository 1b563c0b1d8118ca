"""Batches: a local Dask cluster of two workers beside `-j 2`, a lost worker, speed-up, overhead, memory over many jobs.

python -m tests.bench.batch [dask | lost | workers | memory …] [--jobs 40] [--small 1000] [--chunks 4]

Throughput is measured between the first and the last result of a run, so that start-up does not count, and in
alternating chunks, so that other load on the machine affects both equally. Processor time is that of the command, its
workers, and Dask's scheduler; it hardly depends on the load.
"""

from __future__ import annotations

import argparse
import contextlib
import itertools
import json
import logging
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import psutil

from iccm.io.pictures import image_files

from .goals import goal, unmeasured

ICCM = str(Path(sys.executable).parent / "iccm")
SMALL = {"method": "paper", "vertices": 20, "max_iterations": 2, "size": 16, "texture": "t.png"}
DASK = "time on Dask's two workers by that of -j 2"
LOST = "jobs lost with a worker"


def drawing(points: np.ndarray) -> str:
    """Return an SVG of a polygon on a canvas of 100 by 100."""
    listed = " ".join(f"{z.real:.3f},{z.imag:.3f}" for z in points)
    return f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 100"><polygon points="{listed}"/></svg>'


def blob(seed: int) -> str:
    """Return an SVG with a smooth random shape."""
    rng = np.random.default_rng(seed)
    t = np.linspace(0, 2 * np.pi, 80, endpoint=False)
    r = 35 + sum(rng.normal() * 4 / k * np.cos(k * t + rng.uniform(0, 6)) for k in range(2, 6))
    return drawing(50 + 50j + r * np.exp(1j * t))


def jobs(folder: Path, count: int, **more: object) -> Path:
    """Write a manifest of `count` different jobs between random shapes, with usual options."""
    side = int(np.ceil(np.sqrt(count)))
    for n in range(side):
        (folder / f"{n}.svg").write_text(blob(n))
    pairs = itertools.islice(itertools.product(range(side), repeat=2), count)
    named = {"output": "{source.stem}-{target.stem}.png", **more}
    return listed(folder, [{"source": f"{a}.svg", "target": f"{b}.svg", **named} for a, b in pairs])


def small(folder: Path, count: int) -> Path:
    """Write a manifest of the fastest possible jobs: a square onto itself, 16 px, with a texture of 16 px."""
    (folder / "a.svg").write_text(drawing(np.array([0, 100, 100 + 100j, 100j])))
    image_files.write(folder / "t.png", image_files.Image(np.zeros((16, 16, 3), np.uint8)))
    job = {"source": "a.svg", "target": "a.svg", "output": "{number}.png", **SMALL}
    return listed(folder, [job] * count)


def listed(folder: Path, rows: list[dict]) -> Path:
    """Write a manifest with these jobs."""
    path = folder / "jobs.jsonl"
    path.write_text("\n".join(map(json.dumps, rows)))
    return path


@dataclass(frozen=True)
class Batch:
    """Measurements of a batch.

    Attributes:
        seconds: of the whole command, including start-up.
        steady: seconds per job between the first and the last result.
        used: processor time per job, for the same jobs.
        inside: total seconds of all jobs, as reported in their results.
        memory: MiB of the command and its workers over time.
    """

    seconds: float
    steady: float
    used: float
    inside: float
    memory: list[float]


def run(manifest: Path, *options: str, cluster: Any = None) -> Batch:
    """Run a manifest on local workers, or on a cluster."""
    root, given = manifest.parent / "out", len(manifest.read_text().splitlines())
    memory, ended, results, start = [], [], [], time.perf_counter()
    with command(manifest, root, *options) as process:
        threading.Thread(target=watch, args=(process.pid, memory), daemon=True).start()
        for number, line in enumerate(process.stdout, 1):
            ended.append(time.perf_counter())
            results.append(json.loads(line))
            if number == 1:
                before = processor_time(process.pid, cluster)
            elif number == given:
                used = processor_time(process.pid, cluster) - before
    seconds = time.perf_counter() - start
    shutil.rmtree(root)
    assert all(result["status"] in ("done", "poor") for result in results), results[0]
    count = len(results) - 1
    inside = sum(result["seconds"] for result in results)
    return Batch(seconds, (ended[-1] - ended[0]) / count, used / count, inside, memory)


def command(manifest: Path, root: Path, *options: str) -> subprocess.Popen:
    """Start `iccm batch`."""
    line = [ICCM, "batch", str(manifest), "--root", str(root), *options, "-q"]
    return subprocess.Popen(line, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)


def processor_time(pid: int, cluster: Any) -> float:
    """Return the CPU-seconds so far of a command and its workers, or of a cluster and this process, its scheduler."""
    command = psutil.Process(pid)
    running = [command, *command.children(recursive=True)]
    if cluster:
        running += [psutil.Process(), *(psutil.Process(w.process.pid) for w in cluster.workers.values())]
    times = [process.cpu_times() for process in running]
    return sum(used.user + used.system for used in times)


def watch(pid: int, memory: list[float]) -> None:
    """Record the memory of a process and its descendants until it ends, with shared memory split among them."""
    with contextlib.suppress(psutil.NoSuchProcess):
        process = psutil.Process(pid)
        while process.is_running():
            memory.append(sum(map(memory_mib, [process, *process.children(recursive=True)])))
            time.sleep(0.25)


def memory_mib(process: psutil.Process) -> float:
    """Return the memory of a process in MiB."""
    with contextlib.suppress(psutil.Error):
        memory = process.memory_full_info()
        return getattr(memory, "pss", memory.uss) / 2**20
    return 0.0


@contextlib.contextmanager
def two_workers() -> Iterator[Any]:
    """Start a local Dask cluster of two workers."""
    from distributed import LocalCluster

    quiet = {"dashboard_address": "127.0.0.1:0", "silence_logs": logging.CRITICAL}
    with LocalCluster(n_workers=2, threads_per_worker=1, processes=True, **quiet) as cluster:
        yield cluster


def compare_with_dask(
    make_manifest: Callable[[Path, int], Path], count: int, chunks: int, title: str
) -> float:
    """Return the time of a Dask cluster of two workers relative to `-j 2`: the median of alternating runs."""
    with tempfile.TemporaryDirectory() as name, two_workers() as cluster:
        ways = {"-j": ("-j", "2"), "dask": ("--dask", cluster.scheduler_address)}
        run(make_manifest(Path(name), 8), *ways["dask"], cluster=cluster)  # lets the workers import
        manifest = make_manifest(Path(name), count // chunks)
        rounds = []
        for number in range(chunks):
            names = list(ways)[:: 1 if number % 2 else -1]
            rounds.append({name: run(manifest, *ways[name], cluster=cluster) for name in names})
    ratios = [round["dask"].steady / round["-j"].steady for round in rounds]
    print(
        f"{title}, by turns, milliseconds a job between the first result and the last; processor time a job"
    )
    for name, label in (("-j", "-j 2"), ("dask", "Dask, two workers")):
        wall, used = (np.array([getattr(r[name], key) for r in rounds]) * 1e3 for key in ("steady", "used"))
        seconds = " ".join(f"{value:.1f}" for value in wall)
        print(f"  {label:18} {np.median(wall):7.1f} ({seconds}); {np.median(used):7.1f}")
    print(f"  Dask by -j 2, run by run: {' '.join(f'{ratio:.3f}' for ratio in ratios)}", flush=True)
    return float(np.median(ratios))


def dask(options: argparse.Namespace) -> None:
    """Measure the throughput of small and of usual jobs."""
    description = f"{options.small} small jobs (a square onto itself, 16 px)"
    goal(f"{DASK}, small jobs", compare_with_dask(small, options.small, options.chunks, description), 1 / 0.9)
    description = f"{options.jobs} usual jobs (blobs, balanced, 1024²)"
    goal(f"{DASK}, usual jobs", compare_with_dask(jobs, options.jobs, options.chunks, description), 1 / 0.9)


def lost(options: argparse.Namespace) -> None:
    """Count the jobs that are not done when one of two workers of a Dask cluster is killed while they run."""
    with tempfile.TemporaryDirectory() as name, two_workers() as cluster:
        manifest, ended = small(Path(name), 100), []
        with command(manifest, Path(name) / "out", "--dask", cluster.scheduler_address) as process:
            for line in process.stdout:
                ended.append(json.loads(line)["status"])
                if len(ended) == 25:
                    os.kill(cluster.workers[0].process.pid, signal.SIGKILL)
    done = sum(status in ("done", "poor") for status in ended)
    print(f"100 small jobs on Dask, one of two workers killed after 25: {done} done")
    goal(LOST, 100 - done, 0)


def workers(options: argparse.Namespace) -> None:
    """Compare two workers with one, and with the same work in one process without a batch."""
    with tempfile.TemporaryDirectory() as name:
        manifest = jobs(Path(name), options.jobs)
        single, double = run(manifest, "-j", "1"), run(manifest, "-j", "2")
        base = alone(manifest)
    per = 1000 / options.jobs
    print(f"{options.jobs} usual jobs: {single.seconds:.1f} s on one worker, {double.seconds:.1f} s on two")
    print(f"  {single.steady / double.steady:.2f} x as fast between the first result and the last")
    print(
        f"  one process without a batch {base:.1f} s; more in a batch {per * (single.seconds - base):.1f} ms a job,"
    )
    print(
        f"  of which outside the job itself {per * (single.seconds - single.inside):.1f} ms (start-up included)"
    )


def alone(manifest: Path) -> float:
    """Return the seconds for the same work in one process without a batch, not counting imports."""
    code = (
        "import sys, time, pathlib, os\n"
        "os.environ.update(OPENBLAS_NUM_THREADS='1', OMP_NUM_THREADS='1')\n"
        "from iccm.io import run\nfrom iccm.io.batch import manifest\n"
        "name, root = sys.argv[1], pathlib.Path(sys.argv[2])\n"
        "root.mkdir()\n"
        "tasks = manifest.read(manifest.load(name), name, root=root)\n"
        "run.run(tasks[0].job.model_copy(update={'force': True}), threads=1)\n"
        "start = time.perf_counter()\n"
        "for task in tasks: run.run(task.job.model_copy(update={'force': True}), threads=1)\n"
        "print(time.perf_counter() - start)\n"
    )
    line = [sys.executable, "-c", code, str(manifest), str(manifest.parent / "alone")]
    return float(subprocess.run(line, capture_output=True, text=True, check=True).stdout)


def memory(options: argparse.Namespace) -> None:
    """Measure the memory of all processes over many small jobs: it should not grow."""
    with tempfile.TemporaryDirectory() as name:
        batch_run = run(small(Path(name), min(options.small, 2000)), "-j", "2")
    tenths = [
        max(part) for part in np.array_split(batch_run.memory[len(batch_run.memory) // 10 :], 9) if len(part)
    ]
    print(
        f"{min(options.small, 2000)} small jobs in {batch_run.seconds:.0f} s; MiB of all processes, from a tenth on:"
    )
    print("  " + " ".join(f"{value:.0f}" for value in tenths), flush=True)


def main() -> None:
    """Print the tables."""
    parts = {part.__name__: part for part in (dask, lost, workers, memory)}
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("parts", nargs="*", help=f"{', '.join(parts)}; all of them by default")
    parser.add_argument("--jobs", type=int, default=40, help="usual jobs")
    parser.add_argument("--small", type=int, default=1000, help="small jobs")
    parser.add_argument("--chunks", type=int, default=4, help="runs that either is divided into")
    options = parser.parse_args()
    for name in options.parts or parts:
        try:
            parts[name](options)
        except ImportError as error:
            print(f"{name}: left out: {error}")
            for missed in {"dask": (DASK,), "lost": (LOST,)}.get(name, ()):
                unmeasured(missed, str(error))


if __name__ == "__main__":
    main()
