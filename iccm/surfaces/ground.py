"""A surface in space as the target of Newton's method, with triangles in its holes."""

from dataclasses import replace

import numpy as np

from ..balanced.minimise.in_space import Ground
from ..flattening.scaffold import filling
from ..meshes.flatten import Flattening
from ..meshes.locate import Locator
from ..meshes.mesh import with_unit_area
from ..meshes.topology import Triangles
from ..plane import Similarity


def ground_of(layout: Flattening, similarity: Similarity) -> Ground:
    """Return a layout without folds as Newton's target, in unit coordinates; the surface's area is scaled to one.

    Holes are covered with triangles.
    """
    patch = layout.patch
    points = with_unit_area(patch.points, patch.faces)
    holes = [loop for loop in patch.loops if not np.isin(loop, layout.loop).all()]
    faces = np.concatenate([patch.faces, *(filling(layout.flat, hole) for hole in holes)])
    covered = replace(patch, triangles=Triangles(faces, len(points))) if holes else patch
    return Ground.of(Locator(replace(layout, patch=covered, flat=similarity(layout.flat))), points)
