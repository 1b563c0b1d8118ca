"""Write the values of `--fit` into the menus of `iccm edit` and of the plug-ins: python docs/menus.py

The page and the plug-ins do not import the library, so their menus are text. It is generated from `iccm.fits`.
"""

import re
from collections.abc import Callable
from html import escape
from pathlib import Path

from iccm.fits import FITS, FitMode

ROOT = Path(__file__).resolve().parent.parent


def of_page(fits: dict[str, FitMode]) -> str:
    """Return the options of the menu on the page, with the sentence that is shown below it."""
    return "".join(
        f'        <option value="{name}" data-hint="{escape(mode.help)}">{_line(mode)}</option>\n'
        for name, mode in fits.items()
    )


def of_inkscape(fits: dict[str, FitMode]) -> str:
    """Return the options of the menu in Inkscape's dialog."""
    return "".join(f'        <option value="{name}">{_line(mode)}</option>\n' for name, mode in fits.items())


def of_blender(fits: dict[str, FitMode]) -> str:
    """Return the items of the menu in Blender: value, title and description; islands have no frames."""
    return "".join(
        f'    ("{name}", "{mode.title.title()}", "{mode.summary.capitalize()}"),\n'
        for name, mode in fits.items()
        if not mode.of_drawings
    )


def _line(mode: FitMode) -> str:
    return escape(f"{mode.title}: {mode.summary}")


MENUS: list[tuple[str, str, str, Callable[[dict[str, FitMode]], str]]] = [
    (
        "io/edit/page/index.html",
        '<select id="how" aria-describedby="how-hint">\n',
        "      </select>",
        of_page,
    ),
    (
        "plugins/inkscape/iccm_fit.inx",
        '<param name="fit" type="optiongroup" appearance="combo" gui-text="Fit:">\n',
        "    </param>",
        of_inkscape,
    ),
    ("plugins/blender/__init__.py", "FITS = [\n", "]", of_blender),
]
"""For each menu: its file, the line before it, the line after it, and the function that writes it."""


def written(text: str, before: str, after: str, menu: str) -> str:
    """Return the text of a file with its menu replaced.

    Raises:
        ValueError: the lines around the menu are not in the text.
    """
    pattern = re.compile(f"({re.escape(before)}).*?(^{re.escape(after)})", re.DOTALL | re.MULTILINE)
    found, count = pattern.subn(lambda match: match[1] + menu + match[2], text)
    if count != 1:
        raise ValueError(f"{before.strip()}: {count} menus begin with this line; there must be one")
    return found


def files() -> dict[Path, str]:
    """Return the text of each file with its menu as it should be."""
    return {
        ROOT / name: written((ROOT / name).read_text(encoding="utf-8"), before, after, menu(FITS))
        for name, before, after, menu in MENUS
    }


if __name__ == "__main__":
    for path, text in files().items():
        path.write_text(text, encoding="utf-8")
