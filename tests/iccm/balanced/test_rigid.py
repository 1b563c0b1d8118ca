"""Rigid regions: moved by similarities in any surroundings; their density; and what is rejected."""

import re
from pathlib import Path

import numpy as np
import pytest
import shapely

import iccm
from iccm.arrays import xy_of
from iccm.balanced.errors import Stuck
from iccm.balanced.meshing.mesh import Sizes, triangulate
from iccm.balanced.minimise import energy
from iccm.balanced.minimise.energy import Objective, RestShapes
from iccm.balanced.model.boundary_pairs import Match
from iccm.balanced.model.energy import WITHOUT_ROTATION, Energy
from iccm.balanced.model.mesh_map import MeshMap
from iccm.balanced.rigid import solve as rigid_solve
from iccm.balanced.rigid.given import regions_of
from iccm.balanced.rigid.room import room_for
from iccm.balanced.rigid.solve import AroundPlaces, RegionPlacement, Rigid, place_regions, strains
from iccm.balanced.search.levels import Level
from iccm.balanced.search.unit_problem import UnitProblem
from iccm.curve import Curve
from iccm.io.shapes import shape
from iccm.linalg.cholesky import system_of
from iccm.plane import Similarity
from iccm.status import Status

DRAWN = Path(__file__).parents[3] / "docs" / "files"
SQUARE = np.array([-2 - 2j, 2 - 2j, 2 + 2j, -2 + 2j])
STAR = 1j * np.tile([3, 1.8], 5) * np.exp(2j * np.pi * np.arange(10) / 10)
LETTER = np.array([-0.8 - 1j, 0.6 - 1j, 0.6 - 0.5j, -0.3 - 0.5j, -0.3 + 1j, -0.8 + 1j]) * 0.9 + 0.3
MEAN = np.sqrt(Curve(STAR).area / Curve(SQUARE).area)
INSIDE = np.array([-0.3 - 0.7j, 0.7 - 0.7j, -0.2 + 0.7j, -0.2 - 0.2j, 0.3 - 0.65j])


def similarity_of(fit, z=INSIDE):
    """The similarity that the map is on points, to 1 % of their extent."""
    w = fit.map(z)
    similarity = Similarity.fit(z, w)
    assert np.abs(similarity(z) - w).max() <= 0.01 * abs(similarity.factor) * np.abs(z - z.mean()).max()
    return similarity


@pytest.fixture(scope="module")
def kept():
    return iccm.fit(SQUARE, STAR, rigid=[LETTER])


@pytest.mark.slow
def test_a_region_moves_by_an_upright_similarity_of_the_mean_scale(kept):
    similarity = similarity_of(kept)
    assert kept.status is Status.REACHED and similarity.factor == pytest.approx(MEAN, rel=0.02)
    (region,) = kept.report()["regions"]
    assert 1 <= region["dilatation"] <= 1.02 and region["scale"] == pytest.approx(1, abs=0.02)
    assert abs(region["turn"]) < 1
    free = iccm.fit(SQUARE, STAR)
    away = np.abs(Similarity.fit(INSIDE, free.map(INSIDE))(INSIDE) - free.map(INSIDE)).max()
    assert away > 0.05 and "regions" not in free.report()  # it is due to the region


def test_nothing_folds_and_the_outline_is_met(kept):
    assert kept.certificate.share == 1 and kept._boundary["hausdorff"] <= 1e-3
    back = kept.inverse(kept.map(INSIDE))
    assert np.abs(back - INSIDE).max() < 1e-9


def test_a_region_has_the_requested_size():
    fit = iccm.fit(SQUARE, STAR, rigid=[LETTER], rigid_size=0.7)
    assert similarity_of(fit).factor == pytest.approx(0.7 * MEAN, rel=0.02)
    assert fit.report()["regions"][0]["scale"] == pytest.approx(0.7, rel=0.02)


@pytest.mark.slow
def test_a_free_size_is_the_one_that_bends_the_rest_least():
    def energy_with(size):
        fit = iccm.fit(SQUARE, STAR, rigid=[LETTER], rigid_size=size)
        assert fit.status.ok and fit.rigid[0].is_rigid
        return Energy().between(fit.map.source, fit.map.image, fit.map.faces), fit.rigid[0].scale

    least, scale = energy_with("free")
    assert least < min(energy_with(factor * scale)[0] for factor in (0.85, 1.15))


