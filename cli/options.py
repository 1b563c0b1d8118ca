"""The options of a run on the command line: made from `iccm.io.run.options`, where each is described."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Literal, get_args, get_origin

import click

from ..io.run.options import Option, described
from .paths import FILE

Decorator = Callable[[Callable], Callable]

THREADS = click.option(
    "--threads", type=click.IntRange(1), metavar="N", help="Never changes the result.  [default: all cores]"
)


def of(command: str) -> Decorator:
    """One decorator that adds the options of a command, in the order of help, and --threads."""
    made: list[Decorator] = [
        _click(name, hint, option)
        for name, (hint, option) in described().items()
        if command in option.commands
    ]
    made.append(THREADS)

    def decorate(function: Callable) -> Callable:
        for option in reversed(made):
            function = option(function)
        return function

    return decorate


def _click(name: str, hint: Any, option: Option) -> Decorator:
    settings: dict[str, Any] = {"help": option.help}
    if hint is bool:
        settings |= {"is_flag": True}
    elif option.default == ():
        settings |= {"multiple": True, "metavar": option.metavar, "type": _text(option)}
    elif option.parse:
        settings |= {"metavar": option.metavar, "callback": parsed(option.parse)}
        settings |= {"is_flag": False, "flag_value": option.flag} if option.flag else {}
    else:
        shown = option.default is not None
        settings |= {"metavar": option.metavar, "default": option.default, "show_default": shown}
        settings |= {"type": _type(hint, option)}
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
    return FILE if (option.metavar or "").startswith(("FILE", "IMAGE")) else str


def parsed(parse: Callable[[Any], Any]) -> Callable:
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
