"""Manifests: many jobs in one TOML or JSON Lines file, checked completely before anything runs."""

from __future__ import annotations

import glob
import itertools
import json
import math
import os
import re
import tomllib
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from ...capabilities import CAPABILITIES
from ...errors import InputError, JobError, printable
from ...options import METHODS
from .. import files, formats, limits
from ..options import many
from ..pictures.tiles import MARK, files_of
from ..run.job import KINDS, STEM, WRITTEN, Described, Job
from ..spec import Spec, is_generated, path_of, short_name
from . import commands, names
from .globs import Globs

SHOWN_CHARACTERS = 500  # characters of a mistake that are shown at most
FORMER = {old: new for kind in KINDS.values() for old, new in kind.former_names().items()}
"""Current names of keys by their former names."""
JOURNAL = ".iccm-journal.jsonl"


class ManifestError(InputError):
    """Lists every mistake in a manifest, one per line."""

    def __init__(self, mistakes: list[str]) -> None:
        mistakes = [
            printable(line if len(line) <= SHOWN_CHARACTERS else line[:SHOWN_CHARACTERS] + "…")
            for line in mistakes
        ]
        super().__init__(
            f"{mistakes[0]} (and {len(mistakes) - 1} more)" if len(mistakes) > 1 else mistakes[0]
        )
        self.mistakes = mistakes


@dataclass(frozen=True, slots=True)
class Task:
    """A job of a manifest: its number from 1, name and place, and for a frame the number of the previous frame.

    Values that differ from the defaults are stored as JSON. Job objects take ten times the memory: a hundred thousand
    of them would take most of a gigabyte.
    """

    number: int
    name: str
    place: str
    packed: str
    after: int = 0

    @classmethod
    def of(cls, number: int, name: str, place: str, job: Described, after: int = 0) -> Task:
        """Create a task for a job."""
        values = {"command": job.command, **job.model_dump(exclude_defaults=True)}
        values |= {commands.SHARED: sorted(job.shared)} if job.shared else {}
        return cls(number, name, place, json.dumps(values, ensure_ascii=False), after)

    @property
    def job(self) -> Described:
        """The job."""
        return commands.job_of(self.values)

    @property
    def values(self) -> dict[str, Any]:
        """The `command` and the values that differ from the defaults, as in JSON."""
        return json.loads(self.packed)

    def with_job(self, job: Described) -> Task:
        """Return the same task with another job."""
        return Task.of(self.number, self.name, self.place, job, self.after)


@dataclass(frozen=True)
class Entry:
    """One table or line of a manifest as written, with its place and the defaults."""

    place: str
    values: dict[str, Any]
    defaults: dict[str, Any] = field(default_factory=dict)
    defaults_place: str = ""

    @property
    def command(self) -> Any:
        """The command, as written."""
        return self.values.get("command", self.defaults.get("command", "map"))

    @property
    def is_known(self) -> bool:
        """Whether batches support the command."""
        return isinstance(self.command, str) and self.command in KINDS

    @property
    def kind(self) -> type[Described]:
        """The class of jobs for its command."""
        return KINDS[self.command]

    @property
    def whole(self) -> dict[str, Any]:
        """The values of the job except its command, with those defaults that apply to this command."""
        foreign_keys = {key for kind in KINDS.values() for key in kind.rows} - self.kind.rows.keys()
        defaults, values = _with_todays_names(self.defaults), _with_todays_names(self.values)
        merged = {key: value for key, value in defaults.items() if key not in foreign_keys} | values
        return {key: value for key, value in merged.items() if key != "command"}

    @property
    def shared(self) -> set[str]:
        """The names of values that only the defaults give."""
        return _with_todays_names(self.defaults).keys() - _with_todays_names(self.values).keys()

    @property
    def former(self) -> list[tuple[str, str]]:
        """Pairs of former and current names for keys that have been renamed."""
        return [(key, FORMER[key]) for key in self.defaults | self.values if key in FORMER]

    def at(self, key: str) -> str:
        """Return the place where a key was written."""
        is_in_entry = key.split(".")[0] not in self.defaults or key.split(".")[0] in self.values
        return self.place if is_in_entry else self.defaults_place


