"""Maps between planar domains: exact harmonic maps, and triangulated maps.

z is in the source's plane, w in the target's; arrays are complex (p,). Both kinds have `map(z)`,
`derivatives(z)` and `jet(z, threads)`, which returns f, f_z and f_z̄ at once. Code that draws, writes or
inverts many points uses triangulated maps only; `approximation.triangulated` converts a harmonic map to one.

cauchy_green      the paper's coordinates and their derivatives, and sums of them at many points
harmonic          harmonic maps with given coefficients; dilatation and scale
inverse           the exact inverse of a harmonic map
enclosure         bounds for derivatives and for the image of a curve, for certificates
injectivity       a certificate that a harmonic map is one-to-one
triangulated/     maps given by two triangulations
refinement        triangulations of a polygon, with marked edges refined
folds             the visible sheet of a folded map
approximation     approximation of harmonic maps by triangulated ones, to a given error
composition       several maps, one after the other, as one
extended_inverse  preimages of points in the image and just outside
boundary_image    the image of the boundary, to a given flatness
moved_rings       images of closed polylines inside the source
bounds            bounds on stretch and dilatation of triangulated maps
fields            fields of positive numbers over the plane, from pictures
regions           rigid regions, and figures about them
distortion        figures of distortion, over the target's area
figure            the matplotlib figure of a map
summary           the figures of a report in words
bezier_fit        images of curves under a map, as cubic Béziers
arc_fit           the same, as lines and circular arcs
joined            maps of several parts as one triangulation that is not connected, to be saved as one map
"""
