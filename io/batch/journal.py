"""The journal of a batch, beside its outputs: what was begun and what was finished, so that a run can resume.

A line is appended with one write and read back leniently: a torn last line, left by a full disk or a killed process,
costs nothing but the job that it spoke of. Several batches may append at once.
"""

from __future__ import annotations

import hashlib
import json
import os
import platform
from collections.abc import Iterator
from contextlib import suppress
from functools import lru_cache
from pathlib import Path
from typing import Any

from ... import __version__
from .. import files
from ..run.inputs import Files
from ..run.job import Described
from .manifest import JOURNAL

NAME = JOURNAL


class Journal:
    """What earlier runs in an output folder did, and a place to note what this one does."""

    def __init__(self, root: Path) -> None:
        """Read the journal of an output folder, if there is one."""
        self.path, self._root = Path(root) / NAME, os.fspath(root)
        self._real = os.path.realpath(root)
        self._finished: dict[str, int] = {}
        self._begun: set[str] = set()
        self._left: set[str] = set()
        gone = lru_cache(_has_ended)
        for start, line in self._lines():
            if line.get("event") == "begun":
                outputs = [str(path) for path in _list(line, "outputs")]
                self._begun.update(outputs)
                self._left.update(outputs if gone(*_by(line)) else ())
            elif line.get("event") == "finished" and isinstance(line.get("key"), str):
                self._finished[line["key"]] = start

    def finished(self, key: str) -> dict[str, Any] | None:
        """The result of an earlier run of this very job, if its outputs are still as it left them."""
        start = self._finished.get(key)
        line = None if start is None else self._line(start)
        if line is None or line.get("key") != key or not isinstance(line.get("result"), dict):
            return None
        outputs = _list(line["result"], "outputs")
        return line["result"] if outputs and all(map(self._intact, outputs)) else None

    def wrote(self, path: str) -> bool:
        """Whether an earlier run began to write this output: then --resume may replace it."""
        return self._relative(path) in self._begun

    def begin(self, key: str, job: Described) -> None:
        """Note that a job is about to write its outputs."""
        self._append(
            {
                "event": "begun",
                "key": key,
                "outputs": [self._relative(path) for path in job.outputs],
                "by": [platform.node(), os.getpid()],
            }
        )

    def sweep(self) -> list[Path]:
        """Remove the temporary files that killed batches left beside outputs of this journal; those that were removed.

        Only of batches that ran on this machine and are gone.
        """
        return files.sweep(self.path.parent / path for path in sorted(self._left))

    def finish(self, key: str, result: dict[str, Any]) -> None:
        """Note the result of a job; its outputs with their hashes are in it."""
        outputs = [{**o, "path": self._relative(o["path"])} for o in result["outputs"]]
        self._append({"event": "finished", "key": key, "result": {**result, "outputs": outputs}})

    def _intact(self, output: Any) -> bool:
        try:
            return files.sha256(self.path.parent / output["path"]) == output["sha256"]
        except (files.InputError, TypeError, KeyError):
            return False

    def place(self, path: str) -> str:
        """An output by its name in the journal."""
        return os.path.join(self._root, path)

    def _relative(self, path: str) -> str:
        return os.path.relpath(os.path.realpath(path), self._real)

    def _lines(self) -> Iterator[tuple[int, dict[str, Any]]]:
        """Where each line starts, and what it says: results are read again when they are asked for."""
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
        handle = os.open(
            self.path, os.O_WRONLY | os.O_APPEND | os.O_CREAT | getattr(os, "O_CLOEXEC", 0), 0o666
        )
        try:
            if os.write(handle, data) != len(data):
                raise OSError(28, "No space left on device", str(self.path))
        finally:
            os.close(handle)


def key(job: Described) -> str:
    """The identity of a job's result: version, options, and the contents of its inputs."""
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
    """The machine and process number of the batch that wrote a line; 0 where they are not told."""
    match line.get("by"):
        case [str(node), int(number)]:
            return node, number
    return "", 0


def _has_ended(node: str, number: int) -> bool:
    """Whether the batch of this machine and process number has ended."""
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


def _list(line: dict[str, Any], key: str) -> list[Any]:
    value = line.get(key)
    return value if isinstance(value, list) else []
