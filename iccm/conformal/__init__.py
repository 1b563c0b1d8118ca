"""The conformal method: a conformal map onto the target, to a tolerance.

method            the stages: a start, vertices, Newton's method, a measured gap
harmonic_measure  boundary values of the Riemann map, by finite elements
triangulation     the finite elements' triangles
panels            division of a boundary into panels, small at corners and in thin parts
correspondence    both boundaries as circles, and a map between these
normalisation     the three free real parameters
symmetry          maps that commute with the reflections of both shapes
vertices          boundary vertices with an even error of linear interpolation
riemann_hilbert   Newton's method for the correspondence
relaxation        the relaxation of the correspondence, as a Riemann-Hilbert problem
"""

from .method import solve

__all__ = ["solve"]
