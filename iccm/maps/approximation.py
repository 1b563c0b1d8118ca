"""Approximate harmonic maps by triangulated ones to a given error, for drawing, writing, and inverting many points.

The mesh is refined where the quadratic patches of the inverse are not accurate enough. Between vertices at
which the map has derivatives, those of the inverse determine the bulge of each edge to fourth order. The third
difference 2 (z_i - z_j) + t_i + t_j of its values z and tangents t estimates the error, which is at most 0.048
times that. At the polygon's vertices a harmonic map has no derivatives, since it behaves like z log z there;
for edges at these vertices, the map is evaluated at their midpoints. When the sides of a triangle are accurate,
its midpoint is compared with the map itself.
"""

from weakref import WeakKeyDictionary

import numpy as np

from ..arrays import Complex, Flags, Index, Real
from ..buckets import nearest_segments
from ..curve import polygon_of
from .folds import by_sheets
from .harmonic import ROUNDING_SHARE, HarmonicMap
from .refinement import Triangulation
from .triangulated.adjacency import Edges, edges_of
from .triangulated.map import TriangulatedMap, inverted
from .triangulated.patches import cross, shrunk, tangential

AnyMap = HarmonicMap | TriangulatedMap

TEXELS_ACROSS = 1024  # texels along the longer side of a box
ERROR_TEXELS = 0.02  # error in texels of 1024² at which refinement ends
ALIKE_ERROR_SHARE = 0.9
"""Relative to ERROR_TEXELS. That error is also used if the requested one is hardly smaller, as for a picture
that is a little larger than its shape.
"""
CUBIC_MAXIMUM = 3**0.5 / 36  # maximum of |t (t - 1/2) (t - 1)| on [0, 1]
LOGARITHM_ERROR_RATIO = 3
"""Ratio of the errors for z log z and for a cubic with the same tangent."""
REFINEMENT_ROUNDS = 40  # rounds of refinement: each halves edges, so that digits end before
TERMS_OF_A_TRIANGLE = 700
"""Points at which the map is evaluated, times the polygon's vertices, that take as long as a round of refinement takes
for one of its triangles.
"""
MOST_TERMS = 8e8
"""Of all rounds: about 4 CPU-seconds. A regular map of a polygon of 4000 vertices needs half of it; one that is
irregular everywhere, such as an altered file's, has no end.
"""
MOST_GROWTH = 2.5  # of the number of terms from one round to the next
# Relative to the coordinates: shorter edges are not split for lack of digits.
DIGITS_SHARE = 1e-13
FOLDED_AREA_SHARE = 1e-6
"""Relative to the image's area: a smaller turned-over area is due to rounding, or between two vertices at a
corner.
"""

_made: WeakKeyDictionary[HarmonicMap, dict[tuple[float, float], TriangulatedMap]] = WeakKeyDictionary()


def triangulated(
    map: AnyMap, source_error: float | None = None, image_error: float | None = None
) -> TriangulatedMap:
    """Return a map as a triangulated one. Those of a harmonic map are cached, one for each error.

    Args:
        map: source → target; a triangulated map is returned unchanged.
        source_error: of the inverse, in the source's units; at most ERROR_TEXELS texels, of 1024 along the
            longer side of the source, which is the default.
        image_error: of the map, in the same way in the image.

    Returns:
        The map. If a harmonic map folds, so does this one, and shows the sheets that are connected to the
        widest place.
    """
    if isinstance(map, TriangulatedMap):
        return map
    texels = _texels(map)
    errors = _asked(source_error, ERROR_TEXELS * texels[0]), _asked(image_error, ERROR_TEXELS * texels[1])
    cached = _made.setdefault(map, {})
    if errors not in cached:  # never use a finer one: results must not depend on earlier requests
        cached[errors] = _centred(map, *errors)
    return cached[errors]


def _asked(error: float | None, usual: float) -> float:
    return error if error and error < ALIKE_ERROR_SHARE * usual else usual


def _texels(map: HarmonicMap) -> tuple[float, float]:
    """Return the size of a texel in the source and in the image."""
    planes = map.polygon, map.jet_inside(map.polygon)[0]
    return tuple(float(max(np.ptp(z.real), np.ptp(z.imag))) / TEXELS_ACROSS for z in planes)  # type: ignore[return-value]


