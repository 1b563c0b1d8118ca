"""The image of the source's boundary: which boundary point goes where, as finely as asked."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..arrays import Complex
from .evaluate import Evaluator, edge_jets

ROUNDS = 45  # of halving: 2 ** -45 of an edge is below what stops it, 1e-12
MOST = 400_000  # points (by hand): a wild map's image may be longer than any use of it


@dataclass(frozen=True, eq=False)
class BoundaryImage:
    """A closed polyline with its preimage.

    Attributes:
        z: (k,) points of the source boundary in order, the vertices among them.
        w: (k,) their images, limits from inside.
        edge: (k,) the polygon's edge that a point lies on; a vertex begins its edge.
    """

    z: Complex
    w: Complex
    edge: NDArray[np.int64]


def boundary_image(evaluator: Evaluator, flatness: float, spacing: float = np.inf) -> BoundaryImage:
    """Samples the boundary until its image is known to `flatness`, with steps of at most `spacing` (target units)."""
    polygon, n = evaluator.map.polygon, evaluator.map.polygon.size
    parts = 3
    edge = np.repeat(np.arange(n), parts)
    lo = np.tile(np.arange(parts) / parts, n)
    hi = lo + 1 / parts
    w_lo = evaluator(polygon)
    inner = _on_edges(evaluator, edge, lo)
    inner[::parts] = w_lo
    w0, w1 = inner, np.roll(inner, -1)
    done: list[tuple[NDArray[np.int64], NDArray[np.float64], Complex]] = []
    for _ in range(ROUNDS):
        mid = 0.5 * (lo + hi)
        w = _on_edges(evaluator, edge, mid)
        rough = (np.abs(w - 0.5 * (w0 + w1)) > flatness) | (np.abs(w1 - w0) > spacing)
        rough &= hi - lo > 1e-12
        if sum(part[0].size for part in done) + 4 * rough.sum() > MOST:
            rough[:] = False
        keep = ~rough
        done.append((edge[keep], lo[keep], w0[keep]))
        done.append((edge[keep], mid[keep], w[keep]))
        if not rough.any():
            break
        e, t0, m, t1, a, b, c = (x[rough] for x in (edge, lo, mid, hi, w0, w, w1))
        edge, lo, hi = np.concatenate([e, e]), np.concatenate([t0, m]), np.concatenate([m, t1])
        w0, w1 = np.concatenate([a, b]), np.concatenate([b, c])
    edge, t, w = (np.concatenate(x) for x in zip(*done))
    order = np.lexsort([t, edge])
    edge, t, w = edge[order], t[order], w[order]
    return BoundaryImage(polygon[edge] + t * evaluator.tree.edge[edge], w, edge)


def _on_edges(evaluator: Evaluator, edge: NDArray[np.int64], t: NDArray[np.float64]) -> Complex:
    z = evaluator.map.polygon[edge] + t * evaluator.tree.edge[edge]
    out = np.empty((3, z.size), dtype=np.complex128)
    edge_jets(evaluator.tree, z, edge, out)
    return out[0]
