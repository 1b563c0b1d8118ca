"""Rings opened by a cut."""

import numpy as np
import pytest
import shapely

import iccm
from iccm.arrays import xy_of
from iccm.balanced.fit import price_of
from iccm.balanced.model.energy import Energy
from iccm.balanced.model.settings import Settings
from iccm.balanced.rings import SEAM_WIDTH_SHARE, best_seam, open_ring
from iccm.curve import Curve

ANGLES = 2 * np.pi * np.arange(72) / 72
OUTER = Curve.domain(2 * np.exp(1j * ANGLES))
HOLE = Curve(np.exp(-1j * ANGLES))
ENDS = np.linspace(0.6, 2 * np.pi - 0.6, 50)
ARC = Curve.domain(np.concatenate([2 * np.exp(1j * ENDS), np.exp(1j * ENDS[::-1])]))


def test_a_cut_removes_almost_nothing_of_the_ring():
    opened = open_ring(OUTER, HOLE, 0.3)
    assert shapely.Polygon(xy_of(opened.z)).is_valid
    ring = OUTER.area + HOLE.area
    assert 0 < 1 - opened.area / ring < 2 * SEAM_WIDTH_SHARE


def test_a_cut_does_not_leave_the_ring():
    """Seen from the tip of the arm, the hole is beyond the concavity."""
    arm = Curve.domain(np.array([0, 6, 6 + 6j, 5 + 6j, 5 + 3j, 3j]))
    hole = Curve(np.array([1 + 1j, 1 + 2j, 2 + 2j, 2 + 1j]))
    tip = arm.knots[np.flatnonzero(arm.z == 5 + 6j)[0]]
    assert open_ring(arm, hole, tip) is None
    assert open_ring(arm, hole, arm.knots[np.flatnonzero(arm.z == 0)[0]]) is not None


def test_the_cheapest_seam_is_found_between_the_places_tried_first():
    goal = 2 * np.exp(0.4j)  # between the first two
    seam = best_seam(OUTER, HOLE, lambda ring: float(np.abs(ring.z - goal).min()))
    assert np.abs(seam.z - goal).min() < 2 * OUTER.length / 64
    assert best_seam(OUTER, HOLE, lambda ring: np.inf) is None


@pytest.mark.slow
@pytest.mark.parametrize("back", [False, True])
def test_an_arc_is_mapped_onto_a_ring_that_opens_at_the_same_place(back):
    if back:
        fit = iccm.fit(OUTER, ARC, source_holes=[HOLE.z])
        ring = fit.source
    else:
        fit = iccm.fit(ARC, OUTER, target_holes=[HOLE.z])
        ring = fit.target
    report = fit.report()
    assert all(word in fit.notes[0] for word in ("source" if back else "target", "seam", "(holes)"))
    assert report["dilatation"]["p95"] < 1.4 and report["injective"]["certified"]
    assert fit.left_out == fit.uncovered == 0 and report["boundary"]["hausdorff"] < 5e-4
    ends = ring.z[np.abs(np.abs(ring.z) - 2) < 1e-3]
    assert np.abs(ends - 2).min() < 2 * OUTER.length / 32  # the arc is open to the right


@pytest.mark.slow
def test_a_ring_stays_closed_where_its_hole_costs_little():
    fit = iccm.fit(OUTER, OUTER, source_holes=[0.8 + HOLE.z])
    assert fit.voids.any() and not any("seam" in note for note in fit.notes)
    faces = fit.map.faces[~fit.voids]
    energy = Energy().between(fit.map.source, fit.map.image, faces)  # what fills the hole has almost no area
    assert price_of(fit, Settings()) == pytest.approx(energy, rel=0.05) and energy < 1.5


def test_rings_stay_rings_where_both_are_or_holes_are_kept():
    ring = iccm.fit(OUTER, 2 * OUTER.z, source_holes=[HOLE.z], target_holes=[2 * HOLE.z])
    kept = iccm.fit(ARC, OUTER, target_holes=[HOLE.z], holes="keep")
    assert len(ring.map.loops) == len(kept.map.loops) == 2
