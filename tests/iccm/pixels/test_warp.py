"""Warping: the identity, exact positions, filters, edges, pixel formats, threads."""

from dataclasses import replace

import numpy as np
import pytest
import shapely

from iccm.errors import InputError
from iccm.maps.harmonic import HarmonicMap
from iccm.maps.inverse import inverse
from iccm.memory import Memory
from iccm.pixels import preimages
from iccm.pixels.canvas import BAND_ROWS, Band, Canvas, Diagnostics
from iccm.pixels.checkerboard import checkerboard
from iccm.pixels.coverage import coverage
from iccm.pixels.padding import pad
from iccm.pixels.sampler import Sampler
from iccm.pixels.stmap import stmap
from iccm.pixels.texture import TexturePlaces
from iccm.pixels.warp import Texture, Warp, warp, whole
from tests.cases import slow, some_fast

BOX = (-1.4 - 1.4j, 1.4 + 1.4j)


def star(n=120):
    s = 2 * np.pi * np.arange(n) / n
    return (1 + 0.3 * np.cos(5 * s)) * np.exp(1j * s)


def conformal(g, polygon=None):
    p = star() if polygon is None else polygon
    return HarmonicMap(p, g(p), 0 * p)


IDENTITY = conformal(lambda z: z)
SQUARE = np.array([-1 - 1j, 1 - 1j, 1 + 1j, -1 + 1j])


def noise(shape, dtype, seed=0):
    values = np.random.default_rng(seed).random(shape)
    dtype = np.dtype(dtype)
    return values.astype(dtype) if dtype.kind == "f" else (values * np.iinfo(dtype).max).astype(dtype)


@pytest.mark.parametrize("filter", ["nearest", "linear", "cubic", "lanczos", "spline"])
@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
def test_identity_returns_the_texture(dtype, filter):
    picture = noise((160, 160, 3), dtype)
    out = warp(IDENTITY, Texture(picture, BOX), Canvas(160, 160, BOX), filter=filter)
    inner = out.pixels[..., 3] == (1 if np.dtype(dtype).kind == "f" else np.iinfo(dtype).max)
    assert 0.3 < inner.mean() < 0.5
    if np.dtype(dtype).kind == "f":
        assert np.abs(out.pixels[inner][:, :3] - picture[inner]).max() < 1e-5
    else:
        assert np.array_equal(out.pixels[inner][:, :3], picture[inner])
    assert out.diagnostics.fallback == 0


def test_an_edge_of_a_magnified_picture_has_no_ring():
    """No colour is darker or lighter than the two that meet; data keep the overshoot of the cubic filter."""
    picture = np.full((20, 20, 3), (46, 42, 50), np.uint8)
    picture[:, 10:] = 255, 240, 214
    placed, canvas = Texture(picture, BOX), Canvas(320, 320, BOX)
    colours, numbers = (warp(IDENTITY, placed, canvas, kind=kind).pixels for kind in ("colour", "data"))
    seen = colours[colours[..., 3] == 255][:, :3]
    assert np.array_equal([seen.min(axis=0), seen.max(axis=0)], [(46, 42, 50), (255, 240, 214)])
    assert numbers[numbers[..., 3] == 255][:, :3].min() < 40


def test_a_turn_by_90_degrees_is_a_turn_by_90_degrees():
    picture = checkerboard(128)
    out = warp(
        conformal(lambda z: 1j * z, SQUARE),
        Texture(picture, (-1 - 1j, 1 + 1j)),
        Canvas(128, 128, (-1 - 1j, 1 + 1j)),
    )
    assert np.array_equal(out.pixels[1:-1, 1:-1, :3], np.rot90(picture)[1:-1, 1:-1])


@pytest.mark.slow
@pytest.mark.parametrize(
    "map",
    [
        conformal(lambda z: z + 0.2 * z**2),
        HarmonicMap(star(), star() + 0.1 * star() ** 2, 0.25 * star().conj() + 0.05 * star().conj() ** 2),
    ],
    ids=["conformal", "harmonic"],
)
def test_source_points_stay_within_the_requested_error(map):
    canvas = Canvas(700, 500, BOX)
    for max_error in (1e-3, 1e-5):
        source = preimages.of(map, canvas, max_error)
        for row in range(0, canvas.height, BAND_ROWS):
            band = source(row)
            inner = band.coverage == 1
            w, z = canvas.centres(band.row, len(band.z))[inner], band.z[inner]
            exact, step = inverse(map, w), canvas.step[0]
            good = np.isfinite(exact)
            assert good.mean() > 0.999 and np.abs(z - exact)[good].max(initial=0) <= max_error
            across = (inverse(map, w + 0.01 * step) - exact) / 0.01
            good = np.isfinite(across)
            assert np.abs(band.right[inner] - across)[good].max(initial=0) <= 0.05 * step


