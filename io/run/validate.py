"""A job's values, checked by pydantic: where more is given than names, numbers and choices, and where one is wrong.

It is slow to import: a job of the command line that is plain does without.
"""

from typing import Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from ...errors import JobError
from .. import point_syntax
from ..options import JobOptions


class _Shapes(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    source: str = Field(min_length=1)
    target: str | None = None


class CheckedJob(JobOptions, _Shapes):
    """The values of a `Job`, each checked for itself."""


def validate(values: dict[str, Any]) -> dict[str, Any]:
    """The values, defaults among them, as a job has them.

    Raises:
        JobError: all that is wrong.
    """
    try:
        return vars(CheckedJob(**values))
    except ValidationError as error:
        raise JobError(mistakes(error)) from None


def mistakes(error: ValidationError) -> list[tuple[str, str]]:
    """(key, what is wrong) for each mistake pydantic found."""
    found: dict[str, str] = {}
    for item in error.errors(include_url=False, include_context=False):
        parts = [str(part) for part in item["loc"] if part not in point_syntax.TAGS]
        key = ".".join(part for part in parts if not part.startswith(("tuple[", "function-")))
        found.setdefault(key.removesuffix(".0") if key.startswith("size") else key, _sentence(item["msg"]))
    return list(found.items())


def _sentence(message: str) -> str:
    if "as a unicode string" in message:
        return "the name is not UTF-8; rename the file"
    return message.removeprefix("Value error, ").replace("Extra inputs are not permitted", "unknown key")
