"""The journal of a batch, beside its outputs: which jobs were begun and finished, so that a run can be resumed.

Each line is appended with a single write. When reading, invalid lines are skipped: an incomplete last line, left by a
full disk or a killed process, only loses the job that it describes. Several batches may append at the same time.

The folder, and with it the journal, may come from an untrusted source. It is therefore not read or written through a
link; what it records about files outside of its folder counts only if the manifest names these files as well; and
results in any other form are ignored.
"""

from __future__ import annotations

import hashlib
import json
import os
import platform
from collections.abc import Iterable, Iterator
from contextlib import suppress
from functools import lru_cache
from pathlib import Path
from typing import Any

from ... import __version__
from ...errors import InputError
from .. import files
from ..run.inputs import Files
from ..run.job import Described
from .manifest import JOURNAL

NAME = JOURNAL
RESULT = ("status", "message", "outputs", "figures", "notes", "idle")
"""Fields of a job's result that are stored."""
CLOSED = getattr(os, "O_CLOEXEC", 0) | getattr(os, "O_NOFOLLOW", 0)
"""Flags for opening the journal: not inherited by child processes, and not through a link."""


class Journal:
    """The record of earlier runs in an output folder, to which this run is added."""

    def __init__(self, root: Path) -> None:
        """Read the journal of an output folder, if there is one.

        Raises:
            InputError: the name exists, but is not a plain file.
        """
        self.path, self._root = Path(root) / NAME, os.fspath(root)
        if os.path.lexists(self.path) and (self.path.is_symlink() or not self.path.is_file()):
            raise InputError(f"{self.path}: not a plain file, so the journal cannot be written; remove it")
        self._real = os.path.realpath(root)
        self._finished: dict[str, int] = {}
        self._begun: set[str] = set()
        self._left: set[str] = set()
        has_ended = lru_cache(_has_ended)
        for start, line in self._lines():
            if line.get("event") == "begun":
                outputs = [str(path) for path in _list(line, "outputs")]
                self._begun.update(outputs)
                self._left.update(outputs if has_ended(*_by(line)) else ())
            elif line.get("event") == "finished" and isinstance(line.get("key"), str):
                self._finished[line["key"]] = start

    def finished(self, key: str, job: Described) -> dict[str, Any] | None:
        """Return the result of an earlier run of the same job, if its outputs are unchanged."""
        start = self._finished.get(key)
        line = None if start is None else self._line(start)
        if line is None or line.get("key") != key:
            return None
        result = _result(line.get("result"))
        paths = {self._relative(path) for path in job.outputs}
        if result is None or not all(
            self._is_inside(o["path"]) or o["path"] in paths for o in result["outputs"]
        ):
            return None
        return result if all(map(self._intact, result["outputs"])) else None

    def wrote(self, path: str) -> bool:
        """Return whether an earlier run began to write this output; then --resume may replace it."""
        return self._relative(path) in self._begun

    def begin(self, key: str, job: Described) -> None:
        """Record that a job is about to write its outputs."""
        self._append(
            {
                "event": "begun",
                "key": key,
                "outputs": [self._relative(path) for path in job.outputs],
                "by": [platform.node(), os.getpid()],
            }
        )

    def sweep(self, outputs: Iterable[str] = ()) -> list[Path]:
        """Remove temporary files that killed batches left beside outputs of this journal; return those that were
        removed.

        Only files of batches that ran on this machine and have ended are removed, and only in the journal's folder or
        beside the given `outputs`.
        """
        paths = {self._relative(path) for path in outputs}
        leftover = [path for path in sorted(self._left) if self._is_inside(path) or path in paths]
        return files.sweep(self.path.parent / path for path in leftover)

    def finish(self, key: str, result: dict[str, Any]) -> None:
        """Record the result of a job, which includes its outputs with their hashes."""
        outputs = [{**o, "path": self._relative(o["path"])} for o in result["outputs"]]
        self._append({"event": "finished", "key": key, "result": {**result, "outputs": outputs}})

    def _is_inside(self, path: str) -> bool:
        """Return whether an output of the journal lies in its folder after links are resolved."""
        try:
            real = os.path.realpath(os.path.join(self._real, path))
        except (OSError, ValueError):
            return False
        return Path(real).is_relative_to(self._real)

    def _intact(self, output: dict[str, str]) -> bool:
        try:
            return files.sha256(self.path.parent / output["path"]) == output["sha256"]
        except InputError:
            return False

    def place(self, path: str) -> str:
        """Return the path of an output of the journal."""
        return os.path.join(self._root, path)

    def _relative(self, path: str) -> str:
        return files.relative_path(os.path.realpath(path), self._real)

    def _lines(self) -> Iterator[tuple[int, dict[str, Any]]]:
        """Yield the position and contents of each line; results are read again when needed."""
        start = 0
        with suppress(OSError), self.path.open("rb") as file:
            for text in file:
                if line := _parse(text):
                    yield start, line
                start += len(text)

    def _line(self, start: int) -> dict[str, Any] | None:
        with suppress(OSError), self.path.open("rb") as file:
            file.seek(start)
            return _parse(file.readline())
        return None

    def _append(self, line: dict[str, Any]) -> None:
        # The leading newline closes a line that was torn; empty lines are skipped on reading.
        data = ("\n" + json.dumps(line) + "\n").encode()
        flags = os.O_WRONLY | os.O_APPEND | os.O_CREAT | CLOSED
        handle = os.open(self.path, flags, 0o666)
        try:
            if os.write(handle, data) != len(data):
                raise OSError(28, "No space left on device", str(self.path))
        finally:
            os.close(handle)


