"""The options of a command in click's form, made from the table in `iccm.io.options`."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import Any, Literal, get_args, get_origin

import click

from .. import __version__, deadline
from ..io.option_groups import MOST_SHORT_HELP_OPTIONS, TOPICS, grouped, of_topic
from ..io.options import (
    NAMES,
    TABLE,
    CommonOptions,
    JobOptions,
    MessageOptions,
    Option,
    TextOptions,
    of_command,
    options_of,
    suggest,
)
from ..io.values import EMPTY_NAME
from . import logs, settings
from .logs import apply, styled


class _Name(click.types.StringParamType):
    """A name, which is not empty."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return the name, or fail if it is empty, as an unset variable of a shell makes it."""
        if value == "" and param is not None:
            name = max(param.opts, key=len) if isinstance(param, click.Option) else param.human_readable_name
            raise click.UsageError(f"{name}: {EMPTY_NAME}", ctx)
        return super().convert(value, param, ctx)


class _File(_Name, click.Path):
    """The name of a file, which shells complete."""


NAME = _Name()
"""The value of an option that is a name of something else than a file."""
FILE = _File(readable=False)
"""An argument that is a file; whether it exists is checked when it is read."""
MESSAGES = options_of(MessageOptions).keys()
ALL = "all"
"""The topic of help that lists all options."""

Decorator = Callable[[Callable], Callable]


