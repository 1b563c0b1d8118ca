"""Maps between domains with holes: each outline is mapped to its partner, for any number, position and rotation."""

from dataclasses import replace

import numpy as np
import pytest
import shapely

import iccm
from iccm.arrays import xy_of
from iccm.balanced import solve
from iccm.balanced.errors import Stuck
from iccm.balanced.holes.given import hole_at
from iccm.balanced.holes.outlines import outlines_of
from iccm.balanced.meshing.mesh import Sizes, triangulate
from iccm.balanced.minimise.energy import energy_of, geometry
from iccm.balanced.model.boundary_pairs import Match
from iccm.balanced.model.outline import Outline
from iccm.balanced.search import initial_matches
from iccm.balanced.search.hole_partners import Partners
from iccm.curve import Curve, hausdorff
from iccm.maps.triangulated.simple import fault
from iccm.options import Options
from iccm.plane import orientation
from iccm.problem import Problem
from tests.cases import slow, some_fast

SMALL = 1200  # triangles
STEPS = np.exp(2j * np.pi * np.arange(48) / 48)


def domain(outer, *holes):
    """An outline and holes, clockwise."""
    return Curve.domain(np.asarray(outer)), tuple(Curve.domain(np.asarray(h)).reversed() for h in holes)


def box(middle=0j, half=1.0):
    return middle + half * np.array([-1 - 1j, 1 - 1j, 1 + 1j, -1 + 1j])


RING = domain(STEPS, 0.5 * STEPS)
OFF = domain(STEPS, box(0.25 + 0.1j, 0.3))
FACE = domain(
    STEPS * (1 + 0.2j * STEPS.imag), 0.15 * STEPS - 0.4 + 0.3j, 0.15 * STEPS + 0.4 + 0.3j, 0.2 * STEPS - 0.4j
)
MASK = domain(box(), 0.2 * STEPS - 0.5j, box(-0.5 + 0.4j, 0.2), box(0.45 + 0.5j, 0.12))
DISC = domain(STEPS)
PAIRS = {
    "ring": (RING, OFF),
    "face": (FACE, MASK),
    "fewer": (FACE, OFF),
    "none": (OFF, DISC),
    "more": (RING, MASK),
}


def solved(source, target, turn=None, partners=()):
    problem = Problem.of(source[0], target[0]).between(holes=(source[1], target[1]))
    return solve(
        replace(problem, holes=problem.holes._replace(partners=tuple(partners))),
        Options(fit="whole", turn=turn),
        triangles=SMALL,
    )


def area(z, faces):
    return float(geometry(z, faces)[1].sum())


def check(solution, source, target):
    assert len(solution.map.loops) == 1 + len(target[1])
    for side, (w, (outer, holes)) in enumerate(
        zip((solution.map.source, solution.map.image), (source, target))
    ):
        assert (orientation(*w[solution.map.faces].T) > 0).all() and fault(
            [w[loop] for loop in solution.map.loops]
        ) == ""
        assert hausdorff(Curve(w[solution.map.loops[0]]), outer) <= 5e-4 * outer.diagonal
        for loop, partners in zip(solution.map.loops[1:], solution.partners):
            if partners[side] >= 0:
                assert hausdorff(Curve(w[loop]), holes[partners[side]]) <= 5e-4 * outer.diagonal
    assert sorted(j for _, j in solution.partners) == list(range(len(target[1])))
    rim = outer.area + sum(hole.area for hole in target[1])
    assert area(solution.map.image, solution.map.faces) == pytest.approx(rim, rel=2e-3)


@pytest.mark.parametrize("name", some_fast(PAIRS, 2))
def test_every_outline_is_mapped_onto_its_partner_without_folds(name):
    source, target = PAIRS[name]
    solution = solved(source, target)
    check(solution, source, target)
    assert solution.reached and solution.gap <= 5e-4
    more = len(source[1]) - len(target[1])
    assert len(solution.notes) == (1 if more else 0)
    assert not more or ("shrunk" if more > 0 else "opened") in solution.notes[0]


