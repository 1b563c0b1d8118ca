"""Edge flips that decrease a map's energy."""

import numpy as np

from tests.core.reference.flips import dot, flip, opposite, push, twice_area
from tests.core.reference.minimise import density

GAIN, THIN = 1e-6, 1e-14


def flip_to_lower_energy(z, u, faces, across, stack, fixed, border, links, theta, q, share):
    """Flip edges, beginning with the triangles on the stack, as long as that decreases the energy.

    Args:
        z: (n,) vertices.
        u: (n,) their images.
        faces: (t, 3) triangles, written.
        across: (t, 3) their neighbours, written.
        stack: triangles to inspect, after their number; emptied.
        fixed: (t,) triangles that are not changed.
        border: number of vertices on outlines.
        links: (c,) the vertex to which each of the first c is joined by an edge that is kept.
        theta, q, share: of the density.
    """
    while stack[0] > 0:
        t = stack[stack[0]]
        stack[0] -= 1
        for k in range(3):
            v = across[t, k]
            if v < 0 or fixed[t] or fixed[v]:
                continue
            a, b, c = faces[t, k], faces[t, (k + 1) % 3], faces[t, (k + 2) % 3]
            d = faces[v, opposite(faces, v, b, c)]
            if (a < border and d < border) or joined(links, b, c):
                continue
            after = energy(z, u, a, b, c, theta, q, share) + energy(z, u, d, c, b, theta, q, share)
            before = energy(z, u, a, b, d, theta, q, share) + energy(z, u, a, d, c, theta, q, share)
            if before < (1 - GAIN) * after:
                flip(faces, across, t, k)
                push(stack, t)
                push(stack, v)
                break


def joined(links, a, b):
    return a < links.size and b < links.size and (links[a] == b or links[b] == a)


def energy(z, u, a, b, c, theta, q, share):
    """Return the energy of a triangle; infinite if it or its image is flipped or has almost no area."""
    area, image = twice_area(z, a, b, c), twice_area(u, a, b, c)
    if area <= THIN or image <= THIN:
        return np.inf
    # |f_z|² + |f_z̄|² is half the sum of the squared singular values of the affine map
    ab, ac, first, second = z[b] - z[a], z[c] - z[a], u[b] - u[a], u[c] - u[a]
    d = image / area
    e, f, g = dot(ab, ab), dot(ab, ac), dot(ac, ac)
    p = (g * dot(first, first) - 2 * f * dot(first, second) + e * dot(second, second)) / (2 * area * area)
    return 0.5 * area * density(p, d, theta, q, share)
