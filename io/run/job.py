"""The validated description of one run, shared by the command line, batches and CI."""

from __future__ import annotations

import os
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, Self, TypeVar

from ...errors import InputError, JobError
from .. import formats, values
from ..options import (
    OUTPUT,
    SOLVER,
    FlattenOptions,
    JobOptions,
    Option,
    RelayoutOptions,
    of_command,
    options_of,
    suggest,
)
from ..spec import is_generated, path_of

WRITTEN = ("report", "plot", "preview", "compare", "stmap")
"""Fields that name an output file, besides `output`."""
STEM = "{stem}"
"""Placeholder in the name of a picture for the stem of its texture's name."""
CHECKER = "checker"
"""Value of --texture for the numbered checkerboard instead of a file."""


@dataclass(frozen=True, eq=False)
class Outcome:
    """The outcome of a job.

    Attributes:
        ok: whether the result meets the requirements; exit code 0 if so, else 1.
        message: one sentence.
        report: the figures, see `report.build`.
        written: the files written.
        notes: on the inputs and on solving.
        idle: options without effect, which were given for several jobs of a batch.
    """

    ok: bool
    message: str
    report: dict[str, Any]
    written: tuple[str, ...]
    notes: tuple[str, ...]
    idle: tuple[str, ...] = ()


class Described:
    """The values of a command: its arguments and options. They are immutable.

    Attributes:
        command: name of the subcommand of `iccm`.
        rows: the type of each value and the description of each option, by name.
        globbed: values that name one input file, or several by a pattern in a manifest.
        read: other values that name input files.
        written: values that name an output file, besides `output`.
        templated: values in which the templates of a manifest are filled in.
        shared: names of values that were given for several jobs of a batch, and need not have an effect in each.

    Raises:
        JobError: a value, or a combination of values, is invalid.
    """

    command: ClassVar[str]
    rows: ClassVar[dict[str, tuple[Any, Option | None]]]
    globbed: ClassVar[tuple[str, ...]]
    read: ClassVar[tuple[str, ...]]
    written: ClassVar[tuple[str, ...]]
    templated: ClassVar[tuple[str, ...]]
    shared: frozenset[str] = frozenset()
    output: tuple[str, ...]
    report: str | None
    force: bool
    allow_outside: bool
    max_faces: int

    def __init__(self, **values: Any):
        former = self.former_names()
        checked = self.check({former.get(name, name): value for name, value in values.items()})
        vars(self).update(self.defaults(), **checked)
        if [*self.output, self.report].count("-") > 1:
            raise JobError([("", "only one output can be stdout (`-`)")])

    @classmethod
    def defaults(cls) -> dict[str, Any]:
        """Return the default of each value; None for arguments."""
        return {name: option.default if option else None for name, (_, option) in cls.rows.items()}

    @classmethod
    def former_names(cls) -> dict[str, str]:
        """Return the present names of values that have been renamed."""
        return {old: name for name, (_, option) in cls.rows.items() if option for old in option.old}

    @classmethod
    def required(cls) -> list[str]:
        """Return the names of required values."""
        return [
            name for name, (hint, option) in cls.rows.items() if (option.required if option else hint is str)
        ]

    @classmethod
    def check(cls, arguments: dict[str, Any]) -> dict[str, Any]:
        """Validate the given values, and return them as a job stores them.

        Raises:
            JobError: lists every mistake.
        """
        checked = dict[str, Any]()
        mistakes = list[tuple[str, str]]()
        required = cls.required()
        for name, (hint, option) in cls.rows.items():
            if name not in arguments and name in required:
                mistakes.append((name, values.MISSING))
            if name not in arguments:
                continue
            try:
                if option:
                    checked[name] = option.value_of(arguments[name], hint)
                else:
                    checked[name] = values.convert(arguments[name], hint)
            except values.WrongValue as error:
                mistakes.append((name if error.index is None else f"{name}.{error.index}", str(error)))
                continue
            if checked[name] in ("", ()) and (name in required or option is None):
                mistakes.append((name, values.MISSING))
        mistakes += [(name, cls._unknown(name)) for name in arguments if name not in cls.rows]
        if mistakes:
            raise JobError(mistakes)
        return checked

    @classmethod
    def _unknown(cls, name: str) -> str:
        """Return the message about an unknown name, with similar names."""
        similar = suggest(name, {field: option for field, (_, option) in cls.rows.items()})
        return f"{values.UNKNOWN}; did you mean {' or '.join(similar[:2])}?" if similar else values.UNKNOWN

    @classmethod
    def names_file(cls, key: str, value: str) -> bool:
        """Return whether a value of one of the fields in `read` names a file."""
        return value != "-"

    def __setattr__(self, name: str, value: Any) -> None:
        raise AttributeError(f"{name}: a job does not change; see model_copy")

    def __eq__(self, other: object) -> bool:
        return type(other) is type(self) and vars(self) == vars(other)

    def __repr__(self) -> str:
        values = ", ".join(
            f"{key}={value!r}" for key, value in self.model_dump(exclude_defaults=True).items()
        )
        return f"{type(self).__name__}({values})"

    def sharing(self, names: Collection[str]) -> Self:
        """Return a copy in which these values were given for several jobs."""
        return self.model_copy(update={"shared": frozenset(names)})

    def model_copy(self, *, update: dict[str, Any]) -> Self:
        """Return a copy with some values replaced; these are not validated."""
        copy = object.__new__(type(self))
        vars(copy).update(vars(self), **update)
        return copy

    def model_dump(
        self, *, mode: str = "python", exclude_defaults: bool = False, exclude: Collection[str] = ()
    ) -> dict[str, Any]:
        """Return the values by name, in the order of the help text; with mode "json" as JSON values."""
        defaults = self.defaults()
        dumped = {name: getattr(self, name) for name in defaults if name not in exclude}
        if exclude_defaults:
            dumped = {name: value for name, value in dumped.items() if value != defaults[name]}
        return {name: _as_lists(value) for name, value in dumped.items()} if mode == "json" else dumped

    @property
    def outputs(self) -> tuple[str, ...]:
        """Every output file, in no particular order; stdout is not included."""
        names = [*self.output, *(getattr(self, field) for field in self.written)]
        return tuple(name for name in names if name and name != "-")

    @property
    def inputs(self) -> tuple[str, ...]:
        """Every input file, as a path without its `#id`; stdin is not included."""
        paths = [
            path_of(value)
            for key in self.globbed
            for value in _each(getattr(self, key))
            if not is_generated(value)
        ]
        paths += [
            value for key in self.read for value in _each(getattr(self, key)) if self.names_file(key, value)
        ]
        return tuple(dict.fromkeys(name for name in paths if name and name != "-"))


