"""Killed workers and parents, full disks, read-only folders, missing inputs, concurrent batches: no output is
incomplete or lost.
"""

import json
import os
import platform
import shutil
import signal
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path

import pytest

from iccm.io.pictures import image_files

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="signals of POSIX, and processes as in /proc")
ICCM = str(Path(sys.executable).parent / "iccm")
WHOLE = {"done": 4}
LARGE = {"source": "d.svg", "target": "blob.svg", "size": 8000, "output": "large.png"}


def manifest(size=1000, **more):
    values = {
        "method": "paper",
        "vertices": 60,
        "size": size,
        "output": "{source.stem}-{target.stem}.png",
        **more,
    }
    rows = [
        {"defaults": values},
        {"source": "*.svg", "target": "[bd]*.svg", "name": "{source.stem}-{target.stem}"},
    ]
    return "\n".join(json.dumps(row) for row in rows)


@pytest.fixture
def folder(shapes):
    """Four jobs of about half a second each."""
    (shapes / "disk.svg").unlink()
    shutil.copy("blob.svg", "d.svg")
    (shapes / "square.svg").unlink()
    (shapes / "jobs.jsonl").write_text(manifest())
    return shapes


@pytest.fixture
def start():
    """`start(*options)` starts a batch in the background; what is still running at the end is stopped."""
    begun = []

    def begin(*options, **settings):
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
        command = [ICCM, "batch", "jobs.jsonl", "--root", "out", "-v", *options]
        begun.append(subprocess.Popen(command, **pipes, **settings))
        return begun[-1]

    yield begin
    for process in begun:
        process.kill()
        process.communicate()


def children(pid):
    """The running child processes of a process."""
    pids = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = stat.read_text().rpartition(")")[2].split()
        except OSError:
            continue
        if (
            int(fields[1]) == pid
            and fields[0] != "Z"
            and "spawn_main" in (stat.parent / "cmdline").read_text()
        ):
            pids.append(int(stat.parent.name))
    return pids


def alive(pid):
    stat = Path(f"/proc/{pid}/stat")
    return stat.exists() and stat.read_text().rpartition(")")[2].split()[0] != "Z"


def until(condition, seconds=80):
    """Wait for a condition that must become true."""
    end = time.monotonic() + seconds
    while not (result := condition()):
        assert time.monotonic() < end, "it never came"
        time.sleep(0.02)
    return result


def writing(folder):
    """Whether some worker has begun to write an output."""
    return [p for p in (folder / "out").glob(".*.png")] if (folder / "out").is_dir() else []


def finished(folder):
    """Whether the journal records a finished job."""
    book = folder / "out" / ".iccm-journal.jsonl"
    return book.exists() and '"finished"' in book.read_text()


def ended(process):
    out, err = process.communicate(timeout=90)
    return Counter(json.loads(line)["status"] for line in out.splitlines()), out, err


def whole(folder):
    """Check that every picture in the output folder is complete, and that nothing else is left there."""
    left = [p.name for p in folder.iterdir() if p.suffix != ".png" and p.name != ".iccm-journal.jsonl"]
    hidden = [p.name for p in folder.iterdir() if p.name.startswith(".") and p.suffix == ".png"]
    pictures = [p for p in folder.iterdir() if p.suffix == ".png" and not p.name.startswith(".")]
    return not left and not hidden and all(image_files.read(p).pixels.any() for p in pictures)


def resumed(start, folder):
    """Complete the batch with --resume; return the number of jobs that were skipped."""
    counts, out, err = ended(start("--resume", "-j", "2"))
    assert counts == WHOLE, err
    assert whole(folder / "out")
    return sum(json.loads(line)["resumed"] for line in out.splitlines())


@pytest.mark.slow
def test_a_killed_worker_loses_only_its_own_job(folder, start):
    process = start("-j", "2")
    until(lambda: writing(folder))
    os.kill(children(process.pid)[0], signal.SIGKILL)
    counts, out, err = ended(process)
    assert process.returncode == 0 and counts == WHOLE, err
    assert Counter(json.loads(line)["attempts"] for line in out.splitlines()) == {1: 3, 2: 1}
    assert "the worker died; running the job again" in err


