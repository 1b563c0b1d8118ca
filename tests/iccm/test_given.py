"""What `fit`, `deform` and `transfer` accept for shapes, points and pictures, and what they return."""

import threading
from typing import get_args

import numpy as np
import pytest
import shapely
import skimage.measure
import skimage.transform
import trimesh

import iccm
from iccm import InputError, given
from iccm.axes import complex_in, pairs_in
from tests.cases import some_fast
from tests.shapes import arrow, pear

FLAG = np.array([[0.0, 0.0], [7.0, 0.5], [6.5, 3.0], [3.0, 2.5], [2.5, 6.0], [0.25, 5.75]])
"""An asymmetric outline, x and y."""
GOAL = np.array([[1.0, 1.0], [9.0, 0.0], [10.0, 6.0], [4.0, 8.0]])
HOLE = np.array([[1.0, 1.0], [2.0, 1.25], [1.5, 2.0]])


def complex_of(pairs):
    return pairs[:, 0] + 1j * pairs[:, 1]


INSIDE = np.array([[1.0, 1.0], [5.0, 1.5], [1.25, 4.5]])


@pytest.fixture(scope="module")
def plain():
    return iccm.fit(complex_of(FLAG), complex_of(GOAL))


@pytest.fixture(scope="module")
def whole():
    return iccm.fit(complex_of(FLAG), complex_of(GOAL), fit="whole")


class Row:
    """A stand-in for a row of a GeoDataFrame, without GeoPandas."""

    def __init__(self, polygon):
        self.__geo_interface__ = {"type": "Feature", "geometry": shapely.geometry.mapping(polygon)}


KINDS = {
    "pairs": FLAG,
    "closed pairs": np.concatenate([FLAG, FLAG[:1]]),
    "a list": FLAG.tolist(),
    "a curve": iccm.Curve.domain(complex_of(FLAG)),
    "a polygon": shapely.Polygon(FLAG),
    "a ring": shapely.LinearRing(FLAG),
    "one of several": shapely.MultiPolygon([shapely.Polygon(FLAG)]),
    "GeoJSON": shapely.geometry.mapping(shapely.Polygon(FLAG)),
    "a row": Row(shapely.Polygon(FLAG)),
    "a path": trimesh.path.Path2D(
        [trimesh.path.entities.Line([0, 1, 2, 3, 4, 5, 0])], vertices=FLAG, process=False
    ),
    "a contour of OpenCV": FLAG[:, None, :],
}


@pytest.mark.parametrize("kind", some_fast(KINDS, {"GeoJSON", "a row", "a path", "a contour of OpenCV"}))
def test_shapes_are_accepted_in_several_forms(whole, kind):
    fit = iccm.fit(KINDS[kind], GOAL, fit="whole")
    z = complex_of(INSIDE)
    assert np.abs(fit.map(z) - whole.map(z)).max() < 1e-9 and fit.axes == ("xy", "xy")


def test_holes_of_a_polygon_are_included():
    polygon = shapely.Polygon(FLAG, [HOLE])
    goal = shapely.Polygon(GOAL, [HOLE + np.array([3, 2])])
    fit = iccm.fit(polygon, goal, holes="keep")
    assert len(fit.source_holes) == len(fit.target_holes) == 1 and list(fit.details.hole_partners) == [(0, 0)]
    with pytest.raises(InputError, match="source_holes"):
        iccm.fit(polygon, goal, source_holes=[HOLE])
    assert iccm.fit(polygon, goal, method="paper", vertices=40).source_holes == ()


@pytest.mark.parametrize(
    ("shape", "message"),
    [
        (shapely.Point(0, 0), "Point has no outline"),
        (shapely.Polygon(), "empty"),
        ({"type": "Polygon"}, "GeoJSON"),
        ("heart.svg", "read_shape"),
        (FLAG[None], "shape"),
    ],
)
def test_invalid_shapes_are_refused_in_one_line(shape, message):
    with pytest.raises(InputError, match=f"source.*{message}") as caught:
        iccm.fit(shape, GOAL)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("axes", ["screen", "image"])
def test_axes_flip_pairs_and_polygons_upright(whole, axes):
    def given(pairs):
        return pairs_in(complex_of(pairs), axes)

    fit = iccm.fit(given(FLAG), given(GOAL), axes=axes, fit="whole")
    assert np.array_equal(fit.source.z, whole.source.z) and fit.axes == (axes, axes)
    expected = given(INSIDE * 1.0)
    image = fit.map(given(INSIDE))
    assert np.abs(complex_in(image, axes) - whole.map(complex_of(INSIDE))).max() < 1e-9
    assert np.abs(fit.inverse(image) - expected).max() < 1e-6
    down = shapely.Polygon(FLAG * [1, -1])
    assert np.array_equal(
        iccm.fit(down, given(GOAL), axes=axes, method="paper", vertices=40).source.z, whole.source.z
    )
    with pytest.raises(InputError, match="axes"):
        iccm.fit(FLAG, GOAL, axes="up")


