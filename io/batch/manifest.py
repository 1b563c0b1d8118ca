"""Manifests: many jobs in one TOML or JSON Lines file, checked whole before anything runs."""

from __future__ import annotations

import glob
import itertools
import json
import os
import re
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from ...errors import InputError
from .. import files
from ..run.job import WRITTEN, Job, mistakes
from ..spec import Spec, path_of

MAX_BYTES, MAX_JOBS, LONGEST = 64 << 20, 100_000, 500
GLOBBED = ("source", "target", "texture")
TEMPLATED = ("output", *WRITTEN, "constraints")


class ManifestError(InputError):
    """Every mistake of a manifest, a line each."""

    def __init__(self, found: list[str]) -> None:
        found = [line if len(line) <= LONGEST else line[:LONGEST] + "…" for line in found]
        super().__init__(f"{found[0]} (and {len(found) - 1} more)" if len(found) > 1 else found[0])
        self.mistakes = found


@dataclass(frozen=True)
class Task:
    """A job of a manifest: its number from 1, its name, and where it stands."""

    number: int
    name: str
    place: str
    job: Job


@dataclass(frozen=True)
class Entry:
    """One table or line of a manifest as it was written, with its place and the defaults filled in."""

    place: str
    values: dict[str, Any]


def read(text: str, name: str, *, root: Path, outside: bool = False) -> list[Task]:
    """The jobs of a manifest.

    Args:
        text: its content: TOML when `name` ends in .toml, or is `-` and it does not start with {; else JSON Lines.
        name: its path, which inputs are relative to; `-` for stdin, relative to the current folder.
        root: the folder that outputs are relative to and may not leave.
        outside: let outputs leave the root.

    Raises:
        ManifestError: with every mistake and its place.
    """
    found: list[str] = []
    tasks: list[Task] = []
    base = "" if name == "-" else os.path.dirname(name)
    for entry in _entries(text, name, found):
        for values in _expanded(entry, base, found):
            if len(tasks) >= MAX_JOBS:
                raise ManifestError([f"{name}: more than {MAX_JOBS} jobs; split the manifest"])
            task = _task(len(tasks) + 1, entry.place, values, found)
            if task:
                tasks.append(task)
    placed = [_placed(task, root, outside, found) for task in tasks]
    _distinct(placed, found)
    if not found and not placed:
        found.append(f"{name}: no jobs; add [[job]] tables, or one JSON object a line")
    if found:
        raise ManifestError(found)
    return placed


def load(name: str) -> str:
    """The text of a manifest file.

    Raises:
        InputError: it cannot be read or is not UTF-8.
    """
    try:
        return files.read_bytes(name, max_bytes=MAX_BYTES).decode("utf-8")
    except UnicodeDecodeError as error:
        raise InputError(f"{name}: byte {error.start} is not UTF-8; save the manifest as UTF-8") from None


def _entries(text: str, name: str, found: list[str]) -> Iterator[Entry]:
    if name.endswith(".toml") or (name == "-" and not text.lstrip().startswith("{")):
        return _from_toml(text, name, found)
    return _from_lines(text, name, found)


def _from_toml(text: str, name: str, found: list[str]) -> Iterator[Entry]:
    try:
        manifest = tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        raise ManifestError([f"{name}: {str(error) or 'nested too deeply'}"]) from None
    unknown = sorted(manifest.keys() - {"defaults", "job"})
    found += [f"{name}: {key}: unknown key; a manifest has [defaults] and [[job]]" for key in unknown]
    defaults, jobs = manifest.get("defaults", {}), manifest.get("job", [])
    if not isinstance(defaults, dict):
        found.append(f"{name}: defaults: must be a table, [defaults]")
    elif not isinstance(jobs, list) or not all(isinstance(job, dict) for job in jobs):
        found.append(f"{name}: job: must be tables, [[job]]")
    else:
        yield from (Entry(f"{name}: job {n}", {**defaults, **job}) for n, job in enumerate(jobs, 1))


def _from_lines(text: str, name: str, found: list[str]) -> Iterator[Entry]:
    defaults: dict[str, Any] = {}
    for number, line in enumerate(text.splitlines(), 1):
        if not line.strip():
            continue
        place = f"{name}: line {number}"
        try:
            values = json.loads(line)
        except (ValueError, RecursionError) as error:  # also numbers of thousands of digits, and deep nesting
            what = str(error)
            if isinstance(error, json.JSONDecodeError):
                what = f"column {error.colno}: {error.msg}"
            found.append(f"{place}: {what}; each line is one JSON object")
            continue
        if not isinstance(values, dict):
            found.append(f"{place}: not a JSON object")
        elif values.keys() == {"defaults"} and isinstance(values["defaults"], dict):
            defaults = values["defaults"]
        else:
            yield Entry(place, {**defaults, **values})


