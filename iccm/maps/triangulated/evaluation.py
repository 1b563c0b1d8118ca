"""Values and derivatives of the patches at places already found."""

import numpy as np

from ...arrays import Complex, Real
from ...jit import kernel
from ...parallel import over_slices
from .adjacency import Index


def evaluate(
    patches: Complex, corners: Complex, triangle: Index, place: Real, threads: int | None = None
) -> tuple[Complex, Complex, Complex, Complex]:
    """The inverse's value z, its argument w, and its derivatives by w and w̄; (p,) each, NaN where there is no triangle.

    Args:
        patches: (m, 6) source points of the corners and bulges of the sides opposite to them.
        corners: (m, 3) corners in the image.
        triangle, place: (p,) and (p, 3) barycentric coordinates in the image.
        threads: as many as there are processors by default; the result does not depend on it.
    """
    out = np.full((4, triangle.size), complex(np.nan, np.nan))
    over_slices(
        lambda part: _evaluate(patches, corners, triangle, place, part.start, part.stop, out),
        triangle.size,
        threads,
    )
    return out[0], out[1], out[2], out[3]


@kernel
def _evaluate(patches, corners, triangle, place, start, stop, out):
    for i in range(start, stop):
        t = triangle[i]
        if t < 0:
            continue
        l0, l1, l2 = place[i, 0], place[i, 1], place[i, 2]
        c, w0 = patches[t], corners[t, 0]
        u, v = corners[t, 1] - w0, corners[t, 2] - w0
        e1, e2 = c[1] - c[0], c[2] - c[0]
        out[0, i] = c[0] + (l1 * e1 + l2 * e2 + 2 * (l1 * l2 * c[3] + l2 * l0 * c[4] + l0 * l1 * c[5]))
        out[1, i] = w0 + (l1 * u + l2 * v)
        a = e1 + 2 * ((l0 - l1) * c[5] + l2 * (c[3] - c[4]))
        b = e2 + 2 * ((l0 - l2) * c[4] + l1 * (c[3] - c[5]))
        half = 0.5 / (u.real * v.imag - u.imag * v.real)
        out[2, i] = complex(0, half) * (a * v.conjugate() - b * u.conjugate())
        out[3, i] = complex(0, half) * (b * u - a * v)
