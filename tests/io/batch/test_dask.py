"""A batch on a real Dask scheduler with two workers on loopback."""

import json
import os
import shutil
import signal
import socket
import subprocess
import sys
from concurrent.futures import Future

import pytest

from iccm.io.batch import pools

pytest.importorskip("distributed")


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


@pytest.fixture
def start(tmp_path):
    """`start(*options)` starts a scheduler and two workers with one thread each, in separate processes; returns the
    address and the workers.
    """
    processes = []

    def begin(*options, **settings):
        port = free_port()
        address = f"tcp://127.0.0.1:{port}"
        quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "cwd": tmp_path}
        quiet["env"] = {**os.environ, **settings}
        dask = [sys.executable, "-m"]
        common = ["--no-dashboard", "--host", "127.0.0.1"]
        scheduler = [*dask, "distributed.cli.dask_scheduler", *common, "--port", str(port)]
        processes.append(subprocess.Popen(scheduler, **quiet))
        worker = [*dask, "distributed.cli.dask_worker", address, *common, "--nthreads", "1", *options]
        processes.extend(subprocess.Popen(worker, **quiet) for _ in range(2))
        from distributed import Client

        with Client(address, timeout="30s") as client:
            client.wait_for_workers(2, timeout=30)
        return address, processes[1:]

    yield begin
    for process in reversed(processes):
        process.terminate()  # with a nanny, a killed worker would leave its process
        try:
            process.wait(10)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait(10)


@pytest.fixture
def cluster(start):
    return start("--no-nanny")


@pytest.fixture
def scheduler(cluster):
    return cluster[0]


@pytest.mark.slow
def test_the_same_batch_on_a_cluster(shapes, iccm, scheduler):
    values = {"method": "paper", "vertices": 40, "size": 24, "output": "{source.stem}-{target.stem}.png"}
    rows = [
        {"defaults": values},
        {"source": "*.svg", "target": "blob.svg"},
        {"source": "disk.svg", "target": "square.svg"},
    ]
    (shapes / "jobs.jsonl").write_text("\n".join(map(json.dumps, rows)))
    result = iccm("batch", "jobs.jsonl", "--root", "far", "--dask", scheduler)
    assert result.code == 0, result.err
    assert [row["status"] for row in map(json.loads, result.out.splitlines())] == ["done"] * 4
    assert iccm("batch", "jobs.jsonl", "--root", "near", "-j", "1").code == 0
    for picture in (shapes / "near").glob("*.png"):
        assert picture.read_bytes() == (shapes / "far" / picture.name).read_bytes()
    (shapes / "jobs.jsonl").write_text(
        json.dumps({**values, "source": "blob.svg", "target": "blob.svg", "pin": "0,0:1,1"})
    )
    shutil.rmtree("far")
    result = iccm("batch", "jobs.jsonl", "--root", "far", "--dask", scheduler)
    assert result.code == 1 and json.loads(result.out)["status"] == "failed"


def test_no_scheduler_is_one_line(shapes, iccm, monkeypatch):
    monkeypatch.setattr(pools, "CLUSTER_TIMEOUT", "1s")
    (shapes / "jobs.jsonl").write_text('{"source": "blob.svg", "target": "disk.svg"}')
    result = iccm("batch", "jobs.jsonl", "--dask", f"tcp://127.0.0.1:{free_port()}")
    assert result.code == 2 and "no scheduler answers" in result.err


@pytest.mark.parametrize("more, ahead", [((), True), (("--timeout", "9"), False), (("--fail-fast",), False)])
def test_jobs_wait_at_workers_unless_that_is_seen(shapes, iccm, monkeypatch, more, ahead):
    from iccm.errors import InputError

    def refusing(address, *, ahead):
        raise InputError(f"ahead: {ahead}")

    monkeypatch.setattr(pools, "Dask", refusing)
    (shapes / "jobs.jsonl").write_text('{"source": "blob.svg", "target": "disk.svg"}')
    assert f"ahead: {ahead}" in iccm("batch", "jobs.jsonl", "--dask", "tcp://host:1", *more).err


class Cluster:
    """A cluster of three threads, with an executor whose tasks end like jobs of 20 ms."""

    def __init__(self, address, timeout):
        pass

    def nthreads(self):
        return {"a": 2, "b": 1}

    def get_executor(self, **options):
        return self

    def submit(self, work, payloads):
        future = Future()
        future.set_result([{"seconds": 0.02}] * len(payloads))
        return future


