"""The comparison of speed with another version, with versions whose times are given."""

import subprocess
import sys

import pytest

from tests.bench import guard, guarded


class Version:
    """A version whose tasks take given seconds, one after another, and which records the calls."""

    def __init__(self, name, calls, **seconds):
        self.name, self.calls, self._seconds = name, calls, seconds

    @property
    def tasks(self):
        return list(self._seconds)

    def seconds(self, task):
        self.calls.append(self.name)
        return self._seconds[task].pop(0)


def test_versions_alternate():
    calls = []
    new, old = Version("new", calls, solve=[3.0, 6.0]), Version("old", calls, solve=[2.0, 3.0], other=[1.0])
    assert guard.compare(new, old, 2) == {"solve": [1.5, 2.0]}
    assert calls == ["new", "old", "old", "new"]


def test_only_the_median_counts(capsys):
    ratios = {"solve": [1.0, 9.0, 1.1, 1.0, 9.0], "warp": [1.3, 1.0, 1.3, 1.3, 1.0], "map": [1.0] * 5}
    assert guard.report(ratios, 1.2) == ["warp"]
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith("solve      1.100 (") and "above" not in lines[0] and "above 1.2" in lines[1]


@pytest.mark.slow
def test_there_is_a_task_for_each_part(tmp_path):
    functions = guarded.tasks(tmp_path)
    assert {"solve", "pins", "map", "warp", "flatten", "read", "start", "command", "artwork"} <= set(
        functions
    )
    assert len(functions) >= 12
    for name in ("artwork", "letters"):
        (tmp_path / "out.svg").unlink(missing_ok=True)
        functions[name]()
        assert (tmp_path / "out.svg").stat().st_size


@pytest.mark.slow
def test_a_version_answers_with_seconds(tmp_path):
    version = guard.Version(sys.executable, tmp_path)
    try:
        assert 0 < version.seconds("map") < 60 and "solve" in version.tasks
    finally:
        version.end()
    assert version.process.returncode == 0


def test_a_version_that_does_not_start_is_reported(tmp_path, monkeypatch):
    monkeypatch.setattr(guard, "TASKS", tmp_path / "none.py")
    with pytest.raises(SystemExit, match="could not be started"):
        guard.Version(sys.executable, tmp_path)
    assert (
        subprocess.run([sys.executable, "-m", "tests.bench.guard", "--help"], capture_output=True).returncode
        == 0
    )


@pytest.mark.parametrize("name", ["absent.whl", "no-such-commit", "--output=archive.tar"])
def test_packages_other_than_wheels_and_commits_are_reported(tmp_path, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as stopped:
        guard.wheel_of(name, tmp_path)
    assert name in str(stopped.value) and not list(tmp_path.iterdir())
