"""Batches: one result per job whatever happens, resuming, reproducible bytes."""

import hashlib
import json
import os
import platform
import signal
import subprocess
import sys
import time
from concurrent.futures import BrokenExecutor, Future, wait

import pytest

from iccm import deadline
from iccm.io.batch import dispatch, journal, pools, worker
from iccm.io.batch.journal import Journal
from iccm.io.batch.manifest import ManifestError, Task
from iccm.io.run.inputs import Inputs
from iccm.io.run.job import Job

MANIFEST = """
[defaults]
method = "paper"
vertices = 40
size = 24
report = "{source.stem}-{target.stem}.json"
output = "{source.stem}-{target.stem}.png"
[[job]]
source = "*.svg"
target = "[bd]*.svg"
"""


NOTHING = {"outputs": [], "figures": {}, "notes": [], "seconds": 0}


class Scripted:
    """A pool whose jobs end as scripted, by source and attempt: a status, "dies", "hangs", or "lasts", after which
    there is no time for other jobs of the bundle.
    """

    ahead = 0
    runs_again = False

    def __init__(self, script, size=2, bundle=1):
        self.size, self.script, self.bundle = size, script, bundle
        self.started, self.sent, self.abandoned = [], [], []

    def together(self, left):
        return self.bundle

    def submit(self, payloads):
        self.sent.append("".join(payload["job"]["source"] for payload in payloads))
        future, answers = Future(), []
        for name in self.sent[-1]:
            self.started.append(name)
            ends = self.script.get(name, ["done"])
            end = ends[min(self.started.count(name), len(ends)) - 1]
            if end == "dies":
                future.set_exception(RuntimeError("the worker died"))
            if end in ("dies", "hangs"):
                return future
            answers.append({"status": "done" if end == "lasts" else end, "message": end, **NOTHING})
            if end == "lasts":
                break
        future.set_result(answers)
        return future

    def abandon(self, futures):
        self.abandoned += futures

    def close(self):
        pass


@pytest.fixture
def play(tmp_path, monkeypatch):
    """`play(script, policy)` runs jobs named a to e on a scripted pool; returns their results by name, and the pool."""
    monkeypatch.chdir(tmp_path)
    for name in "abcde":
        (tmp_path / name).write_text(name)

    def run(script, policy=None, **options):
        tasks = [
            Task.of(n, s, f"job {n}", Job(source=s, report=f"{s}.json")) for n, s in enumerate("abcde", 1)
        ]
        pool = Scripted(script, options.pop("size", 2), options.pop("bundle", 1))
        results = list(
            dispatch.execute(tasks, pool, Journal(tmp_path), policy or dispatch.Policy(), **options)
        )
        assert sorted(r["name"] for r in results) == list("abcde")
        return {r["name"]: r for r in results}, pool

    return run


def test_a_job_ends_by_itself_before_it_is_killed():
    """A map that has been found by then is the result, while a worker that is killed leaves nothing."""
    assert dispatch.Policy(timeout=10).seconds == pytest.approx(8)
    assert dispatch.Policy(timeout=10, time_limit=3).seconds == 3
    assert dispatch.Policy().seconds == deadline.DEFAULT_SECONDS


def test_a_failed_job_does_not_stop_the_others(play):
    results, _ = play({"b": ["failed"], "c": ["error"]})
    assert {n: r["status"] for n, r in results.items()} == dict(
        a="done", b="failed", c="error", d="done", e="done"
    )
    assert all(r["schema"] == "iccm.result/1" and r["attempts"] == 1 for r in results.values())


def test_a_job_whose_worker_dies_is_run_again(play):
    results, pool = play({"b": ["dies", "done"]})
    assert results["b"]["status"] == "done" and results["b"]["attempts"] == 2
    assert sorted(pool.started) == list("abbcde")


def test_retries_end(play):
    results, pool = play({"b": ["dies"]}, dispatch.Policy(retries=2))
    assert results["b"]["status"] == "killed" and pool.started.count("b") == 3
    assert {r["status"] for n, r in results.items() if n != "b"} == {"done"}


def test_a_failure_is_not_retried(play):
    _, pool = play({"b": ["failed"]}, dispatch.Policy(retries=5))
    assert pool.started.count("b") == 1


def test_jobs_travel_together_and_each_has_its_result(play):
    results, pool = play({"b": ["failed"]}, size=1, bundle=3)
    assert pool.sent == ["abc", "de"]
    assert [r["status"] for r in results.values()] == ["done", "failed", "done", "done", "done"]


