"""`--method conformal`: the conformal map onto the target, to a tolerance, from its own start and vertices.

method            the method: a start, vertices, Newton, a measured gap
harmonic_measure  boundary values of the Riemann map, by finite elements
triangulation     the finite elements' triangles
panels            a boundary divided: small panels at corners and in thin parts
correspondence    both boundaries as circles, and a map between these
normalisation     the three free real parameters
vertices          boundary vertices where linear interpolation needs them
riemann_hilbert   Newton's method for the correspondence
relaxation        its relaxation, as a Riemann-Hilbert problem
"""
