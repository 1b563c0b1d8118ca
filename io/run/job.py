"""One run, described and validated: the command line, a batch and CI all make one of these."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from ...errors import InputError
from .. import places
from ..spec import path_of
from .options import SOLVER, JobOptions

WRITTEN = ("report", "plot", "stmap")
"""Fields that name a file to write, beside `output`."""


class _Shapes(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    source: str = Field(min_length=1)
    target: str | None = None


class Job(JobOptions, _Shapes):
    """What to map onto what, how, and what to write. Paths are as the user gave them; coordinates in file units.

    `target` None means a deformation of the source by its constraints alone.
    """

    @model_validator(mode="after")
    def _one_stream(self) -> Job:
        if [*self.output, self.report].count("-") > 1:
            raise ValueError("only one output can be `-`: stdout is one stream")
        return self

    @property
    def solver(self) -> dict[str, Any]:
        """What of it goes to `iccm.fit` and `iccm.deform`."""
        return {name: value for name in SOLVER if (value := getattr(self, name)) is not None}

    @property
    def outputs(self) -> tuple[str, ...]:
        """Every file that the job writes, in no particular order; stdout is not a file."""
        names = [*self.output, *(getattr(self, field) for field in WRITTEN)]
        return tuple(name for name in names if name and name != "-")

    @property
    def inputs(self) -> tuple[str, ...]:
        """Every file that the job reads, as a path without its `#id`; stdin is not a file."""
        specs = [path_of(self.source), path_of(self.target or ""), self.texture, self.constraints]
        return tuple(dict.fromkeys(name for name in specs if name and name != "-"))


def make(values: dict[str, Any]) -> Job:
    """A job from the options of the command line.

    Raises:
        InputError: the first mistake, by the name of its option.
    """
    try:
        return Job(**values)
    except ValidationError as error:
        raise InputError("; ".join(_of_option(key, text) for key, text in mistakes(error))) from None


def _of_option(key: str, text: str) -> str:
    """A mistake in the words of the command line, which counts from 1; one that concerns no option as it is."""
    if key in ("source", "target"):
        return f"{key.upper()}: {text}"
    option, _, rest = key.partition(".")
    number = f" {int(rest.split('.')[0]) + 1}" if rest[:1].isdecimal() else ""
    return f"--{option.replace('_', '-')}{number}: {text}" if option else text


def mistakes(error: ValidationError) -> list[tuple[str, str]]:
    """(key, what is wrong) for each mistake pydantic found."""
    found: dict[str, str] = {}
    for item in error.errors(include_url=False, include_context=False):
        parts = [str(part) for part in item["loc"] if part not in places.TAGS]
        key = ".".join(part for part in parts if not part.startswith(("tuple[", "function-")))
        found.setdefault(key.removesuffix(".0") if key.startswith("size") else key, _plain(item["msg"]))
    return list(found.items())


def _plain(message: str) -> str:
    if "as a unicode string" in message:
        return "the name is not UTF-8; rename the file"
    return message.removeprefix("Value error, ").replace("Extra inputs are not permitted", "unknown key")