@pytest.mark.slow
def test_outline_pixels_hold_their_exact_coverage():
    canvas = Canvas(90, 90, BOX)
    map = conformal(lambda z: z + 0.1 * z**2)
    out = warp(map, Texture(np.ones((8, 8, 1), np.float32), BOX), canvas)
    w = canvas.pixels(
        map(np.concatenate([np.linspace(a, b, 30)[:-1] for a, b in zip(star(), np.roll(star(), -1))]))
    )
    region = shapely.Polygon(np.column_stack([w.real, w.imag]))
    truth = [
        [region.intersection(shapely.box(j, i, j + 1, i + 1)).area for j in range(90)] for i in range(90)
    ]
    assert np.abs(out.pixels[..., 1] - truth).max() < 2e-3
    hard = warp(map, Texture(np.ones((8, 8, 1), np.float32), BOX), canvas, antialias=False)
    assert set(np.unique(hard.pixels[..., 1])) == {0.0, 1.0}
    away = np.abs(out.pixels[..., 1] - 0.5) > 1e-3
    assert np.array_equal(hard.pixels[away, 1] == 1, out.pixels[away, 1] > 0.5)


def test_coverage_ignores_direction_and_cuts_at_the_border():
    loop = np.array([-3 + 1.5j, 4.25 + 1.5j, 4.25 + 9j, -3 + 9j])
    for polygon in (loop, loop[::-1]):
        area, inside = coverage(polygon, 1, 3, 6)
        assert np.allclose(area, [[0.5] * 4 + [0.125, 0], [1] * 4 + [0.25, 0], [1] * 4 + [0.25, 0]])
        assert inside[2].tolist() == [True] * 4 + [False] * 2


@pytest.mark.parametrize(
    "dtype", some_fast([np.uint8, np.uint16, np.float16, np.float32], {np.uint8, np.float32})
)
@pytest.mark.parametrize(
    "filter", some_fast(["nearest", "linear", "cubic", "lanczos", "spline"], {"linear", "lanczos"})
)
def test_a_constant_stays_constant_to_the_last_bit(dtype, filter):
    value = np.array([0.2, 0.7, 0.05, 1.0])
    dtype = np.dtype(dtype)
    value = value.astype(dtype) if dtype.kind == "f" else np.rint(value * np.iinfo(dtype).max).astype(dtype)
    picture = np.broadcast_to(value, (33, 47, 4)).copy()
    transfer = "linear" if dtype.kind == "f" else "srgb"
    map = HarmonicMap(star(), star() + 0.2 * star() ** 2, 0.2 * star().conj())
    for size in (60, 600):
        out = warp(map, Texture(picture, BOX, 3, transfer), Canvas(size, size, BOX), filter=filter)
        seen = out.pixels[out.pixels[..., 3] > 0]
        assert len(np.unique(seen[:, :3], axis=0)) == 1
        assert np.array_equal(seen[0, :3], value[:3])


def test_transparent_red_over_blue_gives_no_purple():
    picture = np.zeros((64, 64, 4), np.uint8)
    picture[:32] = [255, 0, 0, 0]
    picture[32:] = [0, 0, 255, 255]
    out = warp(
        conformal(lambda z: 3 * z), Texture(picture, BOX, 3), Canvas(300, 300, (3 * BOX[0], 3 * BOX[1]))
    )
    seen = out.pixels[out.pixels[..., 3] > 0]
    assert seen[:, 0].max() == 0
    assert seen[:, 2].min() == 255
    assert ((seen[:, 3] > 20) & (seen[:, 3] < 235)).any()


