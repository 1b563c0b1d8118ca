"""Memory within a bound."""

import errno

import numpy as np
import pytest

from iccm import InputError
from iccm.io import room
from iccm.io.job import memory

MIB = 1 << 20


def test_what_does_not_fit_lies_in_a_file_that_has_no_name(tmp_path):
    bounded = room.Bounded(room.resident() + 64 * MIB, tmp_path)
    small, large = bounded((100,), np.uint8), bounded((50 * MIB,), np.uint8)
    before = room.resident()
    large[:] = 7
    assert room.resident() > before + 40 * MIB
    bounded.release()
    assert room.resident() < before + 10 * MIB
    assert large.min() == large.max() == 7 and not list(tmp_path.iterdir())
    assert small.base is None and large.base is not None


def test_what_fits_once_does_not_fit_again():
    bounded = room.Bounded(room.resident() + 100 * MIB)
    assert [bounded((15 * MIB,), np.uint8).base is None for _ in range(2)] == [True, False]


def test_as_many_threads_as_fit():
    bounded = room.Bounded(room.resident() + room.MARGIN + 100 * MIB)
    assert bounded.threads(8, 40 * MIB, "work") == 2
    assert bounded.threads(1, 40 * MIB, "work") == 1
    with pytest.raises(InputError, match=r"too little for work, which takes \d+M"):
        bounded.threads(1, 1000 * MIB, "work")


def test_a_full_disk_is_told(tmp_path, monkeypatch):
    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("os.posix_fallocate", full, raising=False)
    with pytest.raises(InputError, match="No space left"):
        room.Bounded(1, tmp_path)((MIB,), np.uint8)


@pytest.mark.parametrize(
    ("text", "bytes"),
    [("2G", 2 << 30), ("1.5 GiB", 3 << 29), ("800m", 800 << 20), ("12", 12), ("1TB", 1 << 40), (7, 7)],
)
def test_sizes(text, bytes):
    assert memory(text) == bytes


@pytest.mark.parametrize("text", ["", "G", "2X", "1e9", "-1G", "2 G B"])
def test_what_is_no_size(text):
    with pytest.raises(ValueError, match="no size"):
        memory(text)
