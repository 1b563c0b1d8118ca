"""All measurements, one after the other: python -m tests.bench [--quick] [NAME ...]. Each runs alone too, with options.

All of it takes about half an hour on two quiet cores; --quick, a third of that, looks at fewer shapes and jobs. What a
bench prints is shown as it comes, and all of it ends with the goals of speed, met or not; the exit code tells only
whether every bench came to its end.
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
OPTIONS = {  # each alone looks at more
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
LONGEST = 900  # seconds, after which a bench is given up
STOPPED = "stopped by Ctrl-C"


def main(names: list[str]) -> int:
    """Run the benches that are there; 1 when one failed, 2 when one is unknown."""
    options = QUICK if "--quick" in names else OPTIONS
    names = [name for name in names if name != "--quick"]
    there = [name for name in ORDER if (HERE / f"{name}.py").exists()]
    unknown = sorted(set(names) - set(there))
    if unknown:
        print(f"no bench {unknown[0]!r}; there is {', '.join(there)}", file=sys.stderr)
        return 2
    ended: list[tuple[str, str, float]] = []
    goals: list[str] = []
    for name in names or there:
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
    """How a bench ended, in a process of its own: what one measures does not depend on what another has compiled or
    allocated. Lines of goals are added to `goals`."""
    line = [sys.executable, "-u", "-m", f"tests.bench.{name}", *options]
    process = subprocess.Popen(
        line, cwd=HERE.parents[1], stdout=subprocess.PIPE, text=True, start_new_session=True
    )
    assert process.stdout is not None
    late = threading.Event()
    watch = threading.Timer(LONGEST, lambda: (late.set(), stop(process)))
    watch.start()
    try:
        for said in process.stdout:
            print(said, end="", flush=True)
            if said.startswith(MARK):
                goals.append(said)
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
    """End a bench and all that it has started."""
    if hasattr(os, "killpg"):
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
    else:
        process.kill()
    process.wait()


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