def test_shrinking_averages_in_linear_light():
    """A black and white checkerboard of single texels becomes the grey of half its light, 188, not 128."""
    picture = np.indices((512, 512)).sum(0)[..., None].astype(np.uint8) % 2 * 255
    for map in (conformal(lambda z: z / 16), HarmonicMap(star(), star() / 16, star().conj() / 48)):
        out = warp(map, Texture(picture, BOX), Canvas(40, 40, (BOX[0] / 16, BOX[1] / 16)))
        inner = out.pixels[..., 1] == 255
        assert inner.sum() > 200
        assert np.abs(out.pixels[inner][:, 0].astype(int) - 188).max() <= 1


def test_an_ellipse_is_averaged_along_its_long_axis_only():
    """Stripes across the squeezed direction vanish, stripes along it remain."""
    p, k = SQUARE, 0.875  # x is unchanged, y shrinks 15 times
    map = HarmonicMap(p, p / (1 + k), k * p.conj() / (1 + k))
    x = np.indices((300, 300))
    lasting = (np.sin(x[1] * 2 * np.pi / 12) * 0.5 + 0.5)[..., None].astype(np.float32)
    fading = (x[0] % 2)[..., None].astype(np.float32)
    canvas = Canvas(300, 20, (-1 - 1j / 15, 1 + 1j / 15))
    kept, averaged = (
        warp(map, Texture(v, (-1 - 1j, 1 + 1j), transfer="linear"), canvas).pixels for v in (lasting, fading)
    )
    assert np.ptp(kept[5:-5, 20:-20, 0]) > 0.95
    assert np.abs(averaged[3:-3, 20:-20, 0] - 0.5).max() < 0.02


def test_nearest_makes_no_new_values():
    labels = np.random.default_rng(0).choice(np.array([3, 70, 255, 40000], np.uint16), (50, 60, 1))
    out = warp(
        conformal(lambda z: z + 0.2 * z**2), Texture(labels, BOX), Canvas(200, 200, BOX), filter="nearest"
    )
    assert set(np.unique(out.pixels[..., 0])) == {0, 3, 70, 255, 40000}


def holed(shape=(100, 120)):
    """A smooth picture, and the same with a tenth of its texels and a block of one channel that are not finite."""
    y, x = np.mgrid[: shape[0], : shape[1]] / max(shape)
    whole = np.dstack([x, y, 0.5 + 0.5 * np.sin(5 * x) * np.cos(4 * y)]).astype(np.float32)
    broken = whole.copy()
    broken[np.random.default_rng(0).random(shape) < 0.1] = np.nan
    broken[40:44, 50:54, 1] = [np.inf, -np.inf, np.nan, np.inf]
    return whole, broken


@pytest.mark.parametrize("size", [20, 100, 400])
@pytest.mark.parametrize("filter", ["linear", "cubic", "lanczos", "spline"])
def test_filters_ignore_texels_that_are_not_finite(filter, size):
    map = conformal(lambda z: z + 0.2 * z**2)
    whole, broken = (
        warp(map, Texture(picture, BOX, transfer="linear"), Canvas(size, size, BOX), filter=filter).pixels
        for picture in holed()
    )
    assert np.isfinite(broken).all()
    assert np.abs(broken - whole).max() < 0.05


def test_nearest_keeps_texels_that_are_not_finite():
    broken = holed()[1]
    map, canvas = conformal(lambda z: z + 0.2 * z**2), Canvas(300, 300, BOX)
    number = np.arange(broken[..., 0].size, dtype=np.float32).reshape(*broken.shape[:2], 1)
    result, indices = (
        warp(map, Texture(picture, BOX, transfer="linear"), canvas, filter="nearest").pixels
        for picture in (broken, number)
    )
    inside = indices[..., 1] > 0
    expected = broken.reshape(-1, 3)[indices[inside, 0].astype(int)]
    assert np.array_equal(result[inside, :3], expected, equal_nan=True)
    assert not np.isfinite(expected).all()


@pytest.mark.parametrize("associated", [False, True])
def test_texels_that_are_not_finite_under_alpha_0_have_no_colour(associated):
    picture = np.zeros((40, 40, 4), np.float32)
    picture[:, 20:] = [0.8, 0.4, 0.2, 1]
    picture[:, :20, :3] = np.nan
    result = warp(IDENTITY, Texture(picture, BOX, 3, "linear", associated), Canvas(230, 230, BOX)).pixels
    alpha = result[..., 3:]
    assert ((alpha > 0.1) & (alpha < 0.9)).any()
    seen = alpha[..., 0] > 0.01
    straight = result[seen, :3] / (alpha[seen] if associated else 1)
    assert np.abs(straight - [0.8, 0.4, 0.2]).max() < 1e-4


