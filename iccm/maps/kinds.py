"""The kinds of maps, and what each is asked for evaluation, inversion and a certificate."""

from ..arrays import Complex
from . import injectivity
from .evaluate import Evaluator
from .harmonic import HarmonicMap
from .injectivity import Certificate
from .inverse import Inverse
from .triangulated.map import TriangulatedMap

AnyMap = HarmonicMap | TriangulatedMap
Evaluated = Evaluator | TriangulatedMap
Inverted = Inverse | TriangulatedMap


def evaluated(map: AnyMap | Evaluated) -> Evaluated:
    """The map made ready for many evaluations: `jet`, `derivatives` and the call, with threads."""
    return Evaluator(map) if isinstance(map, HarmonicMap) else map


def inverted(map: AnyMap | Evaluated) -> Inverted:
    """The map made ready for many inversions: `extended_inverse`."""
    return map if isinstance(map, TriangulatedMap) else Inverse(map)


def certified(map: AnyMap | Evaluated) -> Certificate:
    """What is proven about the map being one-to-one."""
    return map.injectivity if isinstance(map, TriangulatedMap) else injectivity.certify(map)


def rims(map: AnyMap | Evaluated) -> list[Complex]:
    """Vertices of the source's boundaries: the outer one, counter-clockwise, then those of holes, clockwise."""
    return map.rims if isinstance(map, TriangulatedMap) else [map.polygon]
