"""What the site's pages leave to the code (a hook of MkDocs): options and commands from the table, formats, the API.

In a page `<!-- options: map -->` stands for the options of a command, `<!-- formats -->` for what each suffix can hold.
"""

import re
from typing import Any, get_args

from iccm.cli import COMMANDS
from iccm.io import formats, options
from iccm.io.option_groups import grouped

HOLDS = {
    "picture": "pictures",
    "drawing": "shapes, artwork",
    "mesh": "meshes",
    "uv": "meshes with new coordinates",
    "flat": "flattenings",
    "plot": "figures",
    "stmap": "STMaps",
    "map": "saved maps",
    "outlines": "shapes (read)",
    "manifest": "jobs",
    "constraints": "pins and strokes",
}


def on_page_markdown(markdown: str, **_: Any) -> str:
    """The page with the tables in the place of their marks."""
    markdown = re.sub(r"<!-- options: (\w+) -->", lambda found: options_of(found[1]), markdown)
    return markdown.replace("<!-- commands -->", commands()).replace("<!-- formats -->", held())


def options_of(command: str) -> str:
    """The options of a command, a table for each group."""
    rows = {name: row for name, row in options.of_command(command).items() if command not in row[1].hidden}
    parts = []
    for title, example, names in grouped(rows):
        if len(names) < len(rows):
            parts.append(f"**{title}**, such as `{example}`\n" if example else f"**{title}**\n")
        parts.append("| option | what it is |\n|---|---|")
        parts += [_row(name, *rows[name]) for name in names]
        parts.append("")
    return "\n".join(parts)


def _row(name: str, hint: Any, option: options.Option) -> str:
    choices = [
        value for part in (hint, *get_args(hint)) for value in get_args(part) if isinstance(value, str)
    ]
    value = option.metavar or "|".join(choices) or ("" if hint is bool else "N")
    names = [f"--{name.replace('_', '-')}", *filter(None, [option.short])]
    shown = " ".join([", ".join(reversed(names)), value]).strip()
    text = option.help
    if option.default not in (None, (), False) and "[default" not in text:
        text += f"  [default: {option.default}]"
    return f"| <code>{_escaped(shown)}</code> | {_escaped(text)} |"


def _escaped(text: str) -> str:
    """Text in a cell, as it stands."""
    return "".join(f"&#{ord(c)};" if c in "|<>&*_`[]" else c for c in text)


def commands() -> str:
    """Every command but `map`, which has a page of its own, with its options."""
    parts = []
    for name, text in COMMANDS.items():
        parts.append(f"## `iccm {name}`\n\n{text}\n")
        parts.append("[Options of `iccm map`](map.md)\n" if name == "map" else options_of(name))
    return "\n".join(parts)


def held() -> str:
    """What files of each suffix hold, as a table."""
    lines = ["| suffix | holds |", "|---|---|"]
    for suffix, form in formats.FORMATS.items():
        said = [words for name, words in HOLDS.items() if getattr(form, name)]
        if form.picture:
            said[0] += f" ({_pixels(form.picture)})"
        lines.append(f"| `{suffix}` | {', '.join(said)} |")
    return "\n".join(lines)


def _pixels(form: formats.PictureFormat) -> str:
    depths = [f"{bits} bit" for bits in form.bits]
    depths += ["float"] if form.light != "display" else []
    lost = [word for word, kept in (("grey", form.grey), ("alpha", form.alpha)) if not kept]
    return ", ".join(depths) + (f"; no {' or '.join(lost)}" if lost else "")
