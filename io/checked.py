"""Values from outside, checked by pydantic, which is slow to import; what is wrong in words."""

from pydantic import BaseModel, ConfigDict, ValidationError

from .point_syntax import TAGS

MESSAGES = {
    "extra_forbidden": "unknown key",
    "missing": "is missing",
    "model_type": "must be a JSON object, {…}",
    "string_unicode": "the name is not UTF-8; rename the file",
}


class StrictModel(BaseModel):
    """Values by name: none but these, which never change."""

    model_config = ConfigDict(extra="forbid", frozen=True, defer_build=True)


def mistakes(error: ValidationError) -> list[tuple[str, str]]:
    """(key, what is wrong) for each mistake pydantic found."""
    found: dict[str, str] = {}
    for item in error.errors(include_url=False, include_context=False, include_input=False):
        parts = [str(part) for part in item["loc"] if part not in TAGS]
        key = ".".join(part for part in parts if not part.startswith(("tuple[", "function-")))
        text = MESSAGES.get(item["type"], item["msg"]).removeprefix("Value error, ")
        found.setdefault(key.removesuffix(".0") if key.startswith("size") else key, text)
    return list(found.items())


def first(error: ValidationError, whole: str = "the file") -> str:
    """The first mistake with its place, that of a key or the `whole` if not empty, and how many more there are."""
    (key, text), *rest = mistakes(error)
    more = f" (and {len(rest)} more error{'s' if len(rest) > 1 else ''})" if rest else ""
    place = key[:200] or whole
    return f"{place}{': ' if place else ''}{text}{more}"