def test_a_region_rotates_where_the_map_may():
    fit = iccm.fit(SQUARE, 1j * SQUARE * np.array([1, 1, 1.3, 1]), rigid=[LETTER], turn="any")
    assert abs(similarity_of(fit).factor) == pytest.approx(np.sqrt(fit.target.area) / 4, rel=0.02)


def test_two_pins_in_a_region_determine_its_place():
    pins = np.array([[-0.3 - 0.7j, -0.5 - 0.6j], [0.5 - 0.7j, 0.3 - 0.3j]])
    fit = iccm.fit(SQUARE, STAR, rigid=[LETTER], pins=pins)
    factor = (pins[1, 1] - pins[0, 1]) / (pins[1, 0] - pins[0, 0])
    assert fit.status.ok and similarity_of(fit).factor == pytest.approx(factor, rel=0.02)
    assert np.abs(fit.map(pins[:, 0]) - pins[:, 1]).max() < 1e-9


@pytest.mark.slow
def test_a_region_without_room_is_smaller_and_reported():
    medal, star, arc = (
        shape.read(str(DRAWN / name)).curve for name in ("medal.svg", "medal.svg#star", "arc.svg")
    )
    fit = iccm.fit(medal, arc, rigid=[star])
    assert fit.status is Status.REACHED and any(re.search(r"mapped at 0\.", note) for note in fit.notes)
    assert fit._boundary["hausdorff"] <= 1e-3 and fit.certificate.share == 1
    factor = similarity_of(fit, star.z[::2]).factor
    mean = np.sqrt(arc.area / medal.area)
    assert factor.real < 0.95 * mean and abs(factor.imag) < 0.02 * mean  # still upright


def test_regions_that_reach_the_outline_are_kept_away_from_it():
    domain = shapely.Polygon(xy_of(SQUARE))
    corner = np.array([1 + 1j, 2 + 1j, 2 + 2j, 1 + 2j])
    regions = regions_of([corner], Curve(SQUARE))
    polygon = shapely.Polygon(xy_of(regions.polygons[0][0]))
    assert domain.exterior.distance(polygon) == pytest.approx(0.01 * 4, rel=1e-6) and regions.notes
    assert polygon.area > 0.85


def test_a_region_that_touches_the_outline_stays_where_it_is_in_a_similar_shape():
    comb = np.array(
        [-2 - 2j, 2 - 2j, 2 + 2j, 1.2 + 2j, 1 - 1j, 0.3 + 1.8j, -0.5 - 1.2j, -1.4 + 1j, -2 + 1.1j]
    )
    fit = iccm.fit(SQUARE, 1.5 * SQUARE + 3, rigid=[comb])
    assert fit.status is Status.REACHED and fit.certificate.share == 1
    assert np.abs(fit.map(INSIDE) - (1.5 * INSIDE + 3)).max() < 1e-6
    assert fit.rigid[0].is_rigid and fit.rigid[0].scale == pytest.approx(1)
    smaller = iccm.fit(SQUARE, SQUARE, rigid=[LETTER], rigid_size=0.8)
    assert smaller.rigid[0].scale == pytest.approx(0.8, rel=0.02)


def test_touching_regions_are_joined_and_what_they_enclose_moves_along():
    boxes = [np.array([0, 1, 1 + 1j, 1j]) + shift for shift in (0, 0.8, -1.5 - 1.5j)]
    regions = regions_of(boxes, Curve(SQUARE))
    areas = sorted(abs(Curve(rings[0]).area) for rings in regions.polygons)
    assert areas == pytest.approx([1, 1.8], rel=0.01)
    frame = [np.array([-1 - 1j, 1 - 1j, 1 - 0.8j, -1 - 0.8j]) * turn for turn in (1, 1j, -1, -1j)]
    assert [len(rings) for rings in regions_of(frame, Curve(SQUARE)).polygons] == [1]
    hole = Curve(0.3 * np.exp(-2j * np.pi * np.arange(12) / 12))
    assert [len(rings) for rings in regions_of(frame, Curve(SQUARE), [hole]).polygons] == [2]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"rigid": [LETTER + 9]}, "rigid region 1: lies outside"),
        ({"strokes": [([-1.5, 1.5], [-1, 1])]}, "stroke 1: runs through a rigid region"),
        ({"pins": [[z, z * np.exp(abs(z) * 1j)] for z in INSIDE[:3]]}, "rigid region 1: .* 3 pins"),
        ({"method": "conformal"}, "rigid: .*balanced"),
        ({"fit": "contain"}, "fit contain"),
        ({"rigid_size": 0.0}, "rigid_size"),
        ({"rigid": [[0, 1, 1j + 1, 1j, 0.5 - 0.1j]]}, "rigid region 1: .*crosses itself"),
    ],
)
def test_wrong_regions_are_refused(options, message):
    with pytest.raises(iccm.InputError, match=message):
        iccm.fit(SQUARE, STAR, **({"rigid": [LETTER]} | options))