@pytest.mark.parametrize("retries", [0, 1])
def test_a_job_that_kills_its_worker_is_blamed_alone(play, tmp_path, retries):
    warned = []
    results, pool = play({"b": ["dies"]}, dispatch.Policy(retries), size=1, bundle=3, warn=warned.append)
    assert pool.sent == ["abc", "a", *"b" * (1 + retries), "c", "de"]
    assert {n: (r["status"], r["attempts"]) for n, r in results.items()} == {
        n: ("killed", 1 + retries) if n == "b" else ("done", 1) for n in "abcde"
    }
    assert "job 1 and 2 more: the worker died; running the jobs one by one" in warned
    lines = [json.loads(line) for line in (tmp_path / journal.NAME).read_text().split("\n") if line]
    events = [(line["event"], line["key"]) for line in lines]
    assert len(events) == len(set(events)) == 5 + 4  # b was begun, but never finished


def test_jobs_delayed_by_a_long_one_run_later(play):
    results, pool = play({"a": ["lasts"]}, size=1, bundle=3)
    assert pool.sent == ["abc", "bcd", "e"]
    assert {r["attempts"] for r in results.values()} == {1}


def test_where_a_job_may_have_killed_its_worker_none_waits_at_it(play, monkeypatch):
    monkeypatch.setattr(Scripted, "ahead", 1)
    under_way = []
    monkeypatch.setattr(
        dispatch, "wait", lambda running, **how: under_way.append(len(running)) or wait(running, **how)
    )
    play({"a": ["dies", "done"]}, size=1)
    assert under_way[:2] == [2, 1] and 2 in under_way[2:]


def test_skipped_jobs_do_not_wait_for_running_ones(play, monkeypatch):
    done = {"status": "done", "message": "done", **NOTHING}
    monkeypatch.setattr(journal, "key", lambda job: job.source)
    monkeypatch.setattr(Journal, "finished", lambda book, key, job: None if key == "a" else done)
    patience = []
    monkeypatch.setattr(
        dispatch, "wait", lambda running, **how: patience.append(how["timeout"]) or wait(running, **how)
    )
    results, _ = play({"a": ["hangs"]}, resume=True, stopping=lambda: len(patience) == 5)
    assert patience == [0, 0, 0, 0, dispatch.POLL_SECONDS]
    assert [(r["status"], r["resumed"]) for r in results.values()] == [("done", True)] * 4 + [
        ("cancelled", False)
    ]


def test_a_worker_begins_no_job_when_its_time_is_up(monkeypatch):
    ran = []
    monkeypatch.setattr(worker, "run_job", lambda payload: ran.append(payload) or {"seconds": 0})
    assert len(worker.run_bundle([1, 2, 3])) == 3
    monkeypatch.setattr(worker, "RETURN_SECONDS", 0.0)
    assert len(worker.run_bundle([1, 2, 3])) == 1 and ran == [1, 2, 3, 1]


def test_a_time_limit_ends_the_job_alone(play):
    results, pool = play({"b": ["hangs"]}, dispatch.Policy(timeout=0.3))
    assert results["b"]["status"] == "timeout" and "0.3 s" in results["b"]["message"]
    assert len(pool.abandoned) == 1 and {r["status"] for n, r in results.items() if n != "b"} == {"done"}


def test_fail_fast_begins_nothing_after_a_failure(play):
    results, pool = play({"b": ["poor"]}, dispatch.Policy(fail_fast=True), size=1)
    assert pool.started == ["a", "b"]
    assert [r["status"] for r in results.values()] == ["done", "poor", "cancelled", "cancelled", "cancelled"]


def test_stopping_reports_every_job(play):
    began = time.monotonic()
    results, pool = play({"b": ["hangs"], "c": ["hangs"]}, stopping=lambda: time.monotonic() - began > 0.5)
    assert {n: r["status"] for n, r in results.items()} == {
        "a": "done", "b": "cancelled", "c": "cancelled", "d": "cancelled", "e": "cancelled",
    }  # fmt: skip
    assert len(pool.abandoned) == 2


def test_an_input_that_went_away_fails_its_job_only(play, tmp_path):
    (tmp_path / "x").write_text("")
    results, _ = play({}, warn=lambda message: None)
    assert results["c"]["status"] == "done"
    (tmp_path / "c").unlink()
    results, pool = play({})
    assert results["c"]["status"] == "failed" and "c" in results["c"]["message"] and "c" not in pool.started


