"""The maps of a job: solved for each pair of shapes, from scratch or continued from an earlier map."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from ... import progress
from ...arrays import Flags
from ...balanced.errors import NoMapError
from ...balanced.motion import is_reshaped
from ...curve import Curve
from ...errors import InputError
from ...fit_data import with_details
from ...fits import is_of_drawings
from ...maps.joined import split
from ...maps.triangulated.map import TriangulatedMap
from ...pins import Pin
from .. import formats
from ..shapes import parts as shape_parts
from ..spec import Spec
from . import parts, projected
from .constraints import add_names
from .parts import Pair, Pairs
from .phases import Doubt
from .state import Run

EQUAL_RATIO = 1e-6
"""Of dilatations: those of an affine map differ by less, through rounding."""

if TYPE_CHECKING:
    from ...solve import Fit
    from ..shapes.shape import Shape
    from .job import Job

MOST_COST_RATIO = 1.15
"""Factor between costs: a map continued from another is replaced by a new one if it costs more than this many times as
much as the other, and as the new map.
"""
CONSTRAINTS = "pins", "strokes", "rigid", "rigid_target", "importance", "size_map"
KEPT = "start", "keep_start"
SAME_OUTLINE_SHARE = 1e-9  # relative to the diagonal: outlines no farther apart than this are the same

Settings = tuple[dict[str, Any], bool]
"""Options of `iccm.fit` that differ from the job's, and whether holes are mapped onto holes."""


def solve_pairs(run: Run, settings_of: Callable[[Pair], Settings] | None = None) -> None:
    """Solve for the map of each pair of shapes. If there are several, pairs without a map are reported and left out.

    Args:
        run: the job.
        settings_of: returns options for a pair, if they differ from the job's.

    Raises:
        InputError: no pair has a map.
    """
    check_place(run)
    pair_parts(run)
    kept_parts = keep_parts(run)
    job, count, arguments = run.job, len(run.pairs), run.constraints | run.job.solver
    if run.target.is_mesh:
        arguments = {
            name: value for name, value in arguments.items() if name != "place"
        }  # see `layout_choice`
    if job.target and job.exact:
        arguments |= {"holes": "keep"} if job.holes == "keep" else {}
        meshes = any(shape.is_mesh for pair in run.pairs for shape in pair)
        arguments |= {"fit": "whole"} if meshes and job.fit is None else {}
        arguments |= {"fit": "whole"} if job.handles else {}  # as with the pins that will be read
    solved, failed = Pairs(), list[tuple[Pair, InputError]]()
    with run.phases.timed("solve"):
        for k, pair in enumerate(run.pairs):
            within = progress.within("solve" if count == 1 else f"solve part {k + 1} of {count}")
            try:
                with within, add_names(run.called):
                    pair_arguments, holed = settings_of(pair) if settings_of else ({}, job.holed)
                    if run.choices and (holed or not any(shape.holes for shape in pair)):
                        pair_arguments = pair_arguments | {"choices": run.choices[k]}
                    if kept_parts:
                        pair_arguments = pair_arguments | kept_parts[k]
                    known = None if settings_of else run.known.get(k)
                    fit = known or _solve_pair(run, pair, arguments | pair_arguments, holed)
                    run.fits.append(fit)
                    solved.append(_framed(pair, fit))
            except InputError as error:
                failed.append((pair, error))
    if not solved:
        raise failed[0][1]
    run.pairs = solved
    if failed:
        run.figures["without_map"] = parts.without_map(failed)
    run.note(*(Doubt(parts.label(pair, f"omitted: {why}")) for pair, why in failed))


def note_maps(run: Run) -> None:
    """Add the notes on the maps of a job, once it is certain that these are the maps that it uses."""
    run.note(*(parts.label(pair, note) for pair, fit in zip(run.pairs, run.fits) for note in fit.notes))
    if run.detail is not None and "text=" in (Spec.of(run.source.spec).part or "") and _stays_straight(run):
        run.note("the text stays straight; fit='box' bends it into the target")