@pytest.mark.slow
def test_pins_strokes_and_regions_are_in_the_same_axes():
    pin = (INSIDE[0], GOAL.mean(axis=0))
    stroke = (INSIDE[1:2] + np.array([[0, 0], [0.5, 0.25]]), np.array([[7.0, 3.0], [7.5, 3.5]]))
    up = iccm.fit(FLAG, GOAL, exact_pins=True, pins=[pin], strokes=[stroke])

    def given(pairs):
        return pairs_in(complex_in(pairs, "xy"), "image")

    fit = iccm.fit(
        given(FLAG),
        given(GOAL),
        exact_pins=True,
        pins=[[given(p) for p in pin]],
        strokes=[[given(s) for s in stroke]],
        axes="image",
    )
    assert np.array_equal(fit.pins, up.pins) and np.array_equal(fit.strokes[0][1].z, up.strokes[0][1].z)
    assert np.abs(fit.map(given(np.array([pin[0]]))) - given(np.array([pin[1]]))).max() < 1e-6


def test_contours_of_scikit_image_are_upright():
    picture = np.zeros((60, 80), bool)
    picture[10:50, 10:30] = picture[10:25, 10:70] = True  # a flag with its pole on the left
    contour = max(skimage.measure.find_contours(picture.astype(float), 0.5), key=len)
    fit = iccm.fit(contour, contour * 2, axes="image")
    places = np.array([[15.0, 60.0], [45.0, 20.0]])
    assert np.abs(fit.map(places) - 2 * places).max() < 0.1
    row, column = np.array(
        [[45.0, 60.0], [15.0, 60.0]]
    )  # nothing is mapped below the flag, but something is inside it
    assert np.isnan(fit.map(np.array([row, column]))).any(axis=1).tolist() == [True, False]


@pytest.mark.slow
def test_the_inverse_has_a_value_everywhere_inside_the_target():
    """Uncovered points take the value of the nearest point: scikit-image shows no holes in the target."""
    source = 40 + 30 * arrow()
    target = 50 + 30 * pear()
    fit = iccm.fit(source + 8j, target + 10j, fit="contain", axes="screen")
    y, x = np.mgrid[:128, :128]
    w = (x + 1j * y)[fit.target.contains((x + 1j * y).ravel()).reshape(x.shape)]
    assert fit.coverage.uncovered > 0.01 and np.isnan(fit.inverse(w)).any()
    back = fit.transform.inverse(w)
    assert np.isfinite(back).all()
    covered = np.isfinite(fit.inverse(w))
    assert np.array_equal(back[covered], fit.inverse(w)[covered])
    outside = np.array([500 + 500j, fit.target.box[0] - 5])
    assert np.isnan(fit.transform.inverse(outside)).all()


@pytest.mark.slow
@pytest.mark.parametrize("method", ["balanced", "conformal", "paper"])
def test_values_are_restored_bit_for_bit(method):
    source = (
        np.random.default_rng(1).uniform(0.9, 1.1, 30) * np.exp(2j * np.pi * np.arange(30) / 30) * 3.7 + 100.3
    )
    target = (
        np.random.default_rng(2).uniform(0.8, 1.2, 31) * np.exp(2j * np.pi * np.arange(31) / 31) * 1e-3 - 7j
    )
    pins = [(source.mean(), target.mean())]
    fit = iccm.fit(source, target, pins=pins, method=method)
    assert np.array_equal(fit.source.z, source) and np.array_equal(fit.target.z, target)
    assert np.array_equal(fit.pins, pins)
    bent = iccm.deform(source, pins=[(source.mean(), source.mean() + 0.1)], method=method)
    assert np.array_equal(bent.source.z, source)


# floats that a round trip through other coordinates would not restore: neighbours of thirds and tenths, beside 1e6
AWKWARD = np.nextafter(np.array([0, 0.1 + 0.2, 1 / 3, 2 / 7, 1 / 9]), 1)
OUTLINE = (
    np.array([0, 7, 7 + 2j, 3 + 2j, 3 + 5j, 5j]) / 3 + AWKWARD[[0, 1, 2, 3, 4, 1]] * (1e-3 + 1e-3j) + 1e6
)
GOAL_OUTLINE = np.array([0, 4, 5 + 3j, 2 + 4.1j, -1 + 2j]) / 70 + AWKWARD * (1e-5 - 1e-5j)