def test_a_texture_of_holes_only_is_black():
    picture = np.full((9, 9, 4), np.nan, np.float32)
    assert not warp(IDENTITY, Texture(picture, BOX, 3, "linear"), Canvas(20, 20, BOX)).pixels.any()


def test_a_reader_ignores_texels_that_are_not_finite():
    texture = Texture(holed()[1], BOX, transfer="linear")
    xy = np.random.default_rng(1).uniform(0, 100, (500, 2))
    turn = np.tile([1.7, 0.2, -0.1, 0.6], (500, 1))
    read = {name: Sampler(texture, name) for name in ("cubic", "nearest")}
    results = {
        name: reader(lambda part: TexturePlaces(xy[part], turn[part]), 500) for name, reader in read.items()
    }
    assert np.isfinite(results["cubic"]).all()
    assert 0.02 < np.isnan(results["nearest"]).any(axis=1).mean() < 0.2


@pytest.mark.parametrize("dtype, transfer", [(np.uint8, "srgb"), (np.uint16, "srgb"), (np.float32, "linear")])
@pytest.mark.parametrize("filter", ["cubic", "nearest"])
@pytest.mark.parametrize("associated", [False, True])
def test_a_reader_returns_colours_over_alpha_as_stored(dtype, transfer, filter, associated):
    value = np.array([0.25, 0.3, 0.1, 0.5])
    top = 1 if dtype == np.float32 else np.iinfo(dtype).max
    pixel = (value * top).astype(dtype)
    texture = Texture(np.broadcast_to(pixel, (9, 9, 4)).copy(), BOX, 3, transfer, associated)
    xy, turn = np.full((40, 2), 4.3), np.tile([0.5, 0, 0, 0.5], (40, 1))
    result = Sampler(texture, filter)(lambda part: TexturePlaces(xy[part], turn[part]), 40)
    assert result.dtype == dtype
    assert np.abs(result / top - pixel / top).max() < 1e-6


def test_a_filter_that_overshoots_half_stays_finite():
    picture = np.zeros((20, 20, 1), np.float16)
    picture[8:12, 8:12], picture[0, 0] = 65504, np.inf
    out = warp(IDENTITY, Texture(picture, BOX, transfer="linear"), Canvas(90, 90, BOX)).pixels
    assert out.max() == 65504


def test_outside_the_texture_box():
    picture = np.full((20, 20, 3), 200, np.uint8)
    small = (-0.5 - 0.5j, 0.5 + 0.5j)
    clamped = warp(IDENTITY, Texture(picture, small), Canvas(100, 100, BOX)).pixels
    clear = warp(
        IDENTITY,
        Texture(np.dstack([picture, picture[..., :1] * 0 + 255]), small, 3),
        Canvas(100, 100, BOX),
        edge="transparent",
    ).pixels
    assert clamped[50, 75].tolist() == [200, 200, 200, 255]
    assert clear[50, 75, 3] == 0
    assert clear[50, 50].tolist() == [200, 200, 200, 255]


def test_the_bytes_do_not_depend_on_the_threads():
    picture, map = noise((90, 70, 4), np.uint8), conformal(lambda z: z + 0.2 * z**2)
    one_thread, three_threads = (
        warp(map, Texture(picture, BOX, 3), Canvas(500, 400, BOX), threads=k).pixels for k in (1, 3)
    )
    assert one_thread.tobytes() == three_threads.tobytes()


def test_wrong_options_are_refused():
    with pytest.raises(InputError, match="filter 'best'"):
        warp(IDENTITY, Texture(noise((4, 4, 3), np.uint8), BOX), Canvas(4, 4, BOX), filter="best")


