"""The balanced energy and its minimisation; nothing here knows of levels or candidates.

energy     the density, its gradient and its projected Hessian, triangle by triangle
sliding    vertices that slide along a curve, and the curve's own energy
newton     projected Newton with a line search that never folds a triangle
untangle   a first map without folds
"""
