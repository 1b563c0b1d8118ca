"""Algorithm 1 of the paper: energies, termination, invariance, invalid input."""

import re

import numpy as np
import pytest

import iccm
from iccm.curve import Curve
from iccm.options import Options
from iccm.paper.algorithm1 import assemble, discretise, first_targets, iterate
from iccm.paper.energies import Basis
from iccm.paper.initial import arclength, from_constraints
from iccm.paper.least_squares import LeastSquares
from iccm.paper.normalised import NormalisedProblem
from iccm.problem import Problem
from iccm.status import Status
from tests.cases import some_fast
from tests.shapes import arrow, blob, circle, ell, inside, pear, square, star

PAPER = {"method": "paper", "vertices": 40, "max_iterations": 25}
PINS = np.array([[0.2, 1], [-0.3 + 0.2j, 2 + 0.5j]])
STROKES = [(np.array([-0.3, 0.3 + 0.1j]), np.array([0.5 + 0.5j, 2 + 0.3j]))]
JOBS = {
    "conformal": {},
    "pins": {"pins": PINS},
    "strokes": {"strokes": STROKES},
    "quasi": {"quasi": 0.1},
    "consistent": {"consistency": 1e-3},
    "all": {"pins": PINS, "strokes": STROKES, "quasi": 0.05, "smoothness": 1e-4},
}


@pytest.fixture(params=JOBS)
def job(request):
    return {**PAPER, **JOBS[request.param]}


@pytest.mark.slow
@pytest.mark.parametrize("order", [0, 1])
def test_the_energy_never_increases(job, order):
    fit = iccm.fit(pear(), arrow(), **job, order=order)
    total = np.array([e["total"] for e in fit.energies])
    assert fit.report()["iterations"] == total.size - 1 >= 10
    assert np.all(np.diff(total) <= 1e-14 * total[:-1])
    assert total[-1] < 0.6 * total[0]


@pytest.mark.parametrize("name", JOBS)
def test_both_halves_of_each_step_lower_the_energy(name):
    """Zeroth order, by hand: the global step with fixed targets, and the local step with a fixed map."""
    constraints = {k: v for k, v in JOBS[name].items() if k in ("pins", "strokes")}
    settings = {k: v for k, v in JOBS[name].items() if k not in constraints}
    problem = NormalisedProblem.of(Problem.of(pear(), arrow(), **constraints), as_begun=True)
    options = Options(method="paper", **settings)
    polygon, s = discretise(problem.source, 40)
    basis = Basis(polygon.z, options.quasi is not None)
    system = LeastSquares(assemble(problem, options, basis, polygon))
    targets = first_targets(problem, options, system, polygon, s, basis)
    x = system.solve(targets)
    before = system.energies(x, targets)["total"]
    for _ in range(20):
        targets = system.targets(x)
        local = system.energies(x, targets)["total"]
        x = system.solve(targets)
        after = system.energies(x, targets)["total"]
        assert after <= local * (1 + 1e-13) and local <= before * (1 + 1e-13)
        before = after
    names = {"closeness", *constraints, "total"}
    assert names <= set(system.energies(x, targets))


def test_the_arclength_start_pairs_equal_shares_of_the_boundaries():
    problem = NormalisedProblem.of(Problem.of(square(), arrow()), as_begun=True)
    assert problem.target is not None
    w = arclength(problem, np.array([1, 3, 5]) / 6, discretise(problem.source, 40)[1])
    share = (np.arange(120) + 0.5) / 120
    assert np.allclose(w, problem.target.at(share * problem.target.length))


def test_the_report_has_the_reason_for_stopping():
    def end(**options):
        return iccm.fit(pear(), blob(), method="paper", vertices=40, **options)

    assert end(max_iterations=3).status is Status.LIMIT and not Status.LIMIT.ok
    assert end(max_iterations=3).report()["iterations"] == 3
    assert end(threshold=1e-2)._ended is Status.THRESHOLD
    fit = end(decrease=0.05)
    assert fit.status is Status.DECREASE and fit.status.ok
    last = [e["total"] for e in fit.energies]
    assert last[-2] - last[-1] <= 0.05 * last[-2] and last[-3] - last[-2] > 0.05 * last[-3]


def test_a_step_that_does_not_lower_the_energy_is_undone():
    """A system whose local step returns ever more distant targets: the map does not move."""

    class Hostile(LeastSquares):
        def energies(self, x, targets):
            return {"total": 1.0 + float(np.abs(x).max() > 0)}

    problem, options = (
        NormalisedProblem.of(Problem.of(square(), arrow()), as_begun=True),
        Options(method="paper"),
    )
    polygon = problem.source.resample(20)
    basis = Basis(polygon.z)
    x, energies, status = iterate(
        Hostile(assemble(problem, options, basis, polygon)), np.zeros(20, complex), options
    )
    assert not x.any() and status is Status.DECREASE and len(energies) == 2


