"""First order compared with zeroth order (§3.4): iterations to the energy that 100 zeroth-order iterations reach.

python -m tests.bench.orders [--others 14] [--seed 1]

The pairs are those of the samples, in both directions, and others drawn from all of the samples' shapes.
"""

import argparse
import itertools
import random
from collections.abc import Sequence

import numpy as np

import iccm
from iccm import Curve

from . import shapes

PAIRS = (
    ("limbs/gingerbread.svg", "limbs/starfish.svg"),
    ("pins/round.svg", "pins/cat.svg"),
    ("raster/whale.svg", "raster/fish.svg"),
    ("rose-leaf/rose.svg", "rose-leaf/leaf.svg"),
    ("square-country/square.svg", "square-country/france.svg"),
    ("strokes/straight.svg", "strokes/bent.svg"),
    ("hexagon-blob/hexagon.svg", "hexagon-blob/blob.svg"),
)
LAMBDAS = (0.01, 0.03, 0.05, 0.1, 0.3)
STEPS = 100
SHARE = 3  # of the iterations of the zeroth order: at most a third


def energies(source: Curve, target: Curve, order: int, tangential: float = 0.1) -> np.ndarray:
    """Return the energy after each iteration, until it no longer decreases or STEPS are done."""
    options = {"order": order, "tangential": tangential, "max_iterations": STEPS, "decrease": 0.0}
    fit = iccm.fit(source, target, method="paper", **options)
    return np.array([step["total"] for step in fit.energies])


def needed(zeroth: np.ndarray, first: np.ndarray) -> int | None:
    """Return the iterations of the first order to the final energy of the zeroth order; None if it is not reached."""
    resolved = np.flatnonzero(first <= zeroth[-1])
    return int(resolved[0]) if resolved.size else None


def chosen(more: int, seed: int) -> list[tuple[str, str]]:
    """Return the samples' pairs in both directions, and others drawn from all of their shapes."""
    directed = [pair for a, b in PAIRS for pair in ((a, b), (b, a))]
    names = sorted({name for pair in PAIRS for name in pair})
    remaining = [pair for pair in itertools.permutations(names, 2) if pair not in directed]
    return directed + random.Random(seed).sample(remaining, more)


def compare(pairs: Sequence[tuple[str, str]], lambdas: Sequence[float] = LAMBDAS) -> dict[float, float]:
    """Print the table; return, by λ, the share of pairs for which a third of the iterations is enough."""
    print(f"## First order: iterations to the energy of {STEPS} zeroth-order iterations (method paper)")
    print(f"{'pair':28} zeroth: energy  iterations | first, by λ: " + "  ".join(f"{v:8g}" for v in lambdas))
    good: dict[float, list[bool]] = {v: [] for v in lambdas}
    for a, b in pairs:
        source, target = shapes.sample(a).curve, shapes.sample(b).curve
        zeroth = energies(source, target, 0)
        cells = []
        for value in lambdas:
            first = energies(source, target, 1, value)
            steps = needed(zeroth, first)
            good[value].append(steps is not None and SHARE * steps <= zeroth.size - 1)
            mark = " " if good[value][-1] else "!"
            cells.append(f"{'never' if steps is None else steps:>7}{mark}")
        print(
            f"{stem(a)} → {stem(b):{26 - len(stem(a))}}{zeroth[-1]:14.2e}  {zeroth.size - 1:10d} | "
            f"{'':13}" + "  ".join(cells),
            flush=True,
        )
    shares = {value: float(np.mean(outcomes)) for value, outcomes in good.items()}
    print(
        "at most a third of the iterations on: " + ", ".join(f"λ {v:g}: {s:.0%}" for v, s in shares.items())
    )
    print("(asked for: 80 %; ! marks the pairs that fail)")
    return shares


def stem(name: str) -> str:
    """Return a sample's shape without folder and suffix."""
    return name.rpartition("/")[2].partition(".")[0]


def main(words: list[str] | None = None) -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--others", type=int, default=14)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args(words)
    compare(chosen(options.others, options.seed))


if __name__ == "__main__":
    main()
