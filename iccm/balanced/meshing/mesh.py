"""Quality triangulations of a simple polygon that keep its boundary as it is.

Delaunay refinement (Ruppert 1995; Shewchuk 2002) that never splits an edge of the outline: circumcentres of triangles
too large or too thin are inserted unless they would come too close to the outline. No inner edge joins two vertices
of the outline: where the boundary slides such an edge would turn over.
"""

from typing import NamedTuple

import numpy as np

from ...arrays import Complex, Index, Real
from ..failure import Stuck
from ..kernels import cross, dot, kernel, set_row, twice_area
from .delaunay import clip_ears, in_circle, legalise, opposite, push, relink

LEAST_ANGLE = 25.0  # degrees; thinner triangles get a point. Above 28 the refinement no longer settles
ENCROACHED = -0.3  # cosine under which an edge of the outline may be seen from a new point: found by trial
FLAT = 1e-11  # twice the area, of a domain of area one, below which a new point counts as on an edge
ROUNDS = 60  # of refinement; 8 are the most that icons needed
FARTHEST_WALK = 200  # triangles from a bad one to its circumcentre


class Sizes(NamedTuple):
    """The largest area a triangle may have, as a grid of square cells.

    Attributes:
        corner: lower left corner of the grid.
        side: of a cell.
        areas: (columns, rows) area limits; points outside belong to the nearest cell.
    """

    corner: complex
    side: float
    areas: Real

    @classmethod
    def even(cls, area: float) -> "Sizes":
        """The same limit everywhere."""
        return cls(0j, 1.0, np.full((1, 1), float(area)))


def triangulate(outline: Complex, sizes: Sizes) -> tuple[Complex, Index]:
    """Vertices (n,), the outline's first and in order, and counter-clockwise triangles (m, 3) of its inside.

    Args:
        outline: (b,) a simple polygon, counter-clockwise, of area about one.
        sizes: how large the triangles may be.

    Raises:
        Stuck: the polygon is so thin or so close to crossing itself that rounding decides.
    """
    area = 0.5 * float(np.sum((outline.conj() * np.roll(outline, -1)).imag))
    room = int(12 * area / sizes.areas.mean() + 16 * outline.size + 4000)
    z = np.empty(room, np.complex128)
    z[: outline.size] = outline
    faces, across = np.empty((2 * room, 3), np.int64), np.full((2 * room, 3), -1)
    triangles = clip_ears(z, outline.size, faces, across)
    a, b, c = z[faces[: max(triangles, 0)]].T
    if triangles < 0 or not ((b - a).conj() * (c - a)).imag.min() > 0:
        raise Stuck("the outline is too thin to be triangulated in double precision")
    stack = np.zeros(8 * room, np.int64)
    vertices, triangles = _refine(z, outline.size, faces, across, triangles, stack, 0, *sizes)
    vertices, triangles = _split_chords(z, vertices, outline.size, faces, across, triangles, stack)
    return z[:vertices].copy(), faces[:triangles].copy()


@kernel
def _limit(point, corner, side, areas):
    """The area limit at a point."""
    i = min(max(int((point.real - corner.real) / side), 0), areas.shape[0] - 1)
    j = min(max(int((point.imag - corner.imag) / side), 0), areas.shape[1] - 1)
    return areas[i, j]


@kernel
def _circumcentre(a, b, c):
    """The circumcentre of a triangle and the square of its circumradius."""
    u, v = a - c, b - c
    turned = (u * dot(v, v) - v * dot(u, u)) * (0.5 / cross(u, v))
    offset = complex(-turned.imag, turned.real)
    return c + offset, dot(offset, offset)


@kernel
def _walk(z, faces, across, t, point):
    """The triangle that holds a point, going there straight from t; -1 where that leaves the polygon."""
    for _ in range(FARTHEST_WALK):
        next_one = t
        for k in range(3):
            a, b = z[faces[t, (k + 1) % 3]], z[faces[t, (k + 2) % 3]]
            if cross(b - a, point - a) < 0:
                next_one = across[t, k]
                break
        if next_one == t or next_one < 0:
            return min(t, next_one)
        t = next_one
    return -1


@kernel
def _encroaches(z, faces, across, t, new, cavity, mark, stamp):
    """Whether the vertex new, inside t, sees an edge of the outline in its cavity under too wide an angle."""
    cavity[0], mark[t] = t, stamp
    count, at = 1, 0
    while at < count:
        t, at = cavity[at], at + 1
        for k in range(3):
            u = across[t, k]
            if u < 0:
                a, b = z[faces[t, (k + 1) % 3]] - z[new], z[faces[t, (k + 2) % 3]] - z[new]
                if dot(a, b) < ENCROACHED * abs(a) * abs(b):
                    return True
            elif (
                mark[u] != stamp
                and count < cavity.size
                and in_circle(z, faces[u, 0], faces[u, 1], faces[u, 2], new)
            ):
                cavity[count], mark[u] = u, stamp
                count += 1
    return False