def test_a_shape_onto_itself_is_the_identity():
    for shape in (arrow(), square(), ell()):
        fit = iccm.fit(shape, shape, method="paper", vertices=60)
        z = inside(shape)
        assert np.abs(fit.map(z) - z).max() < 1e-12
        assert fit.status is Status.THRESHOLD


@pytest.mark.parametrize("vertices", [None, "source"])
@pytest.mark.parametrize("start", [0, 7, 30])
def test_a_drop_onto_itself_is_the_identity_wherever_its_outline_starts(start, vertices):
    """Its only corner, where resampling starts, need not be the outline's first vertex."""
    drop = np.roll(teardrop(), -start)
    fit = iccm.fit(drop, drop, method="paper", vertices=vertices)
    z = inside(drop)
    assert np.abs(fit.map(z) - z).max() < (1e-12 if vertices else 1e-3)


def teardrop(n=60):
    """Smooth except for a corner at 1."""
    t = 2 * np.pi * np.arange(n) / n
    return np.cos(t) + 1j * np.sin(t) * np.sin(t / 2)


def test_the_given_vertices_of_the_source_are_used_unchanged():
    for method in ("paper", "conformal"):
        fit = iccm.fit(pear(33), blob(), method=method, vertices="source")
        polygon = fit.map.polygon
        assert polygon.size == 33
        assert np.abs(polygon[:, None] - pear(33)).min(axis=0).max() < 1e-12
    with pytest.raises(iccm.InputError, match=r"vertices: .*4001.*more than 4000"):
        iccm.fit(pear(4001), blob(), method="paper", vertices="source")


def test_the_start_minimises_the_energy_of_the_pins():
    """§3.1: pins that can be met are met; for contradictory ones, their mean is."""
    pins = np.array([[0.2, 1], [-0.3 + 0.2j, 2 + 0.5j], [0.1 - 0.4j, 0.3j], [0.5, 0.5], [0.5, 0.9]])
    for strokes in ([], STROKES):
        problem = NormalisedProblem.of(Problem.of(pear(), arrow(), pins, strokes), as_begun=True)
        polygon, _ = discretise(problem.source, 40)
        for harmonic in (False, True):
            basis = Basis(polygon.z, harmonic)
            image = basis.positions(problem.pins[:, 0]) @ from_constraints(problem, basis, polygon)
            images = problem.target_frame.pull_back(image)
            assert np.allclose(images, [*pins[:3, 1], 0.7, 0.7], atol=1e-9)


@pytest.mark.parametrize("harmonic", [False, True])
def test_a_corner_moved_a_little_moves_the_deformation_a_little(harmonic):
    """The two halves of a harmonic map bend separately: in one row they cancelled as the frame rotated."""
    hexagon = circle(6)
    moved = hexagon * (1 + np.array([0, 0, 1e-6, 0, 0, 0]))
    pins = [[-0.5, -0.5], [0.5, 0.5], [0.3j, 0.3 + 0.5j]]
    options = {"pins": pins, "quasi": 0.1} if harmonic else {"pins": pins}
    a, b = (iccm.deform(shape, method="paper", **options) for shape in (hexagon, moved))
    z = inside(hexagon)
    assert np.abs(a.map(z) - b.map(z)).max() < 1e-5


def similarity(job, a, b, c, d):
    """The job with source points moved by a z + b and target points by c w + d."""
    moved = dict(job)
    if "pins" in job:
        moved["pins"] = np.column_stack([a * job["pins"][:, 0] + b, c * job["pins"][:, 1] + d])
    if "strokes" in job:
        moved["strokes"] = [(a * p + b, c * q + d) for p, q in job["strokes"]]
    return moved


MOVES = {
    "similar": (2 * np.exp(0.7j), 3 - 2j, 0.3 * np.exp(-2.1j), -10 + 4j),
    "thousandfold": (1000, 0, 1000, 0),
    "far": (1, 1e6, 1, -1e6j),
    "small": (1e-6, 0, 1e4, 0),
}