def test_normals_rotate_with_the_map():
    """A slope to the right becomes a slope upwards under a rotation by 90 degrees, for either direction of stored y."""
    flat = np.broadcast_to(np.array([128, 128, 255], np.uint8), (40, 40, 3)).copy()
    slope = np.broadcast_to(np.array([218, 128, 218], np.uint8), (40, 40, 3)).copy()
    turn, box = conformal(lambda z: 1j * z, SQUARE), (-1 - 1j, 1 + 1j)
    for kind, y in (("normal", 218), ("normal-down", 38)):
        out = warp(turn, Texture(slope, box), Canvas(50, 50, box), kind=kind).pixels[25, 25]
        assert np.abs(out[:3].astype(int) - [128, y, 218]).max() <= 1
        assert (
            warp(turn, Texture(flat, box), Canvas(50, 50, box), kind=kind).pixels[5:-5, 5:-5, :3]
            == flat[0, 0]
        ).all()
    with pytest.raises(InputError, match="has 1 channel; a normal map needs 3"):
        warp(turn, Texture(flat[..., :1], box), Canvas(50, 50, box), kind="normal")


@pytest.mark.parametrize("fill", ["push-pull", "nearest"])
def test_padding_reaches_the_requested_distance_and_keeps_alpha(fill):
    picture = np.full((20, 20, 3), [10, 200, 77], np.uint8)
    plain, some, all_ = (
        warp(IDENTITY, Texture(picture, BOX), Canvas(120, 100, BOX), padding=k, fill=fill).pixels
        for k in (0, 5, -1)
    )
    assert (all_[..., :3] == [10, 200, 77]).all()
    assert np.array_equal(some[..., 3], plain[..., 3])
    import cv2

    distance = cv2.distanceTransform(
        (plain[..., 3] == 0).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE
    )
    assert ((some[..., 1] == 200) == (distance <= 5)).all()
    premultiplied = Texture(np.ones((4, 4, 4), np.float32), BOX, 3, "linear", True)
    with pytest.raises(InputError, match="associated"):
        warp(IDENTITY, premultiplied, Canvas(9, 9, BOX), padding=2)


@pytest.mark.parametrize("wild", [slow("noise"), "folded", "constant", "not a number", "huge"])
def test_a_bad_map_ends_and_counts_unsolved_pixels(wild):
    p = star()
    phi = {
        "noise": np.random.default_rng(0).normal(size=240).view(complex),
        "folded": p**3 - 0.4 * p,
        "constant": 0 * p + 0.3,
        "not a number": p * np.nan,
        "huge": p * 1e7,
    }[wild]
    out = warp(HarmonicMap(p, phi, 0 * p), Texture(noise((8, 8, 3), np.uint8), BOX), Canvas(90, 90, BOX))
    seen = out.diagnostics
    assert out.pixels.shape == (90, 90, 4)
    assert 0 <= seen.fallback <= seen.inside <= 8100
    if wild == "folded":
        assert seen.fallback < 0.02 * seen.inside


@pytest.mark.parametrize("dtype, channels", [(np.uint8, 4), (np.uint16, 3), (np.uint8, 1)])
@pytest.mark.parametrize("filter", ["cubic", "nearest"])
def test_a_large_texture_is_read_as_stored_with_the_same_result(monkeypatch, dtype, channels, filter):
    import cv2

    rough = noise((400, 330, channels), dtype, 3)
    picture = cv2.GaussianBlur(rough, (0, 0), 6).reshape(rough.shape)
    alpha = 3 if channels == 4 else -1
    plain, compact = [], []
    for results, limit in ((plain, 1 << 40), (compact, 0)):
        monkeypatch.setattr("iccm.pixels.sampler.LARGE_VALUES", limit)
        for map, size in ((IDENTITY, 300), (conformal(lambda z: z + 0.2 * z**2), 40)):
            results.append(
                warp(map, Texture(picture, BOX, alpha), Canvas(size, size, BOX), filter=filter).pixels
            )
    top = np.iinfo(dtype).max
    assert np.array_equal(plain[0], compact[0])
    assert np.abs(plain[1].astype(float) - compact[1]).max() <= 0.01 * top + 1


