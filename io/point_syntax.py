"""The syntax of points, the same on the command line, in JSON, in manifests and in reports.

`x,y` or [x, y] is a point of the file's plane, in its units. On a mesh, `v5` or `5` is the vertex with this number in
the file, and `x,y,z` or [x, y, z] is the point of the surface nearest to a point in space.
"""

import math
import re
from collections.abc import Callable, Sequence
from typing import Annotated, Any

from ..errors import InputError
from . import limits

FORMS = "write x,y or [x, y]; on a mesh also v5 (a vertex) or x,y,z"
PIN = "SX,SY:TX,TY, such as 10,20:30,40 or 10,20:30,40,radius=6"
PIN_SETTINGS = {"r": "radius", "radius": "radius", "tolerance": "tolerance", "turn": "turn", "scale": "scale"}
"""Settings that may follow a pin on the command line, with their names in constraints files."""
_NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
_VERTEX = re.compile(r"[vV]?(\d{1,18})")


def read(value: Any) -> "Place":
    """Parse a place: two or three numbers, or the name of a vertex, such as "v5".

    Raises:
        ValueError: it is not a place; the message is a sentence.
    """
    if isinstance(value, int) and not isinstance(value, bool):
        value = str(value)
    if isinstance(value, list | tuple):
        return _point(value)
    words = [word.strip() for word in value.split(",")] if isinstance(value, str) else []
    if len(words) == 1 and (vertex := _VERTEX.fullmatch(words[0])):
        return f"v{int(vertex[1])}"
    if len(words) not in (2, 3) or not all(map(_NUMBER.fullmatch, words)):
        raise ValueError(f"{f'{value!r} ' if isinstance(value, str) else ''}is not a point; {FORMS}")
    return _point([float(word) for word in words])


def _point(numbers: Sequence[Any]) -> "Place":
    """Check two or three numbers, and return them as a place.

    Raises:
        ValueError: there are more or fewer, or one of them is not a number, or too large.
    """
    if len(numbers) not in (2, 3):
        raise ValueError(f"is not a point; {FORMS}")
    for axis, number in zip("xyz", numbers):
        if not isinstance(number, int | float) or isinstance(number, bool):
            raise ValueError(f"{axis} must be a number")
        if number in (math.inf, -math.inf) or number != number:
            raise ValueError(f"{axis} must be a finite number")
        if abs(number) > limits.COORDINATE:
            raise ValueError(f"{axis} must be between {-limits.COORDINATE:g} and {limits.COORDINATE:g}")
    if len(numbers) == 2:
        return float(numbers[0]), float(numbers[1])
    return float(numbers[0]), float(numbers[1]), float(numbers[2])


class CheckedBy:
    """A type annotation that lets pydantic validate by a function, so that options and documents share one check.

    Args:
        check: returns the value, or raises a ValueError.
    """

    def __init__(self, check: Callable[[Any], Any]):
        self.check = check

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> Any:
        """Return the schema of the type; pydantic, which is slow to import, is already loaded when it calls this."""
        from pydantic_core import core_schema

        return core_schema.no_info_plain_validator_function(self.check)


Place = Annotated[tuple[float, float] | tuple[float, float, float] | str, CheckedBy(read)]


def written(place: Place) -> str:
    """Return a place as it is written on the command line."""
    return place if isinstance(place, str) else ",".join(f"{value:.15g}" for value in place)


def vertex_of(place: Place) -> int | None:
    """Return the number of the vertex that a place names, or None."""
    return int(place[1:]) if isinstance(place, str) else None


def pin(value: Any) -> "Pin":
    """Parse a pin: `SX,SY:TX,TY` as text, also with settings such as `,radius=6`; or two places, or four numbers.

    Raises:
        ValueError: it is not a pin; the message is a sentence.
    """
    if isinstance(value, str):
        return _typed_pin(value)
    if isinstance(value, list | tuple) and len(value) == 4:
        return read(value[:2]), read(value[2:])
    if isinstance(value, list | tuple) and len(value) == 3 and isinstance(value[2], dict):
        settings = dict(_setting(f"{name}={number}") for name, number in value[2].items())
        return read(value[0]), read(value[1]), settings
    if isinstance(value, list | tuple) and len(value) == 2:
        return read(value[0]), read(value[1])
    raise ValueError(f"is not {PIN}")


def _typed_pin(text: str) -> "Pin":
    """Parse a pin given as text.

    Raises:
        ValueError: it is not a pin; the message is a sentence.
    """
    sides = text.split(":")
    if len(sides) != 2:
        raise ValueError(f"{text!r} is not {PIN}")
    words = sides[1].split(",")
    place = [word for word in words if "=" not in word]
    try:
        source, target = read(sides[0]), read(",".join(place))
    except ValueError as error:
        raise ValueError(f"{error}; a pin is {PIN}") from None
    settings = dict(_setting(word) for word in words if "=" in word)
    return (source, target, settings) if settings else (source, target)


def _setting(word: str) -> tuple[str, float]:
    """Parse a setting of a pin; return its name and value."""
    name, _, number = (part.strip() for part in word.partition("="))
    if name not in PIN_SETTINGS:
        names = ", ".join(dict.fromkeys(PIN_SETTINGS.values()))
        raise ValueError(f"{word!r} is not a setting of a pin; these are {names}")
    if not _NUMBER.fullmatch(number):
        raise ValueError(f"{word!r}: {number!r} is not a number")
    value, name = float(number), PIN_SETTINGS[name]
    if abs(value) > limits.COORDINATE or (
        name != "turn" and not (value > 0 or (name == "radius" and value == 0))
    ):
        raise ValueError(
            f"{word!r} is out of range; a {name} is {'at least' if name == 'radius' else 'above'} 0"
        )
    return name, value


Pin = Annotated[tuple[Place, Place] | tuple[Place, Place, dict[str, float]], CheckedBy(pin)]


def is_number(text: str) -> bool:
    """Return whether a text is a number, also one that is not finite."""
    try:
        float(text)
    except ValueError:
        return False
    return True


def coordinate(text: str, where: str) -> float:
    """Parse a coordinate in a table or another text file.

    Args:
        text: the number as written.
        where: its place in the file, for the message.

    Raises:
        InputError: it is not a finite number, or too large.
    """
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not abs(number) <= limits.COORDINATE:
        raise InputError(f"{where}: {text.strip()[:40]!r} is not a coordinate; write a number, such as 12.5")
    return number
