"""The files of installed fonts: found by fontconfig, else in the folders where systems keep fonts."""

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

FONTCONFIG_SECONDS = 5  # timeout for fontconfig
_FONTCONFIG = {100: 0, 200: 40, 300: 50, 400: 80, 500: 100, 600: 180, 700: 200, 800: 205, 900: 210}
_GENERIC = {
    "serif": ("times new roman", "times", "dejavu serif"),
    "sans-serif": ("arial", "helvetica", "dejavu sans"),
    "monospace": ("courier new", "menlo", "dejavu sans mono"),
    "cursive": ("comic sans ms", "apple chancery"),
    "fantasy": ("impact", "papyrus"),
    "system-ui": ("segoe ui", "sf pro", "helvetica neue", "dejavu sans"),
}
"""Of each generic family of CSS, the families to look for where there is no fontconfig, the first one preferred."""
_ALIKE = {
    "arial": ("liberation sans", "arimo"),
    "helvetica": ("liberation sans", "arimo", "nimbus sans"),
    "times new roman": ("liberation serif", "tinos"),
    "times": ("liberation serif", "tinos", "nimbus roman"),
    "courier new": ("liberation mono", "cousine"),
    "courier": ("liberation mono", "cousine", "nimbus mono ps"),
    "calibri": ("carlito",),
    "cambria": ("caladea",),
}
"""Families whose letters are as wide as those of another one, and which browsers take in its place."""
SUFFIXES = (".ttf", ".otf", ".ttc", ".otc")
_FAMILY_NAMES = 1, 16
"""Numbers of the names of a family in a font's table of names: with four styles at most, and typographic."""
_WEIGHTS_A_SLANT_IS_WORTH = 1000.0
"""An upright font is never taken for an italic one because of its weight, as in CSS."""


class InstalledFont(NamedTuple):
    """A font in a file.

    Attributes:
        families: its names, in lower case.
        weight: as in CSS; 400 is regular.
        slanted: whether it is italic or oblique.
        path: the file.
        number: index in a collection.
    """

    families: tuple[str, ...]
    weight: float
    slanted: bool
    path: str
    number: int


def font_file(family: str, weight: int = 400, slant: int = 0) -> tuple[str, int] | None:
    """Return the file of an installed font and its index in a collection; None where another would be substituted.

    Args:
        family: in lower case, such as `dejavu sans`.
        weight: as in CSS; 400 is regular, 700 bold.
        slant: 0 for upright, 100 for italic, 110 for oblique.
    """
    command = shutil.which("fc-match")
    if command is None:
        return _listed(family, weight, slanted=slant > 0)
    pattern = re.sub(r"([\\\-:,])", r"\\\1", family)
    fontconfig_weight = _FONTCONFIG[min(900, max(100, round(weight, -2)))]
    query = f"{pattern}:weight={fontconfig_weight}:slant={slant}"
    arguments = [command, "-f", "%{family}\n%{file}\n%{index}", query]
    try:
        output = subprocess.run(
            arguments, capture_output=True, text=True, timeout=FONTCONFIG_SECONDS, check=True
        ).stdout
        names, path, number = output.split("\n")[:3]
        accepted = {family, *_ALIKE.get(family, ())}
        if family not in _GENERIC and accepted.isdisjoint(names.casefold().split(",")):
            return None
        return path, int(number) & 0xFFFF if path.lower().endswith((".ttc", ".otc")) else 0
    except Exception:  # treat a broken fontconfig as a missing font
        return None


def _listed(family: str, weight: int, *, slanted: bool) -> tuple[str, int] | None:
    """Return the font of a family with the nearest style, for systems without fontconfig."""
    fonts = _fonts(folders())
    for name in _GENERIC.get(family, (family, *_ALIKE.get(family, ()))):
        styles = [font for font in fonts if name in font.families]
        if styles:
            best = min(
                styles,
                key=lambda font: (
                    _WEIGHTS_A_SLANT_IS_WORTH * (font.slanted != slanted) + abs(font.weight - weight)
                ),
            )
            return best.path, best.number
    return None


def folders() -> tuple[Path, ...]:
    """Return the folders in which the system, and the user, keep fonts."""
    home = Path.home()
    if sys.platform == "win32":
        places = [
            Path(os.environ.get("WINDIR", "C:\\Windows"), "Fonts"),
            Path(os.environ.get("LOCALAPPDATA", home), "Microsoft", "Windows", "Fonts"),
        ]
    elif sys.platform == "darwin":
        places = [Path("/System/Library/Fonts"), Path("/Library/Fonts"), home / "Library" / "Fonts"]
    else:
        places = [Path("/usr/share/fonts"), Path("/usr/local/share/fonts")]
        places += [home / ".local" / "share" / "fonts", home / ".fonts"]
    return tuple(place for place in places if place.is_dir())


@lru_cache(maxsize=8)
def _fonts(places: tuple[Path, ...]) -> tuple[InstalledFont, ...]:
    """Return the fonts in folders, in the order of their paths, so that equally good ones do not change places."""
    return tuple(
        font
        for place in places
        for path in sorted(place.rglob("*"))
        if path.suffix.lower() in SUFFIXES
        for font in _read(path)
    )


def _read(path: Path) -> Iterator[InstalledFont]:
    """Yield the fonts of a file; none if it cannot be read."""
    import uharfbuzz as hb

    try:
        blob = hb.Blob.from_file_path(str(path))
        for number in range(hb.Face(blob).count):
            face = hb.Face(blob, number)
            names = (face.get_name(name) for name in _FAMILY_NAMES)
            font = hb.Font(face)
            slanted = bool(
                font.get_style_value(hb.StyleTag.ITALIC) or font.get_style_value(hb.StyleTag.SLANT_ANGLE)
            )
            yield InstalledFont(
                tuple(name.casefold() for name in names if name),
                font.get_style_value(hb.StyleTag.WEIGHT),
                slanted,
                str(path),
                number,
            )
    except Exception:  # treat a broken font file as missing
        return


def finder() -> str:
    """Return a description of how fonts are found on this system."""
    command = shutil.which("fc-match")
    return (
        f"found by {command}"
        if command
        else "fc-match is missing; looked for in " + (", ".join(map(str, folders())) or "no folder")
    )