@pytest.mark.slow
def test_outlines_pins_strokes_and_holes_are_restored_bit_for_bit(tmp_path):
    pins = [
        (OUTLINE[1], GOAL_OUTLINE[1]),  # on both outlines
        (1e6 + 1 / 3 + 1j / 3 + AWKWARD[1] * 1e-4, 0.02 + 0.01j + AWKWARD[2] * 1e-6),
    ]
    stroke = np.array([1.2 + 0.25j, 1.5 + 0.3j, 1.9 + 0.41j]) + AWKWARD[2] * 1e-4 + 1e6
    goal = np.array([0.03 + 0.012j, 0.045 + 0.017j]) + AWKWARD[3] * 1e-6
    hole = np.array([0.3 + 0.9j, 0.6 + 0.9j, 0.45 + 1.3j]) + AWKWARD[1] * 1e-4 + 1e6
    opening = np.array([0.02 + 0.03j, 0.03 + 0.03j, 0.025 + 0.04j]) + AWKWARD[2] * 1e-6
    options = dict(pins=pins, strokes=[(stroke, goal)], source_holes=[hole], target_holes=[opening])
    fit = iccm.fit(OUTLINE, GOAL_OUTLINE, **options)
    fit.save(tmp_path / "map.npz")
    for result in (fit, iccm.load(tmp_path / "map.npz")):
        assert np.array_equal(result.source.z, OUTLINE) and np.array_equal(result.target.z, GOAL_OUTLINE)
        assert np.array_equal(result.pins, pins)
        assert np.array_equal(result.strokes[0][0].z, stroke) and np.array_equal(result.strokes[0][1].z, goal)
        assert set(result.source_holes[0].z) == set(hole) and set(result.target_holes[0].z) == set(opening)
    assert fit._boundary["hausdorff"] < 1e-6


@pytest.mark.parametrize("method", ["balanced", "paper"])
def test_deformations_give_outlines_pins_and_strokes_back_bit_for_bit(method):
    pins = [(OUTLINE[5] + 0.1 - 0.1j, OUTLINE[5] + AWKWARD[1])]
    stroke = np.array([1.2 + 0.25j, 1.9 + 0.41j]) + AWKWARD[2] * 1e-4 + 1e6
    bent = iccm.deform(OUTLINE, pins=pins, strokes=[(stroke, stroke + AWKWARD[2] * 0.1j)], method=method)
    assert np.array_equal(bent.source.z, OUTLINE) and np.array_equal(bent.pins, pins)
    assert np.array_equal(bent.strokes[0][0].z, stroke)


@pytest.mark.parametrize(
    ("make", "kind"),
    [
        (lambda p: p > 100, np.uint8),
        (lambda p: p.astype(np.int64), np.uint8),
        (lambda p: p.astype(np.int32) * 200, np.uint16),
        (lambda p: p.astype(np.float64), np.float32),
    ],
)
def test_pictures_of_any_usual_type_are_carried(plain, make, kind):
    picture = make(np.arange(64 * 48, dtype=np.uint8).reshape(64, 48))
    carried = iccm.warp(plain, picture, size=32)
    assert carried.pixels.dtype == kind and carried.pixels[..., 0].max() > 0.6 * float(np.max(picture)) > 0


@pytest.mark.parametrize(
    "picture", [np.full((4, 4), -1), np.full((4, 4), 1 << 20), np.zeros((4, 4), complex)]
)
def test_other_pictures_are_refused_with_the_cure(plain, picture):
    with pytest.raises(InputError, match=r"texture: .*(scale|use uint8)"):
        iccm.warp(plain, picture)
    with pytest.raises(InputError, match=r"iccm\.warp"):
        iccm.transfer(plain, picture)


def test_transfer_takes_the_options_of_fit():
    carried = iccm.transfer(iccm.checkerboard(64), shapely.Polygon(FLAG), GOAL, size=40, fit="whole")
    transferred = iccm.transfer(
        iccm.checkerboard(64), complex_of(FLAG), complex_of(GOAL), size=40, fit="whole"
    )
    assert np.array_equal(carried.pixels, transferred.pixels)


def test_progress_is_reported_and_cancelling_ends():
    seen = []
    iccm.fit(FLAG, GOAL, progress=seen.append)
    assert seen and all(
        isinstance(step, iccm.Progress) and 0 <= step.done <= max(step.of, step.done) for step in seen
    )
    calls = []

    def cancel():
        calls.append(True)
        return len(calls) > 2

    with pytest.raises(iccm.Cancelled):
        iccm.fit(FLAG, GOAL, cancel=cancel)
    assert len(calls) == 3
    stopped = threading.Event()
    stopped.set()
    with pytest.raises(iccm.Cancelled):
        iccm.deform(FLAG, pins=[(INSIDE[0], INSIDE[0] + 0.1)], cancel=stopped.is_set)