def test_the_density_of_regions_has_these_derivatives():
    z, faces = triangulate(np.exp(2j * np.pi * np.arange(16) / 16) / np.sqrt(np.pi), Sizes.even(0.05))
    pattern = system_of(faces, (np.arange(16) + 1) % 16, z.size)
    aims = np.where(np.arange(len(faces)) % 3 == 0, 1.1 + 0.2j, 0)
    shapes = RestShapes.of(pattern, *energy.geometry(z, pattern.corners), aims)
    u, objective = z + 0.15 * z**2 + 0.1 * z.conj(), Objective.of(1.0, 3.0)
    matrix, gradient = np.empty((pattern.columns.size, 4)), np.empty(z.size, complex)
    value = energy.assemble(shapes, u, objective, matrix, gradient)
    assert value == pytest.approx(shapes.energy(u, objective), rel=1e-12)
    direction = np.exp(1j * np.arange(z.size))
    ahead, behind = (shapes.energy(u + h * direction, objective) for h in (1e-6, -1e-6))
    assert (ahead - behind) / 2e-6 == pytest.approx(np.vdot(gradient, direction).real, rel=1e-6)
    alone = shapes._replace(weights=shapes.weights * (aims != 0))
    assert alone.energy((1.1 + 0.2j) * z + 5, objective) == pytest.approx(0, abs=1e-20)
    assert shapes.energy(z.conj(), objective) == np.inf


@pytest.mark.parametrize("strain", [0.05, 5e-3, 1e-4])
def test_no_descent_strains_firm_regions_by_more_than_they_may(strain):
    square, box = Curve(np.array([0, 1, 1 + 1j, 1j])), 0.2 * SQUARE / 2 + 0.5 + 0.5j
    problem = UnitProblem(square, square, WITHOUT_ROTATION, regions=((box,),))
    even = Match(np.arange(5.0), np.arange(5.0))
    begun = place_regions(
        Level.of(problem, 0.08, 0.0, 6e-4, 20.0).started(even),
        RegionPlacement(np.array([2.3 + 0j]), np.array([0.5 + 0.5j]), np.array([0.5 + 0.5j])),
    )
    assert strains(begun).max() < 1e-9 and begun.rigid_vertices.size
    soft, firm = (state.forward(3.0, 50, 1e-6) for state in (begun, begun.with_firm_regions(3.0, strain)))
    assert strains(firm).max() <= strain and strains(soft).max() > 0.05


LEG = np.array([0, 6, 6 + 1j, 1j])
BONE = np.array([0.2 + 0.1j, 2.4 + 0.1j, 2.4 + 0.9j, 0.2 + 0.9j])


@pytest.mark.parametrize("holds_pins", [1, 2])
def test_bones_of_a_leg_keep_their_form_and_the_knee_bends(holds_pins):
    pins = np.array([[0.6 + 0.5j] * 2, [5.4 + 0.5j, 3.2 + 3j], [2 + 0.5j] * 2])[: 1 + holds_pins]
    fit = iccm.deform(LEG, pins=pins, rigid=[BONE, BONE + 3.4])
    assert fit.status is Status.MET and fit.certificate.share == 1
    assert np.abs(fit.map(pins[:, 0]) - pins[:, 1]).max() < 1e-9
    thigh, shin = (similarity_of(fit, BONE + shift + 0.02 * (1.3 + 0.5j - BONE)).factor for shift in (0, 3.4))
    assert [abs(thigh), abs(shin)] == pytest.approx([1, 1], abs=0.02)
    assert 60 < np.degrees(abs(np.angle(shin / thigh))) < 120
    if holds_pins == 2:  # two pins in a rigid region
        assert thigh == pytest.approx(1, abs=0.02)


