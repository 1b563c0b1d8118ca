"""Fixtures for tests of the command line: shapes, and running commands; all reports are checked against their
schema.
"""

import functools
import hashlib
import json
import pickle
import subprocess
import sys
import tempfile
from pathlib import Path

import hypothesis
import pytest

sys.path.insert(
    0, str(Path(__file__).parents[1])
)  # so that `from tests import shapes` works however pytest is started

import iccm as package
from iccm import cli, deadline
from iccm.native import library

SCHEMAS = Path(__file__).parents[1] / "docs" / "reference" / "schemas"
SVG = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 100">{}</svg>'
SHAPES = {
    "square.svg": '<path d="M10 10H90V90H10Z"/>',
    "blob.svg": '<path d="M10 40C10 10 40 5 60 12S98 40 90 60 60 95 40 90 10 70 10 40Z"/>',
    "disk.svg": '<circle id="rim" cx="50" cy="50" r="40"/>',
}

# whether a test passes does not depend on what else the machine does
hypothesis.settings.register_profile(
    "any load", deadline=None, suppress_health_check=[hypothesis.HealthCheck.too_slow]
)
hypothesis.settings.load_profile("any load")


@pytest.hookimpl(tryfirst=True)
def pytest_sessionstart(session):
    """Compile the core if its sources have changed, which takes longer than a test may; workers find it compiled."""
    if not hasattr(session.config, "workerinput"):
        library.refresh()


def pytest_runtest_setup(item):
    """Skip tests marked `large("module")` where that library is missing."""
    for mark in item.iter_markers("large"):
        for module in mark.args:
            pytest.importorskip(module, reason=f"{module} of the extra large is not installed")


@functools.cache
def validator(name):
    """A validator for `docs/reference/schemas/iccm.NAME.json`."""
    from jsonschema import Draft202012Validator

    return Draft202012Validator(json.loads((SCHEMAS / f"iccm.{name}.json").read_text(encoding="utf-8")))


@pytest.fixture(autouse=True)
def reports_are_valid(monkeypatch):
    """Check every report made by a test against its published schema."""
    from iccm.io.run import flatten, relayout, report

    def checked(make, schema):
        def validated(*args, **kwargs):
            result = make(*args, **kwargs)
            validator(schema).validate(report.as_json(result))
            return result

        return validated

    for home, name, schema in (
        (report, "build", "report-1"),
        (flatten, "write_all", "flatten-1"),
        (relayout, "write_all", "relayout-1"),
    ):
        monkeypatch.setattr(home, name, checked(getattr(home, name), schema))


@pytest.fixture(scope="session")
def states(tmp_path_factory):
    """A folder for the states of all tests: `mktemp` for each would search thousands of folders for the next number."""
    return tmp_path_factory.mktemp("states")


@pytest.fixture(autouse=True)
def own_state(states, monkeypatch):
    """Keep the state of runs in a separate folder for each test."""
    state = tempfile.mkdtemp(dir=states)
    monkeypatch.setenv("XDG_STATE_HOME", state)
    monkeypatch.setenv("LOCALAPPDATA", state)  # the same on Windows


@pytest.fixture(scope="session")
def all_variants():
    """The names of the core's variants, all of which are compiled: a checkout has only that for its processor."""
    if library.library().iccm_runtime_x86_64_level() < 3:
        pytest.skip("this processor can run one variant only")
    script = Path(__file__).parents[1] / "core" / "compile.py"
    subprocess.run([sys.executable, str(script), str(library.FOLDER)], check=True, capture_output=True)
    return [path.stem.removeprefix("core-") for path in library.FOLDER.glob("core-*.*")]


@pytest.fixture
def shapes(tmp_path, monkeypatch):
    """A folder, made current, with square.svg, blob.svg and disk.svg."""
    monkeypatch.chdir(tmp_path)
    for name, content in SHAPES.items():
        (tmp_path / name).write_text(SVG.format(content))
    return tmp_path


SOLVED: dict[bytes, bytes] = {}
"""Pickled results of `iccm.fit` and `iccm.deform` by a digest of their arguments, see `solve_once`."""


def remembered(solve):
    """Decorate a solve so that the same arguments are solved once; each call has a copy of the result of its own."""

    @functools.wraps(solve)
    def call(*args, **options):
        limit = deadline.current()
        timed = limit is not None and limit.seconds < deadline.DEFAULT_SECONDS
        if timed or options.get("cancel") is not None or options.get("progress") is not None:
            return solve(*args, **options)
        if options.get("choices") is not None:  # found by a search in this process; they hold native objects
            return solve(*args, **options)
        key = hashlib.sha256(pickle.dumps((solve.__name__, args, sorted(options.items())))).digest()
        if key not in SOLVED:
            SOLVED[key] = pickle.dumps(solve(*args, **options))
        return pickle.loads(SOLVED[key])

    return call


@pytest.fixture
def solve_once(monkeypatch):
    """Solve the same shapes with the same options once per process.

    For files whose tests check what is done with maps: `pytestmark = pytest.mark.usefixtures("solve_once")`. Not for
    those that patch the solver, or compare two solves.
    """
    for name in ("fit", "deform"):
        monkeypatch.setattr(package, name, remembered(getattr(package, name)), raising=False)


class Typed:
    """The exit code, stdout and stderr of a command."""

    def __init__(self, code: int, out: str, err: str) -> None:
        self.code, self.out, self.err = code, out, err

    @property
    def lines(self) -> list[str]:
        """The lines of stderr."""
        return self.err.splitlines()


@pytest.fixture
def iccm(capsys):
    """`iccm(*arguments)` runs the command line in this process."""

    def run(*arguments) -> Typed:
        capsys.readouterr()
        code = cli.run([str(argument) for argument in arguments])
        captured = capsys.readouterr()
        return Typed(code, captured.out, captured.err)

    return run


@pytest.fixture
def shell():
    """`shell(line)` runs a line in a shell, with `iccm` on the path."""

    def run(line: str, **options) -> subprocess.CompletedProcess:
        path = f'PATH="{Path(sys.executable).parent}:$PATH"; export PATH; '
        return subprocess.run(
            ["bash", "-c", path + line], capture_output=True, text=True, timeout=100, **options
        )

    return run