def _stays_straight(run: Run) -> bool:
    """Return whether the default fit only scales and stretches the source, and no note has named a remedy yet."""
    from ...frames.solve import SHOWN_ON_SILHOUETTE

    if run.job.fit not in (None, "auto") or run.job.place != "fill" or SHOWN_ON_SILHOUETTE in run.fit.notes:
        return False
    dilatations = run.fit.distortion.dilatations
    return np.ptp(dilatations) <= EQUAL_RATIO * dilatations.max()


def check_place(run: Run) -> None:
    """Check that --place can be used: the shapes must suit it, and the map must not come from a file.

    Raises:
        InputError: --place with a mesh that it does not work for, or with an earlier map.
    """
    if run.job.place == "fill":
        return
    option = f"--place {run.job.place}"
    for source, target in run.pairs:
        if source.is_mesh:
            raise InputError(
                f"{option}: only works for drawings and pictures, and {source.spec} is a mesh; leave it out"
            )
        if target.is_mesh and run.job.place == "inside":
            raise InputError(
                f"{option}: would leave much of {target.spec} without texture; use --place slice, with which every "
                "face shows a part of the picture at one scale"
            )
    if run.job.start:
        raise InputError(f"{option}: cannot be combined with --start; leave one of the two out")


def pair_parts(run: Run) -> None:
    """Map the parts of two drawings separately if that costs less than mapping them joined (--parts auto)."""
    job, (source, target) = run.job, run.pairs[0]
    free = not any(value is not None for value in run.constraints.values()) and not job.start
    is_automatic = job.parts == "auto" and job.fit in (None, "auto") and job.place == "fill"
    if not (
        is_automatic
        and job.exact
        and not _needs_one_map(job)
        and free
        and job.target
        and source.drawing
        and target.drawing
        and run.detail is None
    ):
        return
    from ...frames.solve import choose_with_parts
    from ...options import Options

    choices = choose_with_parts(
        source.drawing, target.drawing, Options(**job.solver), free_gaps=run.free_gaps
    )
    if choices is None:
        return
    pairs = choices[0].pairs
    run.choices = [pair.choices for pair in pairs] if pairs else [choices]
    if pairs:
        run.pairs = [
            (source.part_of(pair.source, k + 1), target.part_of(pair.target, k + 1))
            for k, pair in enumerate(pairs)
        ]
        run.note(
            f"{target.spec}: its {len(pairs)} parts are mapped separately (use --parts joined to map them together)"
        )


def _needs_one_map(job: Job) -> bool:
    """Return whether an output of a job, or its handles, are of a single map."""
    return bool(job.handles) or any(formats.of(name).map for name in job.output if name != "-")


def keep_parts(run: Run) -> list[dict[str, Any]]:
    """Map the parts of two drawings separately if the earlier map that is kept consists of maps of theirs.

    Returns:
        The constraints of each pair; empty if the earlier map is a single one.

    Raises:
        InputError: the earlier maps are not of parts of these drawings.
    """
    start, is_kept = run.constraints.get("start"), run.constraints.get("keep_start", False)
    maps = split(start) if isinstance(start, TriangulatedMap) else []
    if len(maps) < 2:
        return []
    source, target = run.pairs[0]
    numbers = parts.numbers_of_maps(source, target, maps)
    run.constraints = {name: value for name, value in run.constraints.items() if name not in KEPT}
    if not is_kept or _needs_one_map(run.job):
        run.note(
            f"{target.spec}: the maps of its parts from the constraints file are not used, because "
            + ("one map is written" if is_kept else "constraints or options have changed since")
        )
        return []
    order = sorted(range(len(maps)), key=lambda k: numbers[k])
    maps, numbers = [maps[k] for k in order], [numbers[k] for k in order]
    run.pairs = [
        (source.part_of(source_part, k + 1), target.part_of(target_part, k + 1))
        for k, (source_part, target_part) in enumerate(parts.drawings_of(source, target, numbers))
    ]
    pins = run.constraints["pins"]
    points = np.array([pin.source if isinstance(pin, Pin) else pin[0] for pin in pins])
    part_of_pin = np.full(len(points), -1)
    for k, map in enumerate(maps):
        part_of_pin[np.isfinite(map(points))] = k
    run.pins_of_parts = [np.flatnonzero(part_of_pin == k) for k in range(len(maps))]
    run.note(f"{target.spec}: its {len(maps)} parts are mapped separately, as they were in the editor")
    return [
        {
            "pins": [pins[number] for number in own] or None,
            "start": map,
            "keep_start": True,
        }
        for own, map in zip(run.pins_of_parts, maps)
    ]


