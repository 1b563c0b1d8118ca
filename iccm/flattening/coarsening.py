"""A layout sought on coarser triangulations of the same surface first.

Vertices that are no neighbours are taken out in rounds, each drawn into a neighbour (half-edge collapse), so that no
triangle folds in the layout; they come back in the opposite order, each at its place in its triangle, or nearer to that
neighbour where a triangle would fold otherwise, so that there are no folds after it either, and from there to where the
triangles around it have least energy. After Hormann, Greiner and Campagna, *Hierarchical parametrization of
triangulated surfaces*, 1999.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..arrays import Complex, Index, Real
from ..balanced.kernels import cross, dot, set_row, twice_area
from ..balanced.minimise.energy import density_derivatives
from ..jit import kernel
from ..meshes.flatten import Flattening
from ..meshes.mesh import Mesh, face_areas
from ..meshes.patch import Patch
from ..meshes.topology import Triangles
from .free import LARGE, SMALL, Elastic, surface

FEWER = 8  # times the vertices of the next coarser triangulation, on which a step costs as much less
DEGREE = 12  # triangles around a vertex that is taken out, at most: twice as many as usual
THIN = 0.2  # of an equilateral triangle's area over its squared sides: none thinner is made
NONE = np.empty(0, np.int64)


class Removed(NamedTuple):
    """Vertices that were taken out, in that order.

    Attributes:
        vertex: (r,) their numbers.
        into: (r,) the neighbour that each was drawn into.
        corners: (r, 3) the triangle that each lay in then.
        weights: (r, 3) its barycentric coordinates there.
        starts: (r + 1,) where the edges around each begin in `edges`.
        edges: (e, 2) those opposite it, counter-clockwise.
    """

    vertex: Index
    into: Index
    corners: Index
    weights: Real
    starts: Index
    edges: Index


def relaxed(
    sheet: Elastic,
    points: Real,
    u: Complex,
    theta: float,
    steps: int,
    tolerance: float,
) -> Complex:
    """(n,) positions of less energy, from some without folds; of large surfaces by way of a coarser triangulation.

    Args:
        sheet: the surface, all of whose vertices move.
        points: (n, 3) of them in space.
        u: (n,) positions at an area of one.
        theta: weight of the area part.
        steps: of Newton's method, at most, on each triangulation.
        tolerance: relative decrease that counts as none.
    """
    u = by_coarser(
        sheet,
        points,
        u,
        theta,
        lambda own, kept: relaxed(own, points[kept], u[kept], theta, steps, tolerance),
    )
    return sheet.relaxed(u, theta, steps, tolerance)


def by_coarser(
    sheet: Elastic,
    points: Real,
    u: Complex,
    theta: float,
    solve: Callable[[Elastic, Index], Complex],
    stay: Index = NONE,
) -> Complex:
    """(n,) positions of less energy by way of a coarser triangulation; those given where the surface is small or there
    are none.

    Args:
        sheet, points, u, theta: as of `relaxed`.
        solve: positions (k,) without folds of the coarser surface, given that and the numbers (k,) of its vertices.
        stay: vertices that are not taken out.
    """
    small = _much_coarser(points, sheet.faces, u, LARGE, stay)
    if small is None:
        return u
    kept, faces, removed = small
    found = u.copy()
    found[kept] = solve(surface(points[kept], faces), kept)
    unit = points / np.sqrt(face_areas(points[sheet.faces]).sum())
    better = put_back(*removed, unit, theta, found) and sheet.energy(found, theta) < sheet.energy(u, theta)
    return found if better else u


def coarser_layout(layout: Flattening, large: int) -> tuple[Flattening, Index] | None:
    """A layout without folds on a coarser triangulation, a mesh of its own, and the patch's vertex (k,) behind each of
    its vertices; None where the surface has fewer vertices than `large`, or there is none."""
    patch = layout.patch
    small = _much_coarser(patch.points, patch.faces, layout.flat, large, NONE)
    if small is None:
        return None
    kept, faces, _ = small
    mesh = Mesh.triangles(patch.mesh.name, patch.points[kept], faces)
    own = Patch(
        mesh,
        mesh.points,
        Triangles(faces, kept.size),
        np.arange(kept.size),
        np.arange(faces.size).reshape(-1, 3),
    )
    loops = [loop for loop in own.loops if np.isin(kept[loop], layout.loop).all()]
    return (replace(layout, patch=own, flat=layout.flat[kept], loop=loops[0]), kept) if loops else None


def _much_coarser(
    points: Real, faces: Index, z: Complex, large: int, stay: Index
) -> tuple[Index, Index, Removed] | None:
    """The vertices (k,) that are left of many, the triangles (m, 3) of these, and what was taken out."""
    if z.size < large:
        return None
    coarse, removed = coarser(points, faces, z, z.size // FEWER, stay)
    kept = np.unique(coarse)
    return None if 2 * kept.size > z.size else (kept, np.searchsorted(kept, coarse), removed)


def coarser(points: Real, faces: Index, z: Complex, goal: int, stay: Index = NONE) -> tuple[Index, Removed]:
    """(k, 3) triangles with about `goal` vertices or as few as there can be, some of which stay, without folds in a
    layout z (n,) that has none; and what was taken out."""
    faces, parts = faces.copy(), list[Removed]()
    count = left = z.size
    while left > goal:
        corners = faces.ravel()
        starts = np.append(0, np.cumsum(np.bincount(corners, minlength=count)))
        around = np.argsort(corners, kind="stable") // 3
        room = left // 3 + 1
        vertex, into, blocked = *np.empty((2, room), np.int64), np.zeros(count, bool)
        blocked[stay] = True
        triangle, weights = np.empty((room, 3), np.int64), np.empty((room, 3))
        ends, edges = np.zeros(room + 1, np.int64), np.empty((len(corners), 2), np.int64)
        given = points, z, starts, around, blocked, left - goal
        number = _round(faces, *given, vertex, into, triangle, weights, ends, edges)
        parts.append(
            Removed(
                vertex[:number],
                into[:number],
                triangle[:number],
                weights[:number],
                ends[: number + 1],
                edges[: ends[number]],
            )
        )
        faces = faces[faces[:, 0] >= 0]
        left -= number
        if 10 * number < left:
            break
    offsets = np.cumsum([0, *(len(part.edges) for part in parts)])
    starts = np.concatenate([*(part.starts[:-1] + at for part, at in zip(parts, offsets)), offsets[-1:]])
    joined = [
        np.concatenate(columns) for columns in zip(*(part._replace(starts=starts[:0]) for part in parts))
    ]
    return faces, Removed(*joined)._replace(starts=starts)


@kernel
def _roundness(points, a, b, c):
    """Area over the sum of squared sides, 1 for an equilateral triangle in space."""
    square, x, y = 0.0, np.empty(3), np.empty(3)
    for k in range(3):
        x[k], y[k] = points[b, k] - points[a, k], points[c, k] - points[a, k]
        square += x[k] * x[k] + y[k] * y[k] + (y[k] - x[k]) * (y[k] - x[k])
    s, t, r = x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]
    return 2 * np.sqrt(3.0) * np.sqrt(s * s + t * t + r * r) / square


@kernel
def _ring(faces, around, v, ring):
    """Fills in the neighbours of v in order, counter-clockwise; how many, negative on the boundary, 0 if none is such.

    Args:
        faces: (m, 3) triangles.
        around: (d,) those of v.
        v: a vertex.
        ring: (DEGREE + 1,) written.
    """
    d = around.size
    ends, begin = np.empty((d, 2), np.int64), -1
    for i in range(d):
        t = around[i]
        k = 0 if faces[t, 0] == v else 1 if faces[t, 1] == v else 2
        ends[i, 0], ends[i, 1] = faces[t, (k + 1) % 3], faces[t, (k + 2) % 3]
    for i in range(d):
        first = True
        for j in range(d):
            first = first and ends[j, 1] != ends[i, 0]
        if first:
            if begin >= 0:
                return 0
            begin = i
    at = max(begin, 0)
    for i in range(d):
        ring[i] = ends[at, 0]
        following = -1
        for j in range(d):
            if ends[j, 0] == ends[at, 1]:
                following = j
        if following < 0:
            ring[i + 1] = ends[at, 1]
            return -(d + 1) if i == d - 1 else 0
        at = following
    return d if begin < 0 and at == 0 else 0


@kernel
def _round(faces, points, z, starts, around, blocked, most, vertex, into, triangle, weights, ends, edges):
    """Takes vertices out that are no neighbours; how many. Faces that go get a first corner of -1.

    Args:
        faces: (m, 3) changed.
        points: (n, 3) in space.
        z: (n,) layout.
        starts: (n + 1,) where the triangles of each vertex begin in `around`.
        around: (3m,) triangles of the vertices.
        blocked: (n,) vertices that stay, written.
        most: how many may go.
        vertex, into, triangle, weights, ends, edges: of `Removed`, written.
    """
    ring, number = np.empty(DEGREE + 1, np.int64), 0
    for v in range(z.size):
        d = starts[v + 1] - starts[v]
        if blocked[v] or d < 2 or d > DEGREE or number == most or number == vertex.size:
            continue
        star = around[starts[v] : starts[v + 1]]
        size = _ring(faces, star, v, ring)
        open_, size = size < 0, abs(size)
        # the neighbour onto which it goes with the roundest triangles left, none turned over
        best, into_ = THIN, -1
        for i in range(0, size, size - 1 if open_ else 1):
            w, worst = ring[i], 1.0
            for j in range(d):
                x, y = ring[j], ring[(j + 1) % size]
                if x != w and y != w:
                    worst = min(worst, _roundness(points, w, x, y)) if twice_area(z, w, x, y) > 0 else 0.0
            if worst > best:
                best, into_ = worst, w
        if into_ < 0:
            continue
        # where it lies in these, to be put back: in the triangle that it is farthest inside
        w, inside, end = into_, -np.inf, ends[number]
        vertex[number], into[number] = v, w
        for j in range(d):
            x, y = ring[j], ring[(j + 1) % size]
            edges[end + j, 0], edges[end + j, 1] = x, y
            if x != w and y != w:
                area = twice_area(z, w, x, y)
                p, q = twice_area(z, v, y, w) / area, twice_area(z, v, w, x) / area
                least = min(p, q, 1 - p - q)
                if least > inside:
                    inside = least
                    set_row(triangle, number, w, x, y)
                    set_row(weights, number, 1 - p - q, p, q)
        for i in range(size):
            blocked[ring[i]] = True
        for t in star:
            gone = faces[t, 0] == w or faces[t, 1] == w or faces[t, 2] == w
            for k in range(3):
                if faces[t, k] == v:
                    faces[t, k] = w
            if gone:
                faces[t, 0] = -1
        number += 1
        ends[number] = end + d
    return number


@kernel
def _bisector(edges, w, u):
    """Half the way between the first and the last of the other vertices around a hole as seen from w, on its rim."""
    first, angle = edges[0, 0], 0.0
    for e in range(len(edges)):
        if edges[e, 0] == w:
            first = edges[e, 1]
    for e in range(len(edges)):
        x, y = u[edges[e, 0]] - u[w], u[edges[e, 1]] - u[w]
        if edges[e, 0] != w and edges[e, 1] != w:
            angle += np.arctan2(cross(x, y), dot(x, y))
    return (u[first] - u[w]) * np.exp(0.5j * angle)


@kernel
def _room(edges, u, a, way):
    """The share of a way from a up to which it faces all edges from the left; 0 if it does not even begin so."""
    share = np.inf
    for e in range(len(edges)):
        x, y = u[edges[e, 0]] - a, u[edges[e, 1]] - a
        left, more = cross(x, y), cross(way, x - y)
        if x == 0 or y == 0:
            left = 0.0
        if more < 0 or left == more:
            share = min(share, max(left, 0.0) / -more if more < 0 else 0.0)
    return share


@kernel
def _pull(points, edges, v, u, theta):
    """The energy of the triangles around v, its gradient by the place of v, and its Hessian's entries xx, yy, xy."""
    energy, slope, xx, yy, xy = 0.0, 0j, 0.0, 0.0, 0.0
    for e in range(len(edges)):
        b, c = edges[e, 0], edges[e, 1]
        square, along, other = 0.0, 0.0, 0.0
        for k in range(3):
            p, q = points[b, k] - points[v, k], points[c, k] - points[v, k]
            square, along, other = square + p * p, along + p * q, other + q * q
        length = np.sqrt(square)
        height = np.sqrt(max(other - along * along / square, 0.0))
        scale, z = complex(0.0, -0.5 / (length * height)), complex(along / length, -height)
        beta, gamma = -scale * z, scale * length
        alpha = -beta - gamma
        x, y = u[b] - u[v], u[c] - u[v]
        f, g = beta * x + gamma * y, beta.conjugate() * x + gamma.conjugate() * y
        ff, gg, area = dot(f, f), dot(g, g), 0.5 * length * height
        if not ff > gg:
            return np.inf, slope, xx, yy, xy
        w, w_p, w_d, w_pp, w_pd, w_dd = density_derivatives(ff + gg, ff - gg, theta, 1.0, 0.0)
        f, g = 2 * alpha.conjugate() * f, 2 * alpha * g
        p, d, same = f + g, f - g, 4 * w_p * dot(alpha, alpha)
        energy += area * w
        slope += area * (w_p * p + w_d * d)
        xx += area * (same + w_pp * p.real**2 + 2 * w_pd * p.real * d.real + w_dd * d.real**2)
        yy += area * (same + w_pp * p.imag**2 + 2 * w_pd * p.imag * d.imag + w_dd * d.imag**2)
        xy += area * (
            w_pp * p.real * p.imag + w_pd * (p.real * d.imag + p.imag * d.real) + w_dd * d.real * d.imag
        )
    return energy, slope, xx, yy, xy