def read(
    text: str,
    name: str,
    *,
    root: Path,
    outside: bool = False,
    tell: Callable[[str], None] = lambda note: None,
) -> list[Task]:
    """Return the tasks of a manifest.

    Args:
        text: its content: TOML if `name` ends in .toml, or is `-` and the text does not start with {; else JSON Lines.
        name: its path, to which inputs are relative; `-` for stdin, with inputs relative to the current folder.
        root: the folder to which outputs are relative, and which they may not leave.
        outside: whether outputs may leave the root, and patterns the root and the manifest's folder.
        tell: called with a note for each key under a former name.

    Raises:
        ManifestError: lists every mistake with its place.
    """
    base = "" if name == "-" else os.path.dirname(name)
    mistakes: list[str] = []
    entries = _with_notices(_entries(text, name, mistakes), name, tell)
    return _tasks(entries, name, base, mistakes, root=root, outside=outside)


def _with_todays_names(values: dict[str, Any]) -> dict[str, Any]:
    return {FORMER.get(key, key): value for key, value in values.items()}


def _with_notices(entries: Iterable[Entry], name: str, tell: Callable[[str], None]) -> Iterator[Entry]:
    """Yield entries unchanged, with a note at the first use of each former name of a key."""
    noted = set[str]()
    for entry in entries:
        for old, new in entry.former if entry.is_known else ():
            if old not in noted:
                noted.add(old)
                tell(f"{name}: {old} is now {new}; the old name works until iccm 2")
        yield entry


def frames(values: dict[str, Any], *, root: Path) -> list[Task]:
    """Return the tasks of a sequence, given by the values of a job that contain patterns.

    Raises:
        ManifestError: lists every mistake.
    """
    entry = Entry("--sequence", values)
    return _tasks([entry], "-", "", [], root=root, outside=True)


def from_patterns(
    sources: Sequence[str], target: str | None, values: dict[str, Any], *, root: Path
) -> list[Task]:
    """Return one task for each combination of a source and a target that the patterns match.

    Args:
        sources: files, patterns such as `icons/*.svg`, or folders, of which all shapes are used.
        target: a file or a pattern.
        values: the other values of the jobs. An output that is a folder receives a picture for each job.
        root: the folder to which outputs are relative.

    Raises:
        ManifestError: lists every mistake.
    """
    patterns = [pattern for source in sources for pattern in _in_folder(source)]
    output = [_named_in_folder(name, target) for name in many(values.get("output"))]
    shared = values | {"target": target} | ({"output": output} if output else {})
    place = sources[0] if len(sources) == 1 else f"{sources[0]} …"
    entries = [Entry(place, {"source": pattern}, shared, place) for pattern in patterns]
    return _tasks(entries, "-", "", [], root=root, outside=True)


def _in_folder(source: str) -> list[str]:
    """Return patterns for the shapes in a folder, one per suffix; anything else is returned unchanged.

    Raises:
        ManifestError: the folder contains no shapes.
    """
    if not os.path.isdir(source):
        return [source]
    shapes = ("drawing", "picture", "mesh", "outlines")
    suffixes = {os.path.splitext(name)[1] for name in os.listdir(source) if not name.startswith(".")}
    matching = sorted(
        suffix for suffix in suffixes if any(getattr(formats.of(f"file{suffix}"), kind) for kind in shapes)
    )
    if not matching:
        raise ManifestError([f"{source}: no shapes in this folder (iccm reads .svg, .png, .obj and others)"])
    return [os.path.join(glob.escape(source), f"*{suffix}") for suffix in matching]


