"""Make room for triangles at the boundary that the outline leaves flat or flipped.

This happens to triangles whose corners all lie on a straight or concave part of the outline, and to those that a chord
between boundary vertices cuts off.
"""

import numpy as np

from ..arrays import Complex, Index
from ..balanced.minimise.unfold import unfold_on
from ..flattening.opening import open_up, tuck_in
from ..meshes.flatten import Flattening
from ..plane import cross

LIFTING_ROUNDS = 20  # rounds of lifting; one is enough unless such triangles lie behind one another
MOST_MOVED_SHARE = 1e-3
"""Default tolerance, a share of the outline's diagonal: how far a vertex may leave the outline."""
HEIGHT_SHARE = 1e-4  # of its base: height given to a triangle, far more than the rounding of files
LIFT_FACTOR = 1.01  # of what a height lacks, so that rounding does not leave it short
LEAST_HEIGHT_SHARE = 2e-7  # of the diagonal: least such height; the ulp of single precision at 1 is 1.2e-7


def with_room(image: Complex, layout: Flattening, diagonal: float) -> Complex:
    """Move vertices (n,) of a layout's image so that flat and flipped triangles and polygons face up where possible.

    Boundary vertices leave the outline only where it leaves no room, see `lift`, `open_up` and `tuck_in`. `diagonal` is
    the outline's. Returns the new positions (n,).
    """
    patch = layout.patch
    every = np.concatenate([patch.faces, patch.fans[0]])
    lifted = lift(image, every, layout.loop, diagonal)
    least, rim = LEAST_HEIGHT_SHARE * diagonal, np.concatenate(patch.loops)
    opened = tuck_in(open_up(lifted, patch, rim), patch, MOST_MOVED_SHARE * diagonal, least)
    fixed = np.zeros(image.size, bool)
    fixed[rim] = True
    for faces in (every, patch.faces):
        opened = unfold_on(opened, faces, fixed, patch.points, least)
    return opened


def lift(flat: Complex, faces: Index, loop: Index, diagonal: float) -> Complex:
    """Move boundary corners just far enough off the outline for their triangles to face up.

    Only triangles with all three corners on the loop are considered.

    Args:
        flat: (n,) positions; those of the loop are on an outline.
        faces: (m, 3) triangles.
        loop: vertices of the outline, counter-clockwise.
        diagonal: of the outline. Vertices that would move more than MOST_MOVED_SHARE of it stay where they are.

    Returns:
        (n,) new positions.
    """
    place = np.full(flat.size, -1)
    place[loop] = np.arange(loop.size)
    faces = faces[(place[faces] >= 0).all(axis=1)]
    # The tip is the corner to lift: the one opposite the side beyond which most of the surface lies.
    tip = np.argmax(_gaps(place[faces], loop.size), axis=1)
    rows = np.arange(len(faces))
    tips, firsts, seconds = faces[rows, tip], faces[rows, (tip + 1) % 3], faces[rows, (tip + 2) % 3]
    lifted = flat.copy()
    for _ in range(LIFTING_ROUNDS):
        base = lifted[seconds] - lifted[firsts]
        length = np.abs(base)
        along = base / np.where(
            length > 0, length, 1
        )  # 0 where both ends are at one point: no direction lifts there
        height = cross(along, lifted[tips] - lifted[firsts])
        short = np.maximum(HEIGHT_SHARE * length, LEAST_HEIGHT_SHARE * diagonal) - height
        low = np.flatnonzero((short > 0) & (length > 0))
        if not low.size:
            break
        # Of triangles with the same tip one counts; the others follow in the next rounds.
        lifted[tips[low]] += 1j * along[low] * (LIFT_FACTOR * short[low])
    is_far = np.abs(lifted - flat) > MOST_MOVED_SHARE * diagonal
    return np.where(is_far, flat, lifted)


def _gaps(places: Index, length: int) -> Index:
    """Count boundary edges between the two other corners of each corner, on the side away from that corner: (m, 3)."""
    return np.mod(np.roll(places, -2, axis=1) - np.roll(places, -1, axis=1), length)
