"""Choose where to lengthen the seam of a cut surface.

Seams grow to where a layout stretches most, after Gu, Gortler, Hoppe, *Geometry Images*, SIGGRAPH 2002, and through
vertices with high angular distortion, after Sheffer and Hart, *Seamster: Inconspicuous Low-Distortion Texture Seam
Layout*, IEEE Visualization 2002. A seam that `joins` holes may run into them, and paths along their rims are free.
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

# Measured on eight benchmark meshes: 3 paths at a time gave shorter seams than 6, and dividing gains by the square root
# of the length gave shorter seams than the power 0.35. RELIEVED_SHARE values of 0.3 and 0.6 gave about the same.
SEAMS_TRIED = 2  # candidate vertices; the one whose layout has the least energy is taken
PATHS_AT_ONCE = 3  # paths added per round for angles
RELIEVED_SHARE = 0.3  # factor on the dilatation beside a new path, which the path relieves


class ShortestPaths(NamedTuple):
    """Shortest paths to all vertices from the nearest of some sources.

    Attributes:
        lengths: (n,) their lengths.
        predecessors: (n,) the vertex before each one on its path, negative at the sources.
    """

    lengths: Real
    predecessors: Index

    @classmethod
    def of(cls, patch: Patch, sources: Index, joins: bool) -> "ShortestPaths":
        """Find the shortest paths from `sources`."""
        return cls(*patch.paths(sources, rims=not joins))

    def sum_along(self, values: Real) -> Real:
        """Return (n,) sums of values (n,) along each path, including its end but not its source."""
        is_source = self.predecessors < 0
        sums = np.where(is_source, 0.0, values)
        before = np.where(is_source, np.arange(is_source.size), self.predecessors)
        # Pointer jumping: each round doubles the length of the part of a path that is summed.
        while not is_source[before].all():
            sums, before = sums + sums[before], before[before]
        return sums


def ends(result: Flattening, joins: bool) -> Iterator[int]:
    """Yield vertices to which the seam could be extended.

    Each has the largest product of stretch and distance to a boundary or to earlier candidates' paths. Stretch is
    log max(s₁, 1/s₂), averaged over a vertex's triangles. Without the distance, or with the most shrunk or most
    stretched vertex instead, seams were found that helped less.
    """
    patch, sources = result.patch, _sources(result, joins)
    stretch = at_vertices(np.log(result.strain), patch.faces, len(patch.points))
    for _ in range(SEAMS_TRIED):
        paths = ShortestPaths.of(patch, sources, joins)
        end = int(np.argmax(stretch * np.where(np.isfinite(paths.lengths), paths.lengths, 0)))
        if not 0 < paths.lengths[end] < np.inf:
            return
        yield end
        sources = np.union1d(sources, walk(paths.predecessors, end))


def lengthened(result: Flattening, ends: Iterable[int], joins: bool) -> Patch:
    """Return the patch with its seam extended to the given vertices by shortest paths, one after another."""
    sources, paths = _sources(result, joins), []
    for end in ends:
        paths.append(walk(ShortestPaths.of(result.patch, sources, joins).predecessors, end))
        sources = np.union1d(sources, paths[-1])
    return cut_along(result.patch, paths)


def sharper(result: Flattening) -> Patch:
    """Return the patch with its seam extended along paths that relieve the most angular distortion.

    A path's merit is the dilatation along it divided by the square root of its length. Paths end at vertices with an
    angle sum below 2π: at others the two sides of the seam would overlap.
    """
    patch = result.patch
    inner = np.ones(len(patch.points), bool)
    inner[np.concatenate(patch.loops)] = False
    convex = inner & (angle_sums(patch) < 2 * np.pi)
    dilated = np.where(inner, _log_dilatation(result), 0.0)
    reached = np.zeros(inner.size, bool)
    reached[result.loop] = True
    paths = []
    for _ in range(PATHS_AT_ONCE):
        path = _worthwhile(patch, np.flatnonzero(reached), dilated, convex)
        reached[path] = True
        neighbours = np.unique(patch.faces[np.isin(patch.faces, path).any(axis=1)])
        dilated[neighbours] *= RELIEVED_SHARE
        dilated[path] = 0
        paths.append(path)
    return cut_along(patch, paths)


def _sources(result: Flattening, joins: bool) -> Index:
    """Return the vertices from which new paths start."""
    return result.loop if joins else np.unique(np.concatenate(result.patch.loops))


def _sums(faces: Index, values: Real) -> Real:
    """Return (n,) sums of values (3m,) given at the corners of faces (m, 3)."""
    sums: Real = np.bincount(faces.ravel(), values).astype(float)
    return sums


def angle_sums(patch: Patch) -> Real:
    """Return (n,) angle sums at the vertices: 2π where the surface is flat, less at a tip."""
    return _sums(patch.faces, face_angles(patch.points[patch.faces]).ravel())


def _log_dilatation(result: Flattening) -> Real:
    """Return (n,) the integral of the logarithm of the dilatation over the triangles around each vertex."""
    faces = result.patch.faces
    area = result.patch.areas
    return _sums(faces, np.repeat(area * np.log(np.minimum(result.dilatation, 1e3)), 3))


def _worthwhile(patch: Patch, sources: Index, dilated: Real, ends: Flags) -> list[int]:
    """Return the path from `sources` to one of the vertices marked in `ends` (n,) with the largest merit."""
    paths = ShortestPaths.of(patch, sources, joins=True)
    reachable = ends & (paths.lengths > 0) & np.isfinite(paths.lengths)
    lengths = np.where(reachable, paths.lengths, 1.0)
    merits = np.where(reachable, paths.sum_along(dilated) / np.sqrt(lengths), -1.0)
    return walk(paths.predecessors, int(np.argmax(merits)))
