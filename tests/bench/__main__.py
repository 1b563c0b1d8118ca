"""All measurements, one after the other: python -m tests.bench [--quick] [NAME ...]. Each runs alone too, with options.

All of it takes an hour or more; --quick looks at fewer shapes and jobs.
"""

import subprocess
import sys
import time
from pathlib import Path

from .goals import MARK

HERE = Path(__file__).parent
ORDER = ("speed", "balanced", "holes", "solver", "orders", "comparison", "resampling", "meshes", "batch")
QUICK = {
    "balanced": "--pairs 20 --conformal 20 --tight 0",
    "holes": "--letters 4 --unequal 2 --drawings 4 --read 20",
    "solver": "--pairs 6 --outlines 1",
    "orders": "--others 3",
    "batch": "--jobs 40 --many 200",
}


def main(names: list[str]) -> int:
    """Run the benches that are there; 1 when one failed, 2 when one is unknown."""
    quick = "--quick" in names
    names = [name for name in names if name != "--quick"]
    there = [name for name in ORDER if (HERE / f"{name}.py").exists()]
    unknown = sorted(set(names) - set(there))
    if unknown:
        print(f"no bench {unknown[0]!r}; there is {', '.join(there)}", file=sys.stderr)
        return 2
    ended, goals = [], []
    for name in names or there:
        print(f"\n{'=' * 20} {name}", flush=True)
        start = time.perf_counter()
        # a process of its own: what one measures does not depend on what another has compiled or allocated
        line = [sys.executable, "-u", "-m", f"tests.bench.{name}"]
        line += QUICK.get(name, "").split() if quick else []
        process = subprocess.Popen(line, cwd=HERE.parents[1], stdout=subprocess.PIPE, text=True)
        assert process.stdout is not None
        for said in process.stdout:
            print(said, end="", flush=True)
            if said.startswith(MARK):
                goals.append(said)
        code = process.wait()
        ended.append((name, code, time.perf_counter() - start))
    print(f"\n{'=' * 20} summary")
    for name, code, seconds in ended:
        print(f"{name:12} {'done' if code == 0 else f'failed, exit code {code}':22} {seconds:7.1f} s")
    print(f"\n{'=' * 20} goals")
    print(*goals, sep="", end="")
    return int(any(code for _, code, _ in ended))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
