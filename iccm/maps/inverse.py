"""The exact inverse of a harmonic map: Newton's method from the preimage under the triangulated map.

f(z + h) = w gives

    h = (conj(f_z) r - f_z̄ conj(r)) / (|f_z|² - |f_z̄|²),   r = w - f(z);

steps that leave the source or do not lower |r| are halved.
"""

import numpy as np

from ..arrays import Complex, Real, as_points
from .approximation import TEXELS_ACROSS, triangulated
from .harmonic import HarmonicMap
from .triangulated.map import inverted

MOST_NEWTON_STEPS, MOST_HALVINGS = (
    60,
    30,
)  # of Newton's method, and of one step: far more than usual points need
EXACT_RESIDUAL_SHARE = 1e-9  # relative to the image's size: |r| up to which a point is accepted, if also
CLOSE_STEP_SHARE = 1e-8  # relative to the source's size: the next Newton step is at most this
# Relative to the image's size: |r| up to which points without a Newton step are accepted.
ROUNDING_SHARE = 1e-14


def inverse(map: HarmonicMap, w: Complex) -> Complex:
    """Return the points z inside the source polygon with map(z) = w, in the shape of w.

    If there are several, it is the one on the sheet that is connected to the widest place; NaN if there is
    none.
    """
    z, away = extended_inverse(map, w)
    return np.where(~(away == 0), complex(np.nan, np.nan), z)


def extended_inverse(map: HarmonicMap, w: Complex) -> tuple[Complex, Real]:
    """Return the inverse, extended by the nearest point of the boundary for points without a preimage.

    Returns:
        The points z, and the distances of w from the image: 0 for points with a preimage, NaN for points that
            are not finite.
    """
    w = as_points(w)
    flat = w.ravel()
    z, away = np.full(flat.size, complex(np.nan, np.nan)), np.full(flat.size, np.nan)
    finite = np.flatnonzero(np.isfinite(flat))
    if finite.size:
        approximation = triangulated(map)
        start, distance = approximation.extended_inverse(flat[finite])
        solution = np.full(distance.size, complex(np.nan, np.nan))
        is_near = distance <= approximation.image_diagonal / TEXELS_ACROSS
        solution[is_near] = _newton(map, flat[finite[is_near]], start[is_near], approximation.image_diagonal)
        unsolved = np.isnan(solution)
        z[finite], away[finite] = np.where(unsolved, start, solution), 0
        away[finite[unsolved]] = np.maximum(distance, np.abs(map.jet(start)[0] - flat[finite]))[unsolved]
    return z.reshape(w.shape), away.reshape(w.shape)


def _newton(map: HarmonicMap, w: Complex, z: Complex, size: float) -> Complex:
    """Return solutions (p,) from starting points (p,), NaN if none is found; `size` is that of the image."""
    out = np.full(w.size, complex(np.nan, np.nan))
    image, f_z, f_zbar = map.jet(z)
    todo = np.arange(w.size)
    for _ in range(MOST_NEWTON_STEPS):
        residual = w[todo] - image[todo]
        p, q = inverted(f_z[todo], f_zbar[todo])
        step = p * residual + q * residual.conj()
        sloped, residual_size = np.isfinite(step), np.abs(residual)
        small = (np.abs(step) <= 1e-10 * map.diagonal) & (residual_size <= EXACT_RESIDUAL_SHARE * size)
        converged = np.where(sloped, small, residual_size <= ROUNDING_SHARE * size)
        out[todo[converged]] = z[todo[converged]]
        continues = ~converged & (np.abs(f_z[todo]) > np.abs(f_zbar[todo])) & sloped
        todo, step, residual = todo[continues], step[continues], np.abs(residual[continues])
        settled = (residual <= EXACT_RESIDUAL_SHARE * size) & (
            np.abs(step) <= CLOSE_STEP_SHARE * map.diagonal
        )
        improved = np.zeros(todo.size, bool)
        for _ in range(MOST_HALVINGS):
            k = np.flatnonzero(~improved)
            if not k.size:
                break
            trial = z[todo[k]] + step[k]
            jet = map.jet(trial)
            better = np.abs(w[todo[k]] - jet[0]) < residual[k]
            z[todo[k[better]]] = trial[better]
            for values, new in zip((image, f_z, f_zbar), jet):
                values[todo[k[better]]] = new[better]
            improved[k[better]] = True
            step[k[~better]] *= 0.5
        stuck = todo[~improved & settled]
        out[stuck] = z[stuck]
        todo = todo[improved]
        if not todo.size:
            break
    return out
