"""Runs the commands of the pages, all or those that are named: python docs/recipes.py [--update] [PAGE ...]

A block marked `sh` or `python` runs, at the root of a copy of `docs/files` and `samples`; a block marked `bash` is only
shown. A page's blocks run in their order, each in the folder in which the one before ended. A picture of docs/pictures
that a page shows is made by its blocks under the same name. --update keeps it; look at it first.
"""

import contextlib
import io
import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image

ROOT = Path(__file__).resolve().parent.parent
PICTURES = ROOT / "docs" / "pictures"
BLOCK = re.compile(r"^```(sh|python)\n(.*?)^```", re.DOTALL | re.MULTILINE)
WIDEST = 480  # pixels of a picture that is kept
TOOLS = ("jq", "make", "parallel")  # a block that needs one that is not installed is left out
PLAIN = re.compile(r"(iccm|cd) [^|<>$&;*\n]*")
SHOWN = re.compile(r"!\[[^\]]*\]\([^)]*?pictures/([\w.-]+\.(?:png|svg))\)")


def pages() -> list[Path]:
    """The README and all pages that hold commands to run."""
    found = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
    return [page for page in found if BLOCK.search(page.read_text(encoding="utf-8"))]


def shown(page: Path) -> list[str]:
    """The names of the pictures that a page shows and its commands make."""
    return sorted(set(SHOWN.findall(page.read_text(encoding="utf-8"))))


def run(page: Path, folder: Path) -> None:
    """Run a page's commands in an empty folder: lines that only change folders and call `iccm` in this process, to save
    its start, blocks of others by bash.

    Raises:
        RuntimeError: a command failed.
    """
    for part in ("docs/files", "samples"):
        shutil.copytree(ROOT / part, folder / part, ignore=shutil.ignore_patterns("out", "picture.png"))
    missing = [tool for tool in TOOLS if not shutil.which(tool)]
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    for language, text in BLOCK.findall(page.read_text(encoding="utf-8")):
        if any(re.search(rf"(^|\| |&& ){tool} ", text, re.MULTILINE) for tool in missing):
            continue
        if language == "sh" and all(PLAIN.fullmatch(line) for line in text.splitlines()):
            for line in text.splitlines():
                folder = _run_line(line, folder)
            continue
        command = (
            ["bash", "-eo", "pipefail", "-c", text] if language == "sh" else [sys.executable, "-c", text]
        )
        done = subprocess.run(
            command, cwd=folder, env=os.environ | {"PATH": path}, capture_output=True, text=True
        )
        if done.returncode:
            raise RuntimeError(f"{text}{done.stderr}")


def _run_line(line: str, folder: Path) -> Path:
    """Run one `iccm` in a folder, or change it; the folder for the next line."""
    from iccm import cli

    command, *rest = shlex.split(re.sub(r"\s#.*", "", line))
    if command == "cd":
        return folder / rest[0]
    told, made = io.StringIO(), io.TextIOWrapper(io.BytesIO(), encoding="utf-8")
    with contextlib.chdir(folder), contextlib.redirect_stderr(told), contextlib.redirect_stdout(made):
        code = cli.run(rest)
    if code:
        raise RuntimeError(f"{line}\n{told.getvalue()}")
    return folder


def made(page: Path, folder: Path) -> dict[str, Path]:
    """The pictures that a page shows, where its commands have put them."""
    return {name: path for name in shown(page) for path in folder.rglob(name)}


def keep(made: Path, kept: Path) -> None:
    """Copy a picture, a PNG no wider than `WIDEST`."""
    if made.suffix == ".svg":
        shutil.copyfile(made, kept)
        return
    with Image.open(made) as picture:
        height = round(picture.height * min(1, WIDEST / picture.width))
        picture.resize((min(picture.width, WIDEST), height), Image.Resampling.LANCZOS).save(kept)


def main(arguments: list[str]) -> int:
    """0 when the commands of all pages ran and made the pictures shown, else 1."""
    wrong = 0
    names = [Path(name).stem for name in arguments if name != "--update"]
    for page in pages():
        if names and page.stem not in names:
            continue
        with tempfile.TemporaryDirectory() as name:
            try:
                run(page, Path(name))
            except RuntimeError as error:
                print(f"{page.relative_to(ROOT)}: {error}", file=sys.stderr)
                wrong += 1
                continue
            pictures = made(page, Path(name))
            missing = sorted(set(shown(page)) - set(pictures))
            print(f"{page.relative_to(ROOT)}: {', '.join(pictures) or 'no picture'}", flush=True)
            if missing:
                print(f"{page.relative_to(ROOT)}: not made: {', '.join(missing)}", file=sys.stderr)
                wrong += 1
            if "--update" in arguments:
                for file, path in pictures.items():
                    keep(path, PICTURES / file)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