def _framed(pair: Pair, fit: Fit) -> Pair:
    """Return the pair with the frames that the map was solved for.

    With --place, these frames are parts of the shapes; the shapes keep their extent, which determines pictures and
    textures.
    """
    source, target = pair
    if fit.target is not None and (source.view or target.view):
        return source.framed(fit.source), target.framed(fit.target)
    if fit.details.drawings is None or fit.target is None:
        return pair
    if fit.details.place != "fill":
        source, target = (replace(shape, extent=shape.bounds) for shape in pair)
    return source.framed(fit.source), target.framed(fit.target)


def _solve_pair(run: Run, pair: Pair, arguments: dict[str, Any], holed: bool) -> Fit:
    """Return the map of a pair of shapes: projected, packed inside the picture, continued, or solved for."""
    (source, target), start = pair, run.start
    if source.view or target.view:
        return projected.solve(pair)
    if target.is_mesh:
        from ..shapes.mesh_shape import as_mesh

        mesh = as_mesh(target)
        if mesh.packed:
            from ...surfaces.packed import place

            return place(source.curve, mesh.flattening)
    mapped_onto = target if run.job.target else None
    settings: dict[str, Any] = {"holed": holed, "tell": run.note}
    if mapped_onto is not None and source.drawing is not None:
        arguments = arguments | {"opaque": run.opaque, "free_gaps": run.free_gaps, "detail": run.detail}
        drawing = mapped_onto.drawing
        if run.job.parts == "elements" and run.job.fit is None and drawing and not drawing.is_one_part:
            arguments["fit"] = "frame"  # other fits may hide a small part, such as the dot of an i
    if start:
        return continue_map(start, source, mapped_onto, arguments, **settings)
    return solve(source, mapped_onto, arguments, **settings)


def solve(
    source: Shape,
    target: Shape | None,
    arguments: dict[str, Any],
    *,
    holed: bool,
    tell: Callable[[str], None],
) -> Fit:
    """Return the map of two shapes, or the deformation of one; `holed` if holes are to be mapped, too.

    Args:
        source: the shape that is mapped.
        target: the shape to map onto; None for a deformation.
        arguments: options of `iccm.fit` and `iccm.deform`.
        holed: whether holes are mapped onto holes.
        tell: called with notes about holes that are ignored.
    """
    import iccm

    from ..shapes.holes import deform_with_holes, filled, fit_with_holes

    if target is None:
        return deform_with_holes(source, **arguments) if holed else iccm.deform(source.curve, **arguments)
    if holed:
        return prefer_namesakes(
            source, target, partial(fit_with_holes, source, target, tell), arguments, tell
        )
    are_drawn = source.drawing is not None and target.drawing is not None
    sides = (filled(source), filled(target)) if are_drawn else (source, target)
    fit = partial(iccm.fit, *(side.domain for side in sides))
    result = prefer_namesakes(source, target, fit, arguments, tell)
    # holes of drawings are ignored by the map, but still cut out of the picture
    return with_details(result, drawings=(source.drawing, target.drawing)) if are_drawn else result


def prefer_namesakes(
    source: Shape,
    target: Shape,
    fit: Callable[..., Fit],
    arguments: dict[str, Any],
    tell: Callable[[str], None],
) -> Fit:
    """Return the map of two shapes; use parts with the same name as pins if that helps.

    If the unconstrained map does not carry a named part onto its namesake, a map that starts from these parts as pins
    is preferred, unless it costs more than `MOST_COST_RATIO` times as much.
    """
    plain = fit(**arguments)
    is_constrained = any(arguments.get(name) is not None for name in (*CONSTRAINTS, "start"))
    if is_constrained or plain.details.place != "fill" or not isinstance(plain.map, TriangulatedMap):
        return plain
    names, places, radii = shape_parts.namesakes(source, target)
    if not names:
        return plain

    def missed(candidate: Fit) -> Flags:
        return ~(np.abs(candidate.map(places[:, 0]) - places[:, 1]) <= radii)

    missed_before = missed(plain)
    if not missed_before.any():
        return plain
    with suppress(NoMapError, InputError):
        requested = arguments.get("fit")
        mode = requested if is_of_drawings(requested) else "whole"
        pinned = fit(**arguments | {"pins": places, "fit": mode})
        # several pins determine the rotation
        pins_fix_turn = arguments.get("turn") is None and len(names) > 1
        free = fit(
            **arguments | {"start": pinned.map, "fit": mode} | ({"turn": "any"} if pins_fix_turn else {})
        )
        missed_now = missed(free)
        gained = [name for name, is_gained in zip(names, missed_before & ~missed_now) if is_gained]
        if (
            free.status.ok
            and missed_now.sum() < missed_before.sum()
            and cost_of_fit(free) <= MOST_COST_RATIO * cost_of_fit(plain)
        ):
            tell(
                f"{target.spec}: the search starts from elements with the same names in both drawings: "
                f"{', '.join(gained)} (names)"
            )
            return free
    return plain