def _centred(map: HarmonicMap, source_error: float, image_error: float) -> TriangulatedMap:
    """Return the approximation, computed relative to the centres of both shapes.

    Far from the origin, rounding errors would cause unlimited refinement.
    """
    centred, source, image = map.centred()
    return _approximation(centred, source_error, image_error).moved((1, 0, source), (1, 0, image))


def _approximation(map: HarmonicMap, source_error: float, image_error: float) -> TriangulatedMap:
    mesh = Triangulation.of(map.polygon)
    samples = PatchSamples(map, source_error, image_error)
    for rounds_left in reversed(range(REFINEMENT_ROUNDS)):
        terms_before = samples.terms
        samples.terms += TERMS_OF_A_TRIANGLE * len(mesh.faces)
        samples.extend(mesh.z)
        bulge, marked = samples.edges(mesh.z, mesh.edges)
        marked |= samples.triangles(mesh, bulge, marked)
        terms_after_next = samples.terms + MOST_GROWTH * (samples.terms - terms_before)
        if terms_after_next > MOST_TERMS or not marked.any() or not rounds_left:
            break
        mesh = mesh.refined(marked)
    faces, image = mesh.faces, samples.w[: mesh.z.size]
    sheet_size = None
    if not np.isfinite(image).all():
        sheet_size = 0
    elif _folds(image, faces, mesh.loop):
        away = _clearances(image, faces, mesh.loop)
        faces, sheet_size = by_sheets(image, faces, mesh.across, away)
    edges = edges_of(faces)
    bulge = shrunk(faces, image, mesh.z, edges, samples.edges(mesh.z, edges)[0])
    margin = max(map.slack / map.diagonal, ROUNDING_SHARE)
    return TriangulatedMap(mesh.z, image, faces, (mesh.loop,), margin, bulge, sheet_size)


