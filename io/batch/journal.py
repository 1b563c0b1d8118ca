"""The journal of a batch, beside its outputs: what was begun and what was finished, so that a run can resume.

A line is appended with one write and read back leniently: a torn last line, left by a full disk or a killed process,
costs nothing but the job that it spoke of. Several batches may append at once.
"""

from __future__ import annotations

import hashlib
import json
import os
import platform
from contextlib import suppress
from functools import lru_cache
from pathlib import Path
from typing import Any

from ... import __version__
from .. import files
from ..run.inputs import Inputs
from ..run.job import Job
from .manifest import JOURNAL

NAME = JOURNAL


class Journal:
    """What earlier runs in an output folder did, and a place to note what this one does."""

    def __init__(self, root: Path) -> None:
        """Read the journal of an output folder, if there is one."""
        self.path, self._root = Path(root) / NAME, os.fspath(root)
        self._finished: dict[str, dict[str, Any]] = {}
        self._begun: set[str] = set()
        self._left: list[dict[str, Any]] = []
        for line in self._lines():
            if line.get("event") == "begun":
                self._begun.update(str(path) for path in _list(line, "outputs"))
                self._left += [line] if _gone(line.get("by")) else []
            elif line.get("event") == "finished" and isinstance(line.get("key"), str):
                self._finished[line["key"]] = line

    def finished(self, key: str) -> dict[str, Any] | None:
        """The result of an earlier run of this very job, if its outputs are still as it left them."""
        line = self._finished.get(key)
        if line is None or not isinstance(line.get("result"), dict):
            return None
        outputs = _list(line["result"], "outputs")
        return line["result"] if outputs and all(map(self._intact, outputs)) else None

    def wrote(self, path: str) -> bool:
        """Whether an earlier run began to write this output: then --resume may replace it."""
        return self._relative(path) in self._begun

    def begin(self, key: str, job: Job) -> None:
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
        removed = []
        for line in self._left:
            for path in map(str, _list(line, "outputs")):
                for rest in files.siblings(self.path.parent / path):
                    with suppress(OSError):
                        rest.unlink()
                        removed.append(rest)
        return removed

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
        return os.path.relpath(os.path.realpath(path), os.path.realpath(self.path.parent))

    def _lines(self) -> list[dict[str, Any]]:
        try:
            text = self.path.read_text(encoding="utf-8", errors="replace")
        except OSError:
            return []
        return [line for line in map(_parsed, text.splitlines()) if line]

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


def key(job: Job) -> str:
    """The identity of a job's result: version, options, and the contents of its inputs."""
    options = job.model_dump(mode="json", exclude={"force"})
    inputs = {
        path: _hash(path, os.stat(path).st_mtime_ns, os.stat(path).st_size)
        for path in Inputs(job, keep=False).named
    }
    text = json.dumps([__version__, options, inputs], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()


@lru_cache(maxsize=65536)
def _hash(path: str, changed: int, size: int) -> str:
    return files.sha256(path)


def _gone(by: Any) -> bool:
    """Whether the batch of this machine and process number has ended."""
    if os.name != "posix" or not isinstance(by, list) or len(by) != 2 or by[0] != platform.node():
        return False
    try:
        os.kill(int(by[1]), 0)
    except ProcessLookupError:
        return True
    except (OSError, ValueError, TypeError, OverflowError):
        return False
    return False


def _parsed(line: str) -> dict[str, Any] | None:
    try:
        value = json.loads(line)
    except (ValueError, RecursionError):
        return None
    return value if isinstance(value, dict) else None


def _list(line: dict[str, Any], key: str) -> list[Any]:
    value = line.get(key)
    return value if isinstance(value, list) else []
