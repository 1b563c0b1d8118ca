"""Maps that are moved along with their outlines."""

import os
import platform
import subprocess
import sys
from itertools import pairwise

import numpy as np
import pytest
import shapely

import iccm
from iccm.balanced.errors import NoMapError
from iccm.balanced.minimise.untangle import harmonic
from iccm.balanced.motion import carry_map, is_reshaped, match_outlines
from iccm.curve import Curve
from iccm.plane import triangle_areas
from tests.cases import slow

DISC = np.exp(2j * np.pi * np.arange(60) / 60)


def figure(degrees):
    """A body with an arm raised by an angle."""
    tip = 0.4 + 0.7j + 1.8 * np.exp(1j * np.radians(degrees))
    arm = shapely.LineString([(0.3, 0.7), (tip.real, tip.imag)]).buffer(0.22)
    outline = shapely.box(-0.6, -1.5, 0.6, 1.2).buffer(0.15).union(arm).exterior
    return Curve.domain(shapely.get_coordinates(outline)[:-1] @ [1, 1j])


def test_a_moved_outline_is_matched_to_itself():
    star = Curve(DISC * (1.5 + 0.5 * np.cos(5 * np.angle(DISC))))
    for factor, shift in ((1, 3 + 2j), (1.1, 0), (np.exp(0.1j), 1j)):
        moved = Curve(np.roll(factor * star.z + shift, 7))
        matched = moved.at(match_outlines(star, moved))
        assert np.abs(matched - (factor * star.z + shift)).max() < 0.01 * star.diagonal


def test_a_limb_that_moves_is_followed():
    before, after = figure(0), figure(8)
    tip = before.z.real.argmax()
    matched = after.at(match_outlines(before, after))
    assert abs(matched[tip] - after.z[after.z.real.argmax()]) < 0.22  # half the width of the arm
    assert np.abs(matched - before.z).max() < 1.2 * np.radians(8) * 2.1  # no farther than the arm swings


def test_harmonic_functions_obey_the_maximum_principle():
    map = iccm.fit(DISC, 2 * DISC).map
    fixed = np.isin(np.arange(map.source.size), np.concatenate(map.loops))
    # translations are exact
    given = np.where(fixed, 1 + 2j, 0)
    assert np.abs(harmonic(map.source, map.faces, fixed, given) - (1 + 2j)).max() < 1e-12
    values = harmonic(map.source, map.faces, fixed, np.where(fixed, map.source**2, 0))
    assert np.abs(values - map.source**2).max() < 0.1  # z² is harmonic; the weights are clamped from below
    assert np.abs(values).max() <= np.abs(map.source[fixed] ** 2).max() + 1e-12


def test_maps_of_the_same_shapes_are_unchanged_and_other_holes_refused():
    fit = iccm.fit(DISC, 2 * DISC)
    assert carry_map(fit.map, fit.source, fit.target) is fit.map
    with pytest.raises(NoMapError, match="other holes"):
        carry_map(fit.map, fit.source, Curve(3 * DISC), ((), [Curve(0.1 * DISC[::-1])]))


def test_holes_are_met_as_closely_as_the_outer_outline():
    hole = [0.1 * DISC[::-1]]
    fit = iccm.fit(DISC, 2 * DISC, source_holes=hole, target_holes=[2 * hole[0]])
    moved_holes = [Curve(2.01 * hole[0])]  # a thousandth of the whole, several thousandths of the hole
    assert carry_map(fit.map, fit.source, fit.target, (fit.source_holes, moved_holes)) is fit.map


@pytest.mark.parametrize("moves", [slow("target"), "source"])
def test_frames_follow_each_other_without_a_jump(moves):
    frames = [figure(angle) for angle in np.linspace(-30, 0, 4)]
    fits = []
    for frame in frames:
        pair = (DISC, frame) if moves == "target" else (frame, DISC)
        fits.append(iccm.fit(*pair, fit="whole", start=fits[-1] if fits else None))
    assert all(fit.status.ok for fit in fits)
    if moves == "source":
        images = np.array([fit.inverse(0.9 * fits[0].image.mean() + 0.8 * DISC) for fit in fits])
    else:
        images = np.array([fit.map(0.9 * DISC) for fit in fits])
    steps = np.abs(np.diff(images, axis=0))
    moved = np.array([b.distances(a.z).max() for a, b in pairwise(frames)])
    assert (np.quantile(steps, 0.95, axis=1) < 1.5 * moved).all()


