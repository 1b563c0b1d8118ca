"""SVG drawings carried through a map: true to the tolerance, styles kept, what is left out is told."""

import numpy as np
import pytest

from iccm.curve import Curve
from iccm.errors import InputError
from iccm.harmonic import HarmonicMap
from iccm.io import artwork, shapes, svg, svgtree
from iccm.refit import refit

HEAD = '<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" viewBox="-100 -100 200 200">'
DRAWING = """<style>.hot{fill:red}</style><defs><circle id="dot" r="5"/></defs>
<path id="shape" d="M90 0 C90 50 50 90 0 90 S-90 50 -90 0 S-50 -90 0 -90 S90 -50 90 0Z" fill="tan"/>
<g transform="translate(10 5) scale(2)" stroke="blue"><circle class="hot" r="10" stroke-width="1.5"/></g>
<use xlink:href="#dot" x="-40" y="30" fill="green"/>
<polyline points="-50,-20 0,-30 40,-50" fill="none" stroke="black"/>
<rect x="60" y="-20" width="80" height="40" opacity="0.5"/>
<rect x="300" y="0" width="10" height="10"/><text>no</text><circle id="pin-a" r="1"/></svg>"""


@pytest.fixture
def source(tmp_path):
    (tmp_path / "a.svg").write_text(HEAD + DRAWING)
    return shapes.read(f"{tmp_path}/a.svg#shape")


def curved(source, g=lambda z: z + 0.003 * z**2):
    p = source.curve.resample(300).z
    return HarmonicMap(p, g(p), 0 * p)


def drawn(path):
    return svgtree.parse(path.read_bytes()).shapes


def test_refit_stays_within_its_tolerance():
    def image(which, t):
        return np.where(which == 0, np.exp(2j * np.pi * t), t + 1j * np.sin(9 * t))

    cubics = refit(image, 2, 1e-4)
    for k, control in enumerate(cubics):
        s = np.linspace(0, 1, 50)
        basis = np.stack([(1 - s) ** 3, 3 * s * (1 - s) ** 2, 3 * s**2 * (1 - s), s**3])
        points = (control @ basis).ravel()
        truth = Curve(image(np.full(20000, k), np.linspace(0, 1, 20000)), closed=False)
        assert np.abs(truth.at(truth.closest(points)) - points).max() < 1.2e-4
        assert np.array_equal(control[1:, 0], control[:-1, 3])
        assert len(control) < 40


def test_paths_are_the_images_of_the_shapes(source, tmp_path):
    map = curved(source)
    artwork.carry(source, map, source, tmp_path / "b.svg", tolerance=0.02)
    circle = next(d for d in drawn(tmp_path / "b.svg") if d.properties.get("class") == "hot")
    (run,) = svg.runs_of(circle, 1e-6)
    theta = np.linspace(0, 2 * np.pi, 4000)
    truth = map((10 - 5j) + 20 * np.exp(1j * theta))
    gap = np.abs(np.conj(run.z)[:, None] - truth).min(axis=1)
    assert run.closed
    assert gap.max() < 0.03


def test_styles_groups_and_definitions_are_kept(source, tmp_path):
    notes = artwork.carry(source, curved(source), source, tmp_path / "b.svg")
    text = (tmp_path / "b.svg").read_text()
    assert ".hot{fill:red}" in text
    assert 'stroke="blue"' in text
    assert "transform" not in text
    shown = drawn(tmp_path / "b.svg")
    assert [d.properties.get("fill") for d in shown] == ["tan", "red", "green", "none", None]
    lined = float(shown[1].properties["stroke-width"])
    assert abs(lined - 1.5 * 2 * abs(1 + 0.006 * (10 - 5j))) < 0.1
    assert any("<text>" in note for note in notes)
    assert any("outside the source, left out" in note for note in notes)
    assert any("pressed" in note for note in notes)


def test_the_identity_draws_the_same(source, tmp_path):
    artwork.carry(source, curved(source, lambda z: z), source, tmp_path / "b.svg", tolerance=0.01)
    before = {d.tag: d for d in drawn(source.path)}
    after = drawn(tmp_path / "b.svg")
    line, same = svg.runs_of(before["polyline"], 1e-5)[0].z, svg.runs_of(after[3], 1e-5)[0].z
    assert np.abs(same[[0, -1]] - line[[0, -1]]).max() < 0.01
    assert np.abs(same[:, None] - line).min(axis=0).max() < 0.01


def test_only_svg_has_artwork(source, tmp_path):
    from dataclasses import replace

    with pytest.raises(InputError, match="SVG"):
        artwork.carry(replace(source, path=tmp_path / "a.png"), curved(source), source, tmp_path / "b.svg")
