"""Linear algebra on one thread, whatever the variables say, and as before afterwards."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from threadpoolctl import threadpool_info, threadpool_limits

import iccm
from iccm.blas import on_one_thread, one_thread


def threads():
    return {library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"}


def test_one_thread_inside_and_as_before_afterwards():
    with threadpool_limits(2, user_api="blas"):
        before = threads()
        with one_thread(), one_thread():
            assert threads() == {1}
        assert threads() == before
        assert on_one_thread(threads)() == {1} and threads() == before
        with pytest.raises(ZeroDivisionError), one_thread():
            raise ZeroDivisionError
        assert threads() == before


LATER = """
import sys
from threadpoolctl import threadpool_info, threadpool_limits
from iccm.blas import joined, one_thread
with threadpool_limits(2, user_api="blas"):
    with one_thread():
        assert "scipy.linalg" not in sys.modules
        few = len(threadpool_info())
        import iccm.paper.least_squares
        assert "scipy.linalg" in sys.modules
        with one_thread():
            print(*(library["num_threads"] for library in threadpool_info()))
    print(threadpool_info()[-1]["num_threads"], len(threadpool_info()) > few)
"""


def test_scipy_that_comes_later_gets_one_thread_too():
    run = subprocess.run([sys.executable, "-c", LATER], capture_output=True, text=True, check=True)
    first, last = run.stdout.splitlines()
    assert set(first.split()) == {"1"} and last == "2 True"


def test_modules_that_compute_with_scipy_tell_it():
    root = Path(iccm.__file__).parent
    linear = re.compile(r"import scipy\.linalg|from scipy\.(sparse\.)?linalg import")
    texts = {path: path.read_text() for path in root.rglob("*.py")}
    using = [path for path, text in texts.items() if linear.search(text)]
    assert len(using) > 4
    assert [path.name for path in using if "joined()" not in texts[path]] == []


SCRIPT = """
import iccm, hashlib
from tests.shapes import arrow, pear
fit = iccm.fit(pear(), arrow(), quasi=0.1)
print(hashlib.sha256(fit.map.phi.tobytes() + repr(fit.report()).encode()).hexdigest())
"""


def test_the_bytes_do_not_depend_on_the_variable():
    found = set()
    for count in ("1", "2", "4"):
        env = {**os.environ, "OPENBLAS_NUM_THREADS": count}
        run = subprocess.run(
            [sys.executable, "-c", SCRIPT],
            capture_output=True,
            text=True,
            env=env,
            cwd=Path(__file__).parents[2],
        )
        found.add(run.stdout or run.stderr)
    assert len(found) == 1 and "Error" not in found.pop()
