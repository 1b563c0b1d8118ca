"""`python -m tests.mutants`: report which single-line bugs the tests of their own folder detect."""

import argparse
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

from . import MUTANTS
from .mutant import Mutant
from .run import PASSED, ROOT, STAGES, Copy


def stale(mutants: list[Mutant]) -> list[str]:
    """Return a line for each mutant that cannot be applied, or is a syntax error, which any test would detect."""
    lines = []
    for mutant in mutants:
        path = ROOT / mutant.file
        text = path.read_text(encoding="utf-8") if path.is_file() else ""
        mutated = mutant.mutate(text)
        if mutated is None:
            times = text.count(mutant.old)
            lines.append(f"{mutant.file}: {mutant.old!r} occurs {times} times: update or remove the row")
        elif mutant.file.endswith(".py"):
            try:
                compile(mutated, mutant.file, "exec")
            except SyntaxError as error:
                lines.append(f"{mutant.file}: {mutant.new!r} is no Python: correct the row ({error})")
    return lines


def main() -> int:
    """Try mutants; return 1 if some survive or are stale."""
    parser = argparse.ArgumentParser(prog="python -m tests.mutants", description=__doc__)
    parser.add_argument(
        "--only",
        metavar="TEXT",
        nargs="+",
        default=[""],
        help="only mutants whose file or effect contains a TEXT",
    )
    parser.add_argument("--list", action="store_true", help="list mutants and stale rows, run nothing")
    parser.add_argument(
        "--core",
        action="store_true",
        help="also those of the compiled core, each of which compiles some files",
    )
    parser.add_argument(
        "--unchecked", action="store_true", help="do not first run the tests without any mutant"
    )
    parser.add_argument("--tests", nargs="+", default=(), help="run these tests instead of those of each row")
    args = parser.parse_args()
    chosen = [m for m in MUTANTS if any(text in f"{m.file}: {m.effect}" for text in args.only)]
    problems = stale(chosen)
    if args.list:
        for mutant in chosen:
            print(f"{mutant.file}: {mutant.effect}")
        print(f"{len(chosen)} mutants, {len(problems)} stale", *problems, sep="\n")
        return int(bool(problems))
    if not args.core:
        chosen = [mutant for mutant in chosen if not mutant.compiled]
    with tempfile.TemporaryDirectory(prefix="mutants-") as folder:
        copy = Copy(Path(folder))
        if not args.unchecked:
            tests = args.tests or sorted({test for mutant in chosen for test in mutant.tests.split()})
            if copy.test(tests, STAGES[0]) != PASSED:
                print(copy.output, "the tests fail without any mutant", sep="\n", file=sys.stderr)
                return 1
        counts: Counter[str] = Counter()
        for number, mutant in enumerate(chosen, 1):
            start = time.monotonic()
            result = copy.try_mutant(mutant, args.tests)
            counts[result.partition(":")[0]] += 1
            seconds = time.monotonic() - start
            print(
                f"{number}/{len(chosen)} {result}: {mutant.file}: {mutant.effect} [{seconds:.0f} s]",
                flush=True,
            )
            if result == "caught":
                print(
                    *(
                        f"    {line}"
                        for line in copy.output.splitlines()
                        if line.startswith(("FAILED", "ERROR"))
                    ),
                    sep="\n",
                )
            else:
                print(f"    {mutant.old!r} -> {mutant.new!r}; {mutant.tests}", flush=True)
    print(", ".join(f"{count} {result}" for result, count in sorted(counts.items())))
    print(*problems, sep="\n")
    return int(set(counts) != {"caught"})


if __name__ == "__main__":
    sys.exit(main())
