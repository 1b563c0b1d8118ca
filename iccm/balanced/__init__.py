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
"""

from .errors import NoMapError
from .method import solve
from .minimise.terms import Term, TermOnMesh
from .model.solution import Solution

__all__ = ["NoMapError", "Solution", "Term", "TermOnMesh", "solve"]