@pytest.mark.slow
def test_a_worker_that_died_between_two_jobs_does_not_answer_with_the_old_result(tmp_path):
    pool = pools.Processes(1, 1)
    try:
        payload = {"folder": str(tmp_path), "job": {"source": "none.svg", "report": "r.json"}, "threads": 1}
        assert pool.submit([payload]).result(60)[0]["status"] == "failed"
        os.kill(pool._lanes[0]._pid.result(), getattr(signal, "SIGKILL", signal.SIGTERM))
        with pytest.raises(BrokenExecutor):
            pool.submit([payload]).result(60)
        assert pool.submit([payload]).result(60)[0]["status"] == "failed"  # by a new worker
    finally:
        pool.close()


def test_the_journal_forgives_torn_lines(tmp_path):
    (tmp_path / "in").write_text("x")
    (tmp_path / "out.json").write_text("made")
    job = Job(source=str(tmp_path / "in"), report=str(tmp_path / "out.json"))
    book, key = Journal(tmp_path), journal.key(job)
    output = {"path": job.report, "sha256": hashlib.sha256(b"made").hexdigest()}
    book.begin(key, job)
    with book.path.open("a") as file:
        file.write('{"event": "finished", "key": ')
    book.finish(key, {"status": "done", "message": "", "outputs": [output], "figures": {}, "notes": []})
    with book.path.open("ab") as file:
        file.write(b'{"torn": \xff\n[1]\n"x"\n{"event": "finished", "key": 3}\n{"event": "begun"}\n')
    again = Journal(tmp_path)
    assert again.finished(key, job)["status"] == "done" and again.wrote(job.report)
    assert again.finished("other", job) is None and not again.wrote(job.source)
    (tmp_path / "out.json").write_text("changed")
    assert again.finished(key, job) is None


@pytest.fixture
def journal_entry(tmp_path):
    """`journal_entry(path, **changed)`: the journal's entry for a file of a job in tmp_path/out; None if untrusted."""
    root, away = tmp_path / "out", tmp_path / "away.json"
    root.mkdir()
    for path in (away, root / "r.json"):
        path.write_text("made")
    (tmp_path / "in").write_text("x")
    (root / "link").symlink_to(tmp_path)

    def journal_entry(path, output="r.json", **changed):
        job = Job(source=str(tmp_path / "in"), report=str(root / output))
        digest = hashlib.sha256(b"made").hexdigest()
        result = {"status": "done", "message": "", "figures": {}, "notes": []}
        result |= {"outputs": [{"path": path, "sha256": digest}]} | changed
        line = {"event": "finished", "key": journal.key(job), "result": result}
        (root / journal.NAME).write_text(json.dumps(line) + "\n")
        return Journal(root).finished(journal.key(job), job)

    return journal_entry


def test_the_journal_is_trusted_for_files_in_its_folder_and_of_the_job(journal_entry, tmp_path):
    assert journal_entry("r.json") is not None
    assert journal_entry("../away.json", output="../away.json") is not None
    for path in ("../away.json", str(tmp_path / "away.json"), "link/away.json", "gone.json", "a\0b"):
        assert journal_entry(path) is None, path


@pytest.mark.parametrize(
    "changed",
    [
        {"status": 3},
        {"message": None},
        {"outputs": []},
        {"outputs": [3]},
        {"outputs": [{"path": "r.json", "sha256": 3}]},
        {"outputs": {"path": "r.json"}},
        {"figures": []},
        {"notes": [3]},
        {"notes": None},
    ],
)
def test_results_of_another_form_are_none(journal_entry, changed):
    assert journal_entry("r.json", **changed) is None


@pytest.mark.skipif(os.name != "posix", reason="elsewhere it is not known whether a process has ended")
def test_the_journal_sweeps_only_its_folder_and_the_folders_of_outputs(tmp_path):
    ended = subprocess.Popen([sys.executable, "-c", ""])
    ended.wait()
    root, away = tmp_path / "out", tmp_path / "away"
    for folder in (root, away):
        folder.mkdir()
        (folder / ".made.abcdefgh.png").touch()
    outputs = ["made.png", "../away/made.png", str(away / "made.png")]
    line = {"event": "begun", "key": "k", "outputs": outputs, "by": [platform.node(), ended.pid]}
    (root / journal.NAME).write_text(json.dumps(line) + "\n")
    assert Journal(root).sweep() == [root / ".made.abcdefgh.png"]
    (swept,) = Journal(root).sweep([str(away / "made.png")])
    assert swept.name == ".made.abcdefgh.png" and not any(away.iterdir())


