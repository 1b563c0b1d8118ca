"""One run, described and validated: the command line, a batch and CI all make one of these."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from ...errors import InputError
from .. import formats, places
from ..spec import path_of
from .options import SOLVER, JobOptions

WRITTEN = ("report", "plot", "stmap")
"""Fields that name a file to write, beside `output`."""
STEM = "{stem}"
"""In the name of a picture: that of the texture it is made of."""


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

    @model_validator(mode="after")
    def _a_picture_each(self) -> Job:
        """Every texture gets a picture; the first of them is `texture`."""
        if self.maps and not self.texture:
            path, kind = self.maps[0]
            name = kind.replace("-", "_")
            self._set(texture=path, kind=kind, **{name: getattr(self, name)[1:]})
        if self.maps and (self.output or any(getattr(self, field) for field in WRITTEN)):
            self._set(output=shared(self.output, self.maps))
        return self

    def _set(self, **values: Any) -> None:
        """Change fields while it is made; it is frozen for everyone else."""
        for name, value in values.items():
            object.__setattr__(self, name, value)

    @property
    def maps(self) -> list[tuple[str, str]]:
        """The textures, with what their channels are."""
        found = [(self.texture, self.kind)] if self.texture else []
        further = {"normal": self.normal, "normal-down": self.normal_down, "data": self.data}
        return found + [(path, kind) for kind, paths in further.items() for path in paths]

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
        textures = [path for path, _ in self.maps]
        specs = [path_of(self.source), path_of(self.target or ""), *textures, self.constraints]
        return tuple(dict.fromkeys(name for name in specs if name and name != "-"))


def is_picture(name: str) -> bool:
    """Whether an output shows a texture: by its suffix, or as it goes to stdout."""
    return name == "-" or formats.of(name).picture is not None


def is_mesh(name: str) -> bool:
    """Whether an output is a mesh that shows textures by new coordinates, by its suffix."""
    return name != "-" and formats.of(name).uv


def shared(outputs: Sequence[str], maps: Sequence[tuple[str, str]]) -> tuple[str, ...]:
    """Outputs with a picture for each of the maps, in their order, where one name with `{stem}` stands for all; none
    where a mesh shows them: one of colours, one of normals.

    Raises:
        ValueError: pictures too many or too few, or none for several textures.
    """
    textures, kinds = zip(*maps) if maps else ((), ())
    pictures = [name for name in outputs if is_picture(name)]
    if len(pictures) == 1 and STEM in pictures[0]:
        named = [pictures[0].replace(STEM, Path(path).stem) for path in textures]
        return tuple(each for name in outputs for each in (named if name is pictures[0] else [name]))
    alone = not pictures and any(map(is_mesh, outputs)) and sorted(kinds) == ["colour", "normal"]
    if len(textures) > 1 and len(pictures) != len(textures) and not alone:
        also = "; a mesh by itself takes one --texture and one --normal" if any(map(is_mesh, outputs)) else ""
        raise ValueError(
            f"{len(textures)} textures and {len(pictures)} pictures: "
            f"name one -o for each texture, or one with {STEM} in it{also}"
        )
    return tuple(outputs)


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