@pytest.mark.parametrize(
    "filter, channels, alpha, edge",
    [
        ("cubic", 3, -1, "clamp"),
        ("cubic", 4, 3, "transparent"),
        ("cubic", 4, 0, "clamp"),
        ("cubic", 6, -1, "transparent"),
        ("linear", 1, -1, "transparent"),
        ("lanczos", 2, 1, "clamp"),
    ],
)
def test_pixels_computed_at_once_equal_those_computed_in_steps(monkeypatch, filter, channels, alpha, edge):
    picture = noise((90, 130, channels), np.uint8, 5)
    picture[20:50, 30:60, alpha] = 0
    picture[50:, :, alpha] |= 200
    texture = Texture(picture, (-0.9 - 1j, 1.1 + 1j), alpha)
    map = conformal(lambda z: z + 0.2 * z**2)
    for limit in (1 << 40, 0):
        monkeypatch.setattr("iccm.pixels.sampler.LARGE_VALUES", limit)
        sampler = Sampler(texture, filter, edge=edge)
        assert sampler.paints
        for size in (20, 300):  # bands of 128 rows, columns in squares of 256
            canvas = Canvas(size, size, BOX)
            at_once = whole(Warp(map, sampler, canvas)).pixels
            step_by_step = whole(Warp(map, sampler, canvas, placing=replace(texture))).pixels
            assert np.array_equal(at_once, step_by_step)


def test_a_texture_rotated_by_90_degrees_is_read_in_squares(monkeypatch):
    """So that little of it is in memory at a time."""
    calls = []

    class Recorder(Memory):
        def release(self):
            calls.append(None)

    sampler = Sampler(Texture(noise((64, 64, 3), np.uint8), BOX), memory=Recorder())
    calls.clear()
    whole(Warp(conformal(lambda z: 1j * z), sampler, Canvas(1000, 200, BOX)), threads=1)
    assert len(calls) == 2 * 4  # bands of 128 rows, 256 columns at a time


class Halved:
    """A custom kind of map: w = z / 2 on the square, everywhere 2 w."""

    def preimages(self, canvas, tolerance, slopes):
        return Doubling(canvas).band


class Doubling:
    def __init__(self, canvas):
        self.canvas = canvas

    def band(self, row):
        z = 2 * self.canvas.centres(row, min(128, self.canvas.height - row))
        inside = (np.abs(z.real) <= 1) & (np.abs(z.imag) <= 1)
        step = np.full(z.shape, 2 * self.canvas.step[0], np.complex64)
        return Band(
            row, inside.astype(np.float32), z, step, -1j * step, Diagnostics(inside=int(inside.sum()))
        )


def test_another_kind_of_map_may_provide_its_preimages():
    half = conformal(lambda z: z / 2, SQUARE)
    texture, canvas = Texture(checkerboard(64), BOX), Canvas(80, 80, (-0.5 - 0.5j, 0.5 + 0.5j))
    by_iccm, by_duck_type = (warp(map, texture, canvas).pixels.astype(int) for map in (half, Halved()))
    assert np.abs(by_iccm - by_duck_type)[1:-1, 1:-1].max() <= 1
    rows = [np.concatenate(list(stmap(map, BOX, canvas))) for map in (half, Halved())]
    assert np.abs(rows[0] - rows[1])[1:-1, 1:-1].max() < 1e-5


@pytest.mark.parametrize("channels", [1, 3])
@pytest.mark.parametrize("method", ["nearest", "push-pull"])
def test_padding_reaches_the_requested_distance_and_keeps_painted_pixels(method, channels):
    pixels, painted = noise((40, 50, channels), np.uint8), np.zeros((40, 50), bool)
    painted[15:20, 20:30] = True
    pixels[~painted] = 0
    before = pixels.copy()
    pad(pixels, painted, 4, method)
    assert np.array_equal(pixels[painted], before[painted])
    assert not pixels[:, :16].any() and not pixels[25:].any()
    if method == "nearest":
        assert np.array_equal(pixels[15:20, 17], before[15:20, 20])


def test_push_pull_interpolates_between_painted_pixels():
    """Two pixels are known; reduced, they are two opposite corners of 2 by 2, and the others are their mean."""
    pixels, painted = np.full((4, 4, 1), 99, np.float32), np.zeros((4, 4), bool)
    pixels[0, 0], pixels[3, 3], painted[[0, 3], [0, 3]] = 8, 0, True
    pad(pixels, painted, -1)
    assert pixels[..., 0] == pytest.approx(np.array([[8, 7, 5, 4], [7, 6, 4, 3], [5, 4, 2, 1], [4, 3, 1, 0]]))


def test_padded_integers_are_rounded():
    pixels, painted = noise((30, 40, 3), np.uint8), np.random.default_rng(1).random((30, 40)) < 0.1
    exact = pixels.astype(np.float32)
    pad(pixels, painted, -1)
    pad(exact, painted, -1)
    assert np.array_equal(pixels, np.rint(exact))
