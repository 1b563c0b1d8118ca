"""Bounds on the dilatation, relative to that of maps without bounds, and balances, on random pairs.

python -m tests.bench.bounds [COUNT] [SEED] [balance]

Each row is for one bound: the bound, the smallest possible one at the outlines' angles, the dilatation found, the share
of the target on which the bound is exceeded, and the increase of the 95 % quantile and of the energy. With `balance`,
each row is for one balance: the variation of scale, the 95 % quantile of the dilatation, and the rotation of the
picture.
"""

import sys

import numpy as np

import iccm
from iccm.maps.bounds import angle_ratio
from tests.bench import shapes

SHARES = 0.9, 0.7, 0.5
KINDS = (
    "less than corners allow",
    "exceeded by the free map on over 5 %",
    "on 1 to 5 %",
    "on less than 1 %",
)  # relative to the target
BALANCES = 1.0, 2.0, 4.0, 10.0


def main(words: list[str] | None = None) -> None:
    """Print the table."""
    words = sys.argv[1:] if words is None else words
    arguments = [int(word) for word in words if word != "balance"]
    count = arguments[0] if arguments else 20
    seed = arguments[1] if len(arguments) > 1 else 31
    (balances if "balance" in words else bounds)(count, seed)


def balances(count: int, seed: int) -> None:
    """Print the table of balances."""
    rows = []
    for (first, source), (second, target) in shapes.pairs(count, seed):
        for balance in BALANCES:
            distortion = iccm.fit(source, target, fit="whole", balance=balance).distortion
            low, high = (
                distortion.quantile(2 * np.log10(distortion.scales), share) for share in (0.05, 0.95)
            )
            rows.append(
                (balance, high - low, distortion.quantile(distortion.dilatations, 0.95), distortion.turn)
            )
            print(
                f"{first} to {second}, balance {balance:g}: {rows[-1][1]:.3f}, {rows[-1][2]:.3g}, {rows[-1][3]:.0f}°",
                flush=True,
            )
    spread, K95, turn = (np.array([row[k] for row in rows]).reshape(-1, len(BALANCES)) for k in (1, 2, 3))
    for k, balance in enumerate(BALANCES):
        more = np.sum(spread[:, k] <= spread[:, max(k - 1, 0)])
        away = np.abs(np.angle(np.exp(1j * np.radians(turn[:, k] - turn[:, 0])), deg=True)).max()
        print(
            f"{balance:g}: spread {np.median(spread[:, k]):.3f}, no more than before in {more} of {len(spread)}; "
            f"K95 {np.median(K95[:, k]):.3g}, largest {K95[:, k].max():.3g}; turned on by at most {away:.1f}°"
        )


def bounds(count: int, seed: int) -> None:
    """Print the table of bounds."""
    rows, kinds = [], []
    print("pair, bound: asked, corners, found, over, p95 and energy by the free map's")
    for (first, source), (second, target) in shapes.pairs(count, seed):
        free = iccm.fit(source, target, fit="whole").distortion
        for name, values, root in (("dilatation", "dilatations", 1.0), ("stretch", "stretches", 0.5)):
            usual = getattr(free, values)
            for share in SHARES:
                bound = max(1.0, share * float(usual.max()))
                fit = iccm.fit(source, target, fit="whole", **{f"max_{name}": bound})
                attained, least = getattr(fit.distortion, values), angle_ratio(fit.map) ** root
                over = fit.distortion.area @ (attained > bound * (1 + 1e-9)) / fit.distortion.area.sum()
                p95 = fit.distortion.quantile(attained, 0.95) / free.quantile(usual, 0.95)
                cost = energy(fit.distortion) / energy(free)
                print(
                    f"{first} to {second}, {name} {share:g}: {bound:.3g}, {least:.3g}, {attained.max():.3g}, "
                    f"{over:.3%}, {p95:.3f}, {cost:.3f}",
                    flush=True,
                )
                rows.append((share, fit.status.ok, over, p95, cost))
                above = bound >= free.quantile(usual, 0.95), bound >= free.quantile(usual, 0.99)
                kinds.append((KINDS[0] if least > bound else KINDS[1 + sum(above)], fit.status.ok))
    for share in SHARES:
        _, met, over, p95, cost = np.array([row for row in rows if row[0] == share]).T
        print(
            f"{share:g} of the free maximum: {met.sum():.0f} of {met.size} met; "
            f"exceeded on a median of {np.median(over):.3%}; p95 × {np.median(p95):.3f}, energy × {np.median(cost):.3f}"
        )
    for kind in KINDS:
        met = [ok for bounded_kind, ok in kinds if bounded_kind == kind]
        print(f"{kind}: {sum(met)} of {len(met)} met")


def energy(distortion) -> float:
    """Return the mean energy over the target."""
    values, inner = distortion.energies()["total"], distortion.area > 0
    return float(np.average(values[inner], weights=distortion.area[inner]))


if __name__ == "__main__":
    main()