def key(job: Described) -> str:
    """Return a key that identifies a job's result: a hash of version, options, and contents of its inputs."""
    options = {"command": job.command, **job.model_dump(mode="json", exclude={"force"})}
    inputs = {
        path: _hash(path, os.stat(path).st_mtime_ns, os.stat(path).st_size)
        for path in Files(job, keep=False).named
    }
    text = json.dumps([__version__, options, inputs], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()


@lru_cache(maxsize=65536)
def _hash(path: str, changed: int, size: int) -> str:
    return files.sha256(path)


def _by(line: dict[str, Any]) -> tuple[str, int]:
    """Return machine and process number of the batch that wrote a line; 0 if they are missing."""
    match line.get("by"):
        case [str(node), int(number)]:
            return node, number
    return "", 0


def _has_ended(node: str, number: int) -> bool:
    """Return whether the batch with this machine and process number has ended."""
    if os.name != "posix" or number <= 0 or node != platform.node():
        return False
    try:
        os.kill(number, 0)
    except ProcessLookupError:
        return True
    except (OSError, OverflowError):
        return False
    return False


def _parse(line: bytes) -> dict[str, Any] | None:
    try:
        value = json.loads(line.decode("utf-8", errors="replace"))
    except (ValueError, RecursionError):
        return None
    return value if isinstance(value, dict) else None


def _result(value: Any) -> dict[str, Any] | None:
    """Validate a result as written by `Journal.finish`; return None for anything else."""
    match value:
        case {
            "status": str(),
            "message": str(),
            "outputs": [_, *_] as outputs,
            "notes": [*notes],
            "figures": dict(),
        }:
            sound = all(isinstance(note, str) for note in notes) and all(map(_is_output, outputs))
            idle = [str(name) for name in _list(value, "idle")]
            return {key: value[key] for key in RESULT if key != "idle"} | {"idle": idle} if sound else None
    return None


def _is_output(value: Any) -> bool:
    return isinstance(value, dict) and all(isinstance(value.get(key), str) for key in ("path", "sha256"))


def _list(line: dict[str, Any], key: str) -> list[Any]:
    value = line.get(key)
    return value if isinstance(value, list) else []
