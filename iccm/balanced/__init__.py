"""--method balanced: maps whose outline is held, with nothing folded, the size even and the picture upright.

fit           the method as `iccm.fit` calls it
method        `solve`: unit coordinates, the search, checks in the numbers that are returned
motion        an earlier map carried along as outlines move
cartogram     the areas that sizes ask for
coarse        coarse maps, by which pairs of outlines are compared
rings         a ring opened by a seam, where the other shape is none
interactive   a coarse map that follows its pins while they are moved
deform/       shapes moved by pins and strokes alone
rigid/        regions that a map moves as wholes
search/       how a good map is found, from candidates to the final mesh
holes/        holes of both domains
constraints/  pins and strokes
model/        a map in the making
minimise/     the energy and Newton's method
meshing/      meshes of a domain
injectivity   checks of what is returned: no folds, simple outlines
errors        how a solve can fail
"""

from .errors import NoMapError
from .method import solve
from .minimise.terms import Term, TermOnMesh
from .model.settings import Settings, Solution

__all__ = ["NoMapError", "Settings", "Solution", "Term", "TermOnMesh", "solve"]
