"""Triangulations for tests, and maps made from them."""

from fractions import Fraction

import numpy as np
from scipy.spatial import ConvexHull, Delaunay

from iccm.curve import Curve
from iccm.maps.triangulated.map import TriangulatedMap
from tests.shapes import refined


def spiral_points(n):
    """Return (n, 3) evenly distributed points of the unit sphere."""
    k = np.arange(n) + 0.5
    high, turn = 1 - 2 * k / n, np.pi * (1 + 5**0.5) * k
    return np.column_stack([np.cos(turn) * (1 - high**2) ** 0.5, np.sin(turn) * (1 - high**2) ** 0.5, high])


def hull(points):
    """(m, 3) triangles of the convex hull of points around the origin, counter-clockwise from outside."""
    faces = ConvexHull(points).simplices
    a, b, c = points[faces.T]
    inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), a + b + c) < 0
    return np.where(inward[:, None], faces[:, ::-1], faces)


def lattice(n):
    """Points, faces and loops of the square from 0 to 1 + i, divided into n × n × 2 triangles; the loop starts at 0."""
    x, y = np.meshgrid(np.arange(n + 1) / n, np.arange(n + 1) / n)
    number = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    a, b, c, d = (
        number[:-1, :-1].ravel(),
        number[:-1, 1:].ravel(),
        number[1:, 1:].ravel(),
        number[1:, :-1].ravel(),
    )
    loop = np.concatenate([number[0, :-1], number[:-1, -1], number[-1, :0:-1], number[:0:-1, 0]])
    return (x + 1j * y).ravel(), np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]), (loop,)


def irregular(polygon, h, seed=0):
    """The same for a polygon, with edges of about h and scattered points."""
    polygon = refined(polygon, max(1, round(Curve(polygon).length / len(polygon) / h)))
    rng = np.random.default_rng(seed)
    low, high = Curve(polygon).box
    x, y = np.meshgrid(np.arange(low.real, high.real, h), np.arange(low.imag, high.imag, 0.87 * h))
    x[::2] += 0.5 * h
    inner = (x + 1j * y).ravel() + 0.2 * h * (rng.uniform(-1, 1, x.size) + 1j * rng.uniform(-1, 1, x.size))
    curve = Curve(polygon)
    inner = inner[curve.contains(inner)]
    inner = inner[curve.distances(inner) > 0.5 * h]
    z = np.concatenate([polygon, inner])
    faces = Delaunay(np.column_stack([z.real, z.imag])).simplices.astype(np.int64)
    faces = faces[curve.contains(z[faces].mean(axis=1))]
    u, v = z[faces[:, 1]] - z[faces[:, 0]], z[faces[:, 2]] - z[faces[:, 0]]
    turn = u.real * v.imag - u.imag * v.real
    faces[turn < 0] = faces[turn < 0][:, ::-1]
    flat = np.abs(turn) < 1e-9 * h * h
    return z, faces[~flat], (np.arange(polygon.size),)


def ring(n, m):
    """The same for a ring between radii 1 and 2, with n points around and m steps across; the hole's loop is
    clockwise.
    """
    angle, radius = np.meshgrid(2 * np.pi * np.arange(n) / n, 1 + np.arange(m + 1) / m)
    number = np.arange(n * (m + 1)).reshape(m + 1, n)
    a, d = number[:-1].ravel(), number[1:].ravel()
    b, c = np.roll(number[:-1], -1, 1).ravel(), np.roll(number[1:], -1, 1).ravel()
    faces = np.concatenate([np.stack([a, c, b], 1), np.stack([a, d, c], 1)])
    return (radius * np.exp(1j * angle)).ravel(), faces, (number[-1], number[0, ::-1])


def wavy(w):
    """A map of the plane near the unit square, one-to-one and not linear: the inverse to reproduce."""
    return w + 0.12 * w**2 + 0.1 * np.sin(2 * w.real) * (1 + 0.3j) + 0.15j * w.imag * w.real


def wavy_derivatives(w):
    """Its derivatives by w and w̄."""
    u, v = w.real, w.imag
    by_x = 1 + 0.24 * w + 0.2 * np.cos(2 * u) * (1 + 0.3j) + 0.15j * v
    by_y = 1j * (1 + 0.24 * w) + 0.15j * u
    return 0.5 * (by_x - 1j * by_y), 0.5 * (by_x + 1j * by_y)


def map_of(mesh, inverse, **options):
    """The map with given (points, faces, loops) in the image, whose inverse maps the points as given."""
    w, faces, loops = mesh
    return TriangulatedMap(inverse(w), w, faces, loops, **options)


def scattered(map, count, seed=0):
    """Triangles (count,) and barycentric coordinates (count, 3): inside, on edges and at corners."""
    rng = np.random.default_rng(seed)
    place = rng.dirichlet([0.5] * 3, count)
    numbers = np.arange(count)
    place[numbers[::3], rng.integers(0, 3, numbers[::3].size)] = 0
    place[::7] = np.eye(3)[rng.integers(0, 3, numbers[::7].size)]
    return rng.integers(0, len(map.faces), count), place / place.sum(axis=1, keepdims=True)


def exact_turn(a, b, c):
    """The sign of the area of the triangle a, b, c, by fractions."""
    (ax, ay), (bx, by), (cx, cy) = (
        (Fraction(p.real), Fraction(p.imag)) for p in (complex(a), complex(b), complex(c))
    )
    value = (ax - cx) * (by - cy) - (ay - cy) * (bx - cx)
    return (value > 0) - (value < 0)
