"""Triangulations of a polygon's inside, refined where they are asked to be, with triangles of good shape throughout.

Triangles that are too thin are mended as in Rivara's Lepp-Delaunay method (Rivara, Hitschfeld, Simpson, *Terminal-edges
Delaunay (small-angle based) algorithm*, Computer-Aided Design 33, 2001): from the thin triangle one goes on to the
neighbour across the longest side until that side is the longest of both, and cuts it there in the middle. Flips between
keep the triangulation Delaunay. They are decided by the roughness, the sum of squared sides by area, of which the
Delaunay triangulation has the least (Musin 1997): it falls with every flip, so that rounding cannot make flips go on
forever, however close vertices lie. The polygon's edges stay, or are cut in the middle.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely

from ..arrays import Complex, Flags, Index, complex_of
from ..curve import polygon_of
from ..flips import flip, neighbours, opposite, push, relink, write
from ..jit import kernel
from .triangulated.adjacency import Edges

THIN = 0.15  # twice the area by the square of the longest side: about 9 degrees (by hand)
FALL = 1 - 1e-6  # of the roughness, in a flip
SWEEPS, WALK = 30, 1000  # over all triangles; of triangles on the way to a longest side (by hand)
TINIEST = 1e-14  # of the polygon's diagonal: rounding decides the shape of triangles with shorter sides


@dataclass(frozen=True, eq=False)
class Triangulation:
    """Vertices (n,), counter-clockwise triangles (m, 3), and those beyond the sides opposite to their corners, -1 for
    none."""

    z: Complex
    faces: Index
    across: Index

    @classmethod
    def of(cls, polygon: Complex) -> "Triangulation":
        """The inside of a simple counter-clockwise polygon; its vertices come first."""
        parts = shapely.constrained_delaunay_triangles(polygon_of(polygon))
        corners = complex_of(shapely.get_coordinates(parts).reshape(-1, 4, 2)[:, 2::-1])
        order = np.argsort(polygon)
        return shaped(polygon, order[np.searchsorted(polygon[order], corners)])

    @cached_property
    def edges(self) -> Edges:
        """The edges of the triangulation."""
        return Edges(*_numbered(self.faces, self.across))

    def refined(self, marked: Flags) -> "Triangulation":
        """The same with the marked edges (e,) cut in the middle."""
        ends, sides = self.edges.ends[marked], self.edges.sides
        middle = np.full(marked.size, -1)
        middle[marked] = self.z.size + np.arange(len(ends))
        z = np.concatenate([self.z, 0.5 * (self.z[ends[:, 0]] + self.z[ends[:, 1]])])
        length = np.abs(np.diff(self.z[self.edges.ends], axis=1)[:, 0])
        first = np.where(middle[sides] >= 0, length[sides], -1).argmax(axis=1)
        turn = (first[:, None] + np.arange(3)) % 3  # the longest of the cut sides lies opposite corner 0
        (a, b, c), (p, q, r) = (
            np.take_along_axis(values, turn, axis=1).T for values in (self.faces, middle[sides])
        )
        cut = p >= 0
        parts = [
            (~cut, (a, b, c)),
            (cut & (r < 0), (a, b, p)),
            (cut & (r >= 0), (r, b, p)),
            (cut & (r >= 0), (a, r, p)),
            (cut & (q < 0), (a, p, c)),
            (cut & (q >= 0), (a, p, q)),
            (cut & (q >= 0), (q, p, c)),
        ]
        return shaped(z, np.concatenate([np.stack(corners, axis=1)[where] for where, corners in parts]))

    @property
    def loop(self) -> Index:
        """(r,) the vertices around, in order."""
        ends = self.edges.ends[self.edges.rim]
        after = dict(zip(ends[:, 0].tolist(), ends[:, 1].tolist()))
        loop = [int(ends[0, 0])]
        while (following := after[loop[-1]]) != loop[0]:
            loop.append(following)
        return np.array(loop)


def shaped(z: Complex, faces: Index) -> Triangulation:
    """A triangulation made Delaunay, with vertices added where triangles are thin."""
    n, m = z.size, len(faces)
    room = 3 * n + 2000
    points, triangles, across = np.empty(room, np.complex128), *np.empty((2, 2 * room, 3), np.int64)
    points[:n], triangles[:m], across[:m] = z, faces, neighbours(faces, n)
    stack = np.zeros(8 * room, np.int64)
    stack[0], stack[1 : m + 1] = m, np.arange(m)
    tiniest = TINIEST * float(np.hypot(np.ptp(z.real), np.ptp(z.imag)))
    n, m = _mend(points, n, triangles, m, across, stack, THIN, tiniest**2)
    return Triangulation(points[:n].copy(), triangles[:m].copy(), across[:m].copy())


@kernel
def _numbered(faces, across):
    """The edges of triangles, as `Edges` lists them."""
    m = len(faces)
    ends, sides, count = np.empty((3 * m, 2), np.int64), np.empty((m, 3), np.int64), 0
    rim, beside, corner, around = (
        np.empty(3 * m, np.int64),
        np.empty(3 * m, np.int64),
        np.empty(3 * m, np.int64),
        0,
    )
    for t in range(m):
        for k in range(3):
            u, start, end = across[t, k], faces[t, (k + 1) % 3], faces[t, (k + 2) % 3]
            if 0 <= u < t:
                sides[t, k] = sides[u, opposite(faces, u, start, end)]
                continue
            if u < 0:
                rim[around], beside[around], corner[around] = count, t, k
                around += 1
            sides[t, k], ends[count, 0], ends[count, 1] = count, start, end
            count += 1
    return ends[:count], sides, rim[:around], beside[:around], corner[:around]


@kernel
def _cross(a, b):
    return a.real * b.imag - a.imag * b.real


@kernel
def _square(a):
    return a.real * a.real + a.imag * a.imag


@kernel
def _roughness(z, a, b, c):
    """The sum of a triangle's squared sides by twice its area; infinite where it is not counter-clockwise."""
    u, v = z[b] - z[a], z[c] - z[a]
    area = _cross(u, v)
    return (_square(u) + _square(v) + _square(v - u)) / area if area > 0 else np.inf


