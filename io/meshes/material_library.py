"""OBJ material libraries with all their statements: only pictures change, and file names when the library moves."""

import os
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from ...errors import InputError
from ...pixels.texture import REPEAT, Wrap
from .. import limits, references
from ..files import relative_path

ONE = ("-blendu", "-blendv", "-cc", "-clamp", "-texres", "-imfchan", "-type", "-bm", "-boost")
ARGUMENTS = dict.fromkeys(ONE, 1) | {"-mm": 2}
UP_TO_THREE = ("-o", "-s", "-t")
PLACING = (*UP_TO_THREE, "-clamp")  # options that place a picture
SPELT = {"map_kd": "map_Kd", "map_ke": "map_Ke", "map_pr": "map_Pr", "map_pm": "map_Pm", "map_ks": "map_Ks"}
SPELT |= dict.fromkeys(("bump", "map_bump"), "map_Bump -bm 1")  # Blender takes a missing -bm for strength 0
MAPS = ("map_", "bump", "disp", "decal", "refl", "norm")
MAP = re.compile(r"map_\w+|bump|disp|decal|refl|norm", re.IGNORECASE)
NUMBERS = {"ka", "kd", "ks", "ke", "ns", "ni", "d", "tr", "tf", "illum", "sharpness"}
NUMBERS |= {"pr", "pm", "ps", "pc", "pcr", "aniso", "anisor"}
WHITE = "Kd 1 1 1"
PLAIN = ["Ka 1 1 1", WHITE, "Ks 0 0 0", "illum 1"]


@dataclass(frozen=True)
class Library:
    """The material libraries of an OBJ file, concatenated.

    Attributes:
        lines: their statements.
        folder: folder that file names are relative to.
        missing: a note for each library that does not exist.
        outside: a note for each file that is ignored because it is not in the folder.
    """

    lines: tuple[str, ...]
    folder: Path
    missing: tuple[str, ...] = ()
    outside: tuple[str, ...] = ()

    @cached_property
    def materials(self) -> dict[str, list[str]]:
        """The lines of each material by name, starting with the `newmtl` line."""
        materials: dict[str, list[str]] = {}
        current: list[str] = []
        for line in self.lines:
            word, name = split(line)
            if word == "newmtl":
                current = materials.setdefault(name, [])
            current.append(line)
        return materials

    def texture(self, material: str) -> tuple[Path, Wrap] | None:
        """Return the file of a material's `map_Kd`, and its wrap mode; None without one."""
        for line in self.materials.get(material, []):
            if split(line)[0].lower() == "map_kd" and (name := picture_named(line)):
                return self.folder / name, wrap(split(line)[1])
        return None

    def maps(self, material: str) -> list[str]:
        """Return the keywords of a material's statements that refer to pictures, `map_Kd` and others."""
        words = [split(line)[0] for line in self.materials.get(material, [])]
        return [word for word in words if word.lower().startswith(MAPS)]


def read(folder: Path, names: list[str]) -> Library:
    """Read the libraries that `mtllib` lines name.

    A line may contain the name of one file with spaces, or the names of several files; existing files are preferred. So
    that nothing from an unrelated file gets into the output, lines that are not statements are dropped.
    """
    lines: list[str] = []
    missing, outside = [], []
    paths: list[Path] = []
    for text in dict.fromkeys(names):
        unsplit = folder / text
        paths += [unsplit] if os.path.isfile(unsplit) else [folder / word for word in text.split()]
    room = limits.LIBRARY_BYTES
    for path in dict.fromkeys(paths):
        if not references.may_be_read(path, folder):
            outside.append(f"refers to the material library {relative(path, folder)}, {references.OUTSIDE}")
        elif not os.path.isfile(path) or path.stat().st_size > room:
            missing.append(f"{path}: the material library is missing or too large; new materials are created")
        else:
            room -= path.stat().st_size
            lines += path.read_bytes().decode("utf-8", "surrogateescape").splitlines()
    statements = []
    for line in filter(_is_statement, lines):
        picture = picture_named(line)
        if picture and not references.may_be_read(folder / picture, folder):
            outside.append(f"a material refers to {picture}, {references.OUTSIDE}")
        else:
            statements.append(line)
    return Library(tuple(statements), folder, tuple(missing), tuple(dict.fromkeys(outside)))


