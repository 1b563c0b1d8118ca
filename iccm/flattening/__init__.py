"""Patches flattened into the plane: exactly least-squares conformal, conformal and one-to-one, or even.

method    `flatten`: which way is taken, and when; `even_layout`: an even layout of a flattening; `convex`: polygons
tutte     a start without folds: the outline on a circle, each vertex at the mean of its neighbours
free      Newton on the balanced energy of a surface with a free boundary
coarsening  the same by way of coarser triangulations of large surfaces
scaffold  triangles around a layout, and in its holes, that keep it from overlapping
seams     where a cut is lengthened
opening   triangles and polygons of a layout set right by moving single vertices
interpolation  `morph`: shapes between two, by the metric of a map between them
of_arrays  `iccm.flatten`: meshes that are there as arrays
whole     all pieces of a mesh, packed side by side
charts    the charts of a mesh's own texture coordinates, as flattenings
"""

from .method import METHODS, convex, even_layout, flatten

__all__ = ["METHODS", "convex", "even_layout", "flatten"]