def _named_in_folder(output: str, target: str | None) -> str:
    """Return a template for the files in an output folder: a name that ends in a slash, or is an existing folder.

    Raises:
        ManifestError: the name has neither a suffix nor a slash at its end.
    """
    if (
        not os.path.splitext(output)[1]
        and output != "-"
        and not os.path.isdir(output)
        and output[-1:] not in "/\\"
    ):
        raise ManifestError([f"-o {output}: has no suffix; write {output}/ for a folder, or {output}.png"])
    if not output.endswith(("/", os.sep)) and not os.path.isdir(output):
        return output
    goal = "-{target.stem}" if target and glob.has_magic(target) else ""
    return os.path.join(output, f"{{source.stem}}{goal}.png")


def _tasks(
    entries: Iterable[Entry], name: str, base: str, mistakes: list[str], *, root: Path, outside: bool
) -> list[Task]:
    tasks: list[Task] = []
    globs = Globs(None if outside else (base, str(root)))
    for entry in entries:
        if not entry.is_known:
            mistakes.append(f"{entry.at('command')}: command: must be one of {', '.join(KINDS)}")
            continue
        tables = entry.values, entry.defaults
        duplicates = [pair for pair in entry.former if any(set(pair) <= table.keys() for table in tables)]
        mistakes += [
            f"{entry.at(old)}: {old}: former name of {new}, which is also given; remove it"
            for old, new in duplicates
        ]
        predecessor, first = 0, len(tasks)
        for values in _expand(entry, base, globs, mistakes):
            if len(tasks) >= limits.JOBS:
                raise ManifestError([f"{name}: contains more than {limits.JOBS} jobs; split the manifest"])
            task = _task(len(tasks) + 1, entry, values, mistakes)
            if task:
                tasks.append(replace(_place(task, root, outside, mistakes), after=predecessor))
                predecessor = task.number if entry.whole.get("sequence") else 0
        if len(tasks) > first + 1:  # its patterns match several files, for which all of its values are
            for k, task in enumerate(tasks[first:], first):
                tasks[k] = task.with_job(task.job.sharing(entry.whole))
    _check_distinct(
        tasks, {os.path.realpath(path): description for path, description in _reserved(name, root)}, mistakes
    )
    if not mistakes and not tasks:
        mistakes.append(f"{name}: contains no jobs; add [[job]] tables, or one JSON object per line")
    if mistakes:
        # a mistake that occurs for every file that a pattern matches is listed once
        distinct = dict.fromkeys(mistakes)
        above = [line for line in distinct if ": [defaults]: " in line]
        raise ManifestError([*above, *(line for line in distinct if line not in above)])
    return tasks


def _reserved(name: str, root: Path) -> Iterator[tuple[str, str]]:
    """Yield files that no job may write, with a description."""
    yield os.path.join(root, JOURNAL), "the batch's journal"
    if name != "-":
        yield name, "the manifest"


def load(name: str) -> str:
    """Return the text of a manifest file.

    Raises:
        InputError: it cannot be read, or is not UTF-8.
    """
    try:
        return files.read_bytes(name, max_bytes=limits.MANIFEST_BYTES).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(f"{name}: not UTF-8 (byte {error.start}); save the manifest as UTF-8") from None


def _entries(text: str, name: str, mistakes: list[str]) -> Iterator[Entry]:
    if name.endswith(".toml") or (name == "-" and not text.lstrip().startswith("{")):
        return _from_toml(text, name, mistakes)
    return _from_lines(text, name, mistakes)