def _each(value: str | Sequence[str] | None) -> Sequence[str]:
    return [value] if isinstance(value, str) else value or []


class Textured(Described):
    """The values of a command that transfers textures."""

    texture: Any
    normal: tuple[str, ...]
    normal_down: tuple[str, ...]
    data: tuple[str, ...]

    @property
    def maps(self) -> list[tuple[str, str]]:
        """The textures, each with the kind of its channels."""
        textures = [(path, getattr(self, "kind", "colour")) for path in _each(self.texture)]
        further = {"normal": self.normal, "normal-down": self.normal_down, "data": self.data}
        return textures + [(path, kind) for kind, paths in further.items() for path in paths]


class Job(Textured, JobOptions):
    """The description of a map: shapes, options and outputs. Paths are as given by the user; coordinates in file units.

    If `target` is None, the source is deformed by its constraints.

    Raises:
        JobError: a value, or a combination of values, is invalid.
    """

    command = "map"
    rows: ClassVar = {"source": (str, None), "target": (str | None, None), **options_of()}
    globbed = ("source", "target", "texture")
    read = (
        "normal",
        "normal_down",
        "data",
        "constraints",
        "source_landmarks",
        "target_landmarks",
        "rigid",
        "rigid_target",
        "importance",
        "size_map",
        "start",
    )
    written = WRITTEN
    templated = ("output", *WRITTEN, "constraints", "source_landmarks", "target_landmarks")
    source: str
    target: str | None
    checkered: ClassVar[bool] = (
        False  # whether the checkerboard is requested, even if the source has its own picture
    )

    def __init__(self, **values: Any):
        super().__init__(**values)
        self._name_stmap()
        for side, other_side in (("source", "target"), ("target", "source")):
            if getattr(self, f"{side}_landmarks") and not getattr(self, f"{other_side}_landmarks"):
                option = f"--{other_side}-landmarks"
                raise JobError(
                    [(f"{side}_landmarks", f"needs {option}, the same points on the {other_side}")]
                )
        if self.padding_fill != self.defaults()["padding_fill"] and not self.padding:
            raise JobError([("padding_fill", "only works with --padding")])
        if self.texture == CHECKER and not os.path.isfile(CHECKER):
            vars(self).update({"texture": None, "checkered": True})
        self._give_a_picture_each()

    @classmethod
    def names_file(cls, key: str, value: str) -> bool:
        """Return whether a value of one of the fields in `read` names a file; a region may also name an element of the
        drawing.
        """
        return super().names_file(key, value) and not (key.startswith("rigid") and value.startswith("#"))

    def _name_stmap(self) -> None:
        """Use the output that can hold an STMap if --stmap names no file."""
        if self.stmap != OUTPUT:
            return
        able = [name for name in self.output if name != "-" and formats.of(name).stmap]
        if len(able) != 1:
            raise JobError(
                [("stmap", "name one file for the STMap: --stmap map.exr, or one -o map.exr with --stmap")]
            )
        other_outputs = tuple(name for name in self.output if name != able[0])
        vars(self).update(stmap=able[0], output=other_outputs)

    def model_dump(self, **how: Any) -> dict[str, Any]:
        """Return the values by name, as in `Described.model_dump`."""
        dumped = super().model_dump(**how)
        return dumped | (
            {"texture": CHECKER} if self.checkered and "texture" not in how.get("exclude", ()) else {}
        )

    def _give_a_picture_each(self) -> None:
        """Assign an output picture to each texture; the first texture becomes `texture`."""
        if self.maps and not self.texture:
            path, kind = self.maps[0]
            name = kind.replace("-", "_")
            vars(self).update({"texture": path, "kind": kind, name: getattr(self, name)[1:]})
        if self.maps and (self.output or any(getattr(self, field) for field in WRITTEN)):
            try:
                vars(self)["output"] = pair_outputs(self.output, self.maps)
            except ValueError as error:
                raise JobError([("", str(error))]) from None

    @property
    def solver(self) -> dict[str, Any]:
        """The options that are passed to `iccm.fit` and `iccm.deform`."""
        return {name: value for name in SOLVER if (value := getattr(self, name)) is not None}

    @property
    def has_pins(self) -> bool:
        """Whether pins or strokes are given by options or files, beside those that are drawn."""
        return bool(self.pin or self.constraints or self.source_landmarks)

    @property
    def exact(self) -> bool:
        """Whether pins and strokes are hard constraints, which must lie inside the target."""
        from ...options import Options as Solver

        return Solver(**self.solver).is_balanced

    @property
    def several(self) -> bool:
        """Whether parts are mapped separately, as requested."""
        return self.parts in ("all", "each", "elements")

    @property
    def repeated(self) -> bool:
        """Whether the source is mapped onto each of several targets."""
        return self.parts in ("each", "elements")

    @property
    def whole_drawings(self) -> bool:
        """Whether drawings are mapped as a whole."""
        return self.parts in ("auto", "joined", "elements")

    @property
    def holed(self) -> bool:
        """Whether holes take part in the map: those of the balanced method do, unless they are to be cut or filled."""
        return self.holes in ("auto", "keep") and self.exact


