"""Compressed files that unpack to far more than their size are refused, before memory is allocated for them."""

import gzip
import tracemalloc

import numpy as np
import pytest

from iccm import InputError, limits
from iccm.saved import archive

NUMBERS = np.random.default_rng(3).normal(size=(700, 3))


@pytest.fixture
def small(monkeypatch):
    """A limit that test files can reach."""
    monkeypatch.setattr(limits, "UNPACKED_BYTES", 4000)


def member(path, **limit):
    with archive.opened(path, otherwise="not an archive", damaged="damaged", **limit) as file:
        return archive.Archive(file).member("a")


def test_arrays_that_shrink_like_numbers_are_read_and_others_refused(tmp_path, small):
    np.savez_compressed(tmp_path / "numbers.npz", a=NUMBERS)
    assert np.array_equal(member(tmp_path / "numbers.npz"), NUMBERS)
    np.savez_compressed(tmp_path / "zeros.npz", a=np.zeros(10**6))
    np.savez(tmp_path / "plain.npz", a=np.zeros(10**6))  # what is not compressed takes the memory of its file
    assert member(tmp_path / "plain.npz").size == 10**6
    for name, limit in (("zeros.npz", {}), ("numbers.npz", {"most_bytes": 9000})):
        with pytest.raises(InputError, match=r"bytes, more than the limit of .* for a file of its size"):
            member(tmp_path / name, **limit)


def test_a_header_does_not_raise_the_limit(tmp_path, small):
    np.savez_compressed(tmp_path / "a.npz", a=np.zeros(10**6))
    data = bytearray((tmp_path / "a.npz").read_bytes())
    size = data.index(b"PK\1\2") + 20  # of the compressed data
    data[size : size + 4] = (1 << 30).to_bytes(4, "little")
    (tmp_path / "a.npz").write_bytes(data)
    with pytest.raises(InputError, match="more than the limit"):
        member(tmp_path / "a.npz")


def test_an_array_is_unpacked_in_its_place(tmp_path):
    np.savez_compressed(tmp_path / "a.npz", a=np.tile(NUMBERS, (1000, 1)))
    tracemalloc.start()
    try:
        array = member(tmp_path / "a.npz")
        assert tracemalloc.get_traced_memory()[1] < 1.5 * array.nbytes
    finally:
        tracemalloc.stop()
    array[0] = 7  # it can be written


def test_gzip_data_are_unpacked_up_to_the_limit(small):
    text = NUMBERS.tobytes()
    packed = gzip.compress(text)
    assert archive.gunzip(packed, 10**6) == text
    for data, most, reason in (
        (gzip.compress(bytes(10**6)), 10**9, "unpacks to more than"),
        (packed, len(text) - 1, "unpacks to more than"),
        (packed[:-9], 10**6, "truncated"),
        (packed[:10] + b"\xff" + packed[11:], 10**6, "damaged"),
    ):
        with pytest.raises(InputError, match=reason):
            archive.gunzip(data, most)
