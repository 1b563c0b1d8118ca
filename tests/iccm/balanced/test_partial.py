"""Partial maps: concavities filled, holes ignored, and the notes about them."""

import numpy as np
import pytest
import shapely

import iccm
from iccm import InputError
from iccm.arrays import xy_of
from iccm.balanced.holes.bays import SHALLOW_DEPTH_SHARE, fill_half_hull, fill_hull
from iccm.balanced.minimise.energy import (
    NO_SLOTS,
    Objective,
    RestShapes,
    geometry,
)
from iccm.balanced.search.symmetry import half_of
from iccm.curve import Curve
from iccm.frames.choice import GOOD_STRETCH_P95
from tests.core.reference.minimise import void_derivatives

STEPS = np.exp(2j * np.pi * np.arange(60) / 60)
DISC = Curve.domain(3 * STEPS)
SQUARE = Curve.domain(np.array([0, 4, 4 + 4j, 4j]))
U = Curve.domain(np.array([-3, 3, 3 + 6j, 2 + 6j, 2 + 1j, -2 + 1j, -2 + 6j, -3 + 6j]))
HOOK = Curve.domain(np.array([0, 5, 5 + 6j, 4 + 6j, 4 + 1j, 1 + 1j, 1 + 3j, 3j]))  # not symmetric
STAR = Curve.domain(1j * np.exp(1j * np.pi / 5 * np.arange(10)) * np.where(np.arange(10) % 2, 0.35, 1))
PAIRS = {"U": (U, SQUARE), "hook": (HOOK, SQUARE), "star": (STAR, DISC)}


@pytest.fixture(scope="module")
def u_onto_square():
    return iccm.fit(U, SQUARE, fit="contain")


def polygon(curve):
    return shapely.Polygon(xy_of(curve.z))


def unit(curve):
    return Curve(curve.z / np.sqrt(curve.area))


@pytest.mark.parametrize("curve", [U, HOOK, STAR], ids=["U", "hook", "star"])
def test_a_shape_with_its_bays_is_its_hull_but_for_shallow_ones(curve):
    filled = fill_hull(unit(curve))
    hull = polygon(unit(curve)).convex_hull
    assert hull.contains(polygon(filled.outline).buffer(-1e-12))
    assert hull.difference(polygon(filled.outline)).area < 2 * SHALLOW_DEPTH_SHARE * hull.length
    bays = [shapely.Polygon(xy_of(bay)) for bay in filled.bays]
    parts = shapely.unary_union([polygon(unit(curve)), *bays])
    assert parts.symmetric_difference(polygon(filled.outline)).area < 1e-12
    outline = set(filled.outline.z.tolist())
    assert all(bay[0] in outline and bay[-1] in outline for bay in filled.bays)


def test_an_edge_along_the_hull_does_not_begin_a_bay():
    """The feet of a U lie on its hull; its only concavity is the one between them."""
    filled = fill_hull(unit(U))
    assert [bay.size for bay in filled.bays] == [4]
    assert fill_hull(unit(SQUARE)).bays == () == fill_hull(unit(DISC)).bays


def test_a_dent_of_little_area_is_not_a_bay_however_deep():
    """Notches of .3 % and of 2.5 % of the area; both are deeper than what counts as convex."""
    small, large = [0.2, 0.25 + 0.06j, 0.3], [0.5, 0.7 + 0.12j, 0.9]
    (bay,) = fill_hull(Curve(np.array([0, *small, *large, 1.25, 1.25 + 0.8j, 0.8j]))).bays
    assert sorted(bay, key=lambda z: z.real) == large


@pytest.mark.parametrize("curve", [U, STAR], ids=["U", "star"])
def test_half_a_shape_gets_half_the_bays(curve):
    whole = fill_hull(unit(curve))
    half = half_of(unit(curve))
    filled, top = fill_half_hull(half.curve, half.top)
    assert 2 * filled.outline.area == pytest.approx(whole.outline.area, rel=1e-9)
    assert filled.outline.z[0].real == top.real == 0 and filled.outline.z[0].imag < top.imag
    assert filled.outline.z.real.min() > -1e-12


