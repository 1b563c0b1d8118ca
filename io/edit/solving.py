"""The converged map of a scene, computed as `iccm map` computes it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ...arrays import Complex
from ...errors import InputError
from ...maps.triangulated.map import TriangulatedMap
from ...pins import Pin as SoftPin
from ...pins import Softness
from ..run.constraints import as_pins, as_strokes, fingerprint
from ..run.job import Job
from ..run.maps import note_maps, solve_pairs
from ..run.state import Run
from ..shapes import regions
from .map_update import ShownSilhouette, Solved
from .messages import Scene
from .pair import Pair

LEAST_SILHOUETTE_SHARE = 1e-3  # of what the target paints: nobody sees that less is shown in addition


def job_of(pair: Pair, scene: Scene) -> Job:
    """Return the job with the settings of a scene, and without constraints."""
    settings: dict[str, Any] = {"balance": scene.balance, "pin": (), "constraints": None}
    if not pair.deforming:
        settings |= {"turn": scene.turn or None, "fit": None if scene.fit == "auto" else scene.fit}
    return pair.job.model_copy(update=settings)


def fingerprint_of(pair: Pair, scene: Scene) -> str:
    """Return the fingerprint of a scene's pins and settings (see `StartingMap.kept`)."""
    placed = pair.placed(scene)
    return fingerprint(job_of(pair, scene), placed.pins, placed.settings)


def solve_scene(pair: Pair, scene: Scene, start: TriangulatedMap | None, *, kept: bool = False) -> Solved:
    """Return the maps of all parts, as `iccm map` computes them, and their report.

    Args:
        pair: the shapes.
        scene: pins and strokes.
        start: the map to continue from; None to start from scratch.
        kept: whether the start is the map as it is.

    Raises:
        InputError: constraints cannot be met, or do not lie in the shapes.
    """
    pins, strokes, settings, widths = pair.placed(scene)
    if pair.deforming and not (scene.pins or scene.strokes):
        pins = np.tile(pair.source.curve.z[:1], (1, 2))  # a pin that stays in place: then everything does
        settings = []
    settings = [] if pair.job.exact_pins else settings
    constraints: dict[str, Any] = {"pins": as_pins(pins, settings), "strokes": as_strokes(strokes, widths)}
    if start is not None:
        constraints["start"] = start
    if kept:
        constraints["keep_start"] = True
    if rigid := _rigid(pair, scene):
        constraints |= {"rigid": rigid, **regions.greys(pair.source, scene.rigid)}
    run = replace(
        pair.run,
        job=job_of(pair, scene),
        pairs=[(pair.source, pair.target)],
        constraints=constraints,
        notes=[],
        figures={},
        fits=[],
    )
    vars(run).update({name: getattr(pair.run, name) for name in ("image", "detail")})
    solve_pairs(run)
    note_maps(run)
    report = run.fit_report
    report["notes"] = [*dict.fromkeys([*run.notes, *report["notes"]])]
    return Solved(run.fits, report, pins, _silhouette(pair, run))


def _silhouette(pair: Pair, run: Run) -> ShownSilhouette | None:
    """Return what pictures show of the target, if that is more than it paints."""
    drawings = run.fit.details.drawings
    if len(run.fits) > 1 or pair.has_mesh or pair.deforming or drawings is None:
        return None
    shown, painted = drawings[1], pair.target.drawing
    if painted is None or shown.region.area <= (1 + LEAST_SILHOUETTE_SHARE) * painted.region.area:
        return None
    toned = run.toned
    return ShownSilhouette(shown.rings, toned, (run.paper, run.tone) if toned else ("", ""))


def softness_of_settings(pair: Pair, settings: Sequence[dict[str, float]]) -> Softness | None:
    """Return the softness of pins with these settings; None if all pins are exact."""
    if pair.job.exact_pins or (pair.source.is_mesh and pair.target.is_mesh):
        return None
    return Softness.of([SoftPin(0, 0, **pin_settings) for pin_settings in settings])


def _rigid(pair: Pair, scene: Scene) -> list[Complex]:
    """Return the rigid regions of a scene, and those drawn in the file, in the core plane.

    Raises:
        InputError: a region is invalid, or is the name of one that the session did not begin with.
    """
    if any(isinstance(region, str) and region not in pair.first.rigid for region in scene.rigid):
        raise InputError("rigid: only regions from the command line or drawn on this page are possible")
    return regions.read(pair.source, (), scene.rigid)
