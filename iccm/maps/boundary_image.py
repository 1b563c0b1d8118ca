"""The image of the source's boundary, to a given flatness."""

import numpy as np

from ..arrays import Complex
from .harmonic import HarmonicMap

HALVING_ROUNDS = 40  # of halving: 2 ** -40 of an edge is comparable to rounding
FIRST_PARTS = 3  # initial parts of each edge
# Points: the image under an irregular map could need more than is useful.
MOST_POINTS = 400_000


def outline(map: HarmonicMap, flatness: float) -> Complex:
    """Return (k,) the image of the polygon as a closed polyline.

    Its deviation from the image is about `flatness`, in units of the target.
    """
    map, _, shift = map.centred()
    z = map.polygon
    steps = np.repeat((np.roll(z, -1) - z) / FIRST_PARTS, FIRST_PARTS)
    places = np.arange(steps.size, dtype=float)  # along the polygon, in steps
    starts = np.repeat(z, FIRST_PARTS) + places % FIRST_PARTS * steps
    first = map.jet_inside(starts)[0]
    last, samples = np.roll(first, -1), [(places, first)]
    for k in range(1, HALVING_ROUNDS):
        middle = map.jet_inside(starts + 0.5 * steps)[0]
        samples.append((places + 0.5**k, middle))
        rough = np.abs(middle - 0.5 * (first + last)) > flatness
        if not rough.any() or sum(w.size for _, w in samples) + 2 * rough.sum() > MOST_POINTS:
            break
        steps = np.tile(0.5 * steps[rough], 2)
        starts = np.append(starts[rough], starts[rough] + steps[: rough.sum()])
        places = np.append(places[rough], places[rough] + 0.5**k)
        first, last = np.append(first[rough], middle[rough]), np.append(middle[rough], last[rough])
    places, w = (np.concatenate(part) for part in zip(*samples))
    return w[np.argsort(places)] + shift