class FlattenJob(Described, FlattenOptions):
    """The description of a flattening: the mesh, options and outputs."""

    command = "flatten"
    rows: ClassVar = {"mesh": (str, None), **of_command("flatten", FlattenOptions, JobOptions)}
    globbed = ("mesh",)
    read = ("method", "onto", "overlay", "seams")
    written = ("uv", "report", "plot", "preview")
    templated = ("output", *written, *read)
    mesh: str
    uv_by_suffix: ClassVar[bool] = False  # whether `uv` was given by -o

    def __init__(self, **values: Any):
        super().__init__(**values)
        self._take_mesh()

    def _take_mesh(self) -> None:
        """Use an output that can only be a mesh with texture coordinates for `uv`, if that is not given."""
        able = [
            name for name in self.output if name != "-" and formats.of(name).uv and not formats.of(name).flat
        ]
        if able and not self.uv:
            vars(self).update(uv=able[0], output=tuple(name for name in self.output if name != able[0]))
            vars(self)["uv_by_suffix"] = True

    @classmethod
    def names_file(cls, key: str, value: str) -> bool:
        """Return whether a value is the file of an outline; --method used to accept one, too."""
        from ...flattening import METHODS

        return key == "onto" or value not in METHODS


class RelayoutJob(Textured, RelayoutOptions):
    """The description of a transfer of a mesh's textures to another layout."""

    command = "relayout"
    rows: ClassVar = {
        "old": (str, None),
        "new": (str, None),
        **of_command("relayout", RelayoutOptions, JobOptions),
    }
    globbed = ("old", "new")
    read = ("texture", "normal", "normal_down", "data")
    written = ("report",)
    templated = ("new", "output", *written, *read)
    old: str
    new: str
    filter: str
    max_pixels: int
    overlap: str