@pytest.mark.parametrize("order", [0, 1])
@pytest.mark.parametrize("move", some_fast(MOVES, {"similar"}))
def test_similarities_commute_with_the_result(job, order, move):
    a, b, c, d = MOVES[move]
    source, target, z = pear(), arrow(), inside(pear())
    fit = iccm.fit(source, target, **job, order=order)
    moved = iccm.fit(a * source + b, c * target + d, **similarity(job, a, b, c, d), order=order)
    error = np.abs(moved.map(a * z + b) - (c * fit.map(z) + d)).max() / moved._diagonal
    assert error < 1e-8
    # the diagonal of the bounding box, the unit of reports, turns with the shape: compare lengths themselves
    rms = [f._boundary["rms"] * f._diagonal for f in (fit, moved)]
    assert rms[1] == pytest.approx(abs(c) * rms[0], rel=1e-6)


def test_a_mirror_image_gives_the_mirrored_map():
    source, target, z = pear(), arrow(), inside(pear())
    fit = iccm.fit(source, target, **PAPER)
    mirrored = iccm.fit(source.conj(), target.conj(), **PAPER)
    # mirroring reverses the outline; both keep their first vertex, so the start of arclength is the mirrored one
    assert np.abs(mirrored.map(z.conj()) - fit.map(z).conj()).max() < 1e-8


@pytest.mark.parametrize("order", [0, 1])
def test_reversing_the_vertices_changes_nothing(job, order):
    """In reverse from the same first vertex; the paper's start does depend on where an outline begins."""
    source, target = pear(), arrow()
    z = inside(source)
    fit = iccm.fit(source, target, **job, order=order)
    reverse = iccm.fit(np.roll(source[::-1], 1), np.roll(target[::-1], 1), **job, order=order)
    assert np.abs(fit.map(z) - reverse.map(z)).max() < 1e-12


@pytest.mark.parametrize("order", [0, 1])
def test_the_same_input_gives_the_same_bytes(job, order):
    a, b = (iccm.fit(pear(), arrow(), **job, order=order) for _ in range(2))
    assert a.map.phi.tobytes() == b.map.phi.tobytes() and a.map.psi.tobytes() == b.map.psi.tobytes()


def test_curves_and_arrays_are_the_same_input():
    a = iccm.fit(pear(), arrow(), **PAPER)
    b = iccm.fit(Curve.domain(pear()), Curve.domain(arrow()), **PAPER)
    assert a.map.phi.tobytes() == b.map.phi.tobytes()


@pytest.mark.slow
def test_first_order_needs_a_third_of_the_iterations_for_the_same_energy():
    """§3.4, for at least four of five pairs: the two orders do not always end in the same local minimum."""
    pairs = [(pear(), blob()), (pear(), arrow()), (star(), circle(60)), (ell(4), square()), (blob(), arrow())]
    caught_up = []
    for source, target in pairs:
        options = {"method": "paper", "vertices": 60, "decrease": 0}
        zeroth, first = (iccm.fit(source, target, order=k, **options) for k in (0, 1))
        goal = (1 + 1e-6) * zeroth.energies[-1]["total"]
        reached = [k for k, e in enumerate(first.energies) if e["total"] <= goal]
        caught_up.append(bool(reached) and 3 * reached[0] <= zeroth.report()["iterations"])
    assert sum(caught_up) >= 4


def test_the_map_takes_the_boundary_near_the_target():
    fit = iccm.fit(pear(), blob(), method="paper")
    assert fit.report()["boundary"]["hausdorff"] < 1e-2 and fit.report()["boundary"]["rms"] < 3e-3
    assert fit.report()["injective"]["certified"]


@pytest.mark.slow
def test_the_report_has_the_requested_figures():
    fit = iccm.fit(pear(), blob(), pins=PINS * 0.2, strokes=[([0, 0.2], [0, 0.2])], **PAPER, quasi=0.1)
    report = fit.report()
    assert report["status"] == fit.status.name.lower() and report["message"] == fit.status.value
    assert report["vertices"] == fit.map.polygon.size and report["iterations"] == fit.report()["iterations"]
    assert len(report["pins"]) == 2 and len(report["strokes"]) == 1
    expected = np.abs(fit.map(PINS[:, 0] * 0.2) - PINS[:, 1] * 0.2) / Curve(blob()).diagonal
    assert np.allclose([p["error"] for p in report["pins"]], expected)
    assert 1 <= report["dilatation"]["median"] <= report["dilatation"]["p95"] <= report["dilatation"]["max"]
    assert report["log10_area"]["p05"] <= report["log10_area"]["median"] <= report["log10_area"]["p95"]


