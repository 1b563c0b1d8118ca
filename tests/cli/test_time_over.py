"""Exit code 1 whenever the time limit is over: what is written is complete. A counter replaces the clock."""

import json
from pathlib import Path

import pytest

from iccm.deadline import Deadline

COLOURED = """<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 64 48">
<path fill="#c22" d="M8 6h20v36H8z"/><path fill="#26a" d="M36 6h20v30H36z"/></svg>"""
TARGET = (
    """<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 64 48"><path d="M10 9h40l8 14-8 20H10z"/></svg>"""
)
PLATE = "v 0 0 0\nv 3 0 0\nv 3 2 0\nv 0 2 .5\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\n"
CHECKS = 7  # of all times that the clock is read, spread over the run, each of which ends one run


@pytest.fixture
def files(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("c.svg").write_text(COLOURED)
    Path("b.svg").write_text(TARGET)
    Path("m.obj").write_text(PLATE)
    return tmp_path


@pytest.fixture
def clock(monkeypatch):
    """A clock that counts how often it is read, and shows that the time is over from a given count on."""
    state = {"reads": 0, "last": 10**9}

    def is_spent(self, share=1.0):
        state["reads"] += 1
        return state["reads"] > state["last"]

    monkeypatch.setattr(Deadline, "is_spent", is_spent)
    return state


def spread(count):
    """Numbers from 0 to count: all of the first few, then `CHECKS` of them evenly, and the last."""
    return sorted({*range(min(3, count)), *(round(k * count / CHECKS) for k in range(CHECKS)), count - 1})


@pytest.mark.slow
@pytest.mark.parametrize(
    "command",
    [
        "map c.svg b.svg -o o.npz -o o.png -o o.svg --size 40 --report r.json --threads 1",
        "map c.svg m.obj -o o.obj --report r.json --threads 1",
        "map c.svg m.obj -o o.png --bake --size 20 --report r.json --threads 1",
        "map c.svg b.svg -o o.png --parts all --size 40 --report r.json --threads 1",
        "flatten m.obj -o o.svg --report r.json",
        "deform b.svg --pin 20,20:22,20 -o o.png --size 30 --report r.json --threads 1",
    ],
)
def test_whenever_the_time_is_over_the_exit_code_is_1(iccm, files, clock, command):
    words = command.split()
    assert iccm(*words).code in (0, 1)
    written = [name for name in words if name.startswith("o.")]
    complete = {name: Path(name).read_bytes() for name in written}
    for last in spread(clock["reads"]):
        for name in [*written, "r.json"]:
            Path(name).unlink(missing_ok=True)
        clock.update(reads=0, last=last)
        result = iccm(*words)
        found = [name for name in written if Path(name).exists()]
        if clock["reads"] <= last:  # less is read the second time, because pictures are cached
            continue
        assert result.code == 1, (last, result.err)
        assert not list(files.glob(".*")) and not list(files.glob("*tmp*"))
        if not Path("r.json").exists():
            assert not found and "time-limit" in result.err, (last, result.err)
            continue
        report = json.loads(Path("r.json").read_text())
        assert report.get("not_written", []) == [name for name in written if name not in found]
        assert report["status"] not in ("reached", "done")
        assert all(complete[name][:4] == Path(name).read_bytes()[:4] for name in found)


@pytest.mark.slow
def test_a_batch_runs_jobs_again_whose_outputs_are_not_all_written(iccm, files, clock, monkeypatch):
    from iccm.io.batch import worker

    job = {"source": "c.svg", "target": "b.svg", "output": ["o.npz", "o.png"], "size": [40]}
    payload = {"job": job, "threads": 1, "folder": str(files), "seconds": 100.0}
    assert worker.run_job(payload)["status"] == "done"
    for name in ("o.npz", "o.png"):
        Path(name).unlink()
    clock.update(last=clock["reads"] - 1, reads=0)  # while the picture is written
    result = worker.run_job(payload)
    assert result["status"] == "timeout" and Path("o.npz").exists() and not Path("o.png").exists()
    assert [Path(entry["path"]).name for entry in result["outputs"]] == ["o.npz"]
