"""Checks of the values of options: their types, choices and bounds, and the words of messages about wrong ones.

A job is checked here alone, whether its values come from the command line, from a manifest or from Python: pydantic
would take a tenth of the time of a small job to import. Nested documents (constraints files, messages of the editor,
tolerances) are checked by pydantic, see `checked`, which reports mistakes in the same words.
"""

import math
from collections.abc import Callable, Iterable
from types import NoneType, UnionType
from typing import Any, Literal, Union, get_args, get_origin

UNKNOWN = "unknown key"
MISSING = "is missing"
NOT_UNICODE = "the name is not UTF-8; rename the file"
TRUE = ("true", "yes", "on", "t", "y", "1")
FALSE = ("false", "no", "off", "f", "n", "0")
"""Words for true and false, in any case."""


class WrongValue(ValueError):
    """A value that an option does not take.

    Attributes:
        index: the number of the item that is wrong, from 0, where it is one of several; else None.
    """

    def __init__(self, text: str, index: int | None = None) -> None:
        super().__init__(text)
        self.index = index


def at_least(bound: float) -> str:
    """Return the message about a number below a bound."""
    return f"must be at least {bound:.15g}"


def above(bound: float) -> str:
    """Return the message about a number that is not above a bound."""
    return f"must be greater than {bound:.15g}"


def at_most(bound: float) -> str:
    """Return the message about a number above a bound."""
    return f"must be at most {bound:.15g}"


def one_of(choices: Iterable[object]) -> str:
    """Return the message about a value that is not one of these."""
    *most, last = [repr(choice) for choice in choices]
    return f"must be {', '.join(most)} or {last}" if most else f"must be {last}"


def convert(value: Any, hint: Any) -> Any:
    """Return a value as a type has it: whole numbers for floats are floats, lists are tuples, numbers may be given as
    text.

    Args:
        value: from outside.
        hint: a type as options have it: bool, int, float, str, choices, tuples of these, and unions of them.

    Raises:
        WrongValue: it is not of the type.
    """
    origin, args = get_origin(hint), get_args(hint)
    if origin in (Union, UnionType):
        return _one_of_types(value, hint, args)
    if origin is Literal:
        for choice in args:
            is_text_of_number = isinstance(value, str) and value == str(choice)
            if is_text_of_number or (value == choice and type(value) is type(choice)):
                return choice
        raise WrongValue(f"must be {describe(hint)}")
    if origin is tuple:
        return _tuple(value, hint, args)
    return _CONVERSIONS[hint](value)


def _one_of_types(value: Any, hint: Any, types: tuple[Any, ...]) -> Any:
    """Return a value as the first type that it fits has it."""
    if value is None and NoneType in types:
        return None
    types = tuple(each for each in types if each is not NoneType)
    if len(types) == 1:
        return convert(value, types[0])
    for each in types:
        try:
            return convert(value, each)
        except WrongValue:
            continue
    raise WrongValue(f"must be {describe(hint)}")


def _tuple(value: Any, hint: Any, args: tuple[Any, ...]) -> tuple[Any, ...]:
    """Return a list or tuple as a tuple, each item of its type."""
    if not isinstance(value, list | tuple):
        raise WrongValue(f"must be {describe(hint)}")
    if args[-1] is not Ellipsis:
        if len(value) != len(args):
            raise WrongValue(f"must be {describe(hint)}")
        return tuple(convert(item, each) for item, each in zip(value, args))
    return each_of(value, lambda item: convert(item, args[0]))


def each_of(values: Iterable[Any], check: Callable[[Any], Any]) -> tuple[Any, ...]:
    """Return the results of a check for each of several values.

    Raises:
        WrongValue: the number and the mistake of the first wrong one.
    """
    found = []
    for index, value in enumerate(values):
        try:
            found.append(check(value))
        except ValueError as error:
            raise WrongValue(str(error), index) from None
    return tuple(found)


def _bool(value: Any) -> bool:
    text = str(value).lower()
    if not isinstance(value, bool | int | str) or text not in (*TRUE, *FALSE):
        raise WrongValue(f"must be {describe(bool)}")
    return text in TRUE


def _int(value: Any) -> int:
    is_number = isinstance(value, int | float | str) and not isinstance(value, bool)
    try:
        found = int(value) if is_number else None
    except (ValueError, OverflowError):  # not a number, more than 4300 digits, NaN, infinity
        found = None
    if found is None or (isinstance(value, float) and found != value):
        raise WrongValue(f"must be {describe(int)}")
    return found


def _float(value: Any) -> float:
    is_number = isinstance(value, int | float | str) and not isinstance(value, bool)
    try:
        found = float(value) if is_number else math.nan
    except (ValueError, OverflowError):  # a whole number of more than 308 digits
        found = math.nan
    if not math.isfinite(found):
        raise WrongValue(f"must be {describe(float)}")
    return found


def _str(value: Any) -> str:
    if not isinstance(value, str):
        raise WrongValue(f"must be {describe(str)}")
    try:
        value.encode()
    except UnicodeEncodeError:
        raise WrongValue(NOT_UNICODE) from None
    return value


_CONVERSIONS: dict[Any, Callable[[Any], Any]] = {
    bool: _bool,
    int: _int,
    float: _float,
    str: _str,
    Any: lambda value: value,
}


def describe(hint: Any) -> str:
    """Return a type in words, such as "a finite number or 'any'"."""
    words = {bool: "true or false", int: "a whole number", float: "a finite number", str: "text"}
    origin, args = get_origin(hint), get_args(hint)
    if origin in (Union, UnionType):
        return " or ".join(describe(each) for each in args if each is not NoneType)
    if origin is Literal:
        return one_of(args).removeprefix("must be ")
    if origin is tuple:
        if args[-1] is Ellipsis:
            return "a list"
        return f"a list of {len(args)} {'numbers' if args[1:] else 'number'}"
    return words[hint]


def check_bounds(
    value: Any, *, least: float | None = None, more_than: float | None = None, most: float | None = None
) -> None:
    """Refuse a number outside its bounds; values that are not numbers have none.

    Raises:
        WrongValue: naming the bound.
    """
    if not isinstance(value, int | float):
        return
    if least is not None and value < least:
        raise WrongValue(at_least(least))
    if more_than is not None and value <= more_than:
        raise WrongValue(above(more_than))
    if most is not None and value > most:
        raise WrongValue(at_most(most))
