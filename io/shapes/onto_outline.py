"""A mesh laid out onto a given outline."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from ...curve import Curve
from ...surfaces.boundary_slivers import with_room
from .holes import fit_with_holes
from .mesh_shape import MeshShape
from .shape import Shape


def lay_onto(
    mesh: MeshShape, outline: Shape, tell: Callable[[str], None]
) -> tuple[MeshShape, dict[str, Any]]:
    """The mesh laid out onto a drawn outline, in its coordinates, evenly on the surface; and the map's figures.

    Args:
        mesh: laid out in any way that is one-to-one.
        outline: what its boundary is to go to.
        tell: is given remarks.

    Raises:
        NoMapError: no map without folds was found.
    """
    fit = fit_with_holes(mesh, outline, tell)
    for note in fit.notes:
        tell(note)
    before = mesh.flattening
    flat = with_room(fit.map(before.flat), before, outline.curve.diagonal)
    curve = Curve(flat[before.loop])
    holes = tuple(flat[loop] for loop in before.patch.loops if not (loop[0] == before.loop).any())
    laid = replace(before, flat=flat, method=outline.path.name, notes=())
    figures = {"boundary": fit.boundary, **fit.distortion.report()}
    return replace(mesh, curve=curve, box=curve.box, flattening=laid, holes=holes), figures
