"""Triangles at the boundary without room: all corners on a straight or hollow side, or cut off by a corner of it."""

import numpy as np

from ..arrays import Complex, Index
from ..meshes.topology import Triangles
from ..plane import cross, triangle_areas

ROUNDS = 20  # of lifting; one does unless such triangles lie behind one another
RIM = 1e-3  # of the outline's diagonal, the default tolerance: how far a vertex may be moved out of it
HEIGHT = 1e-4  # of a triangle that is lifted, of its base: far above what files round to
LEAST = 2e-7  # and of the diagonal: single precision's ulp at 1 is 1.2e-7
HEIGHTS = (0.1, 0.01, HEIGHT)  # of triangles that are opened, as high as there is room for (by hand)
STEPS = 1000  # of looking for that room: acute rooms are approached slowly


def lift(flat: Complex, faces: Index, loop: Index, diagonal: float) -> Complex:
    """Positions (n,) in which the corners of such triangles stand out of the outline by as little as lets them face up.

    Args:
        flat: positions, those of the loop on an outline.
        faces: (m, 3) triangles.
        loop: vertices of the outline, counter-clockwise.
        diagonal: of the outline; triangles that need more than RIM of it stay as they are.
    """
    place = np.full(flat.size, -1)
    place[loop] = np.arange(loop.size)
    faces = faces[(place[faces] >= 0).all(axis=1)]
    ways = _gaps(place[faces], loop.size)
    tip = np.argmax(ways, axis=1)  # opposite to the side beyond which most of the surface lies
    tips, heads, tails = (np.take_along_axis(faces, ((tip + k) % 3)[:, None], 1)[:, 0] for k in range(3))
    moved = flat.copy()
    for _ in range(ROUNDS):
        base = moved[tails] - moved[heads]
        height = cross(base, moved[tips] - moved[heads]) / np.maximum(np.abs(base), 1e-300)
        short = np.maximum(HEIGHT * np.abs(base), LEAST * diagonal) - height
        low = np.flatnonzero(short > 0)
        if not low.size:
            break
        moved[tips[low]] += 1j * (base / np.abs(base))[low] * (1.01 * short[low])
    far = np.abs(moved - flat) > RIM * diagonal
    return np.where(far, flat, moved)


def open_up(flat: Complex, faces: Index) -> Complex:
    """Positions (n,) in which triangles face up that faced down, where moving one inner corner is enough.

    Where the outline turns between two vertices of the boundary, the straight edge between them cuts its corner off,
    and with it what lies there. Such a vertex goes to a point from which all around it face up: half-planes are
    projected into in turn, the one missed most first. Others stay as they are.

    Args:
        flat: positions.
        faces: (m, 3) triangles, most of them counter-clockwise.
    """
    down = triangle_areas(flat[faces]) <= 0
    if not down.any():
        return flat
    moved, shape = flat.copy(), Triangles(faces, flat.size)
    for vertex in np.setdiff1d(faces[down], shape.tail[shape.twin < 0]):
        ring = faces[(faces == vertex).any(axis=1)]
        first = np.argmax(ring == vertex, axis=1)
        heads, tails = (moved[np.take_along_axis(ring, ((first + k) % 3)[:, None], 1)[:, 0]] for k in (1, 2))
        places = (_room(moved[vertex], heads, tails, height) for height in HEIGHTS)
        moved[vertex] = next((place for place in places if place is not None), moved[vertex])
    return moved


def _room(z: complex, heads: Complex, tails: Complex, height: float) -> complex | None:
    """A point height times their length or more to the left of all edges from heads to tails; None if none is found."""
    base = tails - heads
    length = np.maximum(np.abs(base), 1e-300)
    for _ in range(STEPS):
        short = height * length - cross(base, z - heads) / length
        most = int(np.argmax(short))
        if short[most] <= 0:
            return z
        z += 1j * base[most] / length[most] * (short[most] + height * length[most])
    return None


def _gaps(places: Index, length: int) -> Index:
    """(m, 3) how many edges of the boundary lie between the two other corners, on the side away from each one."""
    return np.mod(np.roll(places, -2, axis=1) - np.roll(places, -1, axis=1), length)