def test_former_names_of_options_warn():
    with pytest.warns(FutureWarning, match="effort"):
        iccm.fit(FLAG, GOAL, starts=1)


def test_help_and_dir_show_the_surface_alone(plain):
    import inspect
    import pydoc

    text = pydoc.plain(pydoc.render_doc(iccm.fit))
    assert "Map the source onto the target" in text
    assert "-> Fit" in text.replace("'", "")  # in quotes up to Python 3.13
    for function in (iccm.fit, iccm.deform, iccm.transfer, iccm.warp):
        parameters = inspect.signature(function).parameters.values()
        assert all(parameter.annotation is not inspect.Parameter.empty for parameter in parameters)
    assert {"map", "inverse", "summary", "report", "plot", "save"} <= set(dir(plain))
    assert not [name for name in dir(plain) if name.startswith("_")]


def test_a_notebook_shows_the_map(plain):
    import io

    from PIL import Image

    picture = Image.open(io.BytesIO(plain._repr_png_()))
    assert picture.mode == "RGBA" and len(picture.getcolors(picture.width * picture.height)) > 20
    assert plain.summary() in plain._repr_html_() and "data:image/png;base64," in plain._repr_html_()
    carried = iccm.warp(plain, np.linspace(0, 1, 2000 * 8).reshape(2000, 8), size=(900, 500))
    image = Image.open(io.BytesIO(carried._repr_png_()))
    assert max(image.size) <= 640 and image.size[0] / image.size[1] == pytest.approx(1.8, rel=0.02)


def test_a_map_is_drawn_into_axes_that_are_there(plain):
    from matplotlib.figure import Figure

    axes = Figure().subplots(1, 2)
    assert plain.plot(ax=axes[1]) is axes[1].figure
    assert len(axes[1].images) == 1 and axes[1].lines and not axes[0].has_data()


def test_meshes_that_are_arrays_are_flattened_and_mapped():
    ball = trimesh.creation.icosphere(subdivisions=2)
    half = ball.submesh([np.flatnonzero(ball.triangles_center[:, 2] > 0.1)], append=True)
    flat = iccm.flatten(half)
    assert np.array_equal(flat.flat, iccm.flatten(half.vertices, half.faces).flat)
    fit = iccm.fit(flat, GOAL)
    assert fit.details.layouts[0] is flat and fit.status.ok
    with pytest.raises(InputError, match="closed"):
        iccm.flatten(ball)
    assert iccm.flatten(ball, cut_open=True).flat.size > len(ball.vertices)
    for wrong in ((half.vertices[:, :2], half.faces), (half.vertices, half.faces + 10_000), ("half.obj",)):
        with pytest.raises(InputError, match="flatten"):
            iccm.flatten(*wrong)


@pytest.mark.slow
def test_several_polygons_are_one_drawing():
    parts = [shapely.box(0, 0, 2, 1), shapely.box(3, 0, 4, 2)]
    several = shapely.MultiPolygon(parts)
    fit = iccm.fit(several, GOAL)
    assert fit.details.drawings is not None and len(fit.details.drawings[0].parts) == 2
    assert fit.report()["injective"]["certified"] and (1 - fit.coverage.hidden) > 0.99
    rings = [np.array(part.exterior.coords)[:-1] for part in parts]
    assert iccm.fit(rings, GOAL).coverage.hidden == fit.coverage.hidden


@pytest.mark.parametrize("method", ["balanced", "conformal"])
@pytest.mark.parametrize("axes", ["xy", "screen", "image"])
def test_one_pair_is_one_point(method, axes):
    fit = iccm.fit(FLAG, GOAL, method=method, axes=axes)
    pairs = INSIDE[:2]
    images = fit.map(pairs)
    for pair, image in zip(pairs.tolist(), images):
        for one in (pair, tuple(pair), np.array(pair)):
            assert np.allclose(fit.map(one), image, rtol=0, atol=1e-12)
        assert np.abs(fit.inverse(image) - pair).max() < 1e-3
    places = [complex(complex_in(pair, axes)) for pair in pairs]
    assert np.allclose(fit.map(places[0]), complex_in(images[0], axes), atol=1e-12)
    if axes != "image":  # transforms always take x and y
        assert np.allclose(fit.transform(pairs[0]), images[0], rtol=0, atol=1e-12)