def test_a_void_counts_the_area_of_its_image():
    """Apart from a barrier, for any form of the image; for the inverse map, that of the source's vertices."""
    z, faces = np.array([0, 1, 0.2 + 1j]), np.array([[0, 1, 2]])
    u = np.array([0.1j, 0.9, 1.3 + 0.7j])
    gradients, areas = geometry(z, faces)
    _, images = geometry(u, faces)
    forward = RestShapes(faces, NO_SLOTS, gradients, -areas).energy(u, Objective.of(1.0, 3.0))
    assert forward == pytest.approx(images[0], rel=0.01)
    back = RestShapes(faces, NO_SLOTS, geometry(u, faces)[0], -images)
    assert back.energy(z, Objective.of(1.0, 3.0, forward=False)) == pytest.approx(forward, rel=1e-12)


@pytest.mark.parametrize("forward", [True, False])
def test_derivatives_of_a_void(forward):
    p, d, step = 0.9, 0.4, 1e-5

    def value(p, d):
        return void_derivatives(p, d, forward)[0]

    _, by_p, by_d, _, by_pd, by_dd = void_derivatives(p, d, forward)
    assert by_p == pytest.approx((value(p + step, d) - value(p - step, d)) / (2 * step), rel=1e-6, abs=1e-12)
    assert by_d == pytest.approx((value(p, d + step) - value(p, d - step)) / (2 * step), rel=1e-6, abs=1e-12)
    slopes = [void_derivatives(p + s, d + t, forward) for s, t in ((0, step), (0, -step))]
    assert by_dd == pytest.approx((slopes[0][2] - slopes[1][2]) / (2 * step), rel=1e-5, abs=1e-10)
    assert by_pd == pytest.approx((slopes[0][1] - slopes[1][1]) / (2 * step), rel=1e-5, abs=1e-10)


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=() if name == "hook" else pytest.mark.slow) for name in PAIRS]
)
def test_all_of_the_source_is_shown_and_the_map_is_less_stretched(name):
    source, target = PAIRS[name]
    whole, fit = (iccm.fit(source, target, fit=choice) for choice in ("whole", "contain"))
    report = fit.report()
    assert fit.status.ok and fit.certificate.certified
    assert report["left_out"] == pytest.approx(0, abs=1e-3) and 0 < report["uncovered"] < 0.15
    assert report["stretch"]["p95"] < 0.9 * whole.report()["stretch"]["p95"]
    image_polygon = shapely.Polygon(xy_of(fit.map.image[fit.map.loops[0]]))
    assert 1 - image_polygon.area / polygon(target).area == pytest.approx(report["uncovered"], abs=1e-3)
    assert polygon(target).buffer(1e-3).contains(image_polygon)
    assert abs(Curve(fit.map.polygon).area) == pytest.approx(source.area, rel=1e-3)
    assert report["boundary"]["hausdorff"] < 5e-4  # of the outline with concavities filled


@pytest.mark.slow
def test_cover_is_the_inverse_of_contain():
    forward, back = iccm.fit(HOOK, SQUARE, fit="contain"), iccm.fit(SQUARE, HOOK, fit="cover")
    assert back.coverage.uncovered == pytest.approx(0, abs=1e-3)
    assert back.coverage.left_out == pytest.approx(forward.coverage.uncovered, rel=0.05)
    assert back.report()["boundary"]["hausdorff"] < 5e-4


@pytest.mark.slow
def test_a_fit_that_leaves_parts_out_keeps_all_where_that_costs_less(u_onto_square):
    assert u_onto_square.details.filled is not None
    whole, contained = (iccm.fit(SQUARE, DISC, fit=name) for name in ("whole", "contain"))
    assert not contained.coverage.is_partial and "left_out" not in contained.report()
    assert np.array_equal(contained.map.image, whole.map.image)


def test_symmetric_pairs_stay_symmetric(u_onto_square):
    fit = u_onto_square
    z = fit._interior[np.abs(fit._interior.real) > 0.1]
    middle = 0.5 * sum(SQUARE.box).real
    w, mirrored = fit.map(z), fit.map(-z.conj())
    finite = np.isfinite(w) & np.isfinite(mirrored)
    assert finite.mean() > 0.9
    assert np.abs((w - middle) + (mirrored - middle).conj())[finite].max() < 1e-6


@pytest.mark.slow
def test_the_lost_area_is_bounded(u_onto_square):
    free = u_onto_square
    assert free.coverage.uncovered > 0.01
    assert not iccm.fit(
        U, SQUARE, fit="contain", max_uncovered=0.5 * free.coverage.uncovered
    ).coverage.is_partial
    assert iccm.fit(U, SQUARE, fit="contain", max_left_out=0.0).coverage.uncovered == pytest.approx(
        free.coverage.uncovered
    )


