"""Maps between planar domains: the exact harmonic ones, and the triangulated ones that are drawn.

z is in the source's plane, w in the target's, arrays are complex and (p,). Both kinds have `map(z)`, `derivatives(z)`
and `jet(z, threads)`, f, f_z and f_z̄ at once. What is drawn, written or inverted in bulk knows triangulated maps alone;
`approximation.triangulated` makes one of a harmonic map.

cauchy_green      the coordinates of the paper and their derivatives, and sums of them at many points
harmonic          harmonic maps by their coefficients; dilatation and scale
inverse           the exact inverse of a harmonic map
enclosure         derivatives and the image of a curve enclosed, for certificates
injectivity       a certificate that a harmonic map is one-to-one
triangulated/     maps given by two triangulations
refinement        triangulations of a polygon, refined where they are asked to be
folds             which sheet of a folded map is seen
approximation     harmonic maps as triangulated ones, to a stated error
extended_inverse  preimages of points in the image and just outside
boundary_image    the image of the boundary, as finely as asked
moved_rings       closed polylines inside the source where a map takes them
bounds            bounds on stretch and dilatation of triangulated maps
fields            numbers over the plane, as pictures give them
regions           rigid regions, and the figures that judge them
distortion        figures of distortion, over the target's area
figure            the figure of a map, as matplotlib has figures
summary           the figures of a report in words
bezier_fit        curves carried through a map, as cubic Béziers
"""
