"""Every measurement in turn, or those that are named: python -m tests.bench [NAME ...]"""

import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).parent
APART = {"gallery"}  # a target of its own


def benches() -> list[str]:
    """The modules here that can be run."""
    found = [path.stem for path in HERE.glob("[!_]*.py") if "__main__" in path.read_text()]
    return sorted(set(found) - APART)


def main(names: list[str]) -> int:
    """0 when all ran, 1 when one failed, 2 when a name is unknown."""
    unknown = set(names) - set(benches()) - APART
    if unknown:
        print(f"no bench {min(unknown)!r}; there is {', '.join(benches())}", file=sys.stderr)
        return 2
    failed = 0
    for name in names or benches():
        print(f"\n== {name}", flush=True)
        failed += (
            subprocess.run([sys.executable, "-m", f"tests.bench.{name}"], cwd=HERE.parents[1]).returncode != 0
        )
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