@kernel
def _settle(points, edges, v, u, theta):
    """Moves v by Newton's method to where the triangles around it have least energy, until a step gains little."""
    energy, slope, xx, yy, xy = _pull(points, edges, v, u, theta)
    while True:
        square = xx * yy - xy * xy
        if not (square > 0 and xx > 0):
            return
        step = -complex(yy * slope.real - xy * slope.imag, xx * slope.imag - xy * slope.real) / square
        at, share = u[v], min(1.0, 0.5 * _room(edges, u, u[v], step))
        u[v] = at + share * step
        below, slope, xx, yy, xy = _pull(points, edges, v, u, theta)
        if not below < energy:
            u[v] = at
            return
        if energy - below < SMALL * energy:
            return
        energy = below


@kernel
def put_back(vertex, into, corners, weights, starts, edges, points, theta, u):
    """Fills in the positions u (n,) of vertices that were taken out, the last one first; False where one has none.

    A hole is seen whole from the vertex that its own was drawn into. So there is room, if not on the way to where it
    was, then along the bisector. From there each goes where the triangles around it have least energy.
    """
    for number in range(vertex.size - 1, -1, -1):
        around, a, v = edges[starts[number] : starts[number + 1]], u[into[number]], vertex[number]
        way = -a
        for k in range(3):
            way += weights[number, k] * u[corners[number, k]]
        share = _room(around, u, a, way)
        if share == 0:
            way = _bisector(around, into[number], u)
            share = _room(around, u, a, way)
        u[v] = a + (way if share > 1 else 0.5 * share * way)
        _settle(points, around, v, u, theta)
        for e in range(len(around)):
            if not cross(u[around[e, 0]] - u[v], u[around[e, 1]] - u[v]) > 0:
                return False
    return True
