"""Certify, without a tolerance, that a triangulated map is one-to-one up to the boundary.

Let h map the abstract triangulation to one of the planes, linearly on each triangle. If all triangles are
positive and the boundary edges are disjoint simple loops around a region, the winding number is 1 at every
point of the region and 0 elsewhere. It equals the number of triangles that cover a point, so h is one-to-one.
The same holds for the patches: a Jacobian with positive Bernstein coefficients is positive, and so each point
of the source counts with at least 1; on the boundary, patches follow the source's straight edges without
turning back. So both planes have the same region, and each patch covers its part of it.
"""

import numpy as np
from numpy.typing import NDArray

from ...arrays import Complex, Real
from ...plane import TINY, UNIT_ROUNDOFF, orientation
from ..injectivity import Certificate
from .adjacency import Edges, Index
from .patches import bernstein, gradients, slides
from .simple import fault

# Error of a Bernstein coefficient relative to the product of its operands' sums of absolute values: an operand
# has at most four roundings, and two more for a bulge on the boundary, which is a multiple of its edge;
# products and sums have four.
MARGIN = 32 * UNIT_ROUNDOFF


def certify(
    source: Complex, image: Complex, faces: Index, loops: tuple[Index, ...], edges: Edges, bulge: Complex
) -> Certificate:
    """Return the certificate of a map; arguments as in `TriangulatedMap`, with its edges and their bulges.

    `zeros` is the number of triangles that are folded in either plane, or whose patch may be folded.
    """
    why = unfit(source, image, faces, loops, bulge)
    if why:
        return Certificate(False, 0.0, beltrami=np.inf, obstacle=why)
    folded = (_turns(source, faces) <= 0) | (_turns(image, faces) <= 0)
    is_curved_fold = ~folded & ~positive(source[faces], bulge[edges.sides])
    late = int(np.sum(np.abs(slides(bulge, source, edges)) >= 0.5 - 1e-9))
    faults = [fault([plane[loop] for loop in loops]) for plane in (source, image)]
    obstacles = [
        f"{count} {what}"
        for count, what in _counts(int(folded.sum()), int(is_curved_fold.sum()), late)
        if count
    ]
    obstacles += [
        f"the outline of the {name} {what}" for name, what in zip(("source", "image"), faults) if what
    ]
    beltrami = _beltrami(faces, image, source)
    return Certificate(
        not obstacles,
        0.0,
        int((folded | is_curved_fold).sum()),
        beltrami,
        not faults[1],
        "; ".join(obstacles),
        float(not obstacles),
    )


def _counts(folded: int, curved_folds: int, late: int) -> list[tuple[int, str]]:
    return [
        (folded, "triangles are folded"),
        (curved_folds, "patches may be folded"),
        (late, "edges of the outline are reversed"),
    ]


def unfit(source: Complex, image: Complex, faces: Index, loops: tuple[Index, ...], bulge: Complex) -> str:
    """Return why this is not a triangulation with these loops as its boundary; an empty string if it is."""
    if not all(np.isfinite(values).all() for values in (source, image, bulge)):
        return "some vertices are not finite numbers"
    n = source.size
    half = np.sort((faces * n + np.roll(faces, -1, axis=1)).ravel())
    opposite = np.sort((np.roll(faces, -1, axis=1) * n + faces).ravel())
    if (half[1:] == half[:-1]).any():
        return "some edges have more than two triangles"
    rim = half[opposite.take(np.searchsorted(opposite, half), mode="clip") != half]
    loop_edges = np.sort(np.concatenate([loop * n + np.roll(loop, -1) for loop in loops]))
    return "" if np.array_equal(rim, loop_edges) else "the loops are not the triangulation's boundary"


def _turns(plane: Complex, faces: Index) -> NDArray[np.int8]:
    return orientation(*(plane[faces[:, k]] for k in range(3)))


def positive(corners: Complex, bulge: Complex) -> NDArray[np.bool_]:
    """Return (m,) whether the Jacobians of patches with (m, 3) corners and bulges are certainly positive.

    Patches without bulges are the triangles themselves, which are checked separately.
    """
    value, size = bernstein(corners, bulge), _size(corners, bulge)
    sure = ((value > MARGIN * size) & (size > TINY)).all(axis=0)
    return sure | (bulge == 0).all(axis=1)


def _size(corners: Complex, bulge: Complex) -> Real:
    """Return (m,) a bound on the sums of absolute values of the products in the coefficients."""
    edges = np.abs(corners[:, 1] - corners[:, 0]) + np.abs(corners[:, 2] - corners[:, 0])
    return (edges + 4 * np.abs(bulge).sum(axis=1)) ** 2


def _beltrami(faces: Index, image: Complex, source: Complex) -> float:
    """Return the largest |f_z̄ / f_z| of the straight triangles."""
    p, q = gradients(faces, image, source)
    return float(np.max(np.abs(q) / np.maximum(np.abs(p), 1e-300), initial=0.0))