@pytest.mark.slow
def test_pins_are_met_by_partial_maps():
    pins = np.array([[-2.5 + 4j, 0.5 + 3j], [2.5 + 4j, 3.5 + 2.5j]])
    assert not iccm.fit(U, SQUARE, exact_pins=True, pins=pins).coverage.is_partial  # unless requested
    fit = iccm.fit(U, SQUARE, exact_pins=True, pins=pins, fit="contain")
    assert fit.details.filled is not None and fit.certificate.certified
    assert np.abs(fit.map(pins[:, 0]) - pins[:, 1]).max() < 1e-9


@pytest.mark.slow
@pytest.mark.parametrize(("pair", "name"), [((U, SQUARE), "contain"), ((SQUARE, HOOK), "cover")])
def test_the_lost_part_has_the_reported_area_and_is_hatched(pair, name):
    fit = iccm.fit(*pair, fit=name)
    shares = [region.area / curve.area for region, curve in zip(fit.coverage.without_partner, pair)]
    assert (
        shares == pytest.approx([fit.coverage.left_out, fit.coverage.uncovered], abs=1e-5)
        and max(shares) > 0.01
    )
    hatched = [sum(bool(patch.get_hatch()) for patch in axes.patches) for axes in fit.plot().axes[:2]]
    assert [count > 0 for count in hatched] == [not region.is_empty for region in fit.coverage.unseen]
    assert hatched[name == "contain"] > 0


@pytest.mark.slow
@pytest.mark.parametrize("pins, partial", [([[-3, 0], [3, 4]], True), ([[-3, 0], [1j, 2 + 4j]], False)])
def test_bays_are_filled_but_for_those_where_the_outline_is_pinned(pins, partial):
    fit = iccm.fit(U, SQUARE, pins=pins, fit="contain")
    pin_sources, pin_targets = np.array(pins, complex).T
    assert fit.coverage.is_partial == partial and fit.status.ok and fit.certificate.certified
    assert np.abs(fit.map(pin_sources) - pin_targets).max() < 1e-9
    assert (fit.report()["stretch"]["p95"] < GOOD_STRETCH_P95) == partial


@pytest.mark.slow
def test_holes_are_ignored_where_that_costs_less():
    """A hole at the left end of a block is not mapped to one at the right end of another."""
    block = Curve.domain(np.array([-4 - 1j, 4 - 1j, 4 + 1j, -4 + 1j]))
    wedge = Curve.domain(np.array([-4 - 1j, 4 - 1j, 3.5 + 1j, -4 + 1j]))
    shapes = [
        shapely.Polygon(xy_of(outline.z), [xy_of(0.5 * STEPS + middle)])
        for outline, middle in ((block, -3), (wedge, 3))
    ]
    kept, free = (iccm.fit(*shapes, holes=choice) for choice in ("keep", "auto"))
    assert len(kept.source_holes) == 1 and not kept.coverage.is_partial and not free.source_holes
    share = abs(Curve(0.5 * STEPS).area) / block.area
    assert free.coverage.hidden == pytest.approx(share, rel=0.3) and free.coverage.left_out == 0
    assert (
        abs(free.report()["turn"]) < 5 < abs(kept.report()["turn"])
    )  # upside down, the holes are mapped onto each other


def test_unknown_fits_are_refused(u_onto_square):
    for wrong in ({"fit": "loose"}, {"holes": "fill"}, {"max_uncovered": 2.0}):
        with pytest.raises(InputError):
            iccm.fit(U, SQUARE, **wrong)
    with pytest.raises(InputError, match="balanced"):
        iccm.fit(U, SQUARE, method="conformal", fit="cover")
    with pytest.raises(InputError, match="partial"):
        iccm.fit(U, SQUARE, start=u_onto_square)


def test_mouths_lie_outside_also_behind_a_spit():
    """A coast that bulges beyond the chord from the root of a spit: its mouth is split there."""
    spit = [10, 10.5 + 4j, 10.4 + 4j, 10 + 1j]
    outline = Curve(0.1 * np.array([0, *spit, 6 + 2j, 6 + 3j, 10.15 + 3.5j, 6 + 4.5j, 6 + 9j, 10 + 10j, 10j]))
    filled = fill_hull(outline)
    shape, whole = (shapely.Polygon(xy_of(c.z)) for c in (outline, filled.outline))
    assert len(filled.bays) == 2 and whole.is_valid and whole.buffer(1e-12).covers(shape)
    for bay in filled.bays:
        ring = shapely.Polygon(xy_of(bay))
        assert ring.is_valid and shape.intersection(ring).area < 1e-12