def _from_toml(text: str, name: str, mistakes: list[str]) -> Iterator[Entry]:
    try:
        manifest = tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        raise ManifestError([f"{name}: {str(error) or 'nested too deeply'}"]) from None
    unknown = sorted(manifest.keys() - {"defaults", "job"})
    mistakes += [f"{name}: {key}: unknown key; a manifest has [defaults] and [[job]]" for key in unknown]
    defaults, jobs = manifest.get("defaults", {}), manifest.get("job", [])
    if not isinstance(defaults, dict):
        mistakes.append(f"{name}: defaults: must be one table, [defaults]")
    elif not isinstance(jobs, list) or not all(isinstance(job, dict) for job in jobs):
        mistakes.append(f"{name}: job: must be tables, [[job]]")
    else:
        defaults_place = f"{name}: [defaults]"
        for place, values in [
            (defaults_place, defaults),
            *((f"{name}: job {n}", job) for n, job in enumerate(jobs, 1)),
        ]:
            if _exceeds(values, limits.DEPTH):
                mistakes.append(f"{place}: nested more than {limits.DEPTH} deep")
                return
        yield from (Entry(f"{name}: job {n}", job, defaults, defaults_place) for n, job in enumerate(jobs, 1))


def _from_lines(text: str, name: str, mistakes: list[str]) -> Iterator[Entry]:
    defaults: dict[str, Any] = {}
    defaults_place = ""
    # not splitlines(): a string may contain other line separators
    for number, line in enumerate(text.split("\n"), 1):
        if not line.strip():
            continue
        place = f"{name}: line {number}"
        try:
            values = json.loads(line.lstrip("\ufeff"), object_pairs_hook=files.distinct_keys)
        # also for numbers of thousands of digits, and deep nesting
        except (ValueError, RecursionError) as error:
            reason = str(error)
            if isinstance(error, json.JSONDecodeError):
                reason = f"column {error.colno}: {error.msg}"
            mistakes.append(f"{place}: {reason}; each line is one JSON object")
            continue
        if not isinstance(values, dict):
            mistakes.append(f"{place}: must be a JSON object")
        elif _exceeds(values, limits.DEPTH):
            mistakes.append(f"{place}: nested more than {limits.DEPTH} deep")
        elif values.keys() == {"defaults"} and isinstance(values["defaults"], dict):
            defaults, defaults_place = values["defaults"], f"{place}: [defaults]"
        else:
            yield Entry(place, values, defaults, defaults_place)


def _exceeds(value: Any, depth: int) -> bool:
    """Return whether lists and tables are nested deeper than `depth`."""
    if not isinstance(value, dict | list):
        return False
    return depth == 0 or any(
        _exceeds(v, depth - 1) for v in (value.values() if isinstance(value, dict) else value)
    )


def _expand(entry: Entry, base: str, globs: Globs, mistakes: list[str]) -> Iterator[dict[str, Any]]:
    """Yield one set of values for each combination of files that the patterns match."""
    choices: list[list[Any]] = []
    values = entry.whole
    keys = entry.kind.globbed
    for key in keys:
        value = values.get(key)
        try:
            matches = [value] if not isinstance(value, str) else _matches(value, base, globs)
        except InputError as error:
            mistakes.append(f"{entry.at(key)}: {key}: {value!r} {error}")
            return
        if not matches:
            mistakes.append(f"{entry.at(key)}: {key}: no file matches {value!r}")
        choices.append(matches)
    if values.get("sequence") and entry.kind is Job:
        yield from _frames(entry, choices, base, mistakes)
        return
    count = math.prod(map(len, choices))
    if count > limits.JOBS:
        mistakes.append(
            f"{entry.place}: its patterns match {count} jobs, more than {limits.JOBS}; split them"
        )
        return
    for combination in itertools.product(*choices):
        yield {**values, **{k: v for k, v in zip(keys, combination) if v is not None}, "": base}


