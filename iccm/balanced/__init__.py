"""--method balanced: maps whose outline is held, with nothing folded, the size even and the picture upright.

solution       what is asked (Settings), what is given (Solution)
method         solve(): frames, stages, checks in the numbers that are returned
stages         coarse starts, fine mesh, last mesh; halves of symmetric pairs; the inverse where that is easier
last_mesh      the fine mesh and the last one, with every vertex of both outlines
levels         one level of outlines and mesh size: meshes for correspondences, carrying a map to a finer mesh
racing         from many coarse maps to the best one
starts         correspondences to start from            pairs      arclength pairs that a mesh's outline is made of
discrete       a map in the making: mesh, image, steps   untangle   a first map without folds
newton         projected Newton with a sliding outline   sliding    directions and energy of the outline's vertices
energy         the density, its derivatives, assembly    cholesky   block factors of Newton's matrices
mesh, delaunay quality triangulations                    sizing     smaller triangles where the map magnifies
constraints    pins and strokes: given, inside (vertices), meeting them, routes around, continuation of an earlier map
deform         shapes moved by pins and strokes alone, their outlines free
discs          starts by way of a disc                  drawn       bounds on the patches that are drawn, notes
frames, outline, symmetry, similar, transfer, measures, orientation: what their names say
"""

from .failure import NoMapError
from .method import solve
from .solution import Settings, Solution

__all__ = ["NoMapError", "Settings", "Solution", "solve"]
