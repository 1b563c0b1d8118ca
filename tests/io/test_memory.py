"""Memory within a limit."""

import errno
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from iccm import InputError
from iccm.io import memory as room
from iccm.io.options import memory

MIB = 1 << 20
SVG = "http://www.w3.org/2000/svg"


@pytest.mark.skipif(
    sys.platform != "linux", reason="elsewhere the resident memory is not known, or only its peak"
)
def test_arrays_that_do_not_fit_are_in_an_unnamed_file(tmp_path):
    bounded = room.Bounded(room.resident() + 64 * MIB, tmp_path)
    small, large = bounded((100,), np.uint8), bounded((50 * MIB,), np.uint8)
    before = room.resident()
    large[:] = 7
    assert room.resident() > before + 40 * MIB
    bounded.release()
    assert room.resident() < before + 10 * MIB
    assert large.min() == large.max() == 7 and not list(tmp_path.iterdir())
    assert small.base is None and large.base is not None


def test_memory_that_is_used_counts():
    bounded = room.Bounded(room.resident() + 100 * MIB)
    assert [bounded((15 * MIB,), np.uint8).base is None for _ in range(2)] == [True, False]


def test_as_many_threads_as_fit():
    bounded = room.Bounded(room.resident() + room.MARGIN + 100 * MIB)
    assert bounded.threads(8, 40 * MIB, "work") == 2
    assert bounded.threads(1, 40 * MIB, "work") == 1
    with pytest.raises(InputError, match=r"--memory: .*too little for work.* \d+M"):
        bounded.threads(1, 1000 * MIB, "work")


@pytest.mark.parametrize(
    ("resident", "kept", "fits"), [(100, 0, True), (200, 140, True), (200, 150, False), (500, 0, False)]
)
def test_outputs_that_will_not_fit_are_refused_before_the_solving(monkeypatch, resident, kept, fits):
    """The memory that the process will hold counts, or that it already holds, and that of pictures in memory."""
    monkeypatch.setattr(room, "resident", lambda: 0)
    bounded = room.Bounded(room.SOLVED + room.MARGIN + 200 * MIB)
    bounded((kept * MIB,), np.uint8)
    monkeypatch.setattr(room, "resident", lambda: resident * MIB)
    if fits:
        bounded.check(55 * MIB, "work")
    else:
        with pytest.raises(InputError, match="too little for work"):
            bounded.check(55 * MIB, "work")


@pytest.mark.skipif(not hasattr(os, "posix_fallocate"), reason="other systems reserve space in other ways")
def test_a_full_disk_is_reported(tmp_path, monkeypatch):
    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("os.posix_fallocate", full, raising=False)
    with pytest.raises(InputError, match="No space left"):
        room.Bounded(1, tmp_path)((MIB,), np.uint8)


@pytest.mark.skipif(os.name != "posix", reason="as on macOS")
def test_space_is_reserved_where_the_system_has_no_call_for_that(tmp_path, monkeypatch):
    monkeypatch.delattr("os.posix_fallocate", raising=False)
    size = 2 * MIB + 12345
    with (tmp_path / "scratch").open("w+b") as file:
        room.allocate(file, size)
        status = os.fstat(file.fileno())
    assert status.st_size == size and status.st_blocks * 512 >= size


@pytest.mark.parametrize(
    ("text", "bytes"),
    [("2G", 2 << 30), ("1.5 GiB", 3 << 29), ("800m", 800 << 20), ("12", 12), ("1TB", 1 << 40), (7, 7)],
)
def test_sizes(text, bytes):
    assert memory(text) == bytes


@pytest.mark.parametrize("text", ["", "G", "2X", "1e9", "-1G", "2 G B"])
def test_invalid_sizes_are_refused(text):
    with pytest.raises(ValueError, match=f"{re.escape(repr(text))}.*2G"):
        memory(text)


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="reads /proc")
@pytest.mark.parametrize("source", ["a.svg", "a.obj"])
def test_a_run_stays_within_its_bound(tmp_path, source):
    """4096² in and out: about 600 MiB without a limit, of which the texture and its reductions are 100."""
    from iccm.io.pictures import image_files

    strip = np.random.default_rng(0).integers(0, 256, (256, 4096, 4), dtype=np.uint8)
    like = image_files.Image(strip, 3)
    image_files.write_bands(tmp_path / "t.tif", like, 4096, 4096, (strip for _ in range(16)))
    for name, points in (("a", "10,10 90,10 90,90 10,90"), ("b", "10,20 90,10 80,90 50,60 10,90")):
        drawing = f'<svg xmlns="{SVG}" viewBox="0 0 100 100"><polygon points="{points}"/></svg>'
        (tmp_path / f"{name}.svg").write_text(drawing)
    corners = ["v 0 0 0", "v 1 0 0", "v 1 1 0.2", "v 0 1 0", "vt 0 0", "vt 1 0", "vt 1 1", "vt 0 1"]
    (tmp_path / "a.obj").write_text("\n".join([*corners, "f 1/1 2/2 3/3", "f 1/1 3/3 4/4"]))
    command = [
        "map",
        source,
        "b.svg",
        "--force",
        "-q",
        "--texture",
        "t.tif",
        "-o",
        "o.tif",
        "--size",
        "4096",
    ]
    outputs, peaks = [], []
    for bound in ("64G", "560M"):
        # of its own memory: wait4 also counts that of the process it was forked from
        code = (
            "import re, sys\nfrom iccm import cli\n"
            "assert cli.run(sys.argv[1:]) in (0, 1)\n"
            "print(re.search(r'VmHWM:\\s+(\\d+)', open('/proc/self/status').read())[1])"
        )
        line = [sys.executable, "-c", code, *command, "--method", "paper", "--memory", bound]
        result = subprocess.run(line, cwd=tmp_path, capture_output=True, text=True, check=True)
        peaks.append(int(result.stdout) / 1024)
        outputs.append((tmp_path / "o.tif").read_bytes())
    assert outputs[0] == outputs[1]
    assert peaks[1] < min(560, peaks[0] - 100)
    assert {path.name for path in tmp_path.iterdir()} == {"a.svg", "a.obj", "b.svg", "t.tif", "o.tif"}