@pytest.mark.parametrize("make", ["link", "pipe", "folder"])
def test_a_journal_that_is_not_a_plain_file_is_refused(tmp_path, iccm, make):
    (tmp_path / "precious").write_text("mine")
    (tmp_path / "j.jsonl").write_text('{"source": "in.svg", "target": "in.svg"}\n')
    path = tmp_path / journal.NAME
    if make == "link":
        path.symlink_to(tmp_path / "precious")
    elif make == "folder":
        path.mkdir()
    elif hasattr(os, "mkfifo"):
        os.mkfifo(path)
    else:
        pytest.skip("there are no pipes with names here")
    (tmp_path / "in.svg").write_text('<svg xmlns="http://www.w3.org/2000/svg"><path d="M0 0H9V5z"/></svg>')
    result = iccm("batch", tmp_path / "j.jsonl")
    assert result.code == 2 and journal.NAME in result.err
    assert (tmp_path / "precious").read_text() == "mine"


def test_the_key_depends_on_inputs_options_and_version(tmp_path, monkeypatch):
    (tmp_path / "a").write_text("x")
    job = Job(source=str(tmp_path / "a"), quasi=0.5)
    key = journal.key(job)
    assert journal.key(job.model_copy(update={"force": True})) == key
    assert journal.key(job.model_copy(update={"quasi": 0.6})) != key
    (tmp_path / "a").write_text("yy")
    assert journal.key(job) != key
    (tmp_path / "a").write_text("x")
    monkeypatch.setattr(journal, "__version__", "9")
    assert journal.key(job) != key


def test_the_key_includes_files_that_a_mesh_refers_to(tmp_path):
    (tmp_path / "a.obj").write_text("mtllib my lib.mtl\nv 0 0 0\n")
    job = Job(source=str(tmp_path / "a.obj"))
    keys = [journal.key(job)]
    (tmp_path / "my lib.mtl").write_text("newmtl x\nmap_Kd -s 1 1 1 t.png\nmap_Bump no such.png\n")
    keys.append(journal.key(job))
    (tmp_path / "t.png").write_text("pixels")
    keys.append(journal.key(job))
    (tmp_path / "t.png").write_text("other pixels")
    keys.append(journal.key(job))
    assert len(set(keys)) == 4
    scene = {"buffers": [{"uri": "b.bin"}, {"uri": "data:,"}, 3], "images": [{"uri": "t.png"}]}
    for text, count in (
        (json.dumps(scene), 1),
        (json.dumps({**scene, "buffers": []}), 2),
        ("{", 1),
        ("[]", 1),
    ):
        (tmp_path / "s.gltf").write_text(text)
        assert len(Inputs(Job(source=str(tmp_path / "s.gltf"))).named) == count


@pytest.mark.parametrize(
    ("error", "status", "part"),
    [
        (MemoryError(), "failed", "out of memory"),
        (OSError(28, "No space left on device", "x.png"), "failed", "x.png: No space left"),
        (
            ZeroDivisionError("of\npigs"),
            "error",
            "internal error, please report it (ZeroDivisionError: of pigs, test_batch.py:",
        ),
    ],
)
def test_a_worker_answers_for_every_failure(monkeypatch, error, status, part):
    def fail(payload):
        raise error

    monkeypatch.setattr(worker, "_run", fail)
    result = worker.run_job({"folder": os.getcwd(), "job": {}, "threads": 1})
    assert result["status"] == status and part in result["message"] and "\n" not in result["message"]


def test_outputs_that_cannot_be_written_are_all_reported_before_anything_runs(tmp_path):
    (tmp_path / "there.json").write_text("mine")
    (tmp_path / "file").write_text("")
    jobs = [
        Job(source="a", report=str(tmp_path / name)) for name in ("there.json", "file/x.json", "sub/new.json")
    ]
    tasks = [Task.of(n, "", f"job {n}", job) for n, job in enumerate(jobs, 1)]
    for resume in (False, True):
        with pytest.raises(ManifestError) as caught:
            dispatch.prepare(tasks, Journal(tmp_path), resume=resume)
        assert [line[:5] for line in caught.value.mistakes] == ["job 1", "job 2"]
    assert (tmp_path / "there.json").read_text() == "mine"


def hashes(folder):
    return {
        p.name: hashlib.sha256(p.read_bytes()).hexdigest()
        for p in folder.iterdir()
        if not p.name.startswith(".")
    }


def rows(text):
    return {row["name"]: row for row in map(json.loads, text.splitlines())}