@pytest.mark.slow
def test_a_killed_parent_leaves_no_orphan_and_resumes(folder, start):
    (folder / "jobs.jsonl").write_text(manifest(size=1500))
    process = start("-j", "2")
    until(lambda: finished(folder))
    until(lambda: writing(folder))
    workers = children(process.pid)
    process.kill()
    process.communicate()
    until(lambda: not any(map(alive, workers)), 10)
    assert process.returncode == -signal.SIGKILL and workers
    assert whole(folder / "out")
    assert resumed(start, folder) >= 1


@pytest.mark.skipif(sys.platform != "linux", reason="a signal that Linux sends")
def test_a_worker_in_native_code_ends_with_its_parent(tmp_path):
    """Code that holds Python's global lock: neither the thread that watches the parent runs, nor a signal handler."""
    code = (
        "import itertools, os, time\n"
        "from iccm.io.batch import pools\n"
        "def busy(): return sum(itertools.repeat(0))\n"
        "if __name__ == '__main__':\n"
        "    lane = pools.Processes(1, 1)._lanes[0]\n"
        "    print(lane._pid.result(), flush=True)\n"
        "    lane.executor.submit(busy)\n"
        "    time.sleep(1)\n"
        "    os.kill(os.getpid(), 9)\n"
    )
    (tmp_path / "code.py").write_text(code)
    quiet = {"stdout": subprocess.PIPE, "stderr": subprocess.DEVNULL, "text": True}
    begun = subprocess.Popen([sys.executable, tmp_path / "code.py"], **quiet)
    worker = int(begun.stdout.readline())
    begun.wait()
    assert alive(worker)
    until(lambda: not alive(worker), 60)


@pytest.mark.slow
@pytest.mark.parametrize("number", [1, 2, 15], ids=["SIGHUP", "SIGINT", "SIGTERM"])
def test_a_signal_stops_cleanly_with_a_summary(folder, start, number):
    (folder / "jobs.jsonl").write_text(manifest(size=2500))
    process = start("-j", "1", start_new_session=True)
    until(lambda: finished(folder))
    until(lambda: writing(folder))
    workers = children(process.pid)
    if number != signal.SIGTERM:
        os.killpg(process.pid, number)  # like Ctrl-C and a closed terminal: also to the workers
    else:
        process.send_signal(number)
    counts, _, err = ended(process)
    assert process.returncode == 128 + number
    assert sum(counts.values()) == 4 and counts["done"] >= 1 and counts["cancelled"] >= 1
    assert "cancelled" in err.splitlines()[-1] and "Traceback" not in err
    until(lambda: not any(map(alive, workers)), 10)
    assert whole(folder / "out")


@pytest.mark.slow
@pytest.mark.parametrize("moment", ["read", "workers start", "jobs run"])
def test_an_interrupt_while_a_batch_is_resumed_prints_no_traceback(folder, start, moment):
    """Ctrl-C reaches workers, too, also while they import modules."""
    assert ended(start("-j", "2"))[0] == WHOLE
    pictures = sorted((folder / "out").glob("*.png"))
    kept = {path: path.read_bytes() for path in pictures[1:]}
    pictures[0].unlink()
    (folder / "jobs.jsonl").write_text(manifest(size=1000) + "\n" + json.dumps(LARGE))
    process = start("-j", "2", "--resume", start_new_session=True)
    moments = {
        "read": lambda: b"numpy" in Path(f"/proc/{process.pid}/maps").read_bytes(),
        "workers start": lambda: children(process.pid),
        "jobs run": lambda: writing(folder),
    }
    until(moments[moment])
    workers = children(process.pid)
    os.killpg(process.pid, signal.SIGINT)
    counts, _, err = ended(process)
    assert process.returncode == 130
    assert "Traceback" not in err and "KeyboardInterrupt" not in err and "worker died" not in err
    last = err.splitlines()[-1]
    assert last.endswith("interrupted") if not counts else "cancelled" in last
    assert moment == "read" or counts["cancelled"] >= 1
    until(lambda: not any(map(alive, workers)), 10)
    assert whole(folder / "out")
    assert all(path.read_bytes() == content for path, content in kept.items())