def test_a_pin_in_the_middle_of_a_region_fixes_it():
    disc = 0.3 + 0.4 * np.exp(2j * np.pi * np.arange(24) / 24)
    fit = iccm.fit(SQUARE, STAR, rigid=[disc], pins=[[0.3, 0.5 + 0.1j]])
    assert fit.status.ok and fit.map(np.array([0.3 + 0j]))[0] == pytest.approx(0.5 + 0.1j, abs=1e-9)
    assert similarity_of(fit, 0.3 + 0.9 * (disc[::3] - 0.3)).factor == pytest.approx(MEAN, rel=0.02)


def test_wrong_options_for_bones_are_refused():
    pins = [[0.6 + 0.5j] * 2]
    with pytest.raises(iccm.InputError, match="rigid_size: "):
        iccm.deform(LEG, pins=pins, rigid=[BONE], rigid_size=2.0)
    with pytest.raises(iccm.InputError, match=r"rigid: .* balanced method"):
        iccm.deform(LEG, pins=pins, rigid=[BONE], method="paper")


@pytest.mark.slow
def test_a_region_that_leaves_no_room_around_it_is_made_smaller():
    bar, ring = np.array([0, 12, 12 + 1j, 1j]), np.exp(1j * np.linspace(0.3, 6, 60))
    region = np.array([9, 10, 10 + 0.2j, 9.3 + 0.2j, 9.3 + 0.9j, 9 + 0.9j]) + 0.05j
    fit = iccm.fit(bar, np.append(3 * ring, 2.6 * ring[::-1]), rigid=[region])
    (shrunk,) = fit.rigid
    assert fit.status.ok and shrunk.is_rigid and 0.2 < shrunk.scale < 0.98
    (match,) = (re.search(r"mapped at (0\.\d\d) ", note) for note in fit.notes if "Rigid region" in note)
    assert fit.certificate.share == 1 and match
    (repeated,) = iccm.fit(fit.source, fit.target, rigid=[region], rigid_size=float(match[1])).rigid
    assert repeated.is_rigid and repeated.scale == pytest.approx(float(match[1]), rel=0.02)


@pytest.mark.parametrize("angle", np.linspace(0.0, 1.5, 7))
def test_where_there_is_room_for_a_region_it_is_inside(angle):
    """Including places between the points of the grid on which places are searched."""
    turned = np.exp(1j * angle) * np.array([0, 20, 20 + 1j, 1j])
    domain, box = shapely.Polygon(xy_of(turned)), np.array([-1 - 1j, 1 - 1j, 1 + 1j, -1 + 1j])
    share, place = room_for(0.7 * box, domain, complex(turned.mean()))
    assert 0 < share < 1 and domain.contains(shapely.Polygon(xy_of(place + share * 0.7 * box)))


def test_a_region_that_the_map_around_it_fills_is_not_placed_that_way(monkeypatch):
    """Where that map would fold, it fills the hole in the place of the region, whose outline is lost."""
    square, box = Curve(np.array([0, 1, 1 + 1j, 1j])), np.array([0.2, 0.4, 0.4 + 0.3j, 0.2 + 0.3j])
    problem, free = UnitProblem(square, square, WITHOUT_ROTATION), np.zeros(1, bool)
    solution = MeshMap.plain(square.z, square.z, np.array([[0, 1, 2], [0, 2, 3]]), 4)
    monkeypatch.setattr(rigid_solve.multilevel, "coarse_to_fine", lambda cut, *_, **__: (cut, solution))
    rigid = Rigid(((box,),), np.ones(1), free, free, np.full((1, 2), np.nan))
    placing = RegionPlacement(np.ones(1), np.array([0.3 + 0.2j]), np.array([0.5 + 0.5j]))
    with pytest.raises(Stuck):
        AroundPlaces.of(problem, solution, rigid, placing, patient=False)


