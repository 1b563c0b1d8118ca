"""`iccm map --compare`: a contact sheet of all fits."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from iccm.fits import FITS
from iccm.io.run.outputs import compared

SVG = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 100">{}</svg>'


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder with a red ell with a blue dot, a square, and a smaller sheet of three fits."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(compared, "FITS", {name: FITS[name] for name in ("auto", "box", "whole")})
    monkeypatch.setattr(compared, "SIDE_PIXELS", 60)
    ell = '<path fill="red" d="M10 10H40V60H90V90H10Z"/><circle fill="blue" cx="25" cy="30" r="8"/>'
    Path("ell.svg").write_text(SVG.format(ell))
    Path("square.svg").write_text(SVG.format('<path d="M10 10H90V90H10Z"/>'))
    Image.linear_gradient("L").resize((30, 20)).save("grey.png")
    return tmp_path


def cells(name):
    """The pictures of a sheet without labels, in order."""
    sheet = np.asarray(Image.open(name).convert("RGB")).astype(int)
    width = 60 + 2 * compared.BORDER_PIXELS
    height = width + compared.LABEL_PIXELS
    top = compared.BORDER_PIXELS + compared.LABEL_PIXELS
    return [
        sheet[row + top : row + top + 60, column + compared.BORDER_PIXELS :][:, :60]
        for row in range(0, sheet.shape[0], height)
        for column in range(0, sheet.shape[1], width)
    ]


@pytest.mark.slow
def test_a_sheet_shows_the_picture_of_each_fit(folder, iccm):
    result = iccm("map", "ell.svg", "square.svg", "--compare", "sheet.png", "-o", "auto.png", "--size", "60")
    assert result.code == 0 and "wrote sheet.png" in result.err
    shown = cells("sheet.png")
    order = list(compared.FITS)
    for number, fit in enumerate(order):
        alone = iccm(
            "map", "ell.svg", "square.svg", "--fit", fit, "-o", f"{fit}.png", "--size", "60", "--force"
        )
        assert alone.code == 0
        ground = Image.new("RGBA", (60, 60), compared.GROUND)
        ground.alpha_composite(Image.open(f"{fit}.png").convert("RGBA"))
        expected = np.asarray(ground.convert("RGB")).astype(int)
        assert np.abs(shown[number] - expected).mean() < 2
    assert np.abs(shown[order.index("box")] - shown[order.index("whole")]).mean() > 5


@pytest.mark.slow
def test_a_requested_fit_comes_first(folder, iccm):
    for fit in ("whole", "auto"):
        result = iccm("map", "ell.svg", "square.svg", "--fit", fit, "--compare", f"{fit}.png")
        assert result.code == 0
    assert np.abs(cells("whole.png")[0] - cells("auto.png")[2]).mean() < 1


@pytest.mark.slow
def test_a_grey_photo_is_compared(folder, iccm):
    assert iccm("map", "grey.png", "square.svg", "--compare", "grey-sheet.png").code == 0
    assert not np.ptp(cells("grey-sheet.png")[0], axis=2).any()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--compare", "sheet.jpg"], ".png"),
        (["--compare", "sheet.png", "--parts", "each"], "--parts"),
        (["--compare", "sheet.png", "--place", "inside"], "--place"),
        (["--compare", "sheet.png", "--method", "conformal"], "balanced"),
    ],
)
def test_a_sheet_that_cannot_be_made_is_refused(folder, iccm, arguments, words):
    result = iccm("map", "ell.svg", "square.svg", *arguments)
    assert result.code == 2 and words in result.err and not list(Path().glob("sheet.*"))
