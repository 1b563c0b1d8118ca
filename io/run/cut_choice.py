"""The cut of a mesh, chosen for the map onto it from the shape of the source.

A cut that makes the flattening even has a long outline with concavities, as a cross for a cube, and the outline of a
compact source is stretched to reach it. Shorter cuts often give better maps. So the map is found for some of them, and
the one of least cost is taken. The cost of a cut is the 95th percentile, over the surface's area, of the stretch of the
new texture coordinates: max(s₁, 1 / s₂) of their singular values on the triangles, relative to the mean scale.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

from ...errors import InputError
from ...maps.extended_inverse import ExtendedInverse
from ...surfaces.as_written import Written
from ..shapes.mesh_shape import as_mesh
from .outputs.new_uvs import pull_back
from .state import Run

if TYPE_CHECKING:
    from ..shapes.shape import Shape

SEAM_EXTENSIONS = (0, 1, 2)
"""Most times that the first cut is extended, of the further cuts that are tried. Of six closed meshes the best cut was
among these for five, and as good for the sixth."""
MOST_TRIANGLES = 20_000
"""Largest target for which several cuts are tried. Each costs a further map: 0.7 CPU-s for a small target, about 2 for
one of this size."""
GOOD_STRETCH = 1.5  # cost below which no further cut is tried; a map of that cost looks even
WORTHWHILE_DECREASE = (
    0.05  # relative decrease of the cost for which the cut is replaced: less is hardly visible
)


def cost_of(run: Run) -> float:
    """Return the cost of a cut, from the final map."""
    layout, map = as_mesh(run.target).flattening, run.fit.map
    z = pull_back(map, ExtendedInverse(map, run.threads), layout)
    return Written.of(z, layout, run.source.curve).distortion.stretch_p95


def choose_cut(run: Run, solve: Callable[[Run], None]) -> None:
    """Replace the target's cut, and the map, where a shorter cut gives a map of less cost.

    Nothing changes for meshes that are not cut, or cut through landmarks, and for targets of more than MOST_TRIANGLES.

    Args:
        run: the job, solved.
        solve: solves such a job; raises an InputError where there is no map.
    """
    if not _has_choice(run):
        return
    patches = {_identity(run.target)}
    cost = first = cost_of(run)
    for extensions in SEAM_EXTENSIONS:
        if cost <= GOOD_STRETCH:
            break
        trial = _with_cut(run, extensions)
        if trial is None or _identity(trial.target) in patches:
            continue
        patches.add(_identity(trial.target))
        try:
            solve(trial)
        except InputError:
            continue
        if not trial.fit.status.ok:
            continue
        cost_of_trial = cost_of(trial)
        if cost_of_trial < (1 - WORTHWHILE_DECREASE) * cost:
            run.pairs, run.fits, cost = trial.pairs, trial.fits, cost_of_trial
    if cost < first:
        edges = len(as_mesh(run.target).flattening.patch.seam)
        run.note(
            f"{run.target.spec}: cut along {edges} edges instead, which stretches the picture less: on 5 % of the "
            f"surface, lengths change by a factor of more than {cost:.3g} instead of {first:.3g}"
        )


def _has_choice(run: Run) -> bool:
    """Return whether the target is a mesh that was cut freely."""
    job = run.job
    bound = job.has_pins or job.start or job.rigid or job.rigid_target or run.constraints.get("pins")
    if bound or job.several or not job.target or run.source.is_mesh or not run.target.is_mesh:
        return False
    target = as_mesh(run.target)
    if target.packed or target.is_layout or len(run.fits) != 1:
        return False
    patch = target.flattening.patch
    return len(patch.seam) > 0 and len(patch.faces) <= MOST_TRIANGLES


def _with_cut(run: Run, extensions: int) -> Run | None:
    """Return the run with the target cut otherwise, not yet solved; None if there is no such cut."""
    try:
        target = run.inputs.shape(
            run.job.target or "", target=True, source=run.source, seam_extensions=extensions
        )
    except InputError:
        return None
    trial = Run.of_pairs(
        run.job, run.inputs, [(run.source, target)], lambda note: None, run.phases, run.threads
    )
    return replace(trial, constraints=run.constraints, called=run.called, pairs=[(run.source, trial.target)])


def _identity(target: Shape) -> bytes:
    """Return what differs between two cuts of a mesh."""
    return as_mesh(target).flattening.patch.vertex.tobytes()
