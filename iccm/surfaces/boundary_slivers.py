"""Triangles at the boundary without room: all corners on a straight or hollow side, or cut off by a corner of it."""

import numpy as np

from ..arrays import Complex, Index
from ..balanced.minimise.unfold import unfold_on
from ..flattening.opening import open_up, tuck_in
from ..meshes.flatten import Flattening
from ..plane import cross

LIFTING_ROUNDS = 20  # of lifting; one does unless such triangles lie behind one another
MOST_MOVED_SHARE = (
    1e-3  # of the outline's diagonal, the default tolerance: how far a vertex may be moved out of it
)
HEIGHT_SHARE = 1e-4  # of a triangle that is lifted, of its base: far above what files round to
LEAST_HEIGHT_SHARE = 2e-7  # and of the diagonal: single precision's ulp at 1 is 1.2e-7


def with_room(image: Complex, layout: Flattening, diagonal: float) -> Complex:
    """Return images (n,) of a layout's vertices; triangles and polygons have room that the outline leaves them none
    for.

    `diagonal` is the outline's; see `lift`, `open_up` and `tuck_in`.
    """
    patch = layout.patch
    every = np.concatenate([patch.faces, patch.fans[0]])
    lifted = lift(image, every, layout.loop, diagonal)
    least, rim = LEAST_HEIGHT_SHARE * diagonal, np.concatenate(patch.loops)
    opened = tuck_in(open_up(lifted, patch, rim), patch, MOST_MOVED_SHARE * diagonal, least)
    held = np.zeros(image.size, bool)
    held[rim] = True
    for faces in (every, patch.faces):
        opened = unfold_on(opened, faces, held, patch.points, least)
    return opened


def lift(flat: Complex, faces: Index, loop: Index, diagonal: float) -> Complex:
    """Positions (n,) in which the corners of such triangles stand out of the outline by as little as lets them face up.

    Args:
        flat: positions, those of the loop on an outline.
        faces: (m, 3) triangles.
        loop: vertices of the outline, counter-clockwise.
        diagonal: of the outline; triangles that need more than MOST_MOVED_SHARE of it stay as they are.
    """
    place = np.full(flat.size, -1)
    place[loop] = np.arange(loop.size)
    faces = faces[(place[faces] >= 0).all(axis=1)]
    ways = _gaps(place[faces], loop.size)
    tip = np.argmax(ways, axis=1)  # opposite to the side beyond which most of the surface lies
    tips, heads, tails = (np.take_along_axis(faces, ((tip + k) % 3)[:, None], 1)[:, 0] for k in range(3))
    moved = flat.copy()
    for _ in range(LIFTING_ROUNDS):
        base = moved[tails] - moved[heads]
        height = cross(base, moved[tips] - moved[heads]) / np.maximum(np.abs(base), 1e-300)
        short = np.maximum(HEIGHT_SHARE * np.abs(base), LEAST_HEIGHT_SHARE * diagonal) - height
        low = np.flatnonzero(short > 0)
        if not low.size:
            break
        moved[tips[low]] += 1j * (base / np.abs(base))[low] * (1.01 * short[low])
    far = np.abs(moved - flat) > MOST_MOVED_SHARE * diagonal
    return np.where(far, flat, moved)


def _gaps(places: Index, length: int) -> Index:
    """Return (m, 3) how many edges of the boundary lie between the two other corners, on the side away from each
    one.
    """
    return np.mod(np.roll(places, -2, axis=1) - np.roll(places, -1, axis=1), length)