def continue_map(
    start: Fit,
    source: Shape,
    target: Shape | None,
    arguments: dict[str, Any],
    *,
    holed: bool,
    tell: Callable[[str], None],
) -> Fit:
    """Solve as in `solve`, starting from an earlier map; if a new map is `better`, return that with a note.

    A map of exactly the same shapes is returned unchanged.
    """
    free = not any(arguments.get(name) is not None for name in CONSTRAINTS)
    if target is not None and start.target is not None and free:
        earlier = [start.source, *start.source_holes], [start.target, *start.target_holes]
        if all(
            _is_same([shape.curve, *(Curve(shape.holes[k]) for k in shape.mappable_holes if holed)], rings)
            for shape, rings in zip((source, target), earlier)
        ):
            return start
    continued = None
    with suppress(NoMapError, InputError):
        if start.details.filled is None and (not holed or _have_holes(start, source, target)):
            continued = solve(source, target, arguments | {"start": start.map}, holed=holed, tell=tell)
    best = better(start, continued, lambda: solve(source, target, arguments, holed=holed, tell=tell))
    if best is not continued:
        tell(
            f"{(target or source).spec}: the shapes differ too much from those of the earlier map, so a "
            "new one is computed"
        )
    return best


def better(start: Fit, continued: Fit | None, anew: Callable[[], Fit]) -> Fit:
    """Return the map that was continued from another, or a new one if that is better.

    Args:
        start: the earlier map.
        continued: the map continued from it; None if that failed.
        anew: computes a map of the same shapes from scratch. It is called if the continued map costs more than
            `MOST_COST_RATIO` times as much as the earlier one, or if protrusions have merged or separated. Its map is
            returned if it costs less: by that factor in the first case, by any amount in the second.
    """
    if continued is None or not continued.status.ok:
        return anew()
    outlines = (start.source, continued.source), (start.target, continued.target)
    ratio = 1.0 if any(a and b and is_reshaped(a, b) for a, b in outlines) else MOST_COST_RATIO
    if ratio > 1 and cost_of_fit(continued) <= ratio * cost_of_fit(start):
        return continued
    new = anew()
    return new if new.status.ok and cost_of_fit(continued) > ratio * cost_of_fit(new) else continued


def _have_holes(start: Fit, source: Shape, target: Shape | None) -> bool:
    """Return whether shapes have the same numbers of holes as the shapes of a map."""
    sides = zip((source, target), (start.source_holes, start.target_holes))
    return all(len(shape.mappable_holes) == len(holes) for shape, holes in sides if shape)


def _is_same(outlines: list[Curve], rings: list[Curve]) -> bool:
    """Return whether outlines are the same up to rounding and the choice of the first vertex, in the same order."""
    return len(outlines) == len(rings) and all(
        a.z.size == b.z.size and b.distances(a.z).max() <= SAME_OUTLINE_SHARE * a.diagonal
        for a, b in zip(outlines, rings)
    )


def cost_of_fit(fit: Fit) -> float:
    """Return the cost of a map, without that of its rotation; see `drawings.cost`."""
    from ...drawings.cost import Cost

    coverage = fit.coverage
    if coverage.seen is not None:
        return coverage.seen.total
    energies = fit.distortion.energies()["total"]
    energy = float(np.average(energies, weights=fit.distortion.area))
    return Cost(energy, coverage.left_out, coverage.uncovered).total
