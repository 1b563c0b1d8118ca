"""The balanced energy and its minimisation, independent of levels and candidates.

energy     the density, its gradient and its projected Hessian, triangle by triangle
in_space   the energy of a map onto a surface in space
sliding    constrained vertices: held, or sliding along a curve with an energy for its parametrization
upright    the cost of rotating the picture
soft_pins  patches of soft pins, as terms of the energy
terms      further terms of the energy, written in NumPy
newton     projected Newton with a line search that never folds a triangle
untangle   a first map without folds
unfold     folds removed locally
"""
