"""Compare the speed of tasks with another version, such as the last release.

python -m tests.bench.guard WHEEL|COMMIT [--rounds 11] [--limit 1.2]

The other version is a wheel, or a tag or commit of this repository, whose wheel is built. It is installed in a fresh
environment with the Python that runs this. Both versions are asked by turns in one run, and only the ratios of their
processor times are reported: the median over the rounds, and the quartiles. The exit code is 1 if the median of a task
is above the limit.
"""

import argparse
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
QUIET = ("--quiet", "--quiet", "--disable-pip-version-check")  # mistakes are shown, warnings are not
TASKS = Path(__file__).resolve().parent / "guarded.py"


class Version:
    """A version of iccm in a process of its own, which waits for tasks."""

    def __init__(self, python: str, folder: Path) -> None:
        """Start it; `folder` must not contain the sources, which would be imported instead of what is installed."""
        command = [python, "-P", str(TASKS)]
        pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
        self.process = subprocess.Popen(command, cwd=folder, **pipes)
        self._words = self.process.stdout.readline().split()
        if self._words[:1] != ["ready"]:
            raise SystemExit(f"{python}: the tasks could not be started")

    @property
    def name(self) -> str:
        """The version's number."""
        return self._words[1]

    @property
    def tasks(self) -> list[str]:
        """The tasks that it can do."""
        return self._words[2:]

    def seconds(self, task: str) -> float:
        """Return the processor time that a task takes."""
        self.process.stdin.write(task + "\n")
        self.process.stdin.flush()
        return float(self.process.stdout.readline())

    def end(self) -> None:
        """End the process."""
        self.process.stdin.close()
        self.process.wait()


def wheel_of(version: str, folder: Path) -> Path:
    """Return a wheel: the file that is named, or one that is built from a commit.

    Raises
    ------
    SystemExit
        There is no such file or commit.
    """
    if version.endswith(".whl"):
        if not Path(version).is_file():
            raise SystemExit(f"{version}: no such file")
        return Path(version).resolve()
    archive = subprocess.run(["git", "archive", "--end-of-options", version], cwd=ROOT, capture_output=True)
    if archive.returncode:
        raise SystemExit(f"{version}: not a wheel or a commit: {archive.stderr.decode().strip()}")
    tree = folder / "tree"
    tree.mkdir()
    subprocess.run(["tar", "-x", "-C", str(tree)], input=archive.stdout, check=True)
    pip = [sys.executable, "-m", "pip", "wheel", *QUIET, "--no-deps"]
    subprocess.run([*pip, "--wheel-dir", str(folder), str(tree)], check=True)
    return next(folder.glob("iccm-*.whl"))


def install(wheel: Path, folder: Path) -> str:
    """Install a wheel in a fresh environment, and return its Python."""
    environment = folder / "venv"
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", str(environment)], check=True)
    python = environment / ("Scripts/python.exe" if sys.platform == "win32" else "bin/python")
    pip = [sys.executable, "-m", "pip", "--python", str(python), "install", *QUIET]
    subprocess.run([*pip, str(wheel)], check=True)
    return str(python)


def compare(new: Version, old: Version, rounds: int) -> dict[str, list[float]]:
    """Return the ratios of processor times of each task that both versions can do; above 1 the new one is slower."""
    ratios: dict[str, list[float]] = {task: [] for task in new.tasks if task in old.tasks}
    for number in range(rounds):
        for task, task_ratios in ratios.items():
            if number % 2:  # whichever comes second finds the machine as the first one left it
                before = old.seconds(task)
                task_ratios.append(new.seconds(task) / before)
            else:
                after = new.seconds(task)
                task_ratios.append(after / old.seconds(task))
    return ratios


def report(ratios: dict[str, list[float]], limit: float) -> list[str]:
    """Print a line for each task, and return the tasks above the limit."""
    slower = []
    for task, task_ratios in ratios.items():
        low, median, high = statistics.quantiles(task_ratios, n=4)
        too_slow = median > limit
        slower += [task] if too_slow else []
        print(f"{task:10} {median:.3f} ({low:.3f} to {high:.3f}){f', above {limit:g}' if too_slow else ''}")
    return slower


def main() -> int:
    """Compare both versions; return 1 if a task has become slower."""
    parser = argparse.ArgumentParser(
        prog="python -m tests.bench.guard", description=__doc__.partition("\n")[0]
    )
    parser.add_argument("version", metavar="WHEEL|COMMIT")
    parser.add_argument("--rounds", type=int, default=11)
    parser.add_argument(
        "--limit", type=float, default=1.2, help="the ratio above which a task is too slow [1.2]"
    )
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        old_python = install(wheel_of(options.version, folder), folder)
        versions = [Version(sys.executable, folder), Version(old_python, folder)]
        try:
            new, old = versions
            print(f"time of iccm {new.name} here relative to {old.name} ({options.version}):")
            missing = [task for task in new.tasks if task not in old.tasks]
            slower = report(compare(new, old, options.rounds), options.limit)
            for task in missing:
                print(f"{task:10} cannot be compared: not in {options.version}")
        finally:
            for version in versions:
                version.end()
    return int(bool(slower))


if __name__ == "__main__":
    sys.exit(main())