@pytest.mark.slow
def test_a_reader_that_goes_away_ends_the_batch_and_its_workers(folder, start):
    """Immediately, not with the next line, which a job of half a minute is about to write."""
    (folder / "jobs.jsonl").write_text(
        manifest(size=40) + '\n{"source": "d.svg", "target": "blob.svg", "size": 16000, "output": "huge.png"}'
    )
    process = start("-j", "1")
    until(lambda: list((folder / "out").glob(".huge*")))
    workers = children(process.pid)
    process.stdout.close()
    assert process.wait(timeout=10) == 141 and workers
    until(lambda: not any(map(alive, workers)), 10)
    assert whole(folder / "out") and "Traceback" not in process.stderr.read()
    process.stdout, process.stderr = None, None


@pytest.mark.slow
def test_a_time_limit_kills_one_worker_and_the_others_continue(folder, start):
    (folder / "jobs.jsonl").write_text(
        manifest(size=40) + '\n{"source": "d.svg", "target": "blob.svg", "size": 16000, "output": "huge.png"}'
    )
    process = start("-j", "1", "--timeout", "6")
    counts, _, err = ended(process)
    assert process.returncode == 1 and counts == {"done": 4, "timeout": 1}, err
    assert whole(folder / "out")


@pytest.mark.slow
def test_a_full_disk(folder, start):
    """With a small tmpfs as the output folder; skipped without the right to mount one."""
    out = folder / "out"
    out.mkdir()
    if subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=64k", "none", str(out)], capture_output=True
    ).returncode:
        pytest.skip("mounting a tmpfs is not allowed here")
    try:
        (folder / "jobs.jsonl").write_text(manifest(size=700))
        process = start("-j", "2")
        counts, _, err = ended(process)
        assert process.returncode == 1 and counts["failed"] >= 1 and sum(counts.values()) == 4
        assert "No space left on device" in err and "Traceback" not in err
        assert whole(out)
    finally:
        subprocess.run(["umount", str(out)], check=True)
    assert resumed(start, folder) == 0


@pytest.mark.slow
def test_a_read_only_folder_is_refused_before_anything_runs(folder, start):
    """As root, permission bits have no effect, so the folder is made immutable by a read-only bind mount."""
    out = folder / "out"
    out.mkdir()
    mounted = False
    if os.geteuid() == 0:
        steps = (["mount", "--bind", str(out), str(out)], ["mount", "-o", "remount,ro,bind", str(out)])
        if any(subprocess.run(step, capture_output=True).returncode for step in steps):
            pytest.skip("running as root, and mounting is not allowed here")
        mounted = True
    else:
        out.chmod(0o555)
    try:
        process = start("-j", "2")
        counts, _, err = ended(process)
        assert process.returncode == 2 and not counts
        assert err.count("error: ") == 4 and "not writable" in err and "Traceback" not in err
    finally:
        subprocess.run(["umount", str(out)], check=True) if mounted else out.chmod(0o755)
    assert resumed(start, folder) == 0


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="limits of addresses")
def test_a_worker_out_of_memory_fails_its_job_alone(folder, start):
    """With a real system limit: the equations of 4,000 vertices exceed it."""
    import resource

    rows = [json.loads(line) for line in manifest(size=48, output="{number}.png").splitlines()]
    rows.insert(1, {"source": "blob.svg", "target": "d.svg", "vertices": 4000})
    (folder / "jobs.jsonl").write_text("\n".join(map(json.dumps, rows)))
    limit = 1500 << 20  # more than the command needs to start, less than these equations
    process = start("-j", "1", preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (limit, limit)))
    counts, out, err = ended(process)
    assert process.returncode == 1 and counts == {"failed": 1, "done": 4}, err
    (failed,) = [line for line in map(json.loads, out.splitlines()) if line["status"] == "failed"]
    assert failed["job"] == 1 and "memory" in failed["message"] and "vertices" in failed["message"]
    assert "Traceback" not in err and whole(folder / "out")
    del rows[1]["vertices"]
    (folder / "jobs.jsonl").write_text("\n".join(map(json.dumps, rows)))
    counts, out, err = ended(start("--resume", "-j", "2"))
    assert counts == {"done": 5}, err
    assert sum(json.loads(line)["resumed"] for line in out.splitlines()) == 4


