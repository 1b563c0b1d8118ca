"""Run all samples, or those that are named: python samples/run.py [--update] [NAME ...]

A sample is a folder with a file command.txt, one command per line, run from within the folder. Results are written to
out/. --update stores out/picture.png as the sample's picture.png, with which the tests compare; look at it first.
"""

import contextlib
import io
import os
import shlex
import shutil
import sys
import time
from pathlib import Path

from iccm import cli

HERE = Path(__file__).resolve().parent


def samples() -> list[Path]:
    """Return the folders of all samples, by name."""
    return sorted(path.parent for path in HERE.glob("*/command.txt"))


def commands(folder: Path) -> list[list[str]]:
    """Return the arguments of a sample's commands; old results are replaced."""
    lines = (folder / "command.txt").read_text(encoding="utf-8").splitlines()
    words = [shlex.split(line, comments=True) for line in lines]
    return [[*rest, "--force"] for _, *rest in filter(None, words)]


def run(folder: Path, *, update: bool = False) -> bool:
    """Run a sample in this process, print a line about it, and return whether it succeeded."""
    (folder / "out").mkdir(exist_ok=True)
    print(f"{folder.name:16} ...", end="\r", flush=True)
    start = time.perf_counter()
    for command in commands(folder):
        messages = io.StringIO()
        with contextlib.chdir(folder), contextlib.redirect_stderr(messages):
            code = cli.run(command)
        if code:
            print(f"{folder.name:16} failed, exit code {code}", flush=True)
            print(messages.getvalue(), file=sys.stderr, flush=True)
            return False
    if update:
        shutil.copyfile(folder / "out" / "picture.png", folder / "picture.png")
    pictures = ", ".join(
        sorted(str(path.relative_to(HERE.parent)) for path in (folder / "out").glob("*.png"))
    )
    print(f"{folder.name:16} {time.perf_counter() - start:5.1f} s   {pictures}", flush=True)
    return True


def main(names: list[str]) -> int:
    """Run samples; return 0 if all succeeded, 1 if one failed, 2 if a name is unknown."""
    update, names = "--update" in names, [name for name in names if name != "--update"]
    folders = samples()
    unknown = sorted(set(names) - {folder.name for folder in folders})
    if unknown:
        print(f"no sample {unknown[0]!r}; there is {', '.join(f.name for f in folders)}", file=sys.stderr)
        return 2
    os.environ["OPENBLAS_NUM_THREADS"] = "1"  # as `iccm` does; other threads would wait busily
    results = [run(folder, update=update) for folder in folders if not names or folder.name in names]
    return 0 if all(results) else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
