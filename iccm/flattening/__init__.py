"""Patches laid out in the plane: exactly least-squares conformal, conformal and one-to-one, or even.

method     flatten(): which way is taken, and when; even(): the even layout of what is laid out
tutte      a start without folds: the outline on a circle, each vertex at the mean of its neighbours
free       Newton on the balanced energy of a surface, its boundary free
scaffold   triangles outside of the outline and in the holes that keep them from overlapping
seams      where a cut is lengthened
"""

from .method import METHODS, even, flatten

__all__ = ["METHODS", "even", "flatten"]