def _frames(
    entry: Entry, choices: list[list[Any]], base: str, mistakes: list[str]
) -> Iterator[dict[str, Any]]:
    """Yield the values of each frame of a sequence, with files in the order of the numbers in their names.

    What is not a pattern is the same in all frames. Maps are of whole outlines with holes mapped onto holes, so that
    parts do not appear and disappear.
    """
    stated = {
        key: value for key, value in entry.whole.items() if value != "auto" or key not in ("fit", "holes")
    }
    values = {"fit": "whole", "holes": "keep", **stated}
    if not any(isinstance(values.get(key), str) and glob.has_magic(values[key]) for key in Job.globbed):
        mistakes.append(
            f"{entry.place}: none of source, target and texture is a pattern of frames, such as 'frames/*.svg'"
        )
        return
    counts = {len(matches) for matches in choices} - {1}
    if len(counts) > 1:
        numbers = ", ".join(
            f"{key} {len(matches)}" for key, matches in zip(Job.globbed, choices) if len(matches) != 1
        )
        mistakes.append(f"{entry.place}: the numbers of frames differ: {numbers} files")
        return
    if wrong := _why_no_sequence(values):
        mistakes.append(f"{entry.place}: {wrong}")
        return
    count = max(counts, default=1)
    ordered = [
        sorted(matches, key=_by_numbers) if len(matches) > 1 else matches * count for matches in choices
    ]
    for combination in zip(*ordered):
        yield {**values, **{k: v for k, v in zip(Job.globbed, combination) if v is not None}, "": base}


def _why_no_sequence(values: dict[str, Any]) -> str:
    """Return why frames cannot continue from each other with these values; empty if they can."""
    method = values.get("method") or METHODS[0]
    if values.get("parts") in ("all", "each", "elements") or method not in CAPABILITIES["start"].methods:
        return (
            "frames continue from each other only with the balanced method and one part each; remove "
            "the other option"
        )
    if values.get("place") not in (None, "fill"):
        return "frames continue from each other only with place fill; remove place"
    if values["fit"] != "whole":
        return "frames continue from each other only with fit whole; remove fit"
    if values.get("start") or not values.get("target"):
        return "a sequence needs a target and takes no start"
    return ""


def _by_numbers(name: str | None) -> list[Any]:
    """Return a sort key that orders the numbers in names numerically: 2 before 10."""
    return [(int(part), "") if part.isdecimal() else (-1, part) for part in re.split(r"(\d+)", name or "")]


def _matches(spec: str, base: str, globs: Globs) -> list[str]:
    """Return the files that a path or pattern matches, sorted; a path is returned whether it exists or not."""
    if is_generated(spec):
        return [spec]
    path = os.path.join(base, spec)
    if not glob.has_magic(spec) or os.path.exists(path):
        return [path]
    file = path_of(path)
    return [match + path[len(file) :] for match in globs.files(file)]


def _task(number: int, entry: Entry, values: dict[str, Any], mistakes: list[str]) -> Task | None:
    """Return the validated job of an entry with its templates filled in; None after recording what is wrong."""
    base, name, kind = values.pop(""), values.pop("name", None), entry.kind
    problems = [f"{entry.at('name')}: name: must be text"] if not isinstance(name, str | None) else []
    written = entry.whole
    streams = [key for key in (*kind.globbed, *kind.read) if written.get(key) in ("-", ["-"])]
    problems += [f"{entry.at(key)}: {key}: a batch cannot read from `-`; name a file" for key in streams]
    filled: dict[str, Any] = {}
    fields = {
        "number": str(number),
        "stem": STEM,
    }  # the last is filled in by the job, for each of its textures
    for key in kind.globbed:
        if key in values and key in kind.templated:
            values[key] = _fill(values[key], fields, f"{entry.at(key)}: {key}", problems)
        fields |= _fields(key, values.get(key))
    named_by_inputs = not any(values.get(key) for key in ("output", *kind.written))
    if named_by_inputs:
        values["output"] = _default_output(kind, values)
    for key, value in values.items():
        templated = key in kind.templated and key not in kind.globbed
        filled[key] = _fill(value, fields, f"{entry.at(key)}: {key}", problems) if templated else value
        if key in kind.read:
            filled[key] = _placed(kind, key, filled[key], base)
    if filled.get("sequence") and kind is Job:
        filled["output"] = _with_map(filled)
    usual = "-".join(f"{{{key}.stem}}" for key in kind.globbed if kind.rows[key][1] is None)
    label = _fill(name or usual, fields, f"{entry.at('name')}: name", problems)
    try:
        job = kind(**filled)
    except (JobError, TypeError) as error:
        job_mistakes = error.mistakes if isinstance(error, JobError) else [("", "keys must be text")]
        if named_by_inputs:  # if such a name is wrong, so is an input
            input_mistakes = [(key, text) for key, text in job_mistakes if not key.startswith("output")]
            job_mistakes = input_mistakes or job_mistakes
        problems += [
            f"{entry.at(key)}: {key}: {text}" if key else f"{entry.place}: {text}"
            for key, text in job_mistakes
        ]
    else:
        tiles = [path.replace(MARK, "1001") for path in job.outputs]
        problems += [f"{entry.place}: output: {text}" for text in filter(None, map(names.mistake, tiles))]
        if not problems:
            absent = (path for path in job.inputs if not _exists(path))
            problems = [f"{entry.place}: {path}: {_absence(path)}" for path in absent]
        if not problems:
            problems = [f"{entry.place}: {text}" for text in _check_kinds(job)]
    mistakes.extend(problems)
    if problems:
        return None
    return Task.of(number, str(label).strip("-"), entry.place, job.sharing(entry.shared))


