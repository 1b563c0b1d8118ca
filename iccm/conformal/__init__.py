"""`--method conformal`: the conformal map onto the target, to a tolerance, from its own start and vertices."""
