"""One run, described and validated: the command line, a batch and CI all make one of these."""

from __future__ import annotations

import json
import math
from collections.abc import Collection, Sequence
from pathlib import Path
from types import UnionType
from typing import Any, Literal, Union, get_args, get_origin

from ...errors import InputError, JobError
from .. import formats
from ..options import SOLVER, JobOptions, Option, options_of
from ..spec import path_of

WRITTEN = ("report", "plot", "stmap")
"""Fields that name a file to write, beside `output`."""
STEM = "{stem}"
"""In the name of a picture: that of the texture it is made of."""


class Job(JobOptions):
    """What to map onto what, how, and what to write. Paths are as the user gave them; coordinates in file units.

    `target` None means a deformation of the source by its constraints alone. It never changes; what is asked of it
    goes by pydantic's names, which checks its values unless they are plain (see `validate`).

    Raises:
        JobError: a value, or what it comes to with others, is wrong.
    """

    source: str
    target: str | None

    def __init__(self, **values: Any):
        plain = _parse(values)
        if plain is None:
            from .validate import validate

            plain = validate(values)
        vars(self).update(DEFAULTS, **plain)
        if [*self.output, self.report].count("-") > 1:
            raise JobError([("", "only one output can be `-`: stdout is one stream")])
        self._give_a_picture_each()

    def _give_a_picture_each(self) -> None:
        """Every texture gets a picture; the first of them is `texture`."""
        if self.maps and not self.texture:
            path, kind = self.maps[0]
            name = kind.replace("-", "_")
            vars(self).update({"texture": path, "kind": kind, name: getattr(self, name)[1:]})
        if self.maps and (self.output or any(getattr(self, field) for field in WRITTEN)):
            try:
                vars(self)["output"] = pair_outputs(self.output, self.maps)
            except ValueError as error:
                raise JobError([("", str(error))]) from None

    def __setattr__(self, name: str, value: Any) -> None:
        raise AttributeError(f"{name}: a job does not change; see model_copy")

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Job) and vars(self) == vars(other)

    def __repr__(self) -> str:
        return f"Job({', '.join(f'{key}={value!r}' for key, value in self.model_dump(exclude_defaults=True).items())})"

    def model_copy(self, *, update: dict[str, Any]) -> Job:
        """The job with other values, which are not checked."""
        found = object.__new__(Job)
        vars(found).update(vars(self), **update)
        return found

    def model_dump(
        self, *, mode: str = "python", exclude_defaults: bool = False, exclude: Collection[str] = ()
    ) -> dict[str, Any]:
        """The values by name, in the order of help; with mode "json" as JSON has them."""
        found = {name: getattr(self, name) for name in DEFAULTS if name not in exclude}
        if exclude_defaults:
            found = {name: value for name, value in found.items() if value != DEFAULTS[name]}
        return {name: _as_lists(value) for name, value in found.items()} if mode == "json" else found

    def model_dump_json(self, *, exclude_defaults: bool = False) -> str:
        """The values as JSON."""
        return json.dumps(self.model_dump(exclude_defaults=exclude_defaults), ensure_ascii=False)

    @classmethod
    def model_validate_json(cls, text: str) -> Job:
        """The job that JSON describes."""
        return cls(**json.loads(text))

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
    def exact(self) -> bool:
        """Whether pins and strokes are met, not weighed: what lies outside the target could not be."""
        from ...problem import Options as Solver

        return Solver(**self.solver).is_balanced

    @property
    def holed(self) -> bool:
        """Whether the map knows of holes: the balanced method's does, unless they are to be cut or filled."""
        return self.holes in ("auto", "keep") and self.exact

    @property
    def outputs(self) -> tuple[str, ...]:
        """Every file that the job writes, in no particular order; stdout is not a file."""
        names = [*self.output, *(getattr(self, field) for field in WRITTEN)]
        return tuple(name for name in names if name and name != "-")

    @property
    def inputs(self) -> tuple[str, ...]:
        """Every file that the job reads, as a path without its `#id`; stdin is not a file."""
        textures = [path for path, _ in self.maps]
        masks = [each for each in self.rigid if not each.startswith("#")]
        specs = [path_of(self.source), path_of(self.target or ""), *textures, self.constraints, *masks]
        specs += [self.importance, self.size_map, self.start]
        return tuple(dict.fromkeys(name for name in specs if name and name != "-"))


