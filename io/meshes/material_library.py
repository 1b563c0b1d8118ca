"""OBJ material libraries that keep their lines: only `map_Kd` changes, and file names when the library moves."""

import os
from dataclasses import dataclass
from pathlib import Path

from ...errors import InputError

MAX_BYTES = 16 << 20
ARGUMENTS = {
    "-blendu": 1,
    "-blendv": 1,
    "-cc": 1,
    "-clamp": 1,
    "-texres": 1,
    "-imfchan": 1,
    "-type": 1,
    "-bm": 1,
}
ARGUMENTS |= {"-boost": 1, "-mm": 2}
UP_TO_THREE = ("-o", "-s", "-t")
MAPS = ("map_", "bump", "disp", "decal", "refl", "norm")
PLAIN = ["Ka 1 1 1", "Kd 1 1 1", "Ks 0 0 0", "illum 1"]


@dataclass(frozen=True)
class Library:
    """Lines of the material libraries of an OBJ file, in one, and the folder their file names are relative to."""

    lines: tuple[str, ...]
    folder: Path

    def materials(self) -> dict[str, list[str]]:
        """The lines of each material by name, the `newmtl` line first."""
        found: dict[str, list[str]] = {}
        current: list[str] = []
        for line in self.lines:
            word, rest = _split(line)
            if word == "newmtl":
                current = found.setdefault(rest, [])
            current.append(line)
        return found

    def texture(self, material: str) -> Path | None:
        """The file of a material's `map_Kd`."""
        for line in self.materials().get(material, []):
            word, rest = _split(line)
            if word.lower() == "map_kd" and file_name(rest):
                return self.folder / file_name(rest).replace("\\", "/")
        return None

    def maps(self, material: str) -> list[str]:
        """The statements of a material that name pictures, `map_Kd` and others."""
        words = [_split(line)[0] for line in self.materials().get(material, [])]
        return [word for word in words if word.lower().startswith(MAPS)]


def read(folder: Path, names: list[str]) -> tuple[Library, list[str]]:
    """The libraries that `mtllib` lines name, and a note for each that is missing.

    A line may name a file with spaces or several files: the first that exists is meant.
    """
    lines: list[str] = []
    notes = []
    for text in names:
        whole = folder / text
        paths = [whole] if os.path.isfile(whole) else [folder / word for word in text.split()]
        for path in paths:
            if not os.path.isfile(path) or path.stat().st_size > MAX_BYTES:
                notes.append(
                    f"{path}: the material library is missing or too large; its materials are made anew"
                )
                continue
            lines += path.read_bytes().decode("utf-8", "surrogateescape").splitlines()
    return Library(tuple(lines), folder), notes


def bound(library: Library, rename: dict[str | None, str], plain: str, texture: Path, out: Path) -> str:
    """The text of a library for the file `out` in which the renamed materials show the texture.

    Args:
        library: as read.
        rename: new material name by old; None stands for "no material".
        plain: a material for faces that had none, if that is needed.
        texture: the picture.
        out: the library's own path: file names become relative to its folder.

    Raises:
        InputError: the texture's name cannot stand in a material library.
    """
    name = name_of(texture, out.parent)
    moved = [_moved(line, library.folder, out.parent) for line in library.lines]
    found = Library(tuple(moved), out.parent).materials()
    text: list[str] = []
    for line in moved:  # what stands before the first material
        if _split(line)[0] == "newmtl":
            break
        text.append(line)
    for material, lines in found.items():
        text += _with_map(lines, name) if rename.get(material) == material else lines
    for old, new in rename.items():
        if new != old or old not in found:
            body = found[old][1:] if old in found else PLAIN
            text += _with_map([f"newmtl {new}", *body], name)
    if plain and plain not in found:
        text += [f"newmtl {plain}", *PLAIN]
    return "\n".join(text) + "\n"


def name_of(texture: Path, folder: Path) -> str:
    """A picture's name in a material library of the folder.

    Raises:
        InputError: it cannot stand in one.
    """
    name = relative(texture, folder)
    if name != name.strip() or "\n" in name or "\r" in name or name.startswith("-"):
        raise InputError(f"{texture}: a material library cannot name this file; rename it")
    return name


def relative(file: Path, folder: Path) -> str:
    """The file's name as seen from a folder, with forward slashes."""
    try:
        return Path(os.path.relpath(file, folder)).as_posix()
    except ValueError:  # another drive
        return file.resolve().as_posix()


def file_name(rest: str) -> str:
    """What a map statement names after its options; it may contain spaces."""
    words = rest.split(" ")
    k = 0
    while k < len(words):
        option = words[k].lower()
        if option in ARGUMENTS:
            k += 1 + ARGUMENTS[option]
        elif option in UP_TO_THREE:
            k += 1
            for _ in range(3):
                k += k < len(words) and _is_number(words[k])
        elif option == "":
            k += 1
        else:
            break
    return " ".join(words[k:]).strip()


def _with_map(lines: list[str], name: str) -> list[str]:
    """A material's lines with its map_Kd replaced: options such as scaling belong to the old coordinates."""
    kept = [line for line in lines if _split(line)[0].lower() != "map_kd"]
    last = max(k for k, line in enumerate(kept) if line.strip())
    return [*kept[: last + 1], f"map_Kd {name}", *kept[last + 1 :]]


def _moved(line: str, old: Path, new: Path) -> str:
    """A line whose file name is relative to the new folder."""
    word, rest = _split(line)
    if old.resolve() == new.resolve() or not word.lower().startswith(MAPS):
        return line
    name = file_name(rest)
    if not name or Path(name).is_absolute() or "\\" in name:
        return line
    start = line.rindex(name)
    return line[:start] + relative(old / name, new) + line[start + len(name) :]


def _split(line: str) -> tuple[str, str]:
    word, _, rest = line.strip().replace("\t", " ").partition(" ")
    return word, rest.strip()


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True