@pytest.mark.parametrize(
    "wrong", [[1.0, 2.0, 3.0], [[1, 2, 3]], "abc", None, [[1, 2], [3]], [None], {}, 3 * ["a"]]
)
def test_what_is_not_points_is_refused(plain, wrong):
    for function in (plain.map, plain.inverse, plain.transform, plain.map.derivatives, plain.then(plain)):
        with pytest.raises(InputError, match=r"^points: "):
            function(wrong)


def test_points_outside_and_missing_points_have_no_image(plain):
    far = [[50.0, 50.0], [np.nan, 1.0]]
    for function in (plain.map, plain.inverse, plain.transform, plain.transform.inverse):
        assert np.isnan(function(far)).all() and np.isnan(function(np.array([50 + 50j, np.nan]))).all()


@pytest.mark.parametrize(
    "wrong",
    [
        {"strokes": 3},
        {"rigid": 3},
        {"source_holes": 3},
        {"hole_partners": 3},
        {"terms": 3},
        {"pins": [iccm.Pin("a", 2j)]},
        {"pins": 3},
    ],
)
def test_arguments_of_other_types_are_refused_by_name(wrong):
    with pytest.raises(InputError, match=f"^{next(iter(wrong))[:3]}"):
        iccm.fit(FLAG, GOAL, **wrong)


def test_a_missing_file_is_an_error_of_python_and_of_iccm(tmp_path):
    for read in (iccm.load, iccm.read_shape, iccm.read_image):
        with pytest.raises(FileNotFoundError, match="none") as caught:
            read(tmp_path / "none.svg")
        assert isinstance(caught.value, InputError) and "\n" not in str(caught.value)


@pytest.mark.slow
def test_paths_of_matplotlib_are_shapes():
    from matplotlib.path import Path
    from matplotlib.textpath import TextPath

    flag = Path(np.concatenate([FLAG, FLAG[:1]]), closed=True)
    hole = Path(np.concatenate([HOLE, HOLE[:1]]), closed=True)
    both = Path.make_compound_path(flag, hole)
    expected = iccm.fit(shapely.Polygon(FLAG, [HOLE]), GOAL)
    fit = iccm.fit(both, GOAL)
    assert fit.source.area == pytest.approx(expected.source.area, rel=1e-12)
    assert np.allclose(fit.map(INSIDE[1:]), expected.map(INSIDE[1:]), atol=1e-3)
    circle = given.outlines_of(Path.circle((3, 4), 2), "source").outline
    assert np.abs(np.abs(circle - (3 + 4j)) - 2).max() < 1e-3 and len(circle) > 100
    below = given.outlines_of(flag, "source", "screen").outline
    assert np.allclose(np.sort_complex(below), np.sort_complex(complex_of(FLAG).conj()))
    listed = given.outlines_of(Path(FLAG), "source").outline  # neither closed nor with codes
    assert np.allclose(np.sort_complex(listed), np.sort_complex(complex_of(FLAG)))
    parts = Path.make_compound_path(flag, Path(FLAG + np.array([20, 0]), closed=True))
    assert len(given.drawing_of(parts, "source").parts) == 2
    letter = given.outlines_of(TextPath((0, 0), "L", size=10), "source").outline  # another class of paths
    assert np.ptp(letter.imag) == pytest.approx(7.29, abs=0.1) and letter.size == 6
    with pytest.raises(InputError, match=r"^source: the path has no area"):
        iccm.fit(Path([[0, 0], [1, 1]]), GOAL)


def test_a_picture_knows_its_place_for_matplotlib(plain):
    from matplotlib.figure import Figure

    carried = iccm.warp(plain, iccm.checkerboard(32), size=40)
    axes = Figure().subplots()
    axes.imshow(carried.pixels, extent=carried.extent)
    assert axes.get_xlim() == (carried.box[0].real, carried.box[1].real)
    assert axes.get_ylim() == (carried.box[0].imag, carried.box[1].imag)


def test_the_words_that_type_checkers_know_are_those_that_are_accepted():
    from iccm import axes, options, texture_transfer
    from iccm.pixels import filters, pyramid, sampler

    words = {
        texture_transfer.FilterName: ("auto", *filters.FILTERS),
        texture_transfer.KindName: sampler.KINDS,
        texture_transfer.EdgeName: tuple(pyramid.EDGES),
        axes.Axes: tuple(axes.AXES),
        options.HolesName: options.ROWS["holes"].words,
        options.PlaceName: options.ROWS["place"].words,
    }
    for name, accepted in words.items():
        assert sorted(get_args(name)) == sorted(accepted)
