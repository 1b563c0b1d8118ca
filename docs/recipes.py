"""Run the commands of the pages, of all or of the named ones: python docs/recipes.py [--update] [PAGE ...]

A block marked `sh` or `python` is run, in a copy of `docs/files` and `samples`; a block marked `bash` is only shown.
The blocks of a page run in order; a `cd` in a block of `iccm` commands also applies to the next blocks. A comment
`<!-- figures: NAME ... -->` draws figures of docs/figures.py afterwards, which may show files that the commands wrote.

Every picture of docs/pictures that a page shows must be made by that page under the same name. A comment
`<!-- pictures: PAGE ... -->` names pages that make pictures which are only shown here. `--update` stores the pictures;
look at them afterwards.
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
FIGURES = re.compile(r"<!-- figures: ([\w ]+) -->")
ELSEWHERE = re.compile(r"<!-- pictures: ([\w/ -]+) -->")
WIDEST = 480  # pixels of a stored picture
WIDEST_STRIP = 960  # pixels of a stored picture that is more than twice as wide as high
LARGEST = 60_000  # bytes of a stored picture with all its colours; larger ones get a palette of 256
TOOLS = ("jq", "make", "parallel")  # a block that needs one of them is skipped if it is not installed
PLAIN = re.compile(r"(iccm|cd) [^|<>$&;*\n]*")
SHOWN = re.compile(r"(?:\]\(|src=\")[^)\"]*?pictures/([\w.-]+\.(?:png|svg|webp))[)\"]")


def text_of(page: Path) -> str:
    """Return the text of a page."""
    return page.read_text(encoding="utf-8")


def pages() -> list[Path]:
    """Return the README and all pages with commands to run or figures to draw."""
    candidates = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
    return [page for page in candidates if BLOCK.search(text_of(page)) or FIGURES.search(text_of(page))]


def shown(page: Path) -> list[str]:
    """Return the names of the pictures that a page shows."""
    return sorted(set(SHOWN.findall(text_of(page))))


def expected(page: Path) -> list[str]:
    """Return the names of the pictures that a page shows and must make itself."""
    lent = {
        name
        for other in ELSEWHERE.findall(text_of(page))
        for one in other.split()
        for name in shown(page_of(one))
    }
    return [name for name in shown(page) if name not in lent]


def page_of(name: str) -> Path:
    """Return the page that a comment names, such as `cookbook/photo` or `README`."""
    return ROOT / "README.md" if name == "README" else ROOT / "docs" / f"{name}.md"


def run(page: Path, folder: Path) -> None:
    """Run the commands of a page in an empty folder, and draw its figures.

    Lines that only change folders and call `iccm` run in this process, which saves the start of Python; bash runs the
    other blocks.

    Raises
    ------
    RuntimeError
        A command failed.
    """
    for part in ("docs/files", "samples"):
        shutil.copytree(ROOT / part, folder / part, ignore=shutil.ignore_patterns("out", "picture.png"))
    top = folder
    missing = [tool for tool in TOOLS if not shutil.which(tool)]
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    for language, text in BLOCK.findall(text_of(page)):
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
    draw_figures(page, top, folder)


def draw_figures(page: Path, folder: Path, inputs: Path) -> None:
    """Draw the figures of docs/figures.py that a page asks for, into a folder; files of the page are in `inputs`."""
    for names in FIGURES.findall(text_of(page)):
        command = [sys.executable, str(ROOT / "docs" / "figures.py"), str(folder), *names.split()]
        done = subprocess.run(command, cwd=inputs, capture_output=True, text=True)
        if done.returncode:
            raise RuntimeError(f"figures {names}: {done.stderr}")


def _run_line(line: str, folder: Path) -> Path:
    """Run one `iccm` command in a folder, or change the folder; return the folder for the next line."""
    from iccm import cli

    command, *rest = shlex.split(re.sub(r"\s#.*", "", line))
    if command == "cd":
        return folder / rest[0]
    messages, output = io.StringIO(), io.TextIOWrapper(io.BytesIO(), encoding="utf-8")
    with contextlib.chdir(folder), contextlib.redirect_stderr(messages), contextlib.redirect_stdout(output):
        code = cli.run(rest)
    if code:
        raise RuntimeError(f"{line}\n{messages.getvalue()}")
    return folder


def made(page: Path, folder: Path) -> dict[str, Path]:
    """Return the pictures that a page must make, with the paths at which its commands wrote them."""
    return {name: path for name in expected(page) for path in folder.rglob(name)}


def keep(made: Path, kept: Path) -> None:
    """Store a picture: drawings and animations unchanged, PNGs reduced to `WIDEST`, large ones with a palette."""
    if made.suffix in (".svg", ".webp"):
        shutil.copyfile(made, kept)
        return
    with Image.open(made) as picture:
        widest = WIDEST_STRIP if picture.width > 2 * picture.height else WIDEST
        height = round(picture.height * min(1, widest / picture.width))
        small = picture.resize((min(picture.width, widest), height), Image.Resampling.LANCZOS)
        small.save(kept, optimize=True)
        if kept.stat().st_size > LARGEST:
            small.convert("RGBA").quantize(256, method=Image.Quantize.FASTOCTREE).save(kept, optimize=True)


def _short(name: str) -> str:
    """Return a page's name without folder `docs` and suffix, such as `cookbook/photo`."""
    return name.removesuffix(".md").removeprefix("docs/")


def main(arguments: list[str]) -> int:
    """Run the pages, and return 0 if all commands succeeded and made the pictures shown, else 1."""
    wrong = 0
    asked = {_short(name) for name in arguments if name != "--update"}
    for page in pages():
        if asked and not {page.stem, _short(page.relative_to(ROOT).as_posix())} & asked:
            continue
        with tempfile.TemporaryDirectory() as name:
            try:
                run(page, Path(name))
            except RuntimeError as error:
                print(f"{page.relative_to(ROOT)}: {error}", file=sys.stderr)
                wrong += 1
                continue
            pictures = made(page, Path(name))
            missing = sorted(set(expected(page)) - set(pictures))
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