HINTS: dict[str, Any] = {"source": str, "target": str | None} | {
    name: hint for name, (hint, _) in options_of().items()
}
OPTIONS = {name: option for name, (_, option) in options_of().items()}
DEFAULTS: dict[str, Any] = {name: option.default for name, option in OPTIONS.items()} | {
    "source": None,
    "target": None,
}


def _parse(values: dict[str, Any]) -> dict[str, Any] | None:
    """The values as a job has them, if they are beyond doubt; None where a closer look is needed, which is slow."""
    if not values.get("source") or not values.keys() <= DEFAULTS.keys():
        return None
    found = dict[str, Any]()
    for name, value in values.items():
        option = OPTIONS.get(name)
        try:
            parsed = option.parse(value) if option and option.parse else value
        except ValueError:
            return None
        found[name] = tuple(parsed) if isinstance(parsed, list) else parsed
        if not _fits(found[name], HINTS[name]) or (option and not _in_bounds(found[name], option)):
            return None
    return found


def _fits(value: Any, hint: Any) -> bool:
    """Whether a value is of a type, without being made so."""
    kind, args = get_origin(hint), get_args(hint)
    if kind in (Union, UnionType):
        return any(_fits(value, each) for each in args)
    if kind is Literal:
        return any(value == each and type(value) is type(each) for each in args)
    if kind is tuple:
        of_each = args[:1] * len(value) if isinstance(value, tuple) and args[-1] is Ellipsis else args
        return isinstance(value, tuple) and len(value) == len(of_each) and all(map(_fits, value, of_each))
    if hint is str:
        return type(value) is str and value.isprintable()
    return type(value) is hint and (hint is not float or math.isfinite(value))


def _in_bounds(value: Any, option: Option) -> bool:
    """Whether a number is between the bounds of its option."""
    return not isinstance(value, int | float) or (
        (option.least is None or value >= option.least)
        and (option.above is None or value > option.above)
        and (option.most is None or value <= option.most)
    )


def _as_lists(value: Any) -> Any:
    """Tuples as lists, all the way down."""
    return [_as_lists(each) for each in value] if isinstance(value, tuple | list) else value


def is_picture(name: str) -> bool:
    """Whether an output shows a texture: by its suffix, or as it goes to stdout."""
    return name == "-" or formats.of(name).picture is not None


def is_mesh(name: str) -> bool:
    """Whether an output is a mesh that shows textures by new coordinates, by its suffix."""
    return name != "-" and formats.of(name).uv


def pair_outputs(outputs: Sequence[str], maps: Sequence[tuple[str, str]]) -> tuple[str, ...]:
    """Outputs with a picture for each of the maps, in their order, where one name with `{stem}` stands for all; none
    where a mesh shows them: one of colours, one of normals.

    Raises:
        ValueError: pictures too many or too few, or none for several textures, or for one that a mesh does not show.
    """
    textures, kinds = zip(*maps) if maps else ((), ())
    pictures = [name for name in outputs if is_picture(name)]
    if len(pictures) == 1 and STEM in pictures[0]:
        named = [pictures[0].replace(STEM, Path(path).stem) for path in textures]
        return tuple(each for name in outputs for each in (named if name is pictures[0] else [name]))
    alone = not pictures and any(map(is_mesh, outputs))
    if alone and (unshown := {"normal-down", "data"}.intersection(kinds)):
        raise ValueError(
            f"a mesh by itself shows a --texture and a --normal; name a picture for {sorted(unshown)[0]} too, "
            "such as -o made.png"
        )
    alone = alone and sorted(kinds) == ["colour", "normal"]
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
    except JobError as error:
        raise InputError("; ".join(_of_option(key, text) for key, text in error.mistakes)) from None


def _of_option(key: str, text: str) -> str:
    """A mistake in the words of the command line, which counts from 1; one that concerns no option as it is."""
    if key in ("source", "target"):
        return f"{key.upper()}: {text}"
    option, _, rest = key.partition(".")
    number = f" {int(rest.split('.')[0]) + 1}" if rest[:1].isdecimal() else ""
    return f"--{option.replace('_', '-')}{number}: {text}" if option else text
