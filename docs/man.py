"""Write the man pages, man/iccm.1 and one for each command, from the table of options: python docs/man.py

They are committed, so that a wheel is built without running iccm; a test compares them with the table.
"""

import inspect
import textwrap
from importlib import import_module
from pathlib import Path

import click

from iccm import __version__
from iccm.cli import COMMANDS, iccm
from iccm.io.option_groups import grouped

FOLDER = Path(__file__).resolve().parent.parent / "man"


def pages() -> dict[str, str]:
    """Return the text of each page by file name."""
    found = {"iccm.1": _overview()}
    for name in COMMANDS:
        found[f"iccm-{name}.1"] = _page(name, import_module(f"iccm.cli.{name}").command)
    return found


def _overview() -> str:
    listed = "".join(f".TP\n.B iccm {name}\n{_plain(text)}\n" for name, text in COMMANDS.items())
    about = iccm.help.partition("\b")[0] if iccm.help else ""
    said = f".SH DESCRIPTION\n{_plain(about)}\n.SH COMMANDS\n{listed}"
    also = ", ".join(f".BR iccm-{name} (1)" for name in COMMANDS).replace(", ", "\n")
    head = _head("iccm", about.strip(), "[\\fIOPTIONS\\fR] \\fICOMMAND\\fR ...")
    return f"{head}{said}.SH SEE ALSO\n{also}\n"


def _page(name: str, command: click.Command) -> str:
    context = click.Context(command, click.Context(iccm, **iccm.context_settings), f"iccm {name}")
    words = " ".join(command.collect_usage_pieces(context))
    text = [_head(f"iccm-{name}", COMMANDS[name], _plain(words)), ".SH DESCRIPTION\n"]
    for part in inspect.cleandoc(command.help or "").split("\n\n"):
        if part.startswith("\b"):
            text.append(".PP\n.nf\n" + _plain(textwrap.dedent(part.lstrip("\b\n"))) + "\n.fi\n")
        else:
            text.append(f".PP\n{_plain(part)}\n")
    rows = {
        max(each.opts, key=len)[2:].replace("-", "_"): each.get_help_record(context)
        for each in command.get_params(context)
        if isinstance(each, click.Option) and not each.hidden
    }
    text.append(".SH OPTIONS\n")
    for title, example, names in grouped(rows, getattr(command, "rows", {})):
        if len(names) < len(rows):
            text.append(f".SS {_plain(title)}\n" + (f"Such as {_plain(example)}\n" if example else ""))
        for option, said in filter(None, (rows[each] for each in names)):
            text.append(f".TP\n.B {_plain(option)}\n{_plain(said)}\n")
    return "".join(text) + ".SH SEE ALSO\n.BR iccm (1)\n"


def _head(name: str, about: str, synopsis: str) -> str:
    shown = name.replace("-", " ", 1)
    title = f'.TH "{name.upper()}" 1 "" "iccm {__version__}" "iccm"\n.SH NAME\n{_plain(name)} \\- {_plain(about)}\n'
    return f"{title}.SH SYNOPSIS\n.B {shown}\n{synopsis}\n"


def _plain(text: str) -> str:
    """Escape text for roff."""
    text = text.replace("\\", "\\e").replace("-", "\\-")
    return "\n".join("\\&" + line if line[:1] in (".", "'") else line for line in text.split("\n"))


if __name__ == "__main__":
    FOLDER.mkdir(exist_ok=True)
    for old in FOLDER.glob("*.1"):
        old.unlink()
    for name, text in pages().items():
        (FOLDER / name).write_text(text, encoding="utf-8")