class Command(click.Command):
    """A command with help by topics that also accepts former names and synonyms of its options."""

    several = ""
    """Message for more files than the command takes."""
    missing = ""
    """Message for a missing argument."""
    passed_on: tuple[str, ...] = ()
    """Options of `iccm map` that it accepts for jobs."""
    shown_of_passed_on: Mapping[str, str] = MappingProxyType({})
    """Those that its help shows, with their text; empty: that of `iccm map`."""

    @property
    def rows(self) -> dict[str, Option]:
        """Options of the table that belong to this command, by name."""
        return {name: option for name, (_, option) in of_command(self.name or "").items()}

    @property
    def accepted(self) -> dict[str, Option]:
        """Options of this command and those that it passes on, by name."""
        every = {name: option for name, (_, option) in options_of().items()}
        return {name: every[name] for name in self.passed_on} | self.rows

    def get_help_option(self, ctx: click.Context) -> click.Option:
        """Return the option `--help`, which takes a topic."""
        topics = _topics_of(self.rows) if len(self.rows) > MOST_SHORT_HELP_OPTIONS else []
        return click.Option(
            ["-h", "--help"],
            is_flag=False,
            flag_value="",
            is_eager=True,
            expose_value=False,
            metavar="[TOPIC]" if topics else "",
            callback=_show_help,
            help="Show help, or the options of one topic." if topics else "Show this help.",
        )

    def get_params(self, ctx: click.Context) -> list[click.Parameter]:
        """Return the options of the command and `--version`, which people also try after a command."""
        version = click.version_option(__version__, prog_name="iccm", help="Show the version.")
        holder: Any = version(lambda: None)
        return [*super().get_params(ctx), *holder.__click_params__]

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Parse after replacing former names and aliases; for unknown options suggest similar ones."""
        ctx.meta["iccm.notices"] = notices = list[str]()
        ctx.default_map = settings.defaults(self.rows)
        try:
            return super().parse_args(ctx, list(_with_todays_names(args, self.accepted, notices)))
        except click.NoSuchOption as error:
            visible = {name: row for name, row in self.accepted.items() if self.name not in row.hidden}
            raise click.UsageError(_unknown(error.option_name, visible), ctx) from None
        except click.MissingParameter:
            if self.missing:
                raise click.UsageError(self.missing, ctx) from None
            raise
        except click.UsageError as error:
            if self.several and "unexpected extra argument" in error.message:
                raise click.UsageError(self.several, ctx) from None
            raise

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command within its time limit, after warnings about deprecated names."""
        for notice in ctx.meta["iccm.notices"]:
            logs.log.warning(notice)
        for name, option in self.rows.items():
            is_on_command_line = ctx.get_parameter_source(name) is click.core.ParameterSource.COMMANDLINE
            if is_on_command_line and self.name in option.hidden:
                logs.log.warning(f"{_dashed(name)}: deprecated, will be removed in iccm 2; {option.instead}")
        with deadline.limited(ctx.params.pop("time_limit", None)):
            return super().invoke(ctx)

    def format_help_text(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the description of the command, except in the help of a topic."""
        if ctx.meta.get("iccm.topic", "") in ("", ALL):
            super().format_help_text(ctx, formatter)

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the most common options, or those of a topic, and how to see the others."""
        records: dict[str, Any] = {
            max(parameter.opts, key=len)[2:].replace("-", "_"): parameter.get_help_record(ctx)
            for parameter in self.get_params(ctx)
            if isinstance(parameter, click.Option) and not parameter.hidden
        }
        topic = ctx.meta.get("iccm.topic", "")
        if not topic and len(self.rows) > MOST_SHORT_HELP_OPTIONS:
            briefs = {name: option.brief for name, option in self.rows.items() if option.brief}
            records |= {name: (records[name][0], brief) for name, brief in briefs.items() if name in records}
        sections = _sections(self.name or "", self.rows, list(records), topic)
        if self.shown_of_passed_on and topic in ("", ALL):
            heading = styled("Options of each job (iccm map --help lists all)", sys.stdout, bold=True)
            with formatter.section(heading):
                formatter.write_dl([self._record_of_passed_on(name) for name in self.shown_of_passed_on])
        for title, example, names in sections:
            heading = styled(title, sys.stdout, bold=True) + (f", such as {example}" if example else "")
            with formatter.section(heading):
                formatter.write_dl([row for name in names if (row := records.get(name))])
        if not topic and sum(len(names) for _, _, names in sections) < len(records):
            with formatter.section(
                styled(f"More options: {ctx.command_path} --help TOPIC", sys.stdout, bold=True)
            ):
                topics = [(word, TOPICS[word].title) for word in _topics_of(self.rows)]
                formatter.write_dl([*topics, (ALL, "All options")])

    def _record_of_passed_on(self, name: str) -> tuple[str, str]:
        """Return what help shows of an option of `iccm map`: its names and its text."""
        option = self.accepted[name]
        names = ", ".join(filter(None, [option.short, _dashed(name)]))
        return f"{names} {option.metavar}", self.shown_of_passed_on[name] or option.brief


def _sections(
    command: str, rows: dict[str, Option], names: list[str], topic: str
) -> list[tuple[str, str, list[str]]]:
    """Return heading, example and option names of each section of the help."""
    if topic == ALL or len(rows) <= MOST_SHORT_HELP_OPTIONS:
        return grouped(names, rows)
    if topic:
        section = TOPICS[topic]
        return [(section.title, section.example, of_topic(topic, names, rows))]
    tables = [
        table for table in TABLE if table not in (JobOptions, TextOptions, CommonOptions, MessageOptions)
    ]
    rows_of_its_own = of_command(command, *tables)
    specific = [name for name in names if name in rows_of_its_own and rows[name].commands[0] == command]
    basic = {name for name, option in rows.items() if option.basic} | {"help"}
    shared = [name for name in names if name in basic - set(specific)]
    by_topic = [name for topic in TOPICS for name in of_topic(topic, shared, rows)]
    return [("Options", "", specific + by_topic)]


def _topics_of(rows: dict[str, Option]) -> list[str]:
    """Return the topics that contain options of a command."""
    return [word for word in TOPICS if of_topic(word, rows, rows)]


def _show_help(ctx: click.Context, parameter: click.Parameter, value: str | None) -> None:
    """Show the help of a topic, or the short help, and exit."""
    if value is None:
        return
    rows = ctx.command.rows if isinstance(ctx.command, Command) else {}
    topics = [*_topics_of(rows), ALL]
    if value and value not in topics:
        raise click.UsageError(f"--help {value}: unknown topic; choose one of {', '.join(topics)}", ctx)
    ctx.meta["iccm.topic"] = value
    click.echo(ctx.get_help())
    ctx.exit()


def _with_todays_names(args: list[str], rows: dict[str, Option], notices: list[str]) -> Iterator[str]:
    """Replace former names and aliases of options by current names, with values in the current form."""
    today = {
        _dashed(old): (name, "{}", True)
        for name, option in rows.items()
        for old in option.old
        if old not in rows
    }
    today |= {
        _dashed(alias): (name, template, False)
        for name, option in rows.items()
        for alias, template in option.aliases
    }
    remaining = iter(args)
    for arg in remaining:
        if arg == "--":
            yield arg
            yield from remaining
            return
        word, joined, value = arg.partition("=")
        if word not in today:
            yield arg
            continue
        name, template, is_old = today[word]
        if is_old:
            notices.append(f"{word} is now {_dashed(name)}; the old name works until iccm 2")
        if template != "{}" and not joined:
            value = next(remaining, "")
        yield _dashed(name) + (f"={template.format(value)}" if joined or template != "{}" else "")


def _unknown(word: str, rows: dict[str, Option]) -> str:
    """Return the message for an unknown option, with suggestions by synonym or spelling."""
    similar = suggest(word.lstrip("-"), rows)
    hint = f"; did you mean {' or '.join(map(_dashed, similar[:2]))}?" if similar else ""
    return f"No such option {word}{hint}"


def _dashed(name: str) -> str:
    return f"--{name.replace('_', '-')}"


def of(command: str, *passed_on: str) -> Decorator:
    """Return a decorator that adds the options of a command in the order of help, and the job options that it passes
    on.
    """
    decorators = [_click(command, name, hint, option) for name, (hint, option) in of_command(command).items()]
    for name, (hint, option) in options_of().items():
        if name in passed_on:
            decorators.append(
                _click(command, name, hint, replace(option, default=_unset(option), hidden=(command,)))
            )

    def decorate(function: Callable) -> Callable:
        for option in reversed(decorators):
            function = option(function)
        return function

    return decorate


def _unset(option: Option) -> Any:
    """Return an empty default for an option that is passed on, so that only given values are passed."""
    return option.default if option.default in ((), False) else None


def _click(command: str, name: str, hint: Any, option: Option) -> Decorator:
    keywords: dict[str, Any] = {"help": option.help, "metavar": option.metavar, "required": option.required}
    keywords["hidden"] = command in option.hidden
    numbers = [str(value) for part in get_args(hint) for value in get_args(part) if isinstance(value, int)]
    if not option.metavar and (numbers or {int, float} & {hint, *get_args(hint)}):
        keywords["metavar"] = "|".join(numbers) or "N"
    if hint is bool:
        keywords |= {"is_flag": True}
    elif option.default == ():
        keywords |= {"multiple": True, "type": _text(option)}
    elif option.parse:
        keywords |= {"callback": _checked(hint, option)}
    else:
        has_default = option.default is not None
        keywords |= {"show_default": has_default, "type": _type(hint, option)}
        if not option.required:  # to click 8.3 and later, a default of None is a value
            keywords["default"] = option.default
    keywords |= {"is_flag": False, "flag_value": option.flag} if option.flag else {}
    if name in MESSAGES:
        keywords |= {"callback": apply, "expose_value": False, "show_default": False}
    return click.option(f"--{name.replace('_', '-')}", *filter(None, [option.short]), **keywords)


class _ByTable(click.ParamType):
    """A click type for help and completion; values are checked by the table of options, as in manifests."""

    hint: Any
    row: Option

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return the value as a job stores it, or fail with the message of the table."""
        try:
            return self.row.value_of(value, self.hint)
        except ValueError as error:
            self.fail(str(error), param, ctx)


class _Choice(_ByTable, click.Choice):
    pass


class _FloatRange(_ByTable, click.FloatRange):
    pass


class _Float(_ByTable, click.types.FloatParamType):
    pass


class _IntRange(_ByTable, click.IntRange):
    pass


def _type(hint: Any, option: Option) -> Any:
    """Return the click type that checks a value: its kind, choices and bounds."""
    types = (hint, *get_args(hint))
    choices = next((get_args(part) for part in types if get_origin(part) is Literal), ())
    least, is_open = (option.least, False) if option.above is None else (option.above, True)
    checker: _ByTable
    if choices and isinstance(choices[0], str):
        checker = _Choice(choices)
    elif float in types and least is None:
        checker = _Float()
    elif float in types:
        checker = _FloatRange(least, option.most, min_open=is_open)
    elif int in types or choices:
        bounds = [None if bound is None else int(bound) for bound in (least, option.most)]
        checker = _IntRange(bounds[0], bounds[1])
    else:
        return _text(option)
    checker.hint, checker.row = hint, option
    return checker


def _text(option: Option) -> Any:
    """Return the click type of text, or of a file name, which shells complete."""
    return FILE if option.names_files else NAME if option.metavar in NAMES else str


def _checked(hint: Any, option: Option) -> Callable:
    """Return a click callback that checks a value by the table of options and reports errors."""

    def of_click(ctx: click.Context, parameter: click.Parameter, value: str | None) -> Any:
        try:
            return None if value is None else option.value_of(value, hint)
        except ValueError as error:
            raise click.BadParameter(str(error)) from None

    return of_click


def values(options: dict[str, object]) -> dict[str, object]:
    """Return the given options as fields of a Job; unset options take its defaults."""
    return {key: _plain(value) for key, value in options.items() if value is not None}


def _plain(value: object) -> object:
    return list(value) if isinstance(value, Sequence) and not isinstance(value, str) else value
