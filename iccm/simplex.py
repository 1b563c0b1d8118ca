"""The least value of a function of a few numbers, without derivatives."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Real = NDArray[np.float64]


def descend(
    f: Callable[[Real], float], simplex: Real, *, most: int, near: float, level: float
) -> tuple[Real, float]:
    """Nelder and Mead, *A simplex method for function minimization* (1965), step for step as scipy.optimize, whose
    import takes a tenth of a second.

    Args:
        f: of (n,) numbers.
        simplex: (n + 1, n) places to begin from.
        most: evaluations after which no new step is begun.
        near, level: ends when all places are so near the best, by each number, and all values too.

    Returns:
        The best place (n,) and its value.
    """
    places = np.array(simplex, dtype=float)
    values = np.array([f(x) for x in places])
    count = len(values)

    def at(x: Real) -> tuple[Real, float]:
        nonlocal count
        count += 1
        return x, f(x)

    while True:
        order = np.argsort(values, kind="stable")
        places, values = places[order], values[order]
        close = np.abs(places[1:] - places[0]).max() <= near and np.abs(values[1:] - values[0]).max() <= level
        if close or count >= most:
            return places[0], float(values[0])
        middle = places[:-1].mean(axis=0)
        away = middle - places[-1]
        x, value = at(middle + away)
        if value < values[0]:
            x, value = min((x, value), at(middle + 2 * away), key=lambda found: found[1])
        elif value >= values[-2]:
            inner, less = at(middle + 0.5 * away if value < values[-1] else middle - 0.5 * away)
            if less > value or less >= values[-1]:
                places[1:] = places[0] + 0.5 * (places[1:] - places[0])
                values[1:] = [at(p)[1] for p in places[1:]]
                continue
            x, value = inner, less
        places[-1], values[-1] = x, value