def _is_statement(line: str) -> bool:
    """Return whether a line is empty or looks like a statement of the format."""
    word, arguments = split(line)
    if word.lower() in NUMBERS:
        return all(is_number(argument) or argument in ("-halo", "xyz") for argument in arguments.split())
    return (
        not word
        or word == "newmtl"
        or bool(picture_named(line))
        or bool(MAP.fullmatch(word) and not arguments)
    )


def picture_named(line: str) -> str:
    """Return the picture file that a statement refers to, with forward slashes; empty if there is none."""
    word, arguments = split(line)
    return file_name(arguments).replace("\\", "/") if MAP.fullmatch(word) else ""


Names = Mapping[str | None, Mapping[str, str]]
"""Names of pictures by material (None: no material) and lower-case statement."""


def bind(
    library: Library,
    rename: dict[str | None, str],
    plain: str,
    pictures: Names,
    out: Path,
    *,
    untinted: bool = False,
) -> str:
    """Return the text of a library for the file `out`, with renamed materials that show other pictures.

    Args:
        library: as read.
        rename: new material name by old one; None stands for "no material".
        plain: name of a material for faces that had none, if needed.
        pictures: names of the pictures, see `name_of`, by old material name.
        out: path of the library; file names become relative to its folder.
        untinted: whether the new pictures are to be seen as they are: the diffuse colours (Kd) of their materials
            become white, because many programs multiply both.
    """
    moved_lines = [_move(line, library.folder, out.parent) for line in library.lines]
    materials = Library(tuple(moved_lines), out.parent).materials
    text: list[str] = []
    for line in moved_lines:  # lines before the first material
        if split(line)[0] == "newmtl":
            break
        text.append(line)
    for material, lines in materials.items():
        changes = rename.get(material) == material
        text += with_maps(lines, pictures.get(material, {}), untinted=untinted) if changes else lines
    for old, new in rename.items():
        if new != old or old not in materials:
            body = materials[old][1:] if old in materials else PLAIN
            text += with_maps([f"newmtl {new}", *body], pictures.get(old, {}), untinted=untinted)
    if plain and plain not in materials:
        text += [f"newmtl {plain}", *PLAIN]
    return "\n".join(text) + "\n"


def name_of(texture: Path, folder: Path) -> str:
    """Return the name of a picture in a material library in the folder.

    Raises:
        InputError: the format cannot represent the name.
    """
    name = relative(texture, folder)
    if name != name.strip() or "\n" in name or "\r" in name or name.startswith("-"):
        raise InputError(f"{texture}: a material library cannot refer to a file of this name; rename it")
    return name


def picture_of(mesh: Path, material: str | None, word: str) -> Path:
    """Return the path beside a mesh for a picture of a material's statement; None stands for the only material."""
    parts = [mesh.stem, *([] if material is None else [re.sub(r"[^\w.-]", "_", material) or "plain"]), word]
    return mesh.with_name("-".join(parts).replace("map_", "") + ".png")


def relative(file: Path, folder: Path) -> str:
    """Return the path of a file relative to a folder, with forward slashes."""
    return Path(relative_path(file, folder)).as_posix()


def file_name(arguments: str) -> str:
    """Return the file name after the options of a map statement; it may contain spaces."""
    return _options(arguments)[1]