def test_jobs_wait_at_a_thread_when_they_may(monkeypatch):
    monkeypatch.setattr("distributed.Client", Cluster)
    given = [pools.Dask("tcp://host:1", ahead=ahead) for ahead in (False, True)]
    assert [(pool.size, pool.ahead) for pool in given] == [(3, 0), (3, 3)]


def test_short_jobs_travel_together_as_long_as_all_threads_have_some(monkeypatch):
    monkeypatch.setattr("distributed.Client", Cluster)
    pool, prompt = (pools.Dask("tcp://host:1", ahead=ahead) for ahead in (True, False))
    assert pool.together(1000) == 1  # nothing is known about them
    for one_pool in (pool, prompt):
        one_pool.submit([{}, {}])
    assert [pool.together(left) for left in (1000, 150, 60, 12, 6, 1)] == [25, 25, 10, 2, 1, 1]
    assert prompt.together(1000) == 1


def test_long_jobs_travel_alone(monkeypatch):
    monkeypatch.setattr("distributed.Client", Cluster)
    monkeypatch.setattr(pools, "TASK_SECONDS", 0.01)
    pool = pools.Dask("tcp://host:1", ahead=True)
    pool.submit([{}])
    assert pool.together(1000) == 1


def many(folder, count, **more):
    """A manifest of small jobs, numbered from 1 to `count`."""
    values = {"method": "paper", "vertices": 40, "size": 24, "output": "{number}.png"}
    rows = [
        {"defaults": values},
        *(
            {"source": "blob.svg", "target": "disk.svg", **more.get(f"job_{n}", {})}
            for n in range(1, count + 1)
        ),
    ]
    (folder / "jobs.jsonl").write_text("\n".join(map(json.dumps, rows)))


def batch(address, *options):
    """Run a batch in the background."""
    line = [sys.executable, "-c", "from iccm.cli import main; main()", "batch", "jobs.jsonl", "--root", "far"]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.DEVNULL, "text": True}
    return subprocess.Popen([*line, "--dask", address, *options], **pipes)


def all_done(statuses, count):
    """Whether each of `count` jobs has exactly one result, and is done."""
    return sorted(row["job"] for row in statuses) == list(range(1, count + 1)) and {
        row["status"] for row in statuses
    } == {"done"}


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_a_lost_worker_loses_nothing(shapes, cluster):
    many(shapes, 60)
    address, workers = cluster
    running = batch(address)
    statuses = [json.loads(running.stdout.readline()) for _ in range(15)]
    workers[0].send_signal(signal.SIGKILL)
    statuses += map(json.loads, running.stdout)
    assert running.wait(100) == 0 and all_done(statuses, 60)
    pictures = {path.read_bytes() for path in (shapes / "far").glob("*.png")}
    assert len(list((shapes / "far").glob("*.png"))) == 60 and len(pictures) == 1


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_a_killed_batch_continues_without_repeating_finished_jobs(shapes, scheduler):
    many(shapes, 60)
    killed = batch(scheduler)
    for _ in range(20):
        killed.stdout.readline()
    killed.kill()
    killed.communicate()
    lines = (shapes / "far" / ".iccm-journal.jsonl").read_text().splitlines()
    finished = sum('"finished"' in line for line in lines)
    again = batch(scheduler, "--resume")
    records = [json.loads(line) for line in again.stdout]
    assert again.wait(100) == 0 and all_done(records, 60)
    assert 20 <= finished < 60 and sum(row["resumed"] for row in records) == finished


KILLER = """
import os
from iccm.io.batch import worker
def work(payload, ordinary=worker.run_job):
    return os._exit(1) if payload["job"]["source"] == "killer.svg" else ordinary(payload)
if worker.run_job.__module__ == worker.__name__:  # it is loaded twice
    worker.run_job = work
"""


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_a_job_that_kills_its_workers_is_the_only_one_that_fails(shapes, iccm, start, monkeypatch):
    (shapes / "killer.py").write_text(KILLER)
    shutil.copy("disk.svg", "killer.svg")
    address, _ = start("--preload", "killer.py", DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES="0")
    many(shapes, 60, job_30={"source": "killer.svg"})
    monkeypatch.setattr(pools, "TASK_SECONDS", 5.0)  # bundled even on a busy machine
    result = iccm("batch", "jobs.jsonl", "--root", "far", "--dask", address, "--retries", "0")
    statuses = {row["job"]: row["status"] for row in map(json.loads, result.out.splitlines())}
    assert result.code == 1 and statuses == {n: "killed" if n == 30 else "done" for n in range(1, 61)}
    assert "the worker died; running the jobs one by one" in result.err