@pytest.mark.slow
def test_a_region_moves_to_where_there_is_room():
    # a bar onto a ball with a handle: without constraints the disc is mapped into the handle, which is too narrow for
    # it
    bar = np.array([0, 8, 8 + 1.2j, 1.2j])
    ball = 1.6 * np.exp(1j * np.linspace(np.pi - 0.2, -np.pi + 0.2, 40)[::-1])
    handle = np.array([-8 + 0.32j, -8 - 0.32j])
    disc = 3.2 + 0.6j + 0.5 * np.exp(2j * np.pi * np.arange(24) / 24)
    fit = iccm.fit(bar, np.concatenate([ball, handle]), rigid=[disc], rigid_size=1.0)
    (region,) = fit.rigid
    assert fit.status.ok and region.is_rigid and region.scale == pytest.approx(1, abs=0.02)
    assert fit.certificate.share == 1 and abs(fit.map(np.array([3.2 + 0.6j]))[0]) < 1.2
    # by default it stays near its place, where it is smaller
    (near,) = iccm.fit(bar, np.concatenate([ball, handle]), rigid=[disc]).rigid
    assert near.is_rigid and near.scale < 0.8


def test_room_is_found_where_a_shape_fits_and_nearest():
    domain = shapely.Polygon([(0, 0), (10, 0), (10, 1), (4, 1), (4, 4), (0, 4)])
    square = np.array([-1 - 1j, 1 - 1j, 1 + 1j, -1 + 1j])
    share, place = room_for(square, domain, 9 + 0.5j)
    assert share == 1 and abs(place - (2.9 + 1.1j)) < 0.1
    share, place = room_for(4 * square, domain, 0j)
    assert 0.45 < share < 0.5 and abs(place - (2 + 2j)) < 0.1


def test_a_smaller_shape_lies_nearer_to_its_place_unless_it_would_be_tiny():
    domain = shapely.Polygon([(0, 0), (10, 0), (10, 1), (4, 1), (4, 4), (0, 4)])
    square = np.array([-1 - 1j, 1 - 1j, 1 + 1j, -1 + 1j])
    share, place = room_for(square, domain, 9 + 0.5j, is_smaller_nearer=True)
    assert 0.35 < share < 0.5 and abs(place - (9 + 0.5j)) < 0.2
    share, place = room_for(square, domain, 3.5 + 0.6j, is_smaller_nearer=True)
    assert share > 0.7 and place.real < 3.2
    assert room_for(square, domain, 2 + 2j, is_smaller_nearer=True)[0] == 1


def test_a_speck_far_from_the_domain_keeps_its_size_and_the_nearest_place():
    """Distances are relative to the size of the region, so a smaller one further on used to seem better without end."""
    domain = shapely.Polygon([(0, 0), (10, 0), (10, 1), (4, 1), (4, 4), (0, 4)])
    speck = 1e-3 * np.array([-1 - 1j, 1 - 1j, 1 + 1j, -1 + 1j])
    share, place = room_for(speck, domain, 20 + 0.5j, is_smaller_nearer=True)
    assert share > 0.9 and abs(place - (10 + 0.5j)) < 0.1


@pytest.mark.slow
def test_a_region_of_the_target_is_one_of_the_inverse_problem():
    with_target_region = iccm.fit(STAR, SQUARE, rigid_target=[LETTER])
    with_source_region = iccm.fit(SQUARE, STAR, rigid=[LETTER])
    assert with_target_region.status.ok and with_target_region.certificate.report()["certified"]
    np.testing.assert_array_equal(with_target_region.map.image, with_source_region.map.source)
    np.testing.assert_array_equal(with_target_region.map.source, with_source_region.map.image)
    (region,), (inverse,) = with_target_region.rigid, with_source_region.rigid
    assert (
        region.is_rigid
        and region.of_target
        and region.dilatation == pytest.approx(inverse.dilatation, abs=1e-3)
    )
    assert region.scale * inverse.scale == pytest.approx(1, abs=1e-3) and region.turn == pytest.approx(
        -inverse.turn, abs=0.1
    )


def test_a_region_of_the_target_has_the_requested_size():
    (region,) = iccm.fit(STAR, SQUARE, rigid_target=[LETTER], rigid_size=1.3).rigid
    assert region.is_rigid and region.scale == pytest.approx(1.3, abs=0.026)
