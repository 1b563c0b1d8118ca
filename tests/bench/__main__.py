"""Run all measurements, one after the other: python -m tests.bench [--quick] [NAME ...]. Each can also be run alone,
with options.

All of them take about half an hour on two idle cores; --quick takes a third of that with fewer shapes and jobs. The
output of each bench is shown immediately. At the end, all speed goals are listed as met or missed; the exit code only
reports whether every bench finished.
"""

import contextlib
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

from .goals import MARK, listed

HERE = Path(__file__).parent
ORDER = (  # those with goals first
    "speed",
    "balanced",
    "resampling",
    "batch",
    "many",
    "meshes",
    "comparison",
    "holes",
    "solver",
    "orders",
    "sequences",
)
OPTIONS = {  # a bench run alone measures more
    "balanced": "--pairs 150 --conformal 30 --tight 10",
    "batch": "--jobs 80 --small 10000",
    "holes": "--letters 10 --unequal 5 --drawings 10 --read 50",
    "solver": "--pairs 8 --largest 1000 --outlines 1",
    "orders": "--others 0",
}
QUICK = {
    "balanced": "--pairs 20 --conformal 20 --tight 0",
    "batch": "--jobs 24 --small 400",
    "many": "--jobs 10000",
    "holes": "--letters 4 --unequal 2 --drawings 4 --read 20",
    "solver": "--pairs 2 --largest 500 --outlines 0",
    "orders": "--others 0",
}
LONGEST = 900  # seconds after which a bench is stopped
STOPPED = "stopped by Ctrl-C"


def main(names: list[str]) -> int:
    """Run the requested benches; return 1 if one failed, 2 if one is unknown."""
    options = QUICK if "--quick" in names else OPTIONS
    names = [name for name in names if name != "--quick"]
    available = [name for name in ORDER if (HERE / f"{name}.py").exists()]
    unknown = sorted(set(names) - set(available))
    if unknown:
        print(f"no bench {unknown[0]!r}; there is {', '.join(available)}", file=sys.stderr)
        return 2
    ended: list[tuple[str, str, float]] = []
    goals: list[str] = []
    for name in names or available:
        print(f"\n{'=' * 20} {name}", flush=True)
        start = time.perf_counter()
        how = run(name, options.get(name, "").split(), goals)
        ended.append((name, how, time.perf_counter() - start))
        if how == STOPPED:
            break
    print(f"\n{'=' * 20} summary")
    for name, how, seconds in ended:
        print(f"{name:12} {how:28} {seconds:7.1f} s")
    print(f"\n{'=' * 20} goals")
    print(*listed(goals), sep="\n")
    return int(any(how != "done" for _, how, _ in ended))


def run(name: str, options: list[str], goals: list[str]) -> str:
    """Return how a bench ended. It runs in its own process, so that it does not depend on what others have compiled or
    allocated. Lines with goals are appended to `goals`.
    """
    line = [sys.executable, "-u", "-m", f"tests.bench.{name}", *options]
    process = subprocess.Popen(
        line, cwd=HERE.parents[1], stdout=subprocess.PIPE, text=True, start_new_session=True
    )
    assert process.stdout is not None
    late = threading.Event()
    watch = threading.Timer(LONGEST, lambda: (late.set(), stop(process)))
    watch.start()
    try:
        for printed in process.stdout:
            print(printed, end="", flush=True)
            if printed.startswith(MARK):
                goals.append(printed)
        code = process.wait()
    except KeyboardInterrupt:
        return STOPPED
    finally:
        watch.cancel()
        stop(process)
    if late.is_set():
        return f"given up after {LONGEST} s"
    return "done" if code == 0 else f"failed, exit code {code}"


def stop(process: subprocess.Popen) -> None:
    """End a bench and all processes that it has started."""
    if hasattr(os, "killpg"):
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
    else:
        process.kill()
    process.wait()


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
