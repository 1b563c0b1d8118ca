"""Flatten a mesh onto a given outline."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from ...arrays import Complex
from ...curve import Curve
from ...maps.approximation import triangulated
from ...maps.triangulated.map import TriangulatedMap
from ...meshes.flatten import Flattening
from ...surfaces.boundary_slivers import with_room
from .holes import fit_with_holes
from .mesh_shape import MeshShape
from .shape import Shape
from .split_rims import subdivide_rims


def lay_onto(
    mesh: MeshShape, outline: Shape, tell: Callable[[str], None], tolerance: float | None = None
) -> tuple[MeshShape, dict[str, Any]]:
    """Return the mesh flattened evenly onto a drawn outline, in its coordinates, and measurements of the map.

    Args:
        mesh: flattened by any one-to-one method.
        outline: the goal of its boundary.
        tell: receives notes.
        tolerance: relative to the outline's diagonal: triangles at the rim are split until chords deviate from the
            outline by at most this; None to split none.

    Raises:
        NoMapError: no map without folds was found.
    """
    fit = fit_with_holes(mesh, outline, tell)
    figures, notes_of_fit = {"boundary": fit._boundary, "turn": fit.distortion.turn}, list(fit.notes)

    def lay_out(layout: Flattening) -> Complex:
        return with_room(fit.map(layout.flat), layout, outline.curve.diagonal)

    if tolerance is not None:
        to_outline = triangulated(fit.map)
        back = TriangulatedMap(to_outline.image, to_outline.source, to_outline.faces, to_outline.loops)
        images = [fit.map(mesh.flattening.flat)]
        (mesh,), rims, rim_notes = subdivide_rims([mesh], images, [back], tolerance, [lay_out])
        figures, notes_of_fit = figures | rims, notes_of_fit + rim_notes
    flattening, flat = mesh.flattening, lay_out(mesh.flattening)
    curve = Curve(flat[flattening.loop])
    holes = tuple(flat[loop] for loop in flattening.patch.loops if not (loop[0] == flattening.loop).any())
    new_flattening = replace(flattening, flat=flat, method=outline.path.name, notes=())
    notes = (*mesh.notes, *notes_of_fit)
    return replace(
        mesh, curve=curve, box=curve.box, flattening=new_flattening, holes=holes, notes=notes
    ), figures
