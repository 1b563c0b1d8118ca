"""The options of a command as click takes them: made from the table of `iccm.io.options`, where each is described."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from typing import Any, Literal, get_args, get_origin

import click

from ..io.options import MessageOptions, Option, of_command, options_of
from .logs import apply, styled

FILE = click.Path(readable=False)
"""An argument that is a file: shells complete its name; whether it is there is told by what reads it."""
MESSAGES = options_of(MessageOptions).keys()
FILES = ("FILE", "IMAGE", "DIR", "OUTLINE")  # in what stands for a value: shells complete it

Decorator = Callable[[Callable], Callable]


class Command(click.Command):
    """A command whose help shows options by what they are for."""

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """A section for each group, with an example."""
        from ..io.option_groups import grouped

        parameters = [each for each in self.get_params(ctx) if isinstance(each, click.Option)]
        rows = {
            max(each.opts, key=len)[2:].replace("-", "_"): each.get_help_record(ctx) for each in parameters
        }
        for title, example, names in grouped(rows):
            heading = styled(title, sys.stdout, bold=True) + (f", such as {example}" if example else "")
            with formatter.section(heading):
                formatter.write_dl([row for name in names if (row := rows[name])])


def of(command: str) -> Decorator:
    """One decorator that adds the options of a command, in the order of help."""
    made = [_click(name, hint, option) for name, (hint, option) in of_command(command).items()]

    def decorate(function: Callable) -> Callable:
        for option in reversed(made):
            function = option(function)
        return function

    return decorate


def _click(name: str, hint: Any, option: Option) -> Decorator:
    settings: dict[str, Any] = {"help": option.help, "metavar": option.metavar, "required": option.required}
    if hint is bool:
        settings |= {"is_flag": True}
    elif option.default == ():
        settings |= {"multiple": True, "type": _text(option)}
    elif option.parse:
        settings |= {"callback": _parsed(option.parse)}
        settings |= {"is_flag": False, "flag_value": option.flag} if option.flag else {}
    else:
        shown = option.default is not None
        settings |= {"default": option.default, "show_default": shown, "type": _type(hint, option)}
    if name in MESSAGES:
        settings |= {"callback": apply, "expose_value": False, "show_default": False}
    return click.option(f"--{name.replace('_', '-')}", *filter(None, [option.short]), **settings)


def _type(hint: Any, option: Option) -> Any:
    """What click checks of a value: its kind, its choices, its bounds."""
    types = (hint, *get_args(hint))
    choices = next((get_args(each) for each in types if get_origin(each) is Literal), ())
    if choices and isinstance(choices[0], str):
        return click.Choice(choices)
    least, above = (option.least, False) if option.above is None else (option.above, True)
    if float in types:
        return float if least is None else click.FloatRange(least, option.most, min_open=above)
    return click.IntRange(least, option.most) if int in types or choices else _text(option)


def _text(option: Option) -> Any:
    """Words, or the name of a file, which shells complete."""
    return FILE if any(word in (option.metavar or "") for word in FILES) else str


def _parsed(parse: Callable[[Any], Any]) -> Callable:
    """A click callback that parses a value, and says what is wrong with it."""

    def of_click(ctx: click.Context, parameter: click.Parameter, value: str | None) -> Any:
        try:
            return None if value is None else parse(value)
        except ValueError as error:
            raise click.BadParameter(str(error)) from None

    return of_click


def values(options: dict[str, object]) -> dict[str, object]:
    """The options that were given, as a Job's fields: unset ones are left to its defaults."""
    return {key: _plain(value) for key, value in options.items() if value is not None}


def _plain(value: object) -> object:
    return list(value) if isinstance(value, Sequence) and not isinstance(value, str) else value