@pytest.mark.slow
def test_a_batch_from_end_to_end(shapes, shell):
    """Two workers and one give the same bytes; --resume skips unchanged jobs, and only those."""
    (shapes / "jobs.toml").write_text(MANIFEST)
    env = os.environ | {"SOURCE_DATE_EPOCH": "1700000000"}
    first = shell("iccm batch jobs.toml --root one -j 1", env=env)
    two = shell("iccm batch jobs.toml --root two -j 2 --threads 2", env=env)
    assert first.returncode == two.returncode == 0, first.stderr + two.stderr
    assert len(rows(first.stdout)) == 6 and "6 done" in first.stderr
    assert {r["status"] for r in rows(first.stdout).values()} == {"done"}
    pictures = {n: h for n, h in hashes(shapes / "one").items() if n.endswith(".png")}
    assert len(pictures) == 6 and pictures.items() <= hashes(shapes / "two").items()
    reports = [json.loads((shapes / name / "square-blob.json").read_text()) for name in ("one", "two")]
    for report in reports:
        assert "seconds" not in report
        report.pop("job")  # contains the folder
    assert reports[0] == reports[1]

    (shapes / "square.svg").write_text((shapes / "square.svg").read_text().replace("H90", "H80"))
    (shapes / "one" / "disk-disk.png").write_bytes(b"spoiled")
    again = shell("iccm batch jobs.toml --root one -j 1 --resume", env=env)
    assert again.returncode == 0, again.stderr
    ran = {name for name, row in rows(again.stdout).items() if not row["resumed"]}
    assert ran == {"square-blob", "square-disk", "disk-disk"}
    assert hashes(shapes / "one")["disk-disk.png"] == pictures["disk-disk.png"]
    refused = shell("iccm batch jobs.toml --root one")
    assert refused.returncode == 2 and refused.stderr.count("--force") == 12 and refused.stdout == ""


@pytest.mark.slow
def test_the_wrong_manifest_and_the_failing_job_have_their_exit_codes(shapes, iccm, monkeypatch):
    (shapes / "bad.jsonl").write_text('{"source": "x"}\n{"sauce": 1}\n')
    result = iccm("batch", "bad.jsonl")
    assert (
        result.code == 2
        and len(result.lines) == 3
        and all(line.startswith("error: bad.jsonl") for line in result.lines)
    )
    assert iccm("batch", "none.toml").code == 2
    lines = [{"source": "square.svg", "target": "blob.svg", "method": "paper", "report": "r.json", **more}
             for more in ({"pin": [[0, 0, 1, 1]]}, {"vertices": 30, "report": "s.json"})]  # fmt: skip
    (shapes / "jobs.jsonl").write_text("\n".join(map(json.dumps, lines)))
    assert "2 jobs" in iccm("batch", "jobs.jsonl", "--dry-run").err and not (shapes / "s.json").exists()
    result = iccm("batch", "jobs.jsonl", "-j", "1")
    assert result.code == 1 and sorted(row["status"] for row in map(json.loads, result.out.splitlines())) == [
        "done",
        "failed",
    ]
    assert "outside the shape" in result.err and (shapes / "s.json").exists()


class Forgetful:
    """A pool that runs its jobs here, and loses the first worker after its files are written, with notice or by running
    the job again.
    """

    size, ahead = 1, 0

    def __init__(self, runs_again):
        self.runs_again, self.lost = runs_again, 0

    def together(self, left):
        return 1

    def submit(self, payloads):
        future, result = Future(), worker.run_bundle(payloads)
        if not self.lost:
            self.lost += 1
            if not self.runs_again:
                future.set_exception(RuntimeError("the worker died"))
                return future
            result = worker.run_bundle(payloads)
        future.set_result(result)
        return future

    def abandon(self, futures):
        pass

    def close(self):
        pass


@pytest.mark.parametrize("runs_again", [False, True])
def test_files_of_a_lost_worker_do_not_block_the_repeated_job(shapes, monkeypatch, runs_again):
    monkeypatch.chdir(shapes)
    job = Job(source="blob.svg", target="disk.svg", method="paper", vertices=40, size="24", output=("o.png",))
    pool, policy = Forgetful(runs_again), dispatch.Policy(retries=1)
    task = Task.of(1, "o", "job 1", job)
    first, second = (list(dispatch.execute([task], pool, Journal(shapes), policy)) for _ in range(2))
    assert pool.lost and first[0]["status"] in ("done", "poor"), first
    assert second[0]["status"] == "failed" and "o.png" in second[0]["message"]  # somebody else's file
