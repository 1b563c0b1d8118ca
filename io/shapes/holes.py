"""Which holes of a shape a map can take onto others, and which of two shapes go together by name."""

from collections.abc import Sequence

import numpy as np
import shapely

from ...arrays import Complex
from . import parts
from .shape import Shape

MOST = 64  # the largest: each costs a chain of vertices on every mesh
SPECK = 1e-5  # of the area inside the outline: a smaller hole would need triangles as small
CLOSE = (
    2e-4  # of the diagonal: a hole as close as that to the outline, or to another, leaves no room for a map
)


def mappable(shape: Shape) -> list[int]:
    """The numbers of the holes that are large enough and apart from the outline and from each other."""
    rings = [shapely.Polygon(_xy(hole)) for hole in shape.holes]
    sizes = shapely.area(rings)
    outline = shapely.LinearRing(_xy(shape.curve.z))
    near = CLOSE * shape.curve.diagonal
    kept: list[int] = []
    for k in np.argsort(-sizes, kind="stable"):
        ring = rings[k]
        if len(kept) == MOST or not (ring.is_valid and sizes[k] > SPECK * shape.curve.area):
            continue
        if ring.distance(outline) > near and all(ring.distance(rings[j]) > near for j in kept):
            kept.append(int(k))
    return sorted(kept)


def named_partners(
    source: Shape, target: Shape, holes: tuple[Sequence[int], Sequence[int]]
) -> list[tuple[int, int]]:
    """Pairs of places in the lists of holes, those that have a name in common that no other hole has."""
    said = [
        [parts.said(shape.hole_names[k] if shape.hole_names else ()) for k in chosen]
        for shape, chosen in zip((source, target), holes)
    ]
    own = [{name for name in set().union(*side) if sum(name in each for each in side) == 1} for side in said]
    found: dict[int, int] = {}
    for i, names in enumerate(said[0]):
        shared = [j for j, others in enumerate(said[1]) if names & others & own[0] & own[1]]
        if len(shared) == 1 and shared[0] not in found.values():
            found[i] = shared[0]
    return list(found.items())


def _xy(z: Complex) -> np.ndarray:
    return np.column_stack([z.real, z.imag])
