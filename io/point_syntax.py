"""A point that a user names, written the same on the command line, in JSON, in manifests and in reports.

`x,y` or [x, y] is a point of the file's plane, in its units; on a mesh `v5` or `5` is the vertex that its file counts
so, and `x,y,z` or [x, y, z] the point of the surface nearest to a point in space.
"""

import re
from collections.abc import Callable
from typing import Annotated, Any

from . import limits

TAGS = ("plane", "space", "vertex")  # what pydantic calls the forms of a place in the path to a mistake
FORMS = "write x,y or [x, y]; on a mesh also v5 (a vertex) or x,y,z"
PIN = "SX,SY:TX,TY, such as 10,20:30,40 or 10,20:30,40,radius=6"
PIN_SETTINGS = {"r": "radius", "radius": "radius", "tolerance": "tolerance", "turn": "turn", "scale": "scale"}
"""What may follow a typed pin, with the name of each in constraints files."""
_NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
_VERTEX = re.compile(r"[vV]?(\d{1,18})")


def read(value: Any) -> Any:
    """A place as two or three numbers, or as the name of a vertex, such as "v5"; lists are left to be checked.

    Raises:
        ValueError: it is not a place, in a sentence.
    """
    if isinstance(value, int) and not isinstance(value, bool):
        value = str(value)
    if isinstance(value, list | tuple):
        return value
    words = [word.strip() for word in value.split(",")] if isinstance(value, str) else []
    if len(words) == 1 and (vertex := _VERTEX.fullmatch(words[0])):
        return f"v{int(vertex[1])}"
    if len(words) not in (2, 3) or not all(map(_NUMBER.fullmatch, words)):
        raise ValueError(f"{f'{value!r} ' if isinstance(value, str) else ''}is not a point; {FORMS}")
    return tuple(map(float, words))


def _kind(value: Any) -> str:
    """Which form is meant, so that a mistake in it is reported as one of that form."""
    if isinstance(value, str):
        return "vertex"
    return "space" if isinstance(value, list | tuple) and len(value) == 3 else "plane"


class LazySchema:
    """What pydantic checks of a type, made when it asks: it is slow to import, and most jobs name no place.

    Args:
        type: makes the type with its checks.
    """

    def __init__(self, type: Callable[[], Any]):
        self.type = type

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> Any:
        """The schema of the type with its checks."""
        return handler.generate_schema(self.type())


def _number() -> Any:
    from pydantic import Field

    return Annotated[
        float, Field(allow_inf_nan=False, ge=-limits.COORDINATE, le=limits.COORDINATE, strict=True)
    ]


def _place() -> Any:
    from pydantic import BeforeValidator, Discriminator, Tag

    return Annotated[
        Annotated[tuple[Number, Number], Tag("plane")]
        | Annotated[tuple[Number, Number, Number], Tag("space")]
        | Annotated[str, Tag("vertex")],
        Discriminator(_kind),
        BeforeValidator(read),
    ]


def _pair() -> Any:
    from pydantic import BeforeValidator

    return Annotated[tuple[Place, Place] | tuple[Place, Place, dict[str, float]], BeforeValidator(_pin)]


Number = Annotated[float, LazySchema(_number)]
Place = Annotated[tuple[float, float] | tuple[float, float, float] | str, LazySchema(_place)]


def written(place: Place) -> str:
    """A place as it is typed."""
    return place if isinstance(place, str) else ",".join(f"{value:.15g}" for value in place)


def vertex_of(place: Place) -> int | None:
    """The number of the vertex that a place names, if it names one."""
    return int(place[1:]) if isinstance(place, str) else None


def _pin(value: Any) -> Any:
    """`SX,SY:TX,TY` as typed, also with settings such as `,radius=6`; or two places, or four numbers."""
    if isinstance(value, str):
        sides = value.split(":")
        if len(sides) != 2:
            raise ValueError(f"{value!r} is not {PIN}")
        words = sides[1].split(",")
        place = [word for word in words if "=" not in word]
        try:
            places = read(sides[0]), read(",".join(place))
        except ValueError as error:
            raise ValueError(f"{error}; a pin is {PIN}") from None
        settings = dict(_setting(word) for word in words if "=" in word)
        return (*places, settings) if settings else places
    if isinstance(value, list | tuple) and len(value) == 3 and isinstance(value[2], dict):
        return (*value[:2], dict(_setting(f"{name}={number}") for name, number in value[2].items()))
    if isinstance(value, list | tuple) and len(value) == 4:
        return (value[:2], value[2:])
    return value


def _setting(word: str) -> tuple[str, float]:
    """A setting of a pin and its value."""
    name, _, number = (part.strip() for part in word.partition("="))
    if name not in PIN_SETTINGS:
        known = ", ".join(dict.fromkeys(PIN_SETTINGS.values()))
        raise ValueError(f"{word!r} is not a setting of a pin; these are {known}")
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


Pin = Annotated[tuple[Place, Place] | tuple[Place, Place, dict[str, float]], LazySchema(_pair)]