def test_a_hole_may_have_two_corners():
    x = np.linspace(-0.2, 0.2, 40)
    arc = 1.5j * (0.04 - x**2)
    lens = Curve(np.append(x + arc, (x - arc)[-2:0:-1])[::-1])
    square = Curve(0.5 * np.array([-1 - 1j, 1 - 1j, 1 + 1j, -1 + 1j]))
    assert [outline.corners.size for outline in outlines_of(square, [lens], 5e-4, 6e-3)] == [4, 2]


@pytest.mark.slow
def test_the_inverse_has_the_same_energy():
    forward, back = solved(FACE, MASK), solved(MASK, FACE)
    assert forward.energy == pytest.approx(back.energy, rel=0.02)
    assert forward.energy == pytest.approx(
        energy_of(forward.map.image, forward.map.source, forward.map.faces), rel=1e-9
    )


@pytest.mark.slow
def test_partners_are_the_closest_unless_named():
    assert solved(FACE, MASK).partners == ((2, 0), (0, 1), (1, 2))
    prescribed = solved(FACE, MASK, partners=((0, 2),))
    check(prescribed, FACE, MASK)
    assert (0, 2) in prescribed.partners


def test_holes_without_a_partner_nearly_vanish():
    solution = solved(OFF, DISC)
    inside = Curve(OFF[1][0].z).contains(solution.map.source[solution.map.faces].mean(axis=1))
    assert inside.any() and not solution.partners
    shares = [
        area(w, solution.map.faces[inside]) / area(w, solution.map.faces)
        for w in (solution.map.source, solution.map.image)
    ]
    assert shares[0] == pytest.approx(0.115, abs=2e-3)
    assert shares[1] / shares[0] < 0.05  # a virtual triangle with 2 % is at rest (VOID)
    slit = solved(DISC, OFF)
    (loop,) = slit.map.loops[1:]
    assert slit.partners == ((-1, 0),) and 0 < -Curve(slit.map.source[loop]).area < 0.013 * DISC[0].area


def test_similar_domains_have_the_similarity():
    factor, shift = 3 * np.exp(0.7j), 5 - 2j
    moved = (
        Curve(factor * FACE[0].z + shift),
        tuple(Curve(factor * hole.z + shift) for hole in FACE[1][::-1]),
    )
    solution = solved(FACE, moved, "any")
    assert np.abs(factor * solution.map.source + shift - solution.map.image).max() < 1e-8
    assert solution.partners == ((2, 0), (1, 1), (0, 2)) and solution.energy == pytest.approx(1, abs=1e-9)
    shifted = FACE[0], tuple(Curve(hole.z + 0.02) for hole in FACE[1])
    assert solved(FACE, shifted).energy > 1 + 1e-5


@pytest.mark.slow
def test_moving_and_mirroring_both_shapes_changes_nothing():
    blob = domain(STEPS * (1 + 0.2 * (STEPS**3).real + 0.2 * (STEPS**2).imag), 0.3 * STEPS - 0.1 + 0.2j)
    plain = solved(blob, RING)
    for place in (lambda z: 40 * z - 7 + 9j, lambda z: -z.conj()):
        domains = [domain(place(outer.z), *(place(h.z) for h in holes)) for outer, holes in (blob, RING)]
        assert solved(*domains).energy == pytest.approx(plain.energy, rel=1e-6)


def test_a_mesh_with_holes_covers_all_but_them():
    outer, holes = box(half=0.55), [0.2 * STEPS[::-1], box(0.4 + 0.4j, 0.08)[::-1]]
    z, faces = triangulate(outer, Sizes.even(0.005), np.array([0.3 - 0.4j]), None, holes)
    whole = sum(Curve(ring).area for ring in (outer, *holes))
    assert area(z, faces) == pytest.approx(whole, rel=1e-12) and (orientation(*z[faces].T) > 0).all()
    assert np.array_equal(z[:57], np.concatenate([outer, *holes, [0.3 - 0.4j]]))
    edges, count = np.unique(
        np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])),
        axis=0,
        return_counts=True,
    )
    rims = [np.arange(4), 4 + np.arange(48), 52 + np.arange(4)]
    rim = {tuple(sorted(pair)) for loop in rims for pair in zip(loop.tolist(), np.roll(loop, -1).tolist())}
    assert {tuple(edge) for edge in edges[count == 1].tolist()} == rim
    assert not (edges[count == 2] < 57).all(axis=1).any()
    with pytest.raises(Stuck):
        triangulate(outer, Sizes.even(0.005), holes=[box(0.5, 0.2)[::-1]])


