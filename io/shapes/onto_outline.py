"""A mesh laid out onto a given outline."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from ...curve import Curve
from ...maps.approximation import triangulated
from ...maps.triangulated.map import TriangulatedMap
from ...surfaces.boundary_slivers import with_room
from .holes import fit_with_holes
from .mesh_shape import MeshShape
from .shape import Shape
from .split_rims import subdivide_rims


def lay_onto(
    mesh: MeshShape, outline: Shape, tell: Callable[[str], None], tolerance: float | None = None
) -> tuple[MeshShape, dict[str, Any]]:
    """The mesh laid out onto a drawn outline, in its coordinates, evenly on the surface; and the map's figures.

    Args:
        mesh: laid out in any way that is one-to-one.
        outline: what its boundary is to go to.
        tell: is given remarks.
        tolerance: relative to the outline's diagonal: triangles at the rim are split until chords are off the outline
            by no more; None splits none.

    Raises:
        NoMapError: no map without folds was found.
    """
    fit = fit_with_holes(mesh, outline, tell)
    for note in fit.notes:
        tell(note)
    figures = {"boundary": fit.boundary, **fit.distortion.report()}
    if tolerance is not None:
        there = triangulated(fit.map)
        back = TriangulatedMap(there.image, there.source, there.faces, there.loops)
        images = [fit.map(mesh.flattening.flat)]
        (mesh,), figures["rim_vertices"] = subdivide_rims([mesh], images, [back], tolerance)
    before = mesh.flattening
    flat = with_room(fit.map(before.flat), before, outline.curve.diagonal)
    curve = Curve(flat[before.loop])
    holes = tuple(flat[loop] for loop in before.patch.loops if not (loop[0] == before.loop).any())
    laid = replace(before, flat=flat, method=outline.path.name, notes=())
    return replace(mesh, curve=curve, box=curve.box, flattening=laid, holes=holes), figures
