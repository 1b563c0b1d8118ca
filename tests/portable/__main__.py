"""Run the fast tests as on Windows or macOS, one folder after another, and count the results.

python -m tests.portable [--system windows|macos] [tests/io/batch …] [-k expression]

`site/sitecustomize.py` lists what is imitated. What cannot be imitated here: paths with drives and backslashes and the
case of names in calls of the system, `msvcrt`, consoles, the sharing of files between processes, symbolic links that
need a privilege, and the libraries' own code for these systems. The core is the one of this system.
"""

import argparse
import os
import re
import subprocess
import sys
import tempfile
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SITE = Path(__file__).resolve().parent / "site"
COUNTED = ("passed", "failed", "skipped", "error", "errors")


def environment(system: str, temporary: Path) -> dict[str, str]:
    """Return the environment of the imitated system, which each Python process that inherits it sees.

    On macOS, the folder of temporary files has a symbolic link in its path.
    """
    path = os.pathsep.join(part for part in (str(SITE), os.environ.get("PYTHONPATH", "")) if part)
    common = {**os.environ, "PYTHONPATH": path, "ICCM_IMITATE": system}
    if system == "windows":
        return {**common, "PYTHONIOENCODING": "cp1252"}
    (temporary / "private").mkdir()
    (temporary / "var").symlink_to("private", target_is_directory=True)
    return {**common, "TMPDIR": str(temporary / "var")}


def folders() -> list[Path]:
    """Return the folders of tests, and the files of tests that are in none."""
    with_tests = {path.parent for path in (ROOT / "tests").rglob("test_*.py")} - {ROOT / "tests"}
    return [*sorted(with_tests), *sorted((ROOT / "tests").glob("test_*.py"))]


def run(system: str, path: Path, *options: str) -> tuple[Counter, list[str]]:
    """Run the fast tests of a folder, without those of its folders, and return counts and the lines about failures."""
    tests = [str(path)] if path.is_file() else sorted(map(str, path.glob("test_*.py")))
    command = [sys.executable, "-X", "faulthandler", "-m", "pytest", "-p", "as_there", "-m", "not slow"]
    command += ["-q", "-n", "0", "-rfE", "--tb", "short", *options, *tests]
    with tempfile.TemporaryDirectory() as folder:
        variables = environment(system, Path(folder))
        result = subprocess.run(command, cwd=ROOT, env=variables, capture_output=True, text=True)
    last = (result.stdout.strip().splitlines() or [""])[-1]
    counts = Counter(
        {name: int(number) for number, name in re.findall(r"(\d+) (\w+)", last) if name in COUNTED}
    )
    if result.returncode not in (0, 1, 5) and not counts:  # 5: no tests were selected
        counts["errors"] += 1
    return counts, [] if result.returncode in (0, 5) else [result.stdout[-20_000:], result.stderr[-2_000:]]


def main() -> int:
    """Print a line for each folder, and the sum; return 1 if a test failed."""
    parser = argparse.ArgumentParser(prog="python -m tests.portable", description=__doc__.partition("\n")[0])
    parser.add_argument("paths", nargs="*", type=Path, help="folders or files of tests [default: all]")
    parser.add_argument("-k", metavar="EXPRESSION", help="tests to select, as pytest's option")
    parser.add_argument("--system", choices=("windows", "macos"), default="windows")
    arguments = parser.parse_args()
    total, options = Counter(), ["-k", arguments.k] if arguments.k else []
    for path in [path.resolve() for path in arguments.paths] or folders():
        counts, trouble = run(arguments.system, path, *options)
        total += counts
        print(f"{path.relative_to(ROOT)}: {describe(counts)}", *trouble, sep="\n", flush=True)
    print(f"all: {describe(total)}")
    return int(any(total[name] for name in ("failed", "error", "errors")))


def describe(counts: Counter) -> str:
    """Return counts of results in words."""
    return ", ".join(f"{number} {name}" for name, number in counts.items()) or "no tests"


if __name__ == "__main__":
    sys.exit(main())
