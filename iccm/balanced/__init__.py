"""The balanced method: maps between outlines, without folds, with uniform scale and an upright picture.

fit           the method as `iccm.fit` calls it
method        `solve`: unit coordinates, the search, checks of the returned numbers
motion        an earlier map adapted to outlines that moved
cartogram     areas prescribed by a size map
coarse        coarse maps, with which pairs of outlines are compared
interactive   a coarse map that follows its pins while they are dragged
warped        a map that is kept, with a deformation of its target after it that follows pins
deform/       deformations by pins and strokes, without a target
rigid/        regions that are mapped by similarities
search/       the search for a good map, from candidates to the final mesh
holes/        holes of both domains
constraints/  pins and strokes
model/        the discrete map that a solve works on
minimise/     the energy and Newton's method
meshing/      meshes of a domain
injectivity   checks of the result: no folds, simple outlines
errors        exceptions of the solver

Names are imported when first used: flattening needs the energy, but not the search for maps between outlines.
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .errors import NoMapError as NoMapError
    from .method import solve as solve
    from .minimise.terms import Term as Term
    from .minimise.terms import TermOnMesh as TermOnMesh
    from .model.solution import Solution as Solution

_HOME = {
    "NoMapError": "errors",
    "Solution": "model.solution",
    "Term": "minimise.terms",
    "TermOnMesh": "minimise.terms",
    "solve": "method",
}
__all__ = sorted(_HOME)


if not TYPE_CHECKING:  # a type checker assumes that a module with __getattr__ has every name

    def __getattr__(name):
        if name not in _HOME:
            raise AttributeError(f"module 'iccm.balanced' has no attribute {name!r}")
        return getattr(import_module(f".{_HOME[name]}", __name__), name)


def __dir__() -> list[str]:
    return sorted({*(name for name in globals() if name.startswith("__")), *__all__})
