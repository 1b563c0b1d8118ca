"""Validation by pydantic of documents: constraints files, messages of the editor, and tolerances.

The messages are those of `values`, which validates options. Pydantic is slow to import, so jobs without such documents
do not import it.
"""

from collections.abc import Callable
from typing import Any

from pydantic import BaseModel, ConfigDict, ValidationError

from . import values

MESSAGES: dict[str, Callable[[dict[str, Any]], str]] = {
    "extra_forbidden": lambda bounds: values.UNKNOWN,
    "missing": lambda bounds: values.MISSING,
    "model_type": lambda bounds: "must be a JSON object, {…}",
    "dict_type": lambda bounds: "must be a JSON object, {…}",
    "string_unicode": lambda bounds: values.NOT_UNICODE,
    "string_type": lambda bounds: f"must be {values.describe(str)}",
    "bool_type": lambda bounds: f"must be {values.describe(bool)}",
    "bool_parsing": lambda bounds: f"must be {values.describe(bool)}",
    "int_type": lambda bounds: f"must be {values.describe(int)}",
    "int_parsing": lambda bounds: f"must be {values.describe(int)}",
    "int_from_float": lambda bounds: f"must be {values.describe(int)}",
    "float_type": lambda bounds: f"must be {values.describe(float)}",
    "float_parsing": lambda bounds: f"must be {values.describe(float)}",
    "finite_number": lambda bounds: f"must be {values.describe(float)}",
    "list_type": lambda bounds: "must be a list",
    "tuple_type": lambda bounds: "must be a list",
    "literal_error": lambda bounds: f"must be {bounds['expected']}",
    "greater_than": lambda bounds: values.above(bounds["gt"]),
    "greater_than_equal": lambda bounds: values.at_least(bounds["ge"]),
    "less_than": lambda bounds: f"must be less than {bounds['lt']}",
    "less_than_equal": lambda bounds: values.at_most(bounds["le"]),
    "too_short": lambda bounds: f"must have at least {bounds['min_length']} items",
    "too_long": lambda bounds: f"must have at most {bounds['max_length']} items",
    "string_too_short": lambda bounds: f"must have at least {bounds['min_length']} characters",
    "string_too_long": lambda bounds: f"must have at most {bounds['max_length']} characters",
}
"""Messages by type of pydantic error, filled in with its bounds; other errors keep pydantic's message."""


class StrictModel(BaseModel):
    """A frozen model that rejects unknown fields."""

    model_config = ConfigDict(extra="forbid", frozen=True, defer_build=True)


def mistakes(error: ValidationError) -> list[tuple[str, str]]:
    """Return (key, message) for each mistake that pydantic found.

    For a value of several possible types, pydantic reports a mistake for each of them, with the type in its place, as
    in pins.0.source.tuple[float, float]. These parts are left out, and of such mistakes the first one counts.
    """
    messages: dict[str, str] = {}
    for item in error.errors(include_url=False, include_input=False):
        parts = [str(part) for part in item["loc"]]
        key = ".".join(part for part in parts if not part.startswith(("tuple[", "function-")))
        in_our_words = MESSAGES.get(item["type"])
        text = in_our_words(item.get("ctx", {})) if in_our_words else item["msg"]
        messages.setdefault(key, text.removeprefix("Value error, "))
    return list(messages.items())


def first(error: ValidationError, whole: str = "the file") -> str:
    """Return the first mistake with its key, else with `whole` unless that is empty, and the number of further
    mistakes.
    """
    (key, text), *further = mistakes(error)
    others = f" (and {len(further)} more error{'s' if len(further) > 1 else ''})" if further else ""
    place = key[:200] or whole
    return f"{place}{': ' if place else ''}{text}{others}"