def _with_map(values: dict[str, Any]) -> list[Any]:
    """Return the outputs of a frame including its map, which is named after its first output."""
    outputs = list(many(values.get("output")))
    first = next((output for output in [*outputs, *map(values.get, WRITTEN)] if isinstance(output, str)), "")
    if any(isinstance(output, str) and formats.of(output).map for output in outputs) or not first:
        return outputs
    return [*outputs, str(Path(first.replace(STEM, "map")).with_suffix(".npz"))]


def _exists(path: str) -> bool:
    """Return whether an input is a file, or, for a pattern of tiles, whether there are any."""
    return bool(files_of(path)) if MARK in path else os.path.isfile(path)


def _absence(path: str) -> str:
    """Return why an input is not read."""
    if os.path.isdir(path):
        return f"is a folder; name its files, as in '{path.rstrip('/')}/*.svg'"
    return "no such file"


def _check_kinds(job: Described) -> Iterator[str]:
    """Yield mistakes in the formats of inputs and outputs; existing outputs are reported later."""
    try:
        commands.check(job.model_copy(update={"force": True}))
    except InputError as error:
        yield str(error)


def _fields(key: str, spec: Any) -> dict[str, str]:
    """Return the fields of an input for templates: {source.stem}, {source.name}, {source.id}."""
    if isinstance(spec, str) and is_generated(spec):
        name = short_name(spec)
        return {f"{key}.stem": name, f"{key}.name": name, f"{key}.id": ""}
    parsed = Spec.of(spec if isinstance(spec, str) else "")
    id_text = re.sub(r"[^\w.-]", "_", parsed.selection or "")
    return {f"{key}.stem": parsed.path.stem, f"{key}.name": parsed.path.name, f"{key}.id": id_text}


def _default_output(kind: type[Described], values: dict[str, Any]) -> Any:
    """Return the default output."""
    if kind is not Job:
        return "{mesh.stem}-flat.svg" if "mesh" in kind.rows else ()
    goal = "{target.stem}" if values.get("target") else "deformed"
    suffix = "-" + STEM if any(values.get(key) for key in ("normal", "normal_down", "data")) else ""
    return f"{{source.stem}}-{goal}{suffix}.png"


def _placed(kind: type[Described], key: str, value: Any, base: str) -> Any:
    """Return the value of an input with its files relative to the manifest's folder."""
    if isinstance(value, list | tuple):
        return [_placed(kind, key, item, base) for item in value]
    return os.path.join(base, value) if isinstance(value, str) and kind.names_file(key, value) else value