def test_holes_are_paired_at_the_rotation_of_the_start():
    source, target = ([Outline.of(c, 0.0, 0.0) for c in (s[0], *s[1])] for s in (FACE, MASK))
    partners = Partners(source, target, ())
    assert [list(side) for side in partners.assigned(0.0)] == [[0, 1, 2], [1, 2, 0]]
    assert partners.assigned(np.pi)[1][2] != 0


def test_the_match_of_a_cut_out_hole_is_prescribed(monkeypatch):
    source, target = ([Outline.of(c, 0.0, 0.0) for c in (s[0], *s[1])] for s in (FACE, MASK))
    outer = Match(np.array([0.0, source[0].curve.length]), np.array([0.0, target[0].curve.length]))
    plain = Partners(source, target, ()).of(outer)
    given = Match(np.array([0.0, 1.0]), np.array([0.0, 2.0]))
    matched = []
    search = initial_matches.elastic_matches
    monkeypatch.setattr(
        initial_matches, "elastic_matches", lambda *args: matched.append(args) or search(*args)
    )
    holes = (
        Partners(source, target, (), lambda source_hole, target_hole: given if source_hole == 1 else None)
        .of(outer)
        .holes
    )
    assert [hole.match is given for hole in holes] == [hole.source == 1 for hole in holes]
    assert len(matched) == len(holes) - 1  # nothing is searched for that is given
    for hole, alone in zip(holes, plain.holes, strict=True):
        assert (hole.source, hole.target) == (alone.source, alone.target)
        assert hole.source == 1 or np.array_equal(hole.match.tau, alone.match.tau)


@pytest.fixture(scope="module")
def fit():
    return iccm.fit(
        FACE[0].z, MASK[0].z, source_holes=[h.z for h in FACE[1]], target_holes=[h.z for h in MASK[1]]
    )


def test_the_library_takes_holes_and_reports_the_gap_of_each(fit):
    report = fit.report()
    assert [(h["source"], h["target"]) for h in report["holes"]] == [(3, 1), (1, 2), (2, 3)]
    assert all(h["gap"] <= 1e-3 for h in report["holes"]) and report["boundary"]["hausdorff"] <= 1e-3
    assert report["injective"]["certified"] and report["boundary"]["given"] <= 1e-3
    assert np.isnan(fit.map(np.array([-0.4 + 0.3j]))).all() and np.isnan(fit.inverse(np.array([-0.5j]))).all()
    back = fit.inverse(fit.map(np.array([0.1 + 0.05j, 0.8])))
    assert np.abs(back - [0.1 + 0.05j, 0.8]).max() < 1e-9


@pytest.mark.slow
def test_pins_in_holes_name_partners_and_others_are_met():
    options = {"source_holes": [h.z for h in FACE[1]], "target_holes": [h.z for h in MASK[1]]}
    pins = [[-0.4 + 0.3j, 0.45 + 0.5j], [0.1, 0.05 + 0.1j]]
    fit = iccm.fit(FACE[0].z, MASK[0].z, exact_pins=True, pins=pins, **options)
    assert (0, 2) in fit.details.hole_partners and fit.status.ok
    assert [pin["error"] < 1e-9 for pin in fit.report()["pins"]] == [True]


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"source_holes": [2 * STEPS]}, "source hole 1: crosses or touches the outline, or lies outside"),
        ({"source_holes": [0.2 * STEPS, 0.1 * STEPS]}, "source hole 2: .* hole 1"),
        ({"target_holes": [[0, 1]]}, "target hole 1: .*2 distinct vertices"),
        ({"source_holes": [0.2 * STEPS], "method": "conformal"}, "balanced method"),
        ({"source_holes": [0.2 * STEPS], "hole_partners": [(0, 0)]}, "hole_partners"),
        (
            {"source_holes": [0.2 * STEPS], "pins": [[0, 0.5]]},
            "pin 1: is in a hole in the source but not in the target",
        ),
        (
            {"source_holes": [0.2 * STEPS], "pins": [[0.2, 0.5]]},
            "pin 1: is on the outline of a hole in the source",
        ),
        (
            {"source_holes": [0.2 * STEPS], "strokes": [([-0.5, 0.5], [-0.5, 0.5])]},
            "stroke 1: touches or crosses a hole in the source",
        ),
    ],
)
def test_invalid_holes_are_refused(wrong, message):
    with pytest.raises(iccm.InputError, match=message):
        iccm.fit(STEPS, box(), **wrong)


