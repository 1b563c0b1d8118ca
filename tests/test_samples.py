"""Every sample runs with the installed command, and makes the picture stored beside it."""

import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from iccm.io.pictures import image_files
from tests.cases import slow
from tests.scripts import script

SAMPLES = Path(__file__).resolve().parent.parent / "samples"
LONG = {"rose-leaf", "square-country", "polyline", "strokes", "face-pins", "hexagon-surface", "raster"}
# Several maps of a square or a regular hexagon are equally good, and rounding may decide: only alpha is compared.
FREE = {"square-country", "hexagon-surface"}
BLOCK = 8

# Root mean square difference of the means of 8 x 8 pixels, colours weighted by alpha, on a scale from 0 to 1.
# Rounding differs between machines; inputs scaled by 1 ± 1e-9, which changes every rounding, moved the pictures by at
# most 0.0012. A picture that is off by 4 pixels, mirrored, of another hue or empty differs by at least 0.02: last test.
LIMIT = 0.006


RUN = script("samples/run.py")
ICCM = str(Path(sys.executable).parent / "iccm")
NAMES = [folder.name for folder in RUN.samples()]


def difference(a, b):
    """The difference of two pictures, see LIMIT; infinite if their sizes or channels differ."""
    if a.shape != b.shape:
        return np.inf
    a, b = (premultiplied(picture) for picture in (a, b))
    return float(np.sqrt(np.mean((a - b) ** 2)))


def premultiplied(picture):
    h, w = (n - n % BLOCK for n in picture.shape[:2])
    part = picture[:h, :w].astype(float) / 255
    part[..., :3] *= part[..., 3:] if part.shape[2] == 4 else 1
    return part.reshape(h // BLOCK, BLOCK, w // BLOCK, BLOCK, -1).mean(axis=(1, 3))


def baseline(name):
    return image_files.read(SAMPLES / name / "picture.png").pixels


@pytest.mark.parametrize("name", [slow(name) if name in LONG else name for name in NAMES])
def test_a_sample_makes_its_picture(name, tmp_path):
    folder = tmp_path / name
    shutil.copytree(SAMPLES / name, folder, ignore=shutil.ignore_patterns("out", "picture.png"))
    (folder / "out").mkdir()
    for command in RUN.commands(folder):
        result = subprocess.run([ICCM, *command], cwd=folder, capture_output=True, text=True, check=False)
        assert result.returncode == 0, result.stderr
    picture, stored = image_files.read(folder / "out/picture.png").pixels, baseline(name)
    if name in FREE:
        picture, stored = picture[..., 3:], stored[..., 3:]
    assert difference(picture, stored) < LIMIT


@pytest.mark.parametrize("name", NAMES)
def test_the_comparison_detects_typical_faults(name):
    picture = baseline(name)
    assert difference(picture, picture) == 0
    faults = {
        "right": np.roll(picture, 4, axis=1),
        "down": np.roll(picture, 4, axis=0),
        "mirrored": picture[:, ::-1],
        "hue": picture[..., [1, 2, 0, 3][: picture.shape[2]]],
        "empty": np.zeros_like(picture),
    }
    for fault, wrong in faults.items():
        assert difference(wrong, picture) > LIMIT, fault
    assert difference(picture[:-1], picture) == np.inf


@pytest.mark.parametrize("name", NAMES)
def test_a_sample_is_complete(name):
    folder = SAMPLES / name
    text = (folder / "README.md").read_text()
    assert 3 <= len([line for line in text.splitlines() if line.strip()]) <= 7
    assert "MIT" in text or "public domain" in text
    assert (folder / "picture.png").stat().st_size <= 600_000


def test_an_unknown_sample_is_refused(capsys):
    assert RUN.main(["nothing"]) == 2
    assert "no sample 'nothing'; there is " in capsys.readouterr().err


def test_a_failing_sample_is_reported(monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(RUN, "HERE", tmp_path)
    (tmp_path / "bad").mkdir()
    (tmp_path / "bad/command.txt").write_text("iccm map none.svg none.svg -o out/picture.png\n")
    assert RUN.main([]) == 1
    output = capsys.readouterr()
    assert "bad" in output.out and "exit code 2" in output.out and "none.svg" in output.err
