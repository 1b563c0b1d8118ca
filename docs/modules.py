"""Complete the list of modules in the docstring of each folder's `__init__.py`: python docs/modules.py

A new module gets a line at the end of the list, with the first sentence of its docstring; lines of modules that no
longer exist are removed. All other lines are written by hand, and kept.
"""

import ast
import re
import textwrap
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
ROW = re.compile(r"((\w+/?(?:, \w+/?)*) {2,})\S")
"""The beginning of a line of a list: names, two or more spaces, and a description. Names of folders end in a slash."""
LINE_LENGTH = 120


def files() -> dict[Path, str]:
    """Return the text of each `__init__.py` with a complete list of the modules and folders in its package."""
    paths = sorted(
        path for part in ("iccm", "io", "cli", "extensions") for path in (ROOT / part).rglob("__init__.py")
    )
    return {path: completed(path.read_text(encoding="utf-8"), modules_in(path.parent)) for path in paths}


def modules_in(folder: Path) -> dict[str, Path]:
    """Return the files of the modules in a package by name, and of the packages in it by name and slash."""
    modules = {path.stem: path for path in folder.glob("*.py") if path.stem != "__init__"}
    packages = [*folder.glob("*/__init__.py")]
    if folder == ROOT / "iccm":  # these are installed in it
        packages += [ROOT / part / "__init__.py" for part in ("io", "cli", "extensions")]
    return modules | {f"{path.parent.name}/": path for path in packages}


def completed(text: str, modules: dict[str, Path]) -> str:
    """Return the text of an `__init__.py` with each module in its list."""
    lines = text.splitlines(keepends=True)
    end = ast.parse(text).body[0].end_lineno  # of the docstring
    rows = {number: match for number, line in enumerate(lines[:end]) if (match := ROW.match(line))}
    if not rows:
        return text
    last = rows[max(rows)]
    listed = {name for match in rows.values() for name in match[2].split(", ")}
    for name in sorted(modules.keys() - listed, reverse=True):
        start = f"{name:{max(len(name) + 2, last.end(1))}}"
        description = textwrap.shorten(described(modules[name]), LINE_LENGTH - len(start), placeholder="…")
        lines.insert(max(rows) + 1, f"{start}{description}\n")
    for number in sorted(rows, reverse=True):
        if not modules.keys() & set(rows[number][2].split(", ")):
            del lines[number]
    return "".join(lines)


def described(path: Path) -> str:
    """Return the first sentence of a module's docstring as the description in a list."""
    text = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or path.stem
    sentence = re.split(r"\.(?:\s|$)", text.replace("\n", " "))[0]
    starts_with_word = re.match(r"[A-Z][a-z]* ", sentence) is not None
    return sentence[0].lower() + sentence[1:] if starts_with_word else sentence


if __name__ == "__main__":
    for path, text in files().items():
        path.write_text(text, encoding="utf-8")
