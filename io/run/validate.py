"""A job's values, checked by pydantic: where more is given than names, numbers and choices, and where one is wrong.

It is slow to import: a job of the command line that is plain does without.
"""

from functools import cache
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError, create_model

from ...errors import JobError
from ..checked import MESSAGES, mistakes
from ..options import suggest

STRICT = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


@cache
def checked(kind: Any) -> type[BaseModel]:
    """A model of the values of a kind of job, each checked for itself."""
    needed = kind.required()
    fields: dict[str, Any] = {
        name: (
            Annotated[hint, option or Field(min_length=1)],
            ... if name in needed else option.default if option else None,
        )
        for name, (hint, option) in kind.rows.items()
    }
    return create_model(f"Checked{kind.__name__}", __config__=STRICT, **fields)


def validate(kind: Any, values: dict[str, Any]) -> dict[str, Any]:
    """The values of a job, defaults among them, as it keeps them.

    Raises:
        JobError: all that is wrong.
    """
    try:
        return vars(checked(kind)(**values))
    except ValidationError as error:
        raise JobError([(key, _with_hint(kind, key, text)) for key, text in mistakes(error)]) from None


def _with_hint(kind: Any, key: str, text: str) -> str:
    """What is wrong with a key; of an unknown one also the nearest that there is."""
    if text != MESSAGES["extra_forbidden"]:
        return text
    near = suggest(key, {name: option for name, (_, option) in kind.rows.items()})
    return f"{text}; did you mean {' or '.join(near[:2])}?" if near else text