def with_maps(lines: list[str], names: Mapping[str, str], *, untinted: bool = False) -> list[str]:
    """Return a material's lines with other pictures, without options that place the old pictures.

    If `untinted`, a diffuse colour beside a new `map_Kd` becomes white.
    """
    if untinted and "map_kd" in names:
        lines = [WHITE if split(line)[0].lower() == "kd" else line for line in lines]
    old_lines = {split(line)[0].lower(): line for line in lines}
    remaining = [line for line in lines if split(line)[0].lower() not in names]
    last = max((k for k, line in enumerate(remaining) if line.strip()), default=-1)
    new = [_naming(old_lines.get(word, SPELT.get(word, word)), name) for word, name in names.items()]
    return [*remaining[: last + 1], *new, *remaining[last + 1 :]]


def _naming(line: str, name: str) -> str:
    """Return a statement or keyword with another picture; its options are kept unless they place the picture."""
    word, arguments = split(line)
    options = [
        argument
        for option in _options(arguments)[0]
        if option[0].lower() not in PLACING
        for argument in option
    ]
    return " ".join([word, *options, name])


def placing(arguments: str) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return the scale and offset of texture coordinates in a map statement: its `-s` and `-o`."""
    options = _options_by_name(arguments)
    scale, offset = [1.0, 1.0], [0.0, 0.0]
    for values, name in ((scale, "-s"), (offset, "-o")):
        parameters = [float(word) for word in options.get(name, [])[:2]]
        values[: len(parameters)] = parameters
    return (scale[0], scale[1]), (offset[0], offset[1])


def wrap(arguments: str) -> Wrap:
    """Return the wrap mode of a map statement: clamp with `-clamp on`, else repeat."""
    clamped = [word.lower() for word in _options_by_name(arguments).get("-clamp", [])] == ["on"]
    return ("clamp", "clamp") if clamped else REPEAT


def _options_by_name(arguments: str) -> dict[str, list[str]]:
    """Return the arguments of each option of a map statement, by its lower-case name."""
    return {option.lower(): words for option, *words in _options(arguments)[0]}


def _options(arguments: str) -> tuple[list[list[str]], str]:
    """Return the options of a map statement, each with its arguments, and the file name after them."""
    options, places, k = list[list[str]](), list(re.finditer(r"\S+", arguments)), 0
    words = [place[0] for place in places]
    while k < len(words) and words[k].lower() in (*ARGUMENTS, *UP_TO_THREE):
        stop = k + 1 + ARGUMENTS.get(words[k].lower(), 0)
        while words[k].lower() in UP_TO_THREE and stop < min(k + 4, len(words)) and is_number(words[stop]):
            stop += 1
        options.append(words[k:stop])
        k = stop
    return options, arguments[places[k].start() :].strip() if k < len(words) else ""


def _move(line: str, old: Path, new: Path) -> str:
    """Return a line with its file name made relative to the new folder."""
    word, arguments = split(line)
    if os.path.realpath(old) == os.path.realpath(new) or not word.lower().startswith(MAPS):
        return line
    name = file_name(arguments)
    if not name or Path(name).is_absolute() or "\\" in name:
        return line
    return with_file(line, relative(old / name, new))


def with_file(line: str, file: str) -> str:
    """Return a map statement that refers to another file."""
    name = file_name(split(line)[1])
    start = line.rindex(name)
    return line[:start] + file + line[start + len(name) :]


def split(line: str) -> tuple[str, str]:
    """Return the keyword of a line, and the rest."""
    word, _, arguments = line.strip().replace("\t", " ").partition(" ")
    return word, arguments.strip()


def numbers(lines: Iterable[str]) -> dict[str, list[float]]:
    """Return the values of all purely numeric statements, by lower-case keyword."""
    statements = ((word.lower(), arguments.split()) for word, arguments in map(split, lines))
    return {
        word: list(map(float, arguments))
        for word, arguments in statements
        if arguments and all(map(is_number, arguments))
    }


def is_number(word: str) -> bool:
    """Return whether a word is a number."""
    try:
        float(word)
    except ValueError:
        return False
    return True
