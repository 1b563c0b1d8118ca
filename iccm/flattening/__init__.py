"""Flatten patches into the plane: exact least-squares conformal, one-to-one conformal, or even.

method         `flatten`: choice of the method; `even_layout`: the even layout of a patch; `convex`: convex polygons
tutte          an initial layout without folds: the outline on a circle, each vertex at the mean of its neighbours
free           Newton's method for the balanced energy of a surface with a free boundary
coarsening     coarser triangulations of large surfaces, and the way back
multigrid      relaxation of large surfaces on coarser triangulations first, of huge ones without factorisations of them
scaffold       triangles around a layout and in its holes that keep it from overlapping
seams          where to lengthen a cut
opening        repair of flipped triangles and non-convex polygons by moving single vertices
interpolation  `morph`: shapes between two, by interpolating the metric of a map
of_arrays      `iccm.flatten`: meshes given as arrays
segmentation   pieces divided into charts, so that all of each gets a place
whole          all pieces of a mesh, packed side by side
charts         the charts of a mesh's own texture coordinates as flattenings
unfolding      cut a hard surface into nets: rigid unfoldings of its flat faces along the fewest and shortest seams
bisection      divide a surface in two where both halves are flatter, along a short seam
"""

from .method import METHODS, convex, even_layout, flatten

__all__ = ["METHODS", "convex", "even_layout", "flatten"]
