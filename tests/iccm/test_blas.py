"""Linear algebra on one thread whatever the variables say, and restored afterwards."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from iccm.blas import on_one_thread, one_thread


def threads():
    return {library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"}


def test_one_thread_inside_and_the_former_number_afterwards():
    with threadpool_limits(2, user_api="blas"):
        before = threads()
        with one_thread(), one_thread():
            assert threads() == {1}
        assert threads() == before
        assert on_one_thread(threads)() == {1} and threads() == before
        with pytest.raises(ZeroDivisionError), one_thread():
            raise ZeroDivisionError
        assert threads() == before


SCRIPT = """
import iccm, hashlib
from tests.shapes import arrow, pear
fit = iccm.fit(pear(), arrow(), quasi=0.1)
print(hashlib.sha256(fit.map.phi.tobytes() + repr(fit.report()).encode()).hexdigest())
"""


@pytest.mark.slow
def test_the_bytes_do_not_depend_on_the_variable():
    outputs = set()
    for count in ("1", "2", "4"):
        env = {**os.environ, "OPENBLAS_NUM_THREADS": count}
        run = subprocess.run(
            [sys.executable, "-c", SCRIPT],
            capture_output=True,
            text=True,
            env=env,
            cwd=Path(__file__).parents[2],
        )
        outputs.add(run.stdout or run.stderr)
    assert len(outputs) == 1 and "Error" not in outputs.pop()