BAD_OPTIONS = {
    "method": ("magic", "method: 'magic' is not one of balanced, conformal, paper"),
    "order": (2, "order: 2 … 0 or 1"),
    "quasi": (-1, "quasi: -1 is not a finite number of at least 0"),
    "pin_weight": (np.nan, "pin_weight: nan is not a finite number"),
    "tolerance": (np.inf, "tolerance: inf is not a finite number"),
    "vertices": (2, "vertices: 2 is not between 3 and 4000"),
    "vertices by name": ("all", "vertices: 'all' is neither a number nor 'source'"),
    "samples_per_edge": (0, "samples_per_edge: 0 … at least 1"),
    "max_iterations": (0, "max_iterations: 0 … at least 1"),
    "tangential": (0, "tangential: 0 … above 0"),
    "max_left_out": (1.5, "max_left_out: 1.5 … 0 and 1"),
    "max_stretch": (0.5, "max_stretch: 0.5 … at least 1"),
    "balance": ("much", "balance: 'much' is not a number"),
    "rigid_size": (0, "rigid_size: 0 … above 0"),
}


@pytest.mark.parametrize("name", BAD_OPTIONS)
@pytest.mark.parametrize(
    "call", [lambda **k: iccm.fit(square(), ell(), **k), lambda **k: iccm.deform(square(), **k)]
)
def test_options_out_of_range_are_refused_in_one_line(name, call):
    value, message = BAD_OPTIONS[name]
    with pytest.raises(iccm.InputError) as caught:
        call(**{name.split()[0]: value})
    error = str(caught.value)
    assert "\n" not in error and all(part in error for part in message.split(" … "))


BAD_INPUT = {
    "nan source": (([np.nan, 1, 1j], square()), {}, "source: vertex 0 is not a finite number"),
    "flat target": ((square(), [0, 1, 2]), {}, "target: the outline encloses no area"),
    "crossing": (([0, 2 + 2j, 2, 1j], square()), {}, "source: the outline crosses itself"),
    "nan pin": ((square(), ell()), {"pins": [[0, np.nan]]}, "pins: some coordinates are not finite"),
    "pin outside": (
        (square(), ell()),
        {"pins": [[0, 0], [3 + 1j, 0]]},
        "pin 2: (3, 1) is 2 outside the source shape; move it inside",
    ),
    "stroke outside": (
        (square(), ell()),
        {"strokes": [([0, 2], [0, 1])]},
        "source stroke vertex 2: (2, 0) is",
    ),
    "short stroke": (
        (square(), ell()),
        {"strokes": [([0, 0.5], [1, 1])]},
        "target stroke: a stroke needs at",
    ),
    "points in space": (
        ([[0, 0, 0], [1, 0, 0], [1, 1, 0]], square()),
        {},
        "source: wrong shape (3, 3)",
    ),
    "words": (("abc", square()), {}, "source: is the name of a file; read it first"),
    "flat pins": ((square(), ell()), {"pins": [0, 1, 2]}, "pins: wrong shape (3,)"),
    "ragged pins": (
        (square(), ell()),
        {"pins": [[0, 1], [0]]},
        "pins: cannot be read as an array of complex numbers",
    ),
    "lone stroke": ((square(), ell()), {"strokes": [0.5]}, "strokes: item 1 is not a pair of polylines"),
}


@pytest.mark.parametrize("name", BAD_INPUT)
@pytest.mark.parametrize("method", ["paper", "conformal"])
def test_bad_input_is_refused_in_one_line(name, method):
    shapes, options, message = BAD_INPUT[name]
    with pytest.raises(iccm.InputError, match=re.escape(message)) as caught:
        iccm.fit(*shapes, method=method, **options)
    assert "\n" not in str(caught.value)


def test_a_tolerance_of_zero_is_refused():
    with pytest.raises(iccm.InputError, match=r"tolerance: 0 .* above 0"):
        iccm.fit(square(), ell(), tolerance=0)


@pytest.mark.slow
def test_an_outline_of_very_many_vertices_is_mapped():
    """All of them are corners of its convex hull: their pairwise distances would take 37 GB."""
    fit = iccm.fit(square(), np.exp(2j * np.pi * np.arange(50_000) / 50_000), method="conformal")
    assert fit.status.ok and "simplified from 50000" in fit.notes[0]


def test_an_unknown_option_is_a_type_error():
    with pytest.raises(
        TypeError, match=r"fit\(\) got an unexpected .* 'verticse'; did you mean 'vertices'\?"
    ):
        iccm.fit(square(), ell(), verticse=5)
    with pytest.raises(TypeError, match=r"transfer\(\) .* 'texure_box'; did you mean 'texture_box'\?"):
        iccm.transfer(iccm.checkerboard(), square(), ell(), texure_box=(0, 1 + 1j))
    with pytest.raises(TypeError, match=r"deform\(\) .* 'stroke'; did you mean 'strokes'\?"):
        iccm.deform(square(), stroke=[])
    with pytest.raises(TypeError, match=r"'elephant'$"):
        iccm.transfer(iccm.checkerboard(), square(), ell(), elephant=1)
