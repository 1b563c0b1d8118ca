"""Batches: speed-up of two workers over one, overhead a job, memory over many jobs.

python -m tests.bench.batch [--jobs 200] [--many 2000] [--rounds 2]
"""

from __future__ import annotations

import argparse
import itertools
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

import numpy as np

from .goals import goal

ICCM = str(Path(sys.executable).parent / "iccm")
OPTIONS = {"method": "paper", "vertices": 60, "max_iterations": 20}


def blob(seed: int) -> str:
    """An SVG with a smooth random shape."""
    rng = np.random.default_rng(seed)
    t = np.linspace(0, 2 * np.pi, 80, endpoint=False)
    r = 35 + sum(rng.normal() * 4 / k * np.cos(k * t + rng.uniform(0, 6)) for k in range(2, 6))
    points = " ".join(f"{50 + a * np.cos(s):.3f},{50 + a * np.sin(s):.3f}" for a, s in zip(r, t))
    return f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 100"><polygon points="{points}"/></svg>'


def jobs(folder: Path, count: int, **more: object) -> Path:
    """A manifest of `count` different jobs."""
    side = int(np.ceil(np.sqrt(count)))
    for n in range(side):
        (folder / f"{n}.svg").write_text(blob(n))
    rows: list[dict] = [{"defaults": {**OPTIONS, **more}}]
    for a, b in itertools.islice(itertools.product(range(side), repeat=2), count):
        rows.append({"source": f"{a}.svg", "target": f"{b}.svg", "output": "{source.stem}-{target.stem}.png"})
    (folder / "jobs.jsonl").write_text("\n".join(map(json.dumps, rows)))
    return folder / "jobs.jsonl"


def folder(manifest: Path, where: int | str) -> Path:
    """Where outputs of so many workers, or of a cluster, go."""
    return manifest.parent / f"out{where}".replace(":", "-").replace("/", "-")


def batch(manifest: Path, workers: int | str) -> tuple[float, list[dict], list[int]]:
    """Seconds, results, and the memory in KiB of parent and workers over time; on so many workers, or on a cluster."""
    root = folder(manifest, workers)
    where = ["--dask", workers] if isinstance(workers, str) else ["-j", str(workers)]
    command = [ICCM, "batch", str(manifest), "--root", str(root), *where, "-q"]
    start = time.perf_counter()
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    memory: list[int] = []
    watcher = threading.Thread(target=_watch, args=(process, memory), daemon=True)
    watcher.start()
    out, _ = process.communicate()
    seconds = time.perf_counter() - start
    results = [json.loads(line) for line in out.splitlines()]
    assert all(result["status"] in ("done", "poor") for result in results), results[0]
    return seconds, results, memory


def _watch(process: subprocess.Popen, memory: list[int]) -> None:
    while process.poll() is None:
        memory.append(sum(map(resident, descendants(process.pid))))
        time.sleep(0.25)


def descendants(pid: int) -> list[int]:
    """Processes that come from `pid`, the process itself included."""
    parents = {}
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            parents[int(stat.parent.name)] = int(stat.read_text().rpartition(")")[2].split()[1])
        except OSError:
            continue
    found = [pid]
    for one in found:
        found += [child for child, parent in parents.items() if parent == one]
    return found


def resident(pid: int) -> int:
    """Memory of a process in KiB, of what it shares with others its share."""
    try:
        rollup = Path(f"/proc/{pid}/smaps_rollup").read_text()
    except OSError:
        return 0
    return int(rollup.partition("\nPss:")[2].split()[0])


def beside(manifest: Path, rounds: int) -> tuple[float, float]:
    """The least seconds of `-j 2` and of a local Dask cluster of two workers that runs already, in turn."""
    from distributed import LocalCluster

    with LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None) as cluster:
        address = cluster.scheduler_address
        taken: dict[int | str, list[float]] = {2: [], address: []}
        for _ in range(rounds + 1):
            for where, seconds in taken.items():
                seconds.append(batch(manifest, where)[0])
                shutil.rmtree(folder(manifest, where))
    return min(taken[2][1:]), min(taken[address][1:])  # in the first round workers import


def lost(manifest: Path, count: int) -> int:
    """How many jobs are not done on a Dask cluster one of whose two workers is killed in the midst of them."""
    from distributed import LocalCluster

    with LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None) as cluster:
        address = cluster.scheduler_address
        line = [
            ICCM,
            "batch",
            str(manifest),
            "--root",
            str(folder(manifest, "lost")),
            "--dask",
            address,
            "-q",
        ]
        process = subprocess.Popen(line, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        assert process.stdout is not None
        ended = []
        for number, said in enumerate(process.stdout):
            ended.append(json.loads(said)["status"])
            if number == count // 4:
                os.kill(cluster.workers[0].process.pid, signal.SIGKILL)
        process.wait()
    return count - sum(status in ("done", "poor") for status in ended)


def alone(manifest: Path, count: int) -> float:
    """Seconds for the same work in one process without a batch, its imports done before."""
    code = (
        "import sys, time, pathlib, os\n"
        "os.environ.update(OPENBLAS_NUM_THREADS='1', NUMBA_NUM_THREADS='1', OMP_NUM_THREADS='1')\n"
        "from iccm.io import run\nfrom iccm.io.batch import manifest\n"
        "name, root = sys.argv[1], pathlib.Path(sys.argv[2])\n"
        "root.mkdir()\n"
        "tasks = manifest.read(manifest.load(name), name, root=root)\n"
        "run.run(tasks[0].job.model_copy(update={'force': True}), threads=1)\n"
        "start = time.perf_counter()\n"
        "for task in tasks: run.run(task.job.model_copy(update={'force': True}), threads=1)\n"
        "print(time.perf_counter() - start)\n"
    )
    command = [sys.executable, "-c", code, str(manifest), str(manifest.parent / "alone")]
    return float(subprocess.run(command, capture_output=True, text=True, check=True).stdout)


def main() -> None:
    """Print the three tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--jobs", type=int, default=200)
    parser.add_argument("--many", type=int, default=2000)
    parser.add_argument("--rounds", type=int, default=2)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        manifest = jobs(Path(name), given.jobs, size=400)
        one, results, _ = batch(manifest, 1)
        base = alone(manifest, given.jobs)
        two, cluster = beside(manifest, given.rounds)
        missing = lost(manifest, given.jobs)
    inside = sum(result["seconds"] for result in results)
    print(f"{given.jobs} jobs: {one:.1f} s on one worker, {two:.1f} s on two: {one / two:.2f} x as fast")
    print(
        f"one process without a batch {base:.1f} s; overhead a job {1000 * (one - base) / given.jobs:.1f} ms,"
    )
    print(f"of which outside the job itself {1000 * (one - inside) / given.jobs:.1f} ms (start-up included)")
    print(f"on a Dask cluster of two workers that runs already: {cluster:.1f} s")
    goal("time on Dask's two workers by that of -j 2", cluster / two, 1 / 0.9)
    goal("jobs lost with a worker", missing, 0)
    if given.many:
        with tempfile.TemporaryDirectory() as name:
            manifest = jobs(Path(name), given.many, size=32, vertices=20, max_iterations=2)
            seconds, _, memory = batch(manifest, 2)
        tenths = [max(part) / 1024 for part in np.array_split(memory[len(memory) // 10 :], 9) if len(part)]
        print(f"{given.many} small jobs in {seconds:.0f} s; memory of all processes in MiB, from a tenth on:")
        print("  " + " ".join(f"{value:.0f}" for value in tenths))


if __name__ == "__main__":
    main()