class PatchSamples:
    """A map at the vertices of a mesh, and the errors of the patches between them.

    Attributes:
        w: images of the vertices.
        p, q: the inverse's derivatives with respect to w and its conjugate there; not finite where there are
            none.
        checked: keys of the triangles whose midpoints were compared with the map, in order.
        terms: number of points at which the map was evaluated, times the vertices of its polygon; the work on triangles
            is added in the same unit.
    """

    def __init__(self, map: HarmonicMap, source_error: float, image_error: float):
        self.map, self.errors = map, (source_error, image_error)
        self.w, self.p, self.q = np.empty((3, 0), np.complex128)
        self.checked = np.empty(0, np.int64)
        self.terms = 0

    def _jet(self, z: Complex) -> tuple[Complex, Complex, Complex]:
        """Return the map and its derivatives at points (p,), and count the terms."""
        self.terms += z.size * self.map.polygon.size
        return self.map.jet_inside(z)

    def extend(self, z: Complex) -> None:
        """Evaluate the map at new vertices."""
        w, f_z, f_zbar = self._jet(z[self.w.size :])
        values = zip((self.w, self.p, self.q), (w, *inverted(f_z, f_zbar)))
        self.w, self.p, self.q = (np.concatenate(parts) for parts in values)

    def edges(self, z: Complex, edges: Edges) -> tuple[Complex, Flags]:
        """Return (e,) the bulges of edges, and whether each is to be split."""
        i, j = edges.ends.T
        along, step = z[j] - z[i], self.w[j] - self.w[i]
        with np.errstate(invalid="ignore", over="ignore", divide="ignore"):
            first, last = (self.p[k] * step + self.q[k] * step.conj() for k in (i, j))
            bulge, error = 0.25 * (first - last), CUBIC_MAXIMUM * np.abs(first + last - 2 * along)
            corners = np.flatnonzero(np.minimum(i, j) < self.map.polygon.size)
            bulge[corners], error[corners] = self._beside_corners(
                z, edges.ends[corners], first[corners], last[corners]
            )
            straight = tangential(bulge, z, edges, edges.rim)
            error += 0.5 * np.abs(
                bulge - straight
            )  # distance of the image's edge from the chord, in the source
            marked = ~self._accurate(error, error * np.abs(step) / np.abs(along))
        bulge = np.where(np.isfinite(straight), straight, 0)
        return bulge, marked & self._known(along, step)

    def _beside_corners(self, z: Complex, ends: Index, first: Complex, last: Complex) -> tuple[Complex, Real]:
        """Return bulges and errors of edges at vertices of the polygon, from the map at their midpoints."""
        i, j = ends.T
        along, middle = z[j] - z[i], 0.5 * (z[i] + z[j])
        bulge = 2 * self._off(0.5 * (self.w[i] + self.w[j]), middle)[0]
        corner = ends < self.map.polygon.size
        derivative = np.where(corner[:, 0], last, first)
        error = (
            LOGARITHM_ERROR_RATIO
            * CUBIC_MAXIMUM
            * 2
            * np.abs(derivative - along - np.where(corner[:, 0], -2, 2) * bulge)
        )
        return bulge, np.where(corner.all(axis=1), np.inf, error)

    def triangles(self, mesh: Triangulation, bulge: Complex, marked: Flags) -> Flags:
        """Return (e,) the longest sides of triangles with inaccurate midpoints.

        Each triangle is checked once, when its sides are accurate.
        """
        sides = mesh.edges.sides
        i, j = mesh.edges.ends.T
        along, step = np.abs(mesh.z[j] - mesh.z[i]), np.abs(self.w[j] - self.w[i])
        longest = sides[np.arange(len(sides)), step[sides].argmax(axis=1)]
        ready = np.flatnonzero(~marked[sides.T].any(axis=0) & self._known(along, step)[longest])
        number = np.sort(mesh.faces[ready], axis=1) @ (1 << np.array([0, 21, 42]))
        new = ~np.isin(number, self.checked, assume_unique=True)
        ready, self.checked = ready[new], np.append(self.checked, number[new])
        bend = shrunk(mesh.faces, self.w, mesh.z, mesh.edges, bulge)[sides[ready]].sum(axis=1)
        faces = mesh.faces[ready]
        middle = mesh.z[faces].mean(axis=1) + 2 / 9 * bend
        with np.errstate(invalid="ignore", over="ignore", divide="ignore"):
            off, away = self._off(self.w[faces].mean(axis=1), middle)
            bad = ~self._accurate(np.abs(off), np.abs(away))
        is_marked = np.zeros(step.size, bool)
        is_marked[longest[ready[bad]]] = True
        return is_marked

    def _off(self, w: Complex, z: Complex) -> tuple[Complex, Complex]:
        """Return displacements of the preimages of points w (p,) from points z, and of w from z's images.

        The points z are close to the preimages; the former displacements are of first order.
        """
        image, f_z, f_zbar = self._jet(z)
        p, q = inverted(f_z, f_zbar)
        return p * (w - image) + q * (w - image).conj(), w - image

    def _accurate(self, source: Real, image: Real) -> Flags:
        return (source <= self.errors[0]) & (image <= self.errors[1])

    def _known(self, along: Complex | Real, step: Complex | Real) -> Flags:
        """Return whether edges are long enough to be split: visible in the image, and with distinct ends in the source.

        It is False for NaN.
        """
        digits = DIGITS_SHARE * float(np.abs(self.map.polygon).max())
        return (np.abs(step) > self.errors[1]) & (np.abs(along) > digits)


def _folds(image: Complex, faces: Index, loop: Index) -> bool:
    """Return whether the image of a mesh covers some places twice, or with the wrong orientation."""
    a, b, c = image[faces].T
    area = cross(b - a, c - a)
    if -area[area < 0].sum() > FOLDED_AREA_SHARE * np.abs(area).sum():
        return True
    return not polygon_of(image[loop]).is_valid


def _clearances(image: Complex, faces: Index, loop: Index) -> Real:
    """Return (m,) the distances of the centroids of the triangles' images from the image of the boundary."""
    middle, start, end = image[faces].mean(axis=1), image[loop], image[np.roll(loop, -1)]
    edge, part = nearest_segments(middle, start, end)
    return np.abs(start[edge] + part * (end - start)[edge] - middle)