@kernel
def _flip_all(z, faces, across, stack):
    """Flips, from the triangles on the stack on, until none makes the triangulation less rough."""
    while stack[0] > 0:
        t = stack[stack[0]]
        stack[0] -= 1
        for k in range(3):
            u = across[t, k]
            if u < 0:
                continue
            a, b, c = faces[t, k], faces[t, (k + 1) % 3], faces[t, (k + 2) % 3]
            d = faces[u, opposite(faces, u, b, c)]
            before = _roughness(z, a, b, c) + _roughness(z, d, c, b)
            if not _roughness(z, a, b, d) + _roughness(z, a, d, c) < FALL * before:
                continue
            flip(faces, across, t, k)
            push(stack, t)
            push(stack, u)
            break


@kernel
def _longest(z, faces, t):
    """The corner opposite to a triangle's longest side, and the square of that."""
    side, longest = 0, -1.0
    for k in range(3):
        square = _square(z[faces[t, (k + 1) % 3]] - z[faces[t, (k + 2) % 3]])
        if square > longest:
            side, longest = k, square
    return side, longest


@kernel
def _cut(z, new, faces, across, t, k, m, stack):
    """Cuts the side opposite to corner k of t at the vertex new; the number of triangles, m before."""
    u = across[t, k]
    a, b, c = faces[t, k], faces[t, (k + 1) % 3], faces[t, (k + 2) % 3]
    beyond_ca, beyond_ab = across[t, (k + 1) % 3], across[t, (k + 2) % 3]
    t2, u2 = m, m + 1
    relink(across, beyond_ca, t, t2)
    write(faces, across, t, a, b, new, u, t2, beyond_ab)
    write(faces, across, t2, a, new, c, u2 if u >= 0 else -1, beyond_ca, t)
    push(stack, t)
    push(stack, t2)
    if u < 0:
        _flip_all(z, faces, across, stack)
        return m + 1
    j = opposite(faces, u, b, c)
    d = faces[u, j]
    beyond_bd, beyond_dc = across[u, (j + 1) % 3], across[u, (j + 2) % 3]
    relink(across, beyond_dc, u, u2)
    write(faces, across, u, d, new, b, t, beyond_bd, u2)
    write(faces, across, u2, d, c, new, t2, u, beyond_dc)
    push(stack, u)
    push(stack, u2)
    _flip_all(z, faces, across, stack)
    return m + 2


@kernel
def _terminal(z, faces, across, t):
    """The side to cut, as a triangle and the corner opposite: going from t across longest sides, the one that is the
    longest of both its triangles, or the polygon's. Where the polygon has the second longest of either triangle, that:
    vertices inside would come closer and closer to it."""
    k, longest = _longest(z, faces, t)
    for _ in range(WALK):
        u = across[t, k]
        if u < 0:
            return t, k
        j, other = _longest(z, faces, u)
        if across[u, j] == t or other <= longest:
            break
        t, k, longest = u, j, other
    for v in (t, across[t, k]):
        first, _ = _longest(z, faces, v)
        i, j = (first + 1) % 3, (first + 2) % 3
        before = _square(z[faces[v, j]] - z[faces[v, first]]), _square(z[faces[v, first]] - z[faces[v, i]])
        second = i if before[0] > before[1] else j
        if across[v, second] < 0:
            return v, second
    return t, k


@kernel
def _mend(z, n, faces, m, across, stack, thin, tiniest2):
    """Flips all that is on the stack, then adds vertices until no triangle is thin that numbers tell from others, or
    until there is no room; the numbers of vertices and triangles."""
    _flip_all(z, faces, across, stack)
    for _ in range(SWEEPS):
        before = n
        for t in range(m):
            while n < z.size and m + 2 <= len(faces):
                _, longest = _longest(z, faces, t)
                a, b, c = z[faces[t, 0]], z[faces[t, 1]], z[faces[t, 2]]
                if _cross(b - a, c - a) >= thin * longest or longest < tiniest2:
                    break
                u, k = _terminal(z, faces, across, t)
                z[n] = 0.5 * (z[faces[u, (k + 1) % 3]] + z[faces[u, (k + 2) % 3]])
                m = _cut(z, n, faces, across, u, k, m, stack)
                n += 1
        if n == before:
            break
    return n, m