def _expanded(entry: Entry, base: str, found: list[str]) -> Iterator[dict[str, Any]]:
    """One set of values for each combination of the files that the globs match."""
    choices = []
    for key in GLOBBED:
        value = entry.values.get(key)
        matches = [value] if not isinstance(value, str) else _matches(value, base)
        if not matches:
            found.append(f"{entry.place}: {key}: no file matches {value!r}")
        choices.append(matches)
    for combination in itertools.product(*choices):
        yield {**entry.values, **{k: v for k, v in zip(GLOBBED, combination) if v is not None}, "": base}


def _matches(spec: str, base: str) -> list[str]:
    """The files that a path or glob names, sorted; a path without a glob is itself, there or not."""
    path = os.path.join(base, spec)
    if not glob.has_magic(spec) or os.path.exists(path):
        return [path]
    file = path_of(path)
    return sorted(match + path[len(file) :] for match in glob.glob(file, recursive=True))


def _task(number: int, place: str, values: dict[str, Any], found: list[str]) -> Task | None:
    """The validated job of an entry, its templates filled in; None after noting what is wrong."""
    base, name = values.pop(""), values.pop("name", None)
    fields = _fields(values, number)
    if not any(values.get(key) for key in ("output", *WRITTEN)):
        values["output"] = (
            "{source.stem}-{target.stem}.png" if values.get("target") else "{source.stem}-deformed.png"
        )
    wrong = [f"{place}: name: must be text"] if not isinstance(name, str | None) else []
    filled = {}
    for key, value in values.items():
        filled[key] = _filled(value, fields, f"{place}: {key}", wrong) if key in TEMPLATED else value
    if isinstance(filled.get("constraints"), str) and filled["constraints"] != "-":
        filled["constraints"] = os.path.join(base, filled["constraints"])
    label = _filled(name or "{source.stem}-{target.stem}", fields, f"{place}: name", wrong)
    try:
        job = Job(**filled)
    except (ValidationError, TypeError) as error:
        listed = mistakes(error) if isinstance(error, ValidationError) else [("", "keys must be text")]
        wrong += [f"{place}: {key}: {text}" if key else f"{place}: {text}" for key, text in listed]
    if not wrong:
        wrong = [f"{place}: {path}: no such file" for path in job.inputs if not os.path.isfile(path)]
    found.extend(wrong)
    return None if wrong else Task(number, label.strip("-"), place, job)


def _fields(values: dict[str, Any], number: int) -> dict[str, str]:
    """What templates may name: {number}, {source.stem}, {source.name}, {source.id}, and so for target and texture."""
    fields = {"number": str(number)}
    for key in GLOBBED:
        spec = values.get(key)
        named = Spec.of(spec if isinstance(spec, str) else "")
        fields |= {
            f"{key}.stem": named.path.stem,
            f"{key}.name": named.path.name,
            f"{key}.id": re.sub(r"[^\w.-]", "_", named.chosen or ""),
        }
    return fields


def _filled(value: Any, fields: dict[str, str], place: str, wrong: list[str]) -> Any:
    if isinstance(value, list):
        return [_filled(item, fields, place, wrong) for item in value]
    if not isinstance(value, str):
        return value

    def fill(match: re.Match[str]) -> str:
        if match[1] not in fields:
            wrong.append(f"{place}: unknown {match[0][:60]}; use one of {', '.join(sorted(fields))}")
        return fields.get(match[1], "")

    return re.sub(r"\{([^{}]*)\}", fill, value)


def _placed(task: Task, root: Path, outside: bool, found: list[str]) -> Task:
    """The task with its outputs under the root, after checking that they stay there."""
    job = task.job
    if job.constraints == "-":
        found.append(f"{task.place}: constraints: `-` is no file; a batch has no stdin to spare")
    if "-" in (*job.output, job.report):
        found.append(f"{task.place}: output: `-` is taken by the results of the batch; name a file")
    real = Path(os.path.realpath(root))
    moved = {name: os.path.join(root, name) for name in job.outputs}
    for name, path in moved.items():
        if not outside and not Path(os.path.realpath(path)).is_relative_to(real):
            found.append(
                f"{task.place}: output: {name} leaves {root}; choose --root or allow it with --outside"
            )
    values: dict[str, Any] = {field: moved.get(getattr(job, field) or "") for field in WRITTEN}
    values["output"] = tuple(moved.get(name, name) for name in job.output)
    return Task(task.number, task.name, task.place, job.model_copy(update=values))


def _distinct(tasks: list[Task], found: list[str]) -> None:
    """No file may be the output of two jobs, or an input of one and the output of another."""
    inputs = {os.path.realpath(path) for task in tasks for path in task.job.inputs}
    owner: dict[str, Task] = {}
    for task in tasks:
        for path in task.job.outputs:
            real = os.path.realpath(path)
            if real in owner:
                both = (
                    f"{owner[real].place} writes it too" if owner[real] is not task else "it is named twice"
                )
                found.append(f"{task.place}: output: {path}: {both}; use a template such as {{source.stem}}")
            if real in inputs:
                found.append(f"{task.place}: output: {path}: is also an input of the batch")
            owner[real] = task