@pytest.mark.slow
def test_an_input_deleted_during_the_batch_fails_its_job_only(folder, start):
    process = start("-j", "1")
    until(lambda: writing(folder))
    content = (folder / "d.svg").read_text()
    (folder / "d.svg").unlink()
    counts, _, err = ended(process)
    assert process.returncode == 1 and counts["failed"] >= 1 and sum(counts.values()) == 4
    assert "d.svg" in err and "Traceback" not in err and whole(folder / "out")
    (folder / "d.svg").write_text(content)
    assert resumed(start, folder) == counts["done"]


@pytest.mark.slow
def test_two_batches_at_once_on_the_same_outputs(folder, start):
    batches = [start("-j", "1", "--force"), start("-j", "1", "--force")]
    for process in batches:
        counts, _, err = ended(process)
        assert process.returncode == 0 and counts == WHOLE, err
    assert whole(folder / "out")
    assert resumed(start, folder) == 4


@pytest.mark.slow
def test_resume_sweeps_the_temporary_files_of_a_batch_that_was_killed(shapes, iccm):
    ended = subprocess.Popen([sys.executable, "-c", ""])
    ended.wait()
    job = {"source": "square.svg", "target": "blob.svg", "size": 16, "method": "paper", "vertices": 40}
    (shapes / "j.jsonl").write_text(json.dumps(job) + "\n")
    begun = {"event": "begun", "key": "k", "outputs": ["square-blob.png"], "by": [platform.node(), ended.pid]}
    running = {**begun, "outputs": ["other.png"], "by": [platform.node(), os.getpid()]}
    text = json.dumps(begun) + "\n" + json.dumps(running) + "\n"
    (shapes / ".iccm-journal.jsonl").write_text(text)
    left, kept = shapes / ".square-blob.abcdefgh.png", shapes / ".other.abcdefgh.png"
    left.touch()
    kept.touch()
    result = iccm("batch", "j.jsonl", "-j", "1", "--resume")
    assert result.code == 0 and not left.exists() and kept.exists()
    assert "removed 1 temporary files" in result.err


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")
def test_remains_of_a_killed_batch_print_nothing(folder, start):
    """Neither by its workers, idle or not, nor by the process that tracks their semaphores."""
    process = start("-j", "2")
    first = process.stdout.readline()
    process.kill()
    _, err = process.communicate(timeout=60)  # until the last of them has closed stderr
    assert json.loads(first)["status"] == "done"
    assert "Traceback" not in err and "semaphore" not in err and "Warning" not in err, err


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")
def test_an_idle_worker_stops_silently(tmp_path):
    code = (
        "import sys, time\n"
        "from iccm.io.batch import pools\n"
        "if __name__ == '__main__':\n"
        "    pool = pools.Processes(2, 1)\n"
        "    for lane in pool._lanes:\n"
        "        lane._pid.result(); lane.future = lane.executor.submit(time.sleep, 0); lane.future.result()\n"
        "    time.sleep(1)\n"
        "    pool.abandon([lane.future for lane in pool._lanes])\n"
        "    pool.close()\n"
    )
    (tmp_path / "run.py").write_text(code)
    result = subprocess.run(
        [sys.executable, str(tmp_path / "run.py")], capture_output=True, text=True, timeout=100
    )
    assert result.returncode == 0 and result.stderr == ""
