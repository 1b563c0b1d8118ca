"""Bounds on stretch and dilatation, at shares of the largest that maps without bounds have, on random pairs.

python -m tests.bench.bounds [COUNT] [SEED]

A row a bound: the bound, the least that the outlines' angles allow, what was found, on how much of the target it is
exceeded, and by how much the 95 % quantile and the energy grew.
"""

import sys

import numpy as np

import iccm
from iccm.maps.bounds import angle_ratio
from tests.bench import shapes

SHARES = 0.9, 0.7, 0.5


def main(words: list[str] | None = None) -> None:
    """Print the table."""
    given = [int(word) for word in (sys.argv[1:] if words is None else words)]
    count, seed = (*given, *(20, 31)[len(given) :])
    rows = []
    print("pair, bound: asked, corners, found, over, p95 and energy by the free map's")
    for (one, source), (two, target) in shapes.pairs(count, seed):
        free = iccm.fit(source, target, fit="whole").distortion
        for name, values, root in (("dilatation", "dilatations", 1.0), ("stretch", "stretches", 0.5)):
            usual = getattr(free, values)
            for share in SHARES:
                bound = max(1.0, share * float(usual.max()))
                fit = iccm.fit(source, target, fit="whole", **{f"max_{name}": bound})
                here, least = getattr(fit.distortion, values), angle_ratio(fit.map) ** root
                over = fit.distortion.area @ (here > bound * (1 + 1e-9)) / fit.distortion.area.sum()
                p95 = fit.distortion.quantile(here, 0.95) / free.quantile(usual, 0.95)
                cost = energy(fit.distortion) / energy(free)
                print(
                    f"{one} to {two}, {name} {share:g}: {bound:.3g}, {least:.3g}, {here.max():.3g}, "
                    f"{over:.3%}, {p95:.3f}, {cost:.3f}",
                    flush=True,
                )
                rows.append((share, least > bound, fit.status.ok, over, p95, cost))
    for share in SHARES:
        _, forced, met, over, p95, cost = np.array([row for row in rows if row[0] == share]).T
        print(
            f"{share:g} of the free maximum: {met.sum():.0f} of {met.size} met, corners forbid {forced.sum():.0f}; "
            f"exceeded on a median of {np.median(over):.3%}; p95 × {np.median(p95):.3f}, energy × {np.median(cost):.3f}"
        )


def energy(found) -> float:
    """The mean energy over the target."""
    values, inner = found.energies()["total"], found.area > 0
    return float(np.average(values[inner], weights=found.area[inner]))


if __name__ == "__main__":
    main()
