"""Validation of option values: types, choices and bounds, and the messages about invalid ones.

All jobs are validated here, whether their values come from the command line, a manifest or Python, because importing
pydantic would take a tenth of the time of a small job. Nested documents (constraints files, messages of the editor,
tolerances) are validated by pydantic with the same messages, see `checked`.
"""

import math
from collections.abc import Callable, Iterable
from types import NoneType, UnionType
from typing import Any, Literal, Union, get_args, get_origin

UNKNOWN = "unknown key"
MISSING = "is missing"
NOT_UNICODE = "the name is not UTF-8; rename the file"
EMPTY_NAME = "the name is empty; give one, or leave it out"
TRUE = ("true", "yes", "on", "t", "y", "1")
FALSE = ("false", "no", "off", "f", "n", "0")
"""Words for true and false, in any case."""


class WrongValue(ValueError):
    """An invalid value of an option.

    Attributes:
        index: index of the invalid item, from 0, if the value is a sequence; else None.
    """

    def __init__(self, text: str, index: int | None = None) -> None:
        super().__init__(text)
        self.index = index


def at_least(bound: float) -> str:
    """Return the message for a number below a bound."""
    return f"must be at least {bound:.15g}"


def above(bound: float) -> str:
    """Return the message for a number that is not above a bound."""
    return f"must be greater than {bound:.15g}"


def at_most(bound: float) -> str:
    """Return the message for a number above a bound."""
    return f"must be at most {bound:.15g}"


def one_of(choices: Iterable[object]) -> str:
    """Return the message for a value that is not one of the choices."""
    *most, last = [repr(choice) for choice in choices]
    return f"must be {', '.join(most)} or {last}" if most else f"must be {last}"


def check_names(value: Any) -> None:
    """Check that a name of a file, and each of several names, is not empty, as an unset variable of a shell makes it.

    Raises:
        WrongValue: it is.
    """
    if value == "":
        raise WrongValue(EMPTY_NAME)
    for index, name in enumerate(value if isinstance(value, tuple) else ()):
        if name == "":
            raise WrongValue(EMPTY_NAME, index)


def convert(value: Any, hint: Any) -> Any:
    """Convert a value to a type: integers to floats, lists to tuples, and text to numbers.

    Args:
        value: from outside.
        hint: a type of an option: bool, int, float, str, choices, tuples of these, and unions of them.

    Raises:
        WrongValue: it cannot be converted.
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
    """Convert a value to the first type that accepts it."""
    if value is None and NoneType in types:
        return None
    types = tuple(candidate for candidate in types if candidate is not NoneType)
    if len(types) == 1:
        return convert(value, types[0])
    for candidate in types:
        try:
            return convert(value, candidate)
        except WrongValue:
            continue
    raise WrongValue(f"must be {describe(hint)}")


def _tuple(value: Any, hint: Any, args: tuple[Any, ...]) -> tuple[Any, ...]:
    """Convert a list or tuple to a tuple, with each item of its type."""
    if not isinstance(value, list | tuple):
        raise WrongValue(f"must be {describe(hint)}")
    if args[-1] is not Ellipsis:
        if len(value) != len(args):
            raise WrongValue(f"must be {describe(hint)}")
        return tuple(convert(item, item_type) for item, item_type in zip(value, args))
    return each_of(value, lambda item: convert(item, args[0]))


def each_of(values: Iterable[Any], check: Callable[[Any], Any]) -> tuple[Any, ...]:
    """Return the results of a check for each of several values.

    Raises:
        WrongValue: with the index and the message of the first invalid one.
    """
    results = []
    for index, value in enumerate(values):
        try:
            results.append(check(value))
        except ValueError as error:
            raise WrongValue(str(error), index) from None
    return tuple(results)


def _bool(value: Any) -> bool:
    text = str(value).lower()
    if not isinstance(value, bool | int | str) or text not in (*TRUE, *FALSE):
        raise WrongValue(f"must be {describe(bool)}")
    return text in TRUE


def _int(value: Any) -> int:
    is_number = isinstance(value, int | float | str) and not isinstance(value, bool)
    try:
        number = int(value) if is_number else None
    except (ValueError, OverflowError):  # not a number, more than 4300 digits, NaN, or infinity
        number = None
    if number is None or (isinstance(value, float) and number != value):
        raise WrongValue(f"must be {describe(int)}")
    return number


def _float(value: Any) -> float:
    is_number = isinstance(value, int | float | str) and not isinstance(value, bool)
    try:
        number = float(value) if is_number else math.nan
    except (ValueError, OverflowError):  # an integer with more than 308 digits
        number = math.nan
    if not math.isfinite(number):
        raise WrongValue(f"must be {describe(float)}")
    return number


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
    """Describe a type in words, such as "a finite number or 'any'"."""
    words = {bool: "true or false", int: "a whole number", float: "a finite number", str: "text"}
    origin, args = get_origin(hint), get_args(hint)
    if origin in (Union, UnionType):
        return " or ".join(describe(arg) for arg in args if arg is not NoneType)
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
    """Check that a number is within bounds; other values are ignored.

    Raises:
        WrongValue: it is not; the message contains the bound.
    """
    if not isinstance(value, int | float):
        return
    if least is not None and value < least:
        raise WrongValue(at_least(least))
    if more_than is not None and value <= more_than:
        raise WrongValue(above(more_than))
    if most is not None and value > most:
        raise WrongValue(at_most(most))
