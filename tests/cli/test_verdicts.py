"""A map that folds or misses its outline is never reported as good, for any method and verbosity."""

import json
from pathlib import Path

import numpy as np
import pytest

import iccm as library
from iccm import InputError, Status
from iccm.maps.summary import in_short

pytestmark = pytest.mark.usefixtures("solve_once")

FILES = Path(__file__).parents[2] / "docs" / "files"
LIMB = np.array([0, 4, 4 + 1j, 1.2 + 1j, 1.2 + 3j, 0.2 + 3j, 0.2 + 1j, 1j])
"""An asymmetric outline on which the paper's method folds."""


@pytest.mark.slow
def test_a_folded_map_is_a_failure_and_no_quiet_hides_where(tmp_path, iccm):
    arguments = ("map", FILES / "worm.svg", FILES / "block.svg", "--method", "paper", "--size", "48")
    out, report = tmp_path / "out.png", tmp_path / "r.json"
    result = iccm(*arguments, "-o", out, "--report", report)
    folded = json.loads(report.read_text())["injective"]["folded"]
    assert result.code == 1 and folded > 0.1
    assert f"FOLDS on {100 * folded:.0f} %" in result.err and "no folds" not in result.err
    quiet = iccm(*arguments, "-o", out, "--force", "-q")
    assert quiet.code == 1 and f"{folded:.1%}" in quiet.err and "error: " in quiet.err


@pytest.mark.slow
def test_a_note_names_the_method_that_an_option_selects(tmp_path, iccm):
    arguments = ("map", FILES / "block.svg", FILES / "shield.svg", "--size", "48", "-o", tmp_path / "out.png")
    result = iccm(*arguments, "--smoothness", "1")
    assert result.code == 1 and "using --method conformal because of --smoothness" in result.err
    assert "OUTLINE OFF by" in result.err
    named = iccm(*arguments, "--smoothness", "1", "--method", "conformal", "--force")
    assert named.code == 1 and "because of" not in named.err


@pytest.mark.parametrize("method", ["balanced", "conformal", "paper"])
def test_pins_that_lead_out_of_the_target_are_refused_by_every_method(shapes, iccm, method):
    result = iccm("map", "square.svg", "disk.svg", "--method", method, "--pin", "50,50:5,95", "-o", "out.png")
    assert result.code == 2 and len(result.lines) == 1 and not (shapes / "out.png").exists()
    assert "disk.svg: pin 1" in result.err and "(5, 95)" in result.err
    with pytest.raises(InputError, match="outside the target"):
        library.fit(LIMB, 2 * LIMB, pins=[(0.5 + 0.5j, 9 + 9j)], method=method)


@pytest.mark.slow
def test_options_of_other_methods_are_noted_and_judged_in_python():
    fit = library.fit(LIMB, np.exp(2j * np.pi * np.arange(40) / 40), smoothness=10.0)
    assert "because of --smoothness" in fit.notes[0]
    assert fit._boundary["hausdorff"] > 0.1 and fit.status is Status.GAP and not fit.status.ok
    assert "OUTLINE OFF" in fit.summary()


def test_the_verdict_is_kept_with_the_map(tmp_path):
    fit = library.fit(LIMB, np.exp(2j * np.pi * np.arange(40) / 40), method="paper", tolerance=0.02)
    fit.save(tmp_path / "map.npz")
    loaded = library.load(tmp_path / "map.npz")
    assert loaded.status is fit.status and loaded.details.tolerance == 0.02


def summary_of(**injective):
    whole = {"certified": True, "share": 1.0, "folded": 0.0} | injective
    return in_short(
        {
            "status": "reached",
            "boundary": None,
            "scale": {"within2": 0.123},
            "injective": whole,
            "pixels": {"width": 64, "height": 32},
            "seconds": {"total": 1.25},
        }
    )


def test_the_summary_follows_the_figures():
    assert summary_of() == "64×32 · scale within 2× on 12 % · no folds · 1.2 s"
    assert "FOLDS on 64 %" in summary_of(folded=0.639)
    assert "FOLDS on 0.3 %" in summary_of(folded=0.003)
    assert "not certified one-to-one" in summary_of(certified=False, share=0.0)
    assert "no folds on 97 %" in summary_of(share=0.97)
