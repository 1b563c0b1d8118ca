"""The rows of pyramids are computed when they are read, and are then those of pyramids computed at once."""

import threading

import numpy as np
import pytest

from iccm.memory import Memory
from iccm.pixels import filters, pyramid
from iccm.pixels.canvas import Band, Diagnostics
from iccm.pixels.sampler import Sampler
from iccm.pixels.texture import Texture

HEIGHT, WIDTH = 230, 150
TABLE = np.linspace(0, 1, 256, dtype=np.float32)[:, None].repeat(4, axis=1)
STORED = np.random.default_rng(1).integers(0, 256, (HEIGHT, WIDTH, 4), dtype=np.uint8)


class Read:
    """The rows of STORED, decoded, with a record of those that are read."""

    def __init__(self):
        self.rows = set()

    def __call__(self, rows, out):
        self.rows.update(np.arange(HEIGHT)[rows].tolist())
        return pyramid.ready(STORED[rows], TABLE, 3, out)


def decoded_when_read(edge, read, **options):
    """A pyramid whose rows are noise until they are decoded."""
    noise = np.full((HEIGHT, WIDTH, 4), np.nan, np.float32)
    return pyramid.pyramid(noise, edge, None, read, **options)


def reduced_when_read(edge, read):
    """The same of a picture that stays stored, with noise in place of its reductions."""

    class Noise(Memory):
        def __call__(self, shape, dtype):
            return np.full(shape, np.nan, dtype)

    return pyramid.compact(STORED, TABLE, 3, edge, Noise())


def somewhere(count, *, scales=(-2, 7)):
    """Points in and around the picture, and footprints of all sizes."""
    rng = np.random.default_rng(2)
    xy = rng.uniform((-40, -60), (WIDTH + 40, HEIGHT + 60), (count, 2))
    return xy, rng.normal(size=(count, 4)) * np.exp2(rng.uniform(*scales, (count, 1)))


@pytest.mark.parametrize("make", [decoded_when_read, reduced_when_read])
@pytest.mark.parametrize("edge", list(pyramid.EDGES.values()))
@pytest.mark.parametrize("kind", list(filters.FILTERS.values()))
def test_each_point_reads_what_it_reads_of_a_complete_pyramid(make, edge, kind):
    """One point at a time, so that nothing is present that its neighbours have read."""
    xy, turn = somewhere(40)
    complete = make(edge, Read()).complete()
    for n in range(len(xy)):
        part = slice(n, n + 1)
        ours = filters.read(make(edge, Read()), xy[part], turn[part], kind)
        np.testing.assert_array_equal(ours, filters.read(complete, xy[part], turn[part], kind))


@pytest.mark.parametrize("make", [decoded_when_read, reduced_when_read])
@pytest.mark.parametrize("edge", list(pyramid.EDGES.values()))
def test_points_that_want_many_strips_read_what_they_read_of_a_complete_pyramid(make, edge):
    xy, turn = somewhere(3000)
    xy[70], xy[900], turn[1100], turn[1101] = (20, np.nan), (20, 1e14), np.nan, 1e13
    ours, expected = (
        filters.read(tex, xy, turn, filters.CUBIC)
        for tex in (make(edge, Read()), make(edge, Read()).complete())
    )
    np.testing.assert_array_equal(ours, expected)


def test_a_picture_that_is_magnified_is_decoded_where_it_is_read_and_not_reduced():
    read = Read()
    tex = decoded_when_read(pyramid.CLAMP, read)
    xy, turn = somewhere(200, scales=(-4, -2))
    xy[:, 1] = np.random.default_rng(3).uniform(100, 120, len(xy))
    filters.read(tex, xy, turn, filters.CUBIC)
    assert {*range(98, 123)} <= read.rows <= {*range(80, 144)}
    assert np.isnan(tex.base[:80]).all() and np.isnan(tex.base[144:]).all()
    assert not tex._present[tex._first_strips[1] :].any()


def test_bands_are_painted_as_with_a_complete_pyramid():
    rng = np.random.default_rng(4)
    z = rng.uniform(0, WIDTH, (30, 70)) + 1j * rng.uniform(0, HEIGHT, (30, 70))
    step = np.full(z.shape, 3, np.complex64)
    band = Band(0, rng.random(z.shape, dtype=np.float32), z, step, -1j * step, Diagnostics())
    painted = []
    for tex in (
        decoded_when_read(pyramid.CLAMP, Read()),
        decoded_when_read(pyramid.CLAMP, Read()).complete(),
    ):
        out = np.zeros((30, 70, 4), np.uint8)
        filters.paint(tex, band, (0, 70), (0.0, float(HEIGHT), 1.0, 1.0), filters.CUBIC, True, 3, out)
        painted.append(out)
    assert painted[0].any()
    np.testing.assert_array_equal(*painted)


def test_threads_that_want_the_same_rows_share_them():
    counted, lock = [], threading.Lock()

    def read(rows, out):
        with lock:
            counted.extend(np.arange(HEIGHT)[rows].tolist())
        return pyramid.ready(STORED[rows], TABLE, 3, out)

    tex = decoded_when_read(pyramid.CLAMP, read)
    xy, turn = somewhere(4000)
    results = {}

    def look(number):
        results[number] = filters.read(tex, xy[::-1] if number % 2 else xy, turn, filters.CUBIC)

    workers = [threading.Thread(target=look, args=(number,)) for number in range(6)]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()
    assert sorted(counted) == [*range(HEIGHT)]
    complete = decoded_when_read(pyramid.CLAMP, Read()).complete()
    for number, values in results.items():
        places = xy[::-1] if number % 2 else xy
        np.testing.assert_array_equal(values, filters.read(complete, places, turn, filters.CUBIC))


def test_texels_that_are_not_finite_are_mended_wherever_a_map_looks():
    pixels = np.ones((64, 48, 3), np.float32)
    pixels[3, 5] = np.nan
    sampler = Sampler(Texture(pixels, (0, 48 + 64j), transfer="linear"))
    values = filters.read(
        sampler.pyramid, np.array([[5.5, 3.5]]), np.array([[0.5, 0, 0, 0.5]]), filters.CUBIC
    )
    assert values == pytest.approx(1)
