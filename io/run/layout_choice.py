"""The layout of a mesh inside a picture, where the picture cannot be bent to its outline evenly.

The outline of a mesh that was cut open is long and has concavities, as a cross for a cube. The picture's outline
reaches it only if the picture is stretched. So where that stretches the picture much, or no such map is found, the
charts are packed inside the picture at one scale instead, as `iccm flatten` lays them out. The cost of both is the 95th
percentile, over the surface's area, of the stretch of the new texture coordinates: max(s₁, 1 / s₂) of their singular
values on the triangles, relative to the mean scale.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ...balanced.errors import NoMapError
from ...errors import InputError
from ...maps.extended_inverse import ExtendedInverse
from ...surfaces.as_written import WrittenCoordinates
from ..shapes.mesh_shape import as_mesh
from ..shapes.shape import Shape
from .outputs.new_uvs import pull_back
from .state import Run

GOOD_STRETCH = 1.5
"""Cost of the map onto a sheet's outline below which the sheet is not placed inside the picture: a map of that cost
looks even, and shows the whole picture. On a surface that was cut open, no one sees the picture as a whole."""
BARE_BOX_SHARE = 0.02
"""Share of its box that a photo may leave out, as at rounded corners."""
WORTHWHILE_DECREASE_SHARE = 0.05
"""Share of its cost by which a layout must be better to be taken: less is hardly visible."""


def cost_of(run: Run) -> float:
    """Return the cost of a map onto a mesh."""
    layout, map = as_mesh(run.target).flattening, run.fit.map
    z = pull_back(map, ExtendedInverse(map, run.threads), layout)
    return WrittenCoordinates.of(z, layout, run.source.curve).distortion.stretch_p95


def solve_or_lay_out(run: Run, solve: Callable[[Run], None]) -> None:
    """Map a picture onto a mesh, or lay the charts of the mesh out inside the picture where that costs less.

    Nothing changes for meshes that are cut through landmarks, where holes are mapped onto holes, or with options for
    the map of an outline; and for meshes that are not cut, if the source has an outline and is not a full rectangle.
    With --place slice the charts are packed inside the picture, whatever that costs.

    Args:
        run: the job.
        solve: solves such a job.

    Raises:
        InputError: there is neither a map nor a layout.
    """
    failure = None
    try:
        solve(run)
    except NoMapError as error:
        failure = error
    if not _has_choice(run):
        if failure:
            raise failure
        return
    cost = np.inf if failure or run.job.place == "slice" else cost_of(run)
    is_cut = len(as_mesh(run.target).flattening.patch.seam) > 0
    if not is_cut and cost <= GOOD_STRETCH:
        return
    try:
        target = run.inputs.layout_inside(run.job.target or "", run.source)
    except InputError:
        if run.job.place == "slice":
            raise
        target = None
    if target is None:
        if failure:
            raise failure
        return
    trial = Run.of_pairs(
        run.job, run.inputs, [(run.source, target)], lambda note: None, run.phases, run.threads
    )
    trial = replace(trial, constraints=run.constraints, called=run.called)
    solve(trial)
    cost_of_layout = cost_of(trial)
    if cost_of_layout < (1 - WORTHWHILE_DECREASE_SHARE) * cost:
        run.pairs, run.fits = trial.pairs, trial.fits
        if run.job.place == "slice":
            return
        edges = len(as_mesh(target).flattening.patch.seam)
        reason = (
            "the map of its outline would stretch the picture more: on 5 % of the surface, lengths would change by a "
            f"factor of more than {cost:.3g} instead of {cost_of_layout:.3g}; --parts largest maps the outline"
        )
        if failure:
            reason = "the picture cannot be mapped onto its outline without folds"
        run.note(
            f"{target.spec}: {f'cut along {edges} edges instead and ' if edges else ''}packed inside the picture at "
            f"one scale, since {reason}"
        )


def _has_choice(run: Run) -> bool:
    """Return whether the target is a mesh that was cut freely."""
    job = run.job
    bound = job.has_pins or job.start or job.rigid or job.rigid_target or run.constraints.get("pins")
    if bound or job.several or not job.target or run.source.is_mesh or not run.target.is_mesh:
        return False
    target = as_mesh(run.target)
    return (
        not target.packed
        and not target.is_layout
        and len(run.pairs) == 1
        and not any(fit.source_holes for fit in run.fits)
        and (len(target.flattening.patch.seam) > 0 or _fills_box(run.source) or job.place == "slice")
    )


def _fills_box(source: Shape) -> bool:
    """Return whether a shape is all of its box, as a photo is."""
    low, high = source.curve.box
    box_area = (high - low).real * (high - low).imag
    return not source.holes and source.curve.area >= (1 - BARE_BOX_SHARE) * box_area