Kind = TypeVar("Kind", bound=Described)
KINDS: dict[str, type[Described]] = {kind.command: kind for kind in (Job, FlattenJob, RelayoutJob)}
"""The kinds of jobs in a batch, by command."""


def _as_lists(value: Any) -> Any:
    """Convert tuples to lists, recursively."""
    return [_as_lists(item) for item in value] if isinstance(value, tuple | list) else value


def is_picture(name: str) -> bool:
    """Return whether an output is a picture: by its suffix, or because it goes to stdout."""
    return name == "-" or formats.of(name).picture is not None


def is_mesh(name: str) -> bool:
    """Return whether an output is a mesh with texture coordinates, by its suffix."""
    return name != "-" and formats.of(name).uv


def pair_outputs(outputs: Sequence[str], maps: Sequence[tuple[str, str]]) -> tuple[str, ...]:
    """Return the outputs with one picture for each texture, in order.

    A single name with `{stem}` stands for all pictures. No pictures are needed if a mesh shows the textures, one of
    colours and one of normals.

    Raises:
        ValueError: too many or too few pictures, or none for several textures, or for one that a mesh cannot show.
    """
    textures, kinds = zip(*maps) if maps else ((), ())
    pictures = [name for name in outputs if is_picture(name)]
    if len(pictures) == 1 and STEM in pictures[0]:
        names = name_each(pictures, maps)
        return tuple(output for name in outputs for output in (names if name is pictures[0] else [name]))
    alone = not pictures and any(map(is_mesh, outputs))
    if alone and (unshown := {"normal-down", "data"}.intersection(kinds)):
        raise ValueError(
            f"a mesh only includes a --texture and a --normal; add a picture for {sorted(unshown)[0]}, "
            "such as -o made.png"
        )
    alone = alone and sorted(kinds) == ["colour", "normal"]
    if len(textures) > 1 and len(pictures) != len(textures) and not alone:
        also = "; a mesh takes one --texture and one --normal" if any(map(is_mesh, outputs)) else ""
        count = f"{len(pictures)} picture{'s' * (len(pictures) != 1)}"
        raise ValueError(
            f"{len(textures)} textures but {count}: give one -o for each texture, or one with {STEM} in its "
            f"name{also}"
        )
    return tuple(outputs)


def name_each(pictures: Sequence[str], maps: Sequence[tuple[str, str]]) -> list[str]:
    """Return the names of pictures; a single name with `{stem}` is expanded to one name for each texture."""
    if len(pictures) != 1 or STEM not in pictures[0]:
        return list(pictures)
    return [pictures[0].replace(STEM, Path(path).stem) for path, _ in maps]


def make(values: dict[str, Any]) -> Job:
    """Return a job from the options of the command line; see `described`."""
    return described(Job, values)


def described(kind: type[Kind], values: dict[str, Any]) -> Kind:
    """Return a job of a kind from the options of the command line.

    Raises:
        InputError: lists its mistakes with the names of their options.
    """
    try:
        return kind(**values)
    except JobError as error:
        raise InputError("; ".join(_of_option(key, text) for key, text in error.mistakes)) from None


def _of_option(key: str, text: str) -> str:
    """Name the option in a message about a mistake as on the command line, where items count from 1."""
    if any(key in kind.rows and kind.rows[key][1] is None for kind in KINDS.values()):
        return f"{key.upper()}: {text}"
    option, _, position = key.partition(".")
    number = f" {int(position.split('.')[0]) + 1}" if position[:1].isdecimal() else ""
    return f"--{option.replace('_', '-')}{number}: {text}" if option else text
