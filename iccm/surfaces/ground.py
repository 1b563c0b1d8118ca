"""A surface in space as the target of Newton's method, with triangles in its holes."""

from dataclasses import replace

import numpy as np

from ..balanced.minimise.in_space import Ground
from ..flattening.scaffold import filling
from ..meshes.flatten import Flattening
from ..meshes.locate import Locator
from ..meshes.mesh import face_areas
from ..meshes.topology import Triangles
from ..plane import Similarity


def ground_of(layout: Flattening, frame: Similarity) -> Ground:
    """Of a layout without folds, in the unit coordinates of a frame; the surface's area is taken as one."""
    patch = layout.patch
    points = patch.points / np.sqrt(face_areas(patch.points[patch.faces]).sum())
    holes = [loop for loop in patch.loops if not np.isin(loop, layout.loop).all()]
    faces = np.concatenate([patch.faces, *(filling(layout.flat, hole) for hole in holes)])
    covered = replace(patch, triangles=Triangles(faces, len(points))) if holes else patch
    return Ground.of(Locator(replace(layout, patch=covered, flat=frame(layout.flat))), points)
