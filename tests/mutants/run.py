"""Apply mutants, one by one, to a copy of the repository, and run their tests there."""

import multiprocessing
import os
import shutil
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

from .mutant import Mutant

ROOT = Path(__file__).resolve().parents[2]
LEFT_OUT = (
    ".git",
    ".venv",
    "node_modules",
    "build",
    "dist",
    "out",
    "__pycache__",
    ".*_cache",
    "*.egg-info",
    ".hypothesis",
)
"""Patterns of files and folders that tests do not need."""
PACKAGES = ("io", "cli", "extensions", "plugins", "samples")
"""Folders of the repository that are packages in `iccm` once it is installed."""
TIME_LIMIT = 900.0
"""Seconds: if a mutant's tests take longer, it counts as caught, since they take seconds without it."""
PASSED, FAILED, INTERRUPTED, NO_TESTS = 0, 1, 2, 5
"""Exit codes of pytest; others mean that the tests were not run."""
STAGES = ("not slow", "slow")
"""Markers of the tests of `make test` and `make test-slow`. Mutants that survive the first are tried on the second."""

PRELOADED = [
    "pytest",
    "hypothesis",
    "numpy",
    "scipy.optimize",
    "scipy.sparse.linalg",
    "scipy.ndimage",
    "shapely",
]
PRELOADED += [
    "OpenImageIO",
    "cv2",
    "skimage.metrics",
    "trimesh",
    "click",
    "pydantic",
    "PIL.Image",
    "jsonschema",
]
"""Third-party modules that take long to import: one process imports them, and forks those that run tests."""
CONTEXT = multiprocessing.get_context("forkserver" if sys.platform != "win32" else "spawn")
if sys.platform != "win32":
    CONTEXT.set_forkserver_preload(PRELOADED)


def run_pytest(
    folder: Path, environment: Mapping[str, str], tests: Sequence[str], stage: str, log: Path
) -> None:
    """Run tests in a copy of the repository, and exit with pytest's exit code; called in a separate process."""
    os.chdir(folder)
    os.environ.update(environment)
    sys.dont_write_bytecode = False  # hundreds of modules are the same for all mutants
    sys.path[:] = [str(folder), *(entry for entry in sys.path if Path(entry or ".").resolve() != ROOT)]
    with log.open("w", encoding="utf-8") as file:
        os.dup2(file.fileno(), 1)
        os.dup2(file.fileno(), 2)
    import pytest

    options = ["-x", "-q", "-n", "0", "-m", stage, "-p", "no:cacheprovider", "-o", "timeout=0"]
    options += ["--rootdir", str(folder)]
    sys.exit(int(pytest.main([*options, *tests])))


class Copy:
    """A copy of the repository in which mutants are tried.

    Parameters
    ----------
    folder
        An empty folder.
    """

    def __init__(self, folder: Path):
        self.folder, self.log = folder / "repository", folder / "log"
        shutil.copytree(ROOT, self.folder, ignore=shutil.ignore_patterns(*LEFT_OUT), symlinks=True)
        # The installed package refers to the original's folders. With the copy first on the path, and these links in
        # place of folders, all modules come from the copy, also in subprocesses.
        for name in PACKAGES:
            (self.folder / "iccm" / name).symlink_to(Path("..") / name, target_is_directory=True)
        objects = ROOT / "build" / "core"
        if objects.is_dir():
            shutil.copytree(objects, self.folder / "build" / "core", copy_function=shutil.copy2)
        self.environment = {
            **os.environ,
            "PYTHONPATH": str(self.folder),
            "PYTHONDONTWRITEBYTECODE": "",
            "OPENBLAS_NUM_THREADS": "1",
        }

    def test(self, tests: Sequence[str], stage: str) -> int | None:
        """Run the tests of a stage until one fails. Return pytest's exit code, or None after TIME_LIMIT."""
        job = CONTEXT.Process(target=run_pytest, args=(self.folder, self.environment, tests, stage, self.log))
        job.start()
        job.join(TIME_LIMIT)
        if job.is_alive():
            job.kill()
            job.join()
            return None
        return job.exitcode

    @property
    def output(self) -> str:
        """The output of the last tests."""
        return self.log.read_text(encoding="utf-8", errors="replace")

    def compile(self) -> bool:
        """Update the compiled core from its sources; return whether that succeeds."""
        command = [sys.executable, "core/compile.py"]
        return not subprocess.run(
            command, cwd=self.folder, env=self.environment, capture_output=True
        ).returncode

    def try_mutant(self, mutant: Mutant, tests: Sequence[str] = ()) -> str:
        """Run the mutant's tests, or those given; return "caught", "survived", or why that is impossible."""
        path = self.folder / mutant.file
        original = path.read_bytes() if path.is_file() else b""
        mutated = mutant.mutate(original.decode())
        if mutated is None:
            return "not applicable: the text is not found once"
        self._write(path, mutated.encode())
        try:
            if mutant.compiled and not self.compile():
                return "not applicable: cannot be compiled"
            codes = self._codes(tests or mutant.tests.split())
        finally:
            self._write(path, original)
        if any(code in (FAILED, INTERRUPTED, None) for code in codes):
            return "caught"
        if all(code in (PASSED, NO_TESTS) for code in codes) and PASSED in codes:
            return "survived"
        return f"not applicable: pytest ends with {' and '.join(map(str, codes))}"

    def _codes(self, tests: Sequence[str]) -> list[int | None]:
        """Return pytest's exit codes of the stages, up to the first in which a test fails."""
        codes = list[int | None]()
        for stage in STAGES:
            codes.append(self.test(tests, stage))
            if codes[-1] not in (PASSED, NO_TESTS):
                break
        return codes

    def _write(self, path: Path, content: bytes) -> None:
        """Write a module, and remove the bytecode of its earlier content.

        Python considers bytecode current if the module's size and modification time in whole seconds match those
        recorded in it.
        """
        path.write_bytes(content)
        for bytecode in (path.parent / "__pycache__").glob(f"{path.stem}.*.pyc"):
            bytecode.unlink()