def given_holes(source, target):
    return {"source_holes": [h.z for h in source[1]], "target_holes": [h.z for h in target[1]]}


@pytest.mark.parametrize(
    ("pair", "pin"),
    [
        ((FACE, MASK), 0.1),
        slow((FACE, OFF), -0.3),
        slow((OFF, FACE), -0.3),
    ],
)
def test_a_map_with_holes_continues_from_an_earlier_one(pair, pin):
    source, target = pair
    options = given_holes(*pair)
    first = iccm.fit(source[0].z, target[0].z, exact_pins=True, pins=[[pin, pin - 0.1j]], **options)
    again = iccm.fit(
        source[0].z, target[0].z, exact_pins=True, pins=[[pin, pin - 0.15j]], start=first, **options
    )
    assert again.status.ok and sorted(again.details.hole_partners) == sorted(first.details.hole_partners)
    assert [result["error"] < 1e-9 for result in again.report()["pins"]] == [True]
    assert all(h["gap"] <= 1e-3 for h in again.report()["holes"] if h["gap"] is not None)
    assert again.report()["injective"]["certified"]
    same_mesh = len(source[1]) >= len(
        target[1]
    )  # what fills surplus holes of the target is not part of the earlier map
    assert (again.map.source.size == first.map.source.size) == same_mesh


@pytest.mark.slow
def test_a_start_with_other_holes_is_refused():
    plain, options = iccm.fit(FACE[0].z, MASK[0].z), given_holes(FACE, MASK)
    with pytest.raises(iccm.InputError, match=r"start: .* other holes"):
        iccm.fit(FACE[0].z, MASK[0].z, start=plain, **options)
    holed = iccm.fit(FACE[0].z, MASK[0].z, **options)
    with pytest.raises(iccm.InputError, match=r"start: .* other holes"):
        iccm.fit(FACE[0].z, MASK[0].z, start=holed, fit="whole")
    with pytest.raises(iccm.InputError, match="start: pairs the holes differently"):
        iccm.fit(FACE[0].z, MASK[0].z, start=holed, hole_partners=[(0, 2)], **options)


def test_a_loop_is_the_hole_that_it_follows_though_less_closely_than_the_map_its_outline():
    turns = np.exp(2j * np.pi * np.arange(40) / 40)
    small, large = Curve(3 + 0.1 * turns[::-1]), Curve(2 * turns[::-1])
    assert [hole_at(1.01 * (z - m) + m, (large, small)) for z, m in ((small.z, 3), (large.z, 0))] == [1, 0]
    slit = 3 + 0.05 * np.cos(np.arange(10))
    assert hole_at(slit + 0j, (large, small)) == -1


def test_a_hole_that_opens_from_a_slit_has_every_kink_of_its_outline():
    """Compared with shapely's distance, with triangles far larger than the hole's edges."""
    round_hole = 0.5 * np.exp(2j * np.pi * np.arange(90) / 90)
    given = domain(STEPS, round_hole)
    solution = solved(DISC, given)
    image = shapely.LinearRing(xy_of(solution.map.image[solution.map.loops[1]]))
    gap = shapely.hausdorff_distance(image, shapely.LinearRing(xy_of(round_hole)), densify=0.01)
    assert gap <= 3e-4 * given[0].diagonal
