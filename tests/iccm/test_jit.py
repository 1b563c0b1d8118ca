"""Kernels: compiled for Python and for other kernels apart, and anew when one that they call has changed."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from numba.core import types
from numba.core.errors import TypingError

from iccm import jit
from iccm.jit import inlined, kept, kernel

ROOT = Path(__file__).parents[2]


def copy_the_compiler(package):
    """Into a package of another name."""
    shutil.copy(ROOT / "iccm" / "jit.py", package)
    shutil.copytree(ROOT / "iccm" / "compiling", package / "compiling")


@kernel
def longest(sides):
    """Numba's own functions, of several types of arguments."""
    out = np.zeros(2)
    out[0], out[1] = max(sides[0], sides[1]), max(1, int(sides[2]))
    return out


@inlined
def ratio(a, b):
    return a / b


@kept()
def checked(a, b):
    if b < 0:
        raise ValueError("negative")
    return ratio(a, b)


@kernel
def both(sides):
    found = longest(sides)
    return checked(found[0], found[1])


def test_a_kernel_is_called_by_python_and_by_kernels():
    sides = np.array([3.0, 4.0, 2.5])
    assert both(sides) == 2.0
    assert np.array_equal(longest(sides), [4.0, 2.0])
    assert both.py_func(sides) == 2.0


def test_a_division_by_zero_is_what_the_one_called_says():
    assert ratio(1.0, 0.0) == np.inf
    assert checked(1.0, 0.0) == np.inf

    @kept()
    def strict(a, b):
        return a / b

    with pytest.raises(ZeroDivisionError):
        strict(1.0, 0.0)


def test_what_a_called_kernel_raises_is_raised():
    with pytest.raises(ValueError, match="negative"):
        checked(1.0, -1.0)

    @kernel
    def caller(b):
        return checked(1.0, b) + 1

    assert caller(1.0) == 2.0
    with pytest.raises(ValueError, match="negative"):
        caller(-1.0)


def test_numba_is_left_as_it_was():
    before = types.Function.get_call_type

    @kernel
    def wrong(a):
        return a + None

    with pytest.raises(TypingError):
        wrong(1)
    assert types.Function.get_call_type is before
    assert "iccm" not in before.__module__


def test_a_call_by_a_kernel_leaves_python_its_own():
    """One that was compiled as a part has no entry: what Python calls is compiled by itself."""

    @kernel
    def square(x):
        return x * x

    @kernel
    def more(x):
        return square(x) + 1

    assert more(3) == 10
    assert not square.entry.signatures
    assert square(3) == 9
    assert square.entry.signatures


@pytest.mark.slow
def test_a_kernel_follows_the_kernels_that_it_calls(tmp_path):
    """Numba's own stamp is that of one file: what another file changes would not be seen. What is kept under a class
    that is gone is no longer readable."""
    package = tmp_path / "package"
    package.mkdir()
    (package / "__init__.py").write_text("")
    (package / "caller.py").write_text(
        "from .jit import kernel\nfrom . import called\nf = called.f\n@kernel\ndef g(x):\n    return f(x)\n"
    )
    copy_the_compiler(package)
    said = []
    for number in (1, 2):
        (package / "called.py").write_text(
            "from typing import NamedTuple\nfrom .jit import kernel\n"
            f"class Kind{number}(NamedTuple):\n    x: int\nKind = Kind{number}\n"
            f"@kernel\ndef f(kind):\n    return kind.x + {number}\n"
        )
        os.utime(package / "called.py", (10**9 + number, 10**9 + number))
        done = subprocess.run(
            [sys.executable, "-c", "from package import caller; print(caller.g(caller.called.Kind(0)))"],
            cwd=tmp_path, env=os.environ | {"PYTHONDONTWRITEBYTECODE": "1"}, capture_output=True, text=True, check=True,
        )  # fmt: skip
        said.append(done.stdout.strip())
    assert said == ["1", "2"]


KEPT = """
import sys
import numpy as np
from package.jit import kernel

@kernel
def work(n, z):
    out = np.zeros(n)
    out[: n - 1] = np.arange(n - 1) ** 1.5
    if n > 5:
        raise ValueError("more than", n)
    return out.sum() + abs(z ** 3) + np.hypot(3.0, min(n, 4)) + np.cumsum(out)[-1] + int(round(2.6))

if __name__ == "__main__":
    from package import work as own
    said = [own.work(4, 1 + 2j)]
    for n in (-1, 6):
        try:
            own.work(n, 0j)
        except ValueError as error:
            said.append(str(error))
    print(said, len(own.work.entry._cache_hits), "numba.np.arrayobj" in sys.modules)
"""


@pytest.mark.slow
def test_a_kernel_from_the_cache_works_without_what_compiling_needs(tmp_path):
    """Also where Numba's own functions in it raise, and where it does so with a number."""
    package = tmp_path / "package"
    package.mkdir()
    (package / "__init__.py").write_text("")
    (package / "work.py").write_text(KEPT)
    copy_the_compiler(package)
    line = [sys.executable, "-m", "package.work"]
    done = [subprocess.run(line, cwd=tmp_path, capture_output=True, text=True) for _ in range(2)]
    assert [each.returncode for each in done] == [0, 0], done[0].stderr + done[1].stderr
    run = [each.stdout.rsplit(" ", 2) for each in done]
    assert run[0][0] == run[1][0] and "negative dimensions" in run[0][0] and "more than" in run[0][0]
    assert [hits for _, hits, _ in run] == ["0", "1"]
    if jit.KNOWS:
        assert run[1][2] == "False\n"


def test_all_kernels_are_compiled_here():
    """What another decorator keeps would go on with old code of what it calls."""
    files = [path for part in ("iccm", "io") for path in (ROOT / part).rglob("*.py")]
    assert [path.name for path in files if "njit" in path.read_text(encoding="utf-8")] == ["jit.py"]
