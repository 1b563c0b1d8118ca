"""SVG drawings carried through a map: true to the tolerance, styles kept, what is left out is told."""

from xml.etree import ElementTree

import numpy as np
import pytest

from iccm.curve import Curve
from iccm.errors import InputError
from iccm.harmonic import HarmonicMap
from iccm.io import affine, artwork, css, shapes, svg, svgpath, svgtree
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


CLIPPED = """<style>.c{clip-path:url(#round)}</style><defs>
<clipPath id="round" transform="translate(5 0)"><circle r="10" clip-rule="evenodd"/><use href="#bar"/></clipPath>
<rect id="bar" x="20" y="-5" width="10" height="10"/>
<clipPath id="all"><rect x="-900" y="-900" width="1800" height="1800"/></clipPath>
<clipPath id="none"><rect x="500" y="500" width="4" height="4"/></clipPath>
<clipPath id="box" clipPathUnits="objectBoundingBox"><rect width=".5" height="1"/></clipPath>
<linearGradient id="base" gradientUnits="userSpaceOnUse" x2="9" gradientTransform="scale(2)"/>
<linearGradient id="g" xlink:href="#base"/></defs>
<path id="shape" d="M-90 -90H90V90H-90Z" fill="tan"/>
<g transform="scale(2)"><rect class="c" id="a" x="-20" y="-20" width="40" height="40" fill="url(#g)"/></g>
<rect class="c" id="b" width="40" height="40"/>
<rect id="c" width="40" height="40" clip-path="url(#all)"/>
<rect id="d" width="40" height="40" style="clip-path:url('#none')"/>
<rect id="e" width="40" height="40" clip-path="url(#box)" mask="url(#box)"/></svg>"""


def carried(tmp_path, g=lambda z: z):
    (tmp_path / "a.svg").write_text(HEAD + CLIPPED)
    source = shapes.read(f"{tmp_path}/a.svg#shape")
    notes = artwork.carry(source, curved(source, g), source, tmp_path / "b.svg", tolerance=0.01)
    top = ElementTree.parse(tmp_path / "b.svg").getroot()
    return {e.get("id"): e for e in top.iter() if e.get("id")}, notes


def clip_of(found, id):
    style = css.declarations(found[id].get("style", ""))
    return list(found[style["clip-path"][5:-1]])


def outline(path):
    (run,) = svgpath.runs(path.get("d"))
    return np.concatenate([piece.at(np.linspace(0, 1, 50)) for piece in run.pieces])


def test_clip_paths_are_carried_where_they_are_used(tmp_path):
    found, _ = carried(tmp_path)
    for id, scale in (("a", 2), ("b", 1)):
        circle, bar = clip_of(found, id)
        assert np.abs(np.abs(outline(circle) - 5 * scale) - 10 * scale).max() < 0.02
        assert circle.get("clip-rule") == "evenodd"
        assert abs(outline(bar).real.min() - 25 * scale) < 0.02


def test_a_clip_path_around_all_clips_nothing_and_one_elsewhere_everything(tmp_path):
    found, _ = carried(tmp_path)
    (around,) = clip_of(found, "c")
    assert np.abs(outline(around)).min() > 1e6
    assert clip_of(found, "d") == []


def test_what_cannot_be_carried_is_told_in_one_note(tmp_path):
    found, notes = carried(tmp_path)
    assert len(notes) == 1
    assert "1 × clip-path that is no clipPath in user space" in notes[0] and "1 × mask, left out" in notes[0]
    assert css.declarations(found["e"].get("style")) == {"mask": "none", "clip-path": "none"}


def test_gradients_in_user_space_go_with_the_shape(tmp_path):
    found, _ = carried(tmp_path, lambda z: 0.5j * z + 3)
    style = css.declarations(found["a"].get("style"))
    gradient = found[style["fill"][5:-1]]
    assert gradient.get("{http://www.w3.org/1999/xlink}href") == "#g"
    made = affine.parse(gradient.get("gradientTransform"))
    z = np.array([0, 1, 1j])
    assert np.abs(made(z) - (-0.5j * (2 * 2 * z) + 3)).max() < 1e-6  # y is down: the turn is the other way