def _fill(value: Any, fields: dict[str, str], place: str, wrong: list[str]) -> Any:
    if isinstance(value, list):
        return [_fill(item, fields, place, wrong) for item in value]
    if not isinstance(value, str):
        return value

    def fill(match: re.Match[str]) -> str:
        if match[1] not in fields:
            wrong.append(
                f"{place}: unknown placeholder {match[0][:60]}; use one of {', '.join(sorted(fields))}"
            )
        return fields.get(match[1], "")

    return re.sub(r"\{([^{}]*)\}", fill, value)


def _place(task: Task, root: Path, outside: bool, mistakes: list[str]) -> Task:
    """Return the task with its outputs under the root, after checking that they stay there and are not folders."""
    job = task.job
    if "-" in (*job.output, job.report):
        mistakes.append(
            f"{task.place}: output: `-` is not available, because results of the batch go to "
            "stdout; name a file"
        )
    real = Path(os.path.realpath(root))
    paths = {name: os.path.join(root, name) for name in job.outputs}
    for name, path in paths.items():
        if os.path.isdir(path):
            mistakes.append(f"{task.place}: output: {path}: is a folder; name a file in it")
        if not outside and not Path(os.path.realpath(path)).is_relative_to(real):
            mistakes.append(
                f"{task.place}: output: {name} lies outside {root}; choose another --root, or allow it "
                "with --allow-outside"
            )
    values: dict[str, Any] = {field: paths.get(getattr(job, field) or "") for field in job.written}
    values["output"] = tuple(paths.get(name, name) for name in job.output)
    return task.with_job(job.model_copy(update=values))


def _apart(first: Task, second: Task) -> str:
    """Return how to give different names to the outputs of two jobs: by the first input in which they differ."""
    for name in ("source", "target", "texture", "mesh", "old", "new"):
        if getattr(first.job, name, None) != getattr(second.job, name, None):
            return f"use a template such as {{{name}.stem}}"
    return "use a template such as {number}" if first is not second else "name another file"


def _check_distinct(tasks: list[Task], reserved: dict[str, str], mistakes: list[str]) -> None:
    """Check that no file is the output of two jobs, or the input of one and the output of another.

    Names that differ only in case or Unicode normalization are the same file on many disks.
    """
    inputs: set[str] = set()
    # for each task; nothing else is kept, as there may be a hundred thousand
    outputs: list[tuple[str, ...]] = []
    for task in tasks:
        job = task.job
        inputs.update(job.inputs)
        outputs.append(job.outputs)
    inputs = set(map(os.path.realpath, inputs))
    owner: dict[str, Task] = {}
    for task, paths in zip(tasks, outputs):
        for path in paths:
            real = os.path.realpath(path)
            writer = owner.get(names.alike(real))
            if writer is not None:
                conflict = (
                    f"{writer.place} writes the same file" if writer is not task else "the job names it twice"
                )
                if (other_name := _name_in(writer, real)) != real:
                    conflict = f"{writer.place} writes {other_name}, which is the same file on case-insensitive disks"
                mistakes.append(f"{task.place}: output: {path}: {conflict}; {_apart(writer, task)}")
            if real in inputs:
                mistakes.append(f"{task.place}: output: {path}: is also an input of the batch")
            if real in reserved:
                mistakes.append(f"{task.place}: output: {path}: is {reserved[real]}; name another file")
            owner[names.alike(real)] = task
    for task, paths in zip(tasks, outputs):
        for path in paths:
            parent = next(((owner[key], key) for key in _parents(path) if key in owner), None)
            if parent:
                mistakes.append(
                    f"{task.place}: output: {path}: {parent[0].place} writes {_name_in(*parent)} as a file, "
                    "so it cannot be a folder"
                )


def _name_in(task: Task, name: str) -> str:
    """Return the output of a task that is the same file as another on many disks."""
    real = map(os.path.realpath, task.job.outputs)
    return next(path for path in real if names.alike(path) == names.alike(name))


def _parents(path: str) -> Iterator[str]:
    """Return the folders that contain an output, from the innermost to the root."""
    return (names.alike(str(folder)) for folder in Path(os.path.realpath(path)).parents)
