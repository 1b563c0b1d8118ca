"""What a map between planar domains is: the exact harmonic ones, and the triangulated ones that are drawn.

cauchy_green      coordinates of a polygon, their derivatives, and sums of them at many points
harmonic          HarmonicMap: value and derivatives
refinement        triangulations of a polygon's inside that are refined where they are asked to be
folds             which sheet of a folded map is seen
approximation     harmonic maps as triangulated ones, to a stated error
inverse           the exact inverse of a harmonic map
extended_inverse  bulk inversion, with a count of what lay outside
enclosure, injectivity  what is certain about a harmonic map being one-to-one, and on what part of the source
distortion        stretch, scale, dilatation and turn over the target's area, of both kinds of maps
bezier_fit, bounds, boundary_image
triangulated/     TriangulatedMap

z is in the source's plane, w in the target's, arrays are complex and (p,). Both kinds have `map(z)`, `derivatives(z)`
and `jet(z, threads)`, f, f_z and f_z̄ at once. What is drawn, written or inverted in bulk knows triangulated maps alone;
`approximation.triangulated` makes one of a harmonic map.
"""
