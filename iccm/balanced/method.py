"""Balanced maps: the outline held, nothing folded, the size even, the picture upright.

A piecewise linear homeomorphism between triangulations of two shapes that minimises the symmetric energy of
`energy.py`, its boundary sliding on the target's outline. The stages are in `stages.py`.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..arrays import Complex
from ..curve import Curve
from ..maps.triangulated.map import TriangulatedMap
from ..result import hausdorff
from . import orientation, stages
from .constraints.given import Pins, checked, place
from .frames import Frame, frames_of
from .levels import Sketch
from .minimise.energy import energy_of
from .minimise.measures import stretches, turn_of
from .solution import Journal, Settings, Solution

NO_PINS = np.empty((0, 2), np.complex128)


def solve(
    source: Curve,
    target: Curve,
    settings: Settings | None = None,
    pins: Complex = NO_PINS,
    strokes: Sequence[tuple[Curve, Curve]] = (),
    start: TriangulatedMap | None = None,
) -> Solution:
    """The balanced map of two domains.

    Args:
        source: a domain, as from `Curve.domain`.
        target: likewise.
        settings: what is asked of the map.
        pins: (k, 2) points of the source and where they go.
        strokes: polylines in the source and where they go, ends to ends.
        start: an earlier map of these domains to go on from.

    Raises:
        NoMapError: no map without folds was found.
        InputError: pins or strokes that no one-to-one map meets.
    """
    settings = settings or Settings()
    frames = frames_of(source, target, settings.turn)
    journal = Journal()
    if len(pins) or len(strokes) or start is not None:
        given = checked(source, target, pins, strokes)
        journal.notes += given.notes
        curves = (frames[0].curve(source), frames[1].curve(target))
        state, met = stages.constrained(
            *curves, given.unit(frames), settings, journal, start and sketched(start, frames)
        )
        found = _solution(state, frames, (source, target), settings, journal, False, given)
        return replace(found, met=met, lines=state.lines)
    state, symmetric = stages.mapped(frames[0].curve(source), frames[1].curve(target), settings, journal)
    return _solution(state, frames, (source, target), settings, journal, symmetric)


def sketched(map: TriangulatedMap, frames: tuple[Frame, Frame]) -> Sketch:
    """A map in unit coordinates, vertices of the outline first."""
    loop, faces = map.loops[0], map.faces
    if frames[0].mirrored:
        loop, faces = loop[::-1], faces[:, ::-1]
    order = np.append(loop, np.setdiff1d(np.arange(map.source.size), loop))
    place = np.argsort(order)
    z, u = frames[0].unit(map.source)[order], frames[1].unit(map.image)[order]
    return Sketch(z, u, np.ascontiguousarray(place[faces]), loop.size)


def _solution(
    state: stages.Meshed,
    frames: tuple[Frame, Frame],
    given: tuple[Curve, Curve],
    settings: Settings,
    journal: Journal,
    symmetric: bool,
    pins: Pins | None = None,
) -> Solution:
    """The map in the given coordinates, checked there."""
    z, u = frames[0].world(state.z), frames[1].world(state.u)
    mirror = frames[0].mirrored
    faces = np.ascontiguousarray(state.faces[:, ::-1]) if mirror else state.faces
    loop = np.arange(state.border)[::-1].copy() if mirror else np.arange(state.border)
    if pins is not None:
        place(pins, z, u, state.border, state.first_pin)
    for name, w in (("source", z), ("image", u)):
        orientation.refuse_folds(name, w, faces)
        orientation.refuse_touching(name, w[loop])
    source_gap, gap = (hausdorff(Curve(w[loop]), c) / c.diagonal for w, c in zip((z, u), given))
    dilatation, stretch, _ = stretches(state.z, state.u, state.faces)
    lean = turn_of(state.z, state.u, state.faces) * (-1 if mirror else 1)
    turn = np.angle(np.exp(1j * lean) * frames[0].factor / frames[1].factor)
    reached = max(gap, source_gap) <= settings.tolerance and stages.excess(state, settings) <= 1
    return Solution(
        z,
        u,
        faces,
        (loop,),
        energy_of(state.z, state.u, state.faces, settings.theta),
        journal.energies,
        float(turn),
        gap,
        source_gap,
        journal.starts,
        {"dilatation": float(dilatation.max()), "stretch": float(stretch.max())},
        symmetric,
        bool(reached),
        journal.notes,
    )