def test_an_outline_is_reshaped_where_limbs_part_and_moved_where_they_swing():
    def figure(gap):
        legs = [shapely.box(side * gap - 0.2, 0, side * gap + 0.2, 2) for side in (-0.5, 0.5)]
        whole = shapely.union_all([shapely.box(-1, 2, 1, 3), *legs])
        return Curve.domain(shapely.get_coordinates(whole.exterior)[:-1] @ [1, 1j])

    closed, ajar, apart = figure(0.38), figure(0.42), figure(0.5)
    assert is_reshaped(closed, ajar) and is_reshaped(ajar, closed)  # by .02, while the crotch moves by 2
    assert not is_reshaped(ajar, apart) and not is_reshaped(ajar, ajar)
    assert not is_reshaped(closed, Curve(1.1 * np.exp(0.2j) * closed.z))


def banner(phase):
    """The mid-line and the outline of a flag, held at the left, whose upper and lower edges wave alike."""
    x = np.linspace(0, 300, 81)
    height = 22 * (x / 300) ** 0.5 * (np.sin(2 * np.pi * x / 210 - phase) + np.sin(phase) * (1 - x / 300))
    middle = 0.95 * x + 1j * height
    return middle, np.concatenate([middle - 30j, (middle + 30j)[::-1]])


@pytest.mark.slow
def test_lettering_on_a_flag_rotates_with_the_cloth_in_every_frame():
    source = np.array([0, 300, 300 + 60j, 60j])
    letters = (np.linspace(50, 250, 21)[:, None] + 1j * np.linspace(22, 38, 5)).ravel()
    fit = None
    for phase in np.linspace(0, 1.5 * np.pi, 4):
        middle, outline = banner(phase)
        fit = iccm.fit(source, outline, fit="whole", start=fit)
        assert fit.status.ok
        map = fit.map
        areas = triangle_areas(map.image[map.faces])
        assert areas.min() > 0
        assert areas.sum() == pytest.approx(Curve.domain(outline).area, rel=1e-4)  # outlines to a tolerance
        rotation = np.angle(map.derivatives(letters)[0])
        nearest = np.abs(map(letters)[:, None] - middle).argmin(axis=1)
        tangent = np.angle(np.gradient(middle))[nearest]
        away = np.degrees(np.sqrt(np.mean((rotation - tangent) ** 2)))
        # cloth that is only sheared stays 12 degrees behind in the last frames
        assert np.degrees(np.abs(tangent).max()) > 25 and away < 7
    alone = iccm.fit(source, outline, fit="whole")
    assert fit.energies[-1]["total"] < 1.01 * alone.energies[-1]["total"]  # shear does not add up


@pytest.mark.slow
def test_a_flag_does_not_shear_further_the_longer_it_waves():
    source = np.array([0, 300, 300 + 60j, 60j])
    costs, fit = [], None
    for phase in 0.5 * np.pi * np.arange(5):  # there and back again
        fit = iccm.fit(source, banner(phase)[1], fit="whole", start=fit)
        costs.append(fit.energies[-1]["total"])
    assert costs[-1] == pytest.approx(costs[0], rel=0.01)


@pytest.mark.slow
@pytest.mark.parametrize("balance", [2.0, *(slow(b) for b in (4.0, 10.0))])
def test_a_map_onto_moved_outlines_costs_little_more_than_one_from_scratch_whatever_the_balance(balance):
    source, target = np.array([0, 3, 3 + 2j, 2j]), banner(0.0)[1] / 40
    moved = target + 0.15j * np.sin(target.real)
    start = iccm.fit(source, target, fit="whole", balance=balance)
    carried = iccm.fit(source, moved, fit="whole", balance=balance, start=start)
    alone = iccm.fit(source, moved, fit="whole", balance=balance)
    assert carried.status.ok and carried.energies[-1]["total"] < 1.1 * alone.energies[-1]["total"]


MOVED = """
import hashlib
import iccm
from iccm.balanced.motion import carry_map
from tests.iccm.balanced.test_motion import DISC, figure
fit = iccm.fit(figure(0).z, 2 * DISC)
moved = carry_map(fit.map, figure(20), iccm.curve.Curve(2.1 * DISC))
print(hashlib.sha256(moved.source.tobytes() + moved.image.tobytes()).hexdigest())
"""


@pytest.mark.slow
@pytest.mark.skipif(
    platform.machine() not in ("x86_64", "AMD64"), reason="its name of a processor is for x86-64"
)
def test_a_moved_map_is_the_same_on_every_processor():
    """OpenBLAS has other sums for every kind of processor; Prescott's run on all of them."""
    kernels = ({}, {"OPENBLAS_CORETYPE": "Prescott"})
    runs = [
        subprocess.run([sys.executable, "-c", MOVED], env=os.environ | kernel, capture_output=True, text=True)
        for kernel in kernels
    ]
    digests = {run.stdout for run in runs}
    assert len(digests) == 1 and digests != {""}, [run.stderr for run in runs]
