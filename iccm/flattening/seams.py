"""The place at which the seam of a cut surface is lengthened.

To where a layout stretches most, after Gu, Gortler, Hoppe, *Geometry Images*, SIGGRAPH 2002, and on through vertices at
which angles suffer, after Sheffer and Hart, *Seamster: Inconspicuous Low-Distortion Texture Seam Layout*, IEEE
Visualization 2002. A seam that `joins` holes may run into them; ways along
their rims cost nothing.
"""

from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np

from ..arrays import Flags, Index, Real, at_vertices
from ..meshes.cut import cut_along
from ..meshes.flatten import Flattening
from ..meshes.mesh import face_angles
from ..meshes.patch import Patch
from ..meshes.topology import walk

# On eight meshes of the bench 3 ways at a time gave shorter seams than 6, and gains over the root of the length shorter
# ones than gains over its power of 0.35. At 0.3 or 0.6 of what is beside a way all came out alike.
TRIED = 2  # of which the one is taken whose layout has the least energy
AT_ONCE = 3
RELIEVED = 0.3


class Ways(NamedTuple):
    """The shortest ways from the boundary, as (n,) lengths and the vertex before each, negative at the sources."""

    reach: Real
    before: Index

    @classmethod
    def of(cls, patch: Patch, sources: Index, joins: bool) -> "Ways":
        """From some vertices."""
        return cls(*patch.triangles.paths(patch.points, sources, patch.drawn, rims=not joins))

    def summed(self, values: Real) -> Real:
        """Return (n,) sums of values at vertices along the ways, the ends included and the sources not."""
        start = self.before < 0
        total, before = np.where(start, 0.0, values), np.where(start, np.arange(start.size), self.before)
        while not start[before].all():
            total, before = total + total[before], before[before]
        return total


def ends(result: Flattening, joins: bool) -> Iterator[int]:
    """Vertices to each of which the seam could be extended.

    Each has the largest product of stretch and distance to a boundary, or to the ways before. The stretch is the
    logarithm of max(s₁, 1/s₂), averaged over a vertex's triangles. Without the distance, or with the most shrunk or
    most stretched vertex instead, seams were found that helped less.
    """
    patch, sources = result.patch, _sources(result, joins)
    strain = at_vertices(np.log(result.strain), patch.faces, len(patch.points))
    for _ in range(TRIED):
        ways = Ways.of(patch, sources, joins)
        end = int(np.argmax(strain * np.where(np.isfinite(ways.reach), ways.reach, 0)))
        if not 0 < ways.reach[end] < np.inf:
            return
        yield end
        sources = np.union1d(sources, walk(ways.before, end))


def lengthened(result: Flattening, ends: Iterable[int], joins: bool) -> Patch:
    """Return the patch, its seam extended to some vertices by the shortest ways, one after another."""
    sources, found = _sources(result, joins), []
    for end in ends:
        found.append(walk(Ways.of(result.patch, sources, joins).before, end))
        sources = np.union1d(sources, found[-1])
    return cut_along(result.patch, found)


def sharper(result: Flattening) -> Patch:
    """Return the patch, its seam extended along the ways that pass most dilatation for the root of their length.

    They end at convex vertices: at others, about which there is more than a full turn, the sides of a seam overlap.
    """
    patch = result.patch
    inner = np.ones(len(patch.points), bool)
    inner[np.concatenate(patch.loops)] = False
    convex = inner & (turns(patch) < 2 * np.pi)
    dilated = np.where(inner, _log_dilatation(result), 0.0)
    reached = np.zeros(inner.size, bool)
    reached[result.loop] = True
    found = []
    for _ in range(AT_ONCE):
        way = _worthwhile(patch, np.flatnonzero(reached), dilated, convex)
        reached[way] = True
        beside = np.unique(patch.faces[np.isin(patch.faces, way).any(axis=1)])
        dilated[beside] *= RELIEVED
        dilated[way] = 0
        found.append(way)
    return cut_along(patch, found)


def _sources(result: Flattening, joins: bool) -> Index:
    """Return the vertices from which ways go."""
    return result.loop if joins else np.unique(np.concatenate(result.patch.loops))


def _sums(faces: Index, values: Real) -> Real:
    """Return (n,) sums of values (3m,) at corners."""
    sums: Real = np.bincount(faces.ravel(), values).astype(float)
    return sums


def turns(patch: Patch) -> Real:
    """Return (n,) the sums of the angles about each vertex: 2π where the surface is flat, less at a tip."""
    return _sums(patch.faces, face_angles(patch.points[patch.faces]).ravel())


def _log_dilatation(result: Flattening) -> Real:
    """Return (n,) the integral of the logarithm of the dilatation over the triangles around each vertex."""
    faces = result.patch.faces
    area = result.patch.areas
    return _sums(faces, np.repeat(area * np.log(np.minimum(result.dilatation, 1e3)), 3))


def _worthwhile(patch: Patch, sources: Index, dilated: Real, ends: Flags) -> list[int]:
    """Return the way to one of some ends that passes most."""
    ways = Ways.of(patch, sources, joins=True)
    there = ends & (ways.reach > 0) & np.isfinite(ways.reach)
    reach = np.where(there, ways.reach, 1.0)
    return walk(ways.before, int(np.argmax(np.where(there, ways.summed(dilated) / np.sqrt(reach), -1.0))))