@kernel
def _insert(z, faces, across, t, new, triangles, stack, fixed):
    """Puts the vertex new into triangle t; False where it lies on an edge."""
    a, b, c = faces[t, 0], faces[t, 1], faces[t, 2]
    if min(twice_area(z, a, b, new), twice_area(z, b, c, new), twice_area(z, c, a, new)) < FLAT:
        return False
    u, v = triangles, triangles + 1
    beyond_a, beyond_b, beyond_c = across[t, 0], across[t, 1], across[t, 2]
    set_row(faces, t, new, b, c)
    set_row(faces, u, new, c, a)
    set_row(faces, v, new, a, b)
    set_row(across, t, beyond_a, u, v)
    set_row(across, u, beyond_b, v, t)
    set_row(across, v, beyond_c, t, u)
    relink(across, beyond_b, t, u)
    relink(across, beyond_c, t, v)
    for triangle in (t, u, v):
        push(stack, triangle)
    legalise(z, faces, across, stack, fixed)
    return True


@kernel
def _wanted(z, faces, t, corner, side, areas, only_large):
    """Whether triangle t is too large or too thin, and the point that would mend it."""
    a, b, c = z[faces[t, 0]], z[faces[t, 1]], z[faces[t, 2]]
    centre, radius2 = _circumcentre(a, b, c)
    large = 0.5 * cross(b - a, c - a) > _limit((a + b + c) / 3, corner, side, areas)
    shortest2 = min(dot(b - a, b - a), dot(c - b, c - b), dot(a - c, a - c))
    thin = shortest2 < 4 * radius2 * np.sin(np.radians(LEAST_ANGLE)) ** 2
    return large or (thin and not only_large), centre


@kernel
def _refine(z, vertices, faces, across, triangles, stack, fixed, corner, side, areas):
    """Inserts circumcentres, of large triangles first, until none is left that can be mended."""
    for t in range(triangles):
        push(stack, t)
    legalise(z, faces, across, stack, fixed)
    mark, cavity, stamp = np.zeros(faces.shape[0], np.int64), np.empty(4000, np.int64), 0
    for sweep in range(ROUNDS):
        before = vertices
        for t in range(triangles):
            wanted, point = _wanted(z, faces, t, corner, side, areas, sweep == 0)
            if not wanted or vertices + 1 >= z.size:
                continue
            holder = _walk(z, faces, across, t, point)
            if holder < 0:
                continue
            stamp += 1
            z[vertices] = point
            if _encroaches(z, faces, across, holder, vertices, cavity, mark, stamp):
                continue
            if _insert(z, faces, across, holder, vertices, triangles, stack, fixed):
                vertices, triangles = vertices + 1, triangles + 2
        if vertices == before and sweep > 0:
            break
    return vertices, triangles


@kernel
def _split(z, new, faces, across, t, k, triangles, stack, outline):
    """Splits the inner edge opposite corner k of t at its middle, the vertex new."""
    u = across[t, k]
    a, b, c = faces[t, k], faces[t, (k + 1) % 3], faces[t, (k + 2) % 3]
    j = opposite(faces, u, b, c)
    d = faces[u, j]
    z[new] = 0.5 * (z[b] + z[c])
    t2, u2 = triangles, triangles + 1
    beyond_ca, beyond_ab = across[t, (k + 1) % 3], across[t, (k + 2) % 3]
    beyond_bd, beyond_dc = across[u, (j + 1) % 3], across[u, (j + 2) % 3]
    set_row(faces, t, a, b, new)
    set_row(faces, t2, a, new, c)
    set_row(faces, u, d, new, b)
    set_row(faces, u2, d, c, new)
    set_row(across, t, u, t2, beyond_ab)
    set_row(across, t2, u2, beyond_ca, t)
    set_row(across, u, t, beyond_bd, u2)
    set_row(across, u2, t2, u, beyond_dc)
    relink(across, beyond_ca, t, t2)
    relink(across, beyond_dc, u, u2)
    for triangle in (t, t2, u, u2):
        push(stack, triangle)
    legalise(z, faces, across, stack, outline)


@kernel
def _split_chords(z, vertices, outline, faces, across, triangles, stack):
    """Splits inner edges that join two vertices of the outline until there are none."""
    for _ in range(ROUNDS):
        before = vertices
        for t in range(triangles):
            for k in range(3):
                b, c = faces[t, (k + 1) % 3], faces[t, (k + 2) % 3]
                if across[t, k] >= 0 and b < outline and c < outline and vertices < z.size:
                    _split(z, vertices, faces, across, t, k, triangles, stack, outline)
                    vertices, triangles = vertices + 1, triangles + 2
                    break
        if vertices == before:
            break
    return vertices, triangles
