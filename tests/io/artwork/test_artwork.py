"""SVG drawings carried through a map: accurate to the tolerance, with their styles; what is omitted is reported."""

import base64
import re
import shutil
import subprocess
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest

import iccm
from iccm.curve import Curve
from iccm.errors import InputError
from iccm.io import artwork
from iccm.io.artwork import animation, element
from iccm.io.artwork.clip import Span
from iccm.io.artwork.mapping import SegmentMapper
from iccm.io.pictures import image_files
from iccm.io.pictures.image import Image
from iccm.io.shapes import shape
from iccm.io.svg import affine, css, path_data, reader, tree
from iccm.io.svg.curves import Arc, Bezier
from iccm.maps.bezier_fit import refit
from iccm.maps.harmonic import HarmonicMap

LINK = "{http://www.w3.org/1999/xlink}href"  # the only form that Inkscape 1.2 shows
INKSCAPE = shutil.which("inkscape")
HEAD = '<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" viewBox="-100 -100 200 200">'
DRAWING = """<style>.hot{fill:red}</style><defs><circle id="dot" r="5"/></defs>
<path id="shape" d="M90 0 C90 50 50 90 0 90 S-90 50 -90 0 S-50 -90 0 -90 S90 -50 90 0Z" fill="tan"/>
<g transform="translate(10 5) scale(2)" stroke="blue"><circle class="hot" r="10" stroke-width="1.5"/></g>
<use xlink:href="#dot" x="-40" y="30" fill="green"/>
<polyline points="-50,-20 0,-30 40,-50" fill="none" stroke="black"/>
<rect x="60" y="-20" width="80" height="40" opacity="0.5"/>
<rect x="300" y="0" width="10" height="10"/><text writing-mode="sideways-lr">no</text>
<circle id="pin-a" r="1"/></svg>"""


@pytest.fixture
def source(tmp_path):
    (tmp_path / "a.svg").write_text(HEAD + DRAWING)
    return shape.read(f"{tmp_path}/a.svg#shape")


def curved(source, g=lambda z: z + 0.003 * z**2):
    p = source.curve.resample(300).z
    return HarmonicMap(p, g(p), 0 * p)


def drawn(path):
    return tree.parse(path.read_bytes()).shapes


def test_a_drawing_is_written_without_touching_the_prefixes_that_other_threads_use(
    source, tmp_path, monkeypatch
):
    """`ElementTree.register_namespace` removes a prefix for a moment, in which elements get others, such as ns0:svg."""
    monkeypatch.setattr(ElementTree, "register_namespace", lambda *_: pytest.fail("prefixes are changed"))
    artwork.carry(source, curved(source), source, tmp_path / "b.svg")
    frames = [tmp_path / "b.svg", tmp_path / "b.svg"]
    animation.write(frames, tmp_path / "c.svg", 2)
    for name in ("b.svg", "c.svg"):
        assert (tmp_path / name).read_text().split("\n", 1)[1].startswith("<svg ")


def test_refit_stays_within_its_tolerance():
    def image(curve, t):
        return np.where(curve == 0, np.exp(2j * np.pi * t), t + 1j * np.sin(9 * t))

    cubics = refit(image, 2, 1e-4)
    for k, control in enumerate(cubics):
        s = np.linspace(0, 1, 50)
        basis = np.stack([(1 - s) ** 3, 3 * s * (1 - s) ** 2, 3 * s**2 * (1 - s), s**3])
        points = (control @ basis).ravel()
        truth = Curve(image(np.full(20000, k), np.linspace(0, 1, 20000)), closed=False)
        assert truth.distances(points).max() < 1.2e-4
        assert np.array_equal(control[1:, 0], control[:-1, 3])
        assert len(control) < 40


def test_refit_is_straight_where_the_curve_nearly_stops():
    def image(curve, t):
        return np.where(curve == 0, t**2 - 1e-4j * t, 1 - (1 - t) ** 2 + 1e-4j * (1 - t))

    first, last = refit(image, 2, 1e-3)
    cubic, reversed_cubic = first[0], last[-1][::-1]
    for p in (cubic, reversed_cubic):
        toward = next(q for q in p[1:] if abs(q - p[0]) > 1e-12) - p[0]
        assert abs(np.angle(toward / (p[3] - p[0]))) < 0.2


@pytest.mark.parametrize("digits", [0, 2, 5])
def test_path_data_are_the_rounded_numbers_without_zeros_at_the_end(digits):
    first = [-0.001 + 1e-7j, 12.5 - 3j, 1234567.125 + 0.30001j, 100 - 1e-9j]
    z = np.array([first, [first[-1], 2j, 5, -7.06]])
    data = element._data([([z[:1], z[1:]], True), ([z[1:]], False)], digits, curves=False)
    assert re.sub("[^A-Z]", "", data) == "MCCZMC"
    numbers = [float(part) for part in re.findall(r"[-+.\de]+", data)]
    points = np.array([*z[0], *z[1, 1:], *z[1]])
    expected = [float(f"{x:.{digits}f}") for x in points.view(float)]
    assert numbers == expected and "-0 " not in data and ".0 " not in data


def test_straight_segments_are_lines_unless_all_frames_need_curves():
    along = np.array([0, 1, 2, 3]) * (10 + 4j) / 3
    bent = along + np.array([0, 0.02, 0, 0])
    down, back = np.linspace(10 + 4j, 8j, 4), np.linspace(8j, 0, 4)
    bends, closes = [along[None], bent[None]], [along[None], down[None], back[None]]
    assert element._data([(bends, True)], 2, curves=False) == "M0 0L10 4C3.35 1.33 6.67 2.67 10 4Z"
    assert element._data([(closes, True)], 2, curves=False) == "M0 0L10 4L0 8Z"
    assert element._data([(closes, False)], 2, curves=False) == "M0 0L10 4L0 8L0 0"
    assert element._data([(closes, True)], 2, curves=True).count("C") == 3


def test_points_of_many_pieces_are_those_of_each():
    pieces = [
        Bezier((0j, 1 + 2j)),
        Span(Arc(1 + 1j, 2 + 0j, 1j, 0.3, 2.0, 5j), 0.7, 0.2),
        Bezier((0j, 1 + 2j, 3 - 1j, 4j)),
        Span(Curve(np.array([0, 2, 2 + 1j, 1j])), 4.5, 1.25),
        Arc(1 + 1j, 2 + 0j, 1j, 0.3, 2.0, 5j),
        Span(Bezier((1j, 3 - 1j, 4j)), 0.1, 0.4),
    ]
    numbers = np.array([5, 5, 0, 3, 3, 3, 1, 4, 2, 2, 0, 5])
    t = np.linspace(0, 1, numbers.size)
    expected = np.array([pieces[k].at(np.array([s]))[0] for k, s in zip(numbers, t)])
    assert np.abs(SegmentMapper(pieces)(numbers, t) - expected).max() < 1e-14
    assert SegmentMapper([])(numbers[:0], t[:0]).size == 0


def test_paths_are_the_images_of_the_shapes(source, tmp_path):
    map = curved(source)
    artwork.carry(source, map, source, tmp_path / "b.svg", tolerance=0.02)
    circle = next(d for d in drawn(tmp_path / "b.svg") if d.properties.get("class") == "hot")
    (run,) = reader.runs_of(circle, 1e-6)
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
    drawing = drawn(tmp_path / "b.svg")
    assert [d.properties.get("fill") for d in drawing] == ["tan", "red", "green", "none", None]
    lined = float(drawing[1].properties["stroke-width"])
    assert abs(lined - 1.5 * 2 * abs(1 + 0.006 * (10 - 5j))) < 0.1
    assert any("<text>" in note for note in notes)
    assert any("outside the source, omitted" in note for note in notes)
    assert any("clipped" in note for note in notes)


def test_the_identity_draws_the_same(source, tmp_path):
    artwork.carry(source, curved(source, lambda z: z), source, tmp_path / "b.svg", tolerance=0.01)
    before = {d.tag: d for d in drawn(source.path)}
    after = drawn(tmp_path / "b.svg")
    line, redrawn = reader.runs_of(before["polyline"], 1e-5)[0].z, reader.runs_of(after[3], 1e-5)[0].z
    assert np.abs(redrawn[[0, -1]] - line[[0, -1]]).max() < 0.01
    assert np.abs(redrawn[:, None] - line).min(axis=0).max() < 0.01


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
<rect id="e" width="40" height="20" clip-path="url(#box)"/></svg>"""


def carried(tmp_path, g=lambda z: z, drawing=CLIPPED):
    (tmp_path / "a.svg").write_text(HEAD + drawing)
    source = shape.read(f"{tmp_path}/a.svg#shape")
    notes = artwork.carry(source, curved(source, g), source, tmp_path / "b.svg", tolerance=0.01)
    top = ElementTree.parse(tmp_path / "b.svg").getroot()
    return {e.get("id"): e for e in top.iter() if e.get("id")}, notes


def clip_of(elements, id):
    style = css.declarations(elements[id].get("style", ""))
    return list(elements[style["clip-path"][5:-1]])


def outline(path):
    (run,) = path_data.runs(path.get("d"))
    return np.concatenate([piece.at(np.linspace(0, 1, 50)) for piece in run.pieces])


def test_clip_paths_are_carried_where_they_are_used(tmp_path):
    elements, _ = carried(tmp_path)
    for id, scale in (("a", 2), ("b", 1)):
        circle, bar = clip_of(elements, id)
        assert np.abs(np.abs(outline(circle) - 5 * scale) - 10 * scale).max() < 0.02
        assert circle.get("clip-rule") == "evenodd"
        assert abs(outline(bar).real.min() - 25 * scale) < 0.02


def test_a_clip_path_around_everything_clips_nothing_and_a_distant_one_everything(tmp_path):
    elements, _ = carried(tmp_path)
    (around,) = clip_of(elements, "c")
    assert np.abs(outline(around)).min() > 1e6
    assert clip_of(elements, "d") == []


def test_clip_paths_in_units_of_the_box_are_carried(tmp_path):
    elements, notes = carried(tmp_path)
    (half,) = clip_of(elements, "e")
    z = outline(half)
    assert np.allclose([z.real.min(), z.real.max(), z.imag.min(), z.imag.max()], [0, 20, 0, 20], atol=0.02)
    assert not notes


def test_gradients_in_user_space_go_with_the_shape(tmp_path):
    elements, _ = carried(tmp_path, lambda z: 0.5j * z + 3)
    style = css.declarations(elements["a"].get("style"))
    gradient = elements[style["fill"][5:-1]]
    assert gradient.get("{http://www.w3.org/1999/xlink}href") == "#g"
    parsed = affine.parse(gradient.get("gradientTransform"))
    z = np.array([0, 1, 1j])
    assert (
        np.abs(parsed(z) - (-0.5j * (2 * 2 * z) + 3)).max() < 1e-6
    )  # y points down: the rotation is reversed


SQUARE = '<path id="shape" d="M-90 -90H90V90H-90Z" fill="tan"/>'


def body(tmp_path, drawing, g=lambda z: z):
    """Carry a drawing over a square source; return the elements of the new document by id, and the notes."""
    return carried(tmp_path, g, SQUARE + drawing + "</svg>")


def style_of(element):
    return element.attrib | css.declarations(element.get("style", ""))


def referred(elements, element, name):
    return elements[style_of(element)[name].removeprefix("url(#").removesuffix(")")]


def winding(path, points):
    total = np.zeros(points.size)
    for run in path_data.runs(path.get("d")):
        z = np.concatenate([piece.at(np.linspace(0, 1, 60)) for piece in run.pieces])
        away = np.append(z, z[0])[:, None] - points
        total += np.angle(away[1:] / away[:-1]).sum(axis=0) / (2 * np.pi)
    return np.rint(total)


@pytest.mark.parametrize(
    "d",
    [
        "M-300 -200H250V220H-300Z",  # around everything
        "M-300 -200V220H250V-200Z M-310 -210V230H260V-210Z",  # in reverse, twice
        "M0 0H200V30H0Z",
        "M-200 -30H200V30H-200Z M-40 -300H40V300H-40Z",
        "M-50 0L300 0L300 300L-300 300L-300 -300L20 -300L20 50",  # open, around everything
        "M0 0C400 0 0 400 0 0M10 10A150 150 0 1 1 60 60",
        "M-90 -90H120V-95H90V90H-90Z",  # along the outline
        "M100 0L0 100L-100 0L0 -100Z",  # over its corners
    ],
)
def test_a_fill_that_leaves_the_source_paints_the_same_inside(tmp_path, d):
    elements, notes = body(tmp_path, f'<path id="a" d="{d}" fill-rule="evenodd"/>')
    inside = np.random.default_rng(5).uniform(-88, 88, (400, 2)) @ [1, 1j]
    before = ElementTree.fromstring(f'<path d="{d}"/>')
    clear = np.abs(outline_points(before)[:, None] - inside).min(axis=0) > 1
    assert np.array_equal(winding(elements["a"], inside[clear]), winding(before, inside[clear]))
    assert notes == ("1 × shape partly outside the source, clipped at its outline",)
    z = outline_points(elements["a"])
    assert max(np.abs(z.real).max(), np.abs(z.imag).max()) < 90.2


@pytest.mark.parametrize(
    "d",
    [
        "M-300 -200H250V220H-300Z",  # around everything
        "M-60 -60H60V60H-60Z M-50 -50V50H50V-50Z",  # around the hole, and back
        "M-60 -10H60V10H-60Z",  # across it
        "M0 0L60 5L-60 5Z M-70 -70L70 70L70 -70Z",  # from its middle, and over its corners
        "M-5 -5H5V5H-5Z M30 -80H80V80H30Z",  # inside it, and beside it
        "M-20 -20H20V20H-20Z",  # along it
    ],
)
def test_holes_stay_empty_and_everything_else_is_painted(tmp_path, d):
    hole = "M90 90H-90V-90H90Z M20 20V-20H-20V20Z"
    (tmp_path / "a.svg").write_text(f'{HEAD}<path id="s" d="{hole}"/><path id="a" d="{d}"/></svg>')
    source = shape.read(f"{tmp_path}/a.svg#s")
    rims = {"source_holes": source.holes, "target_holes": source.holes}
    artwork.carry(source, iccm.fit(source.curve, source.curve, **rims).map, source, tmp_path / "b.svg")
    elements = {e.get("id"): e for e in ElementTree.fromstring((tmp_path / "b.svg").read_bytes()).iter()}
    z = np.random.default_rng(5).uniform(-88, 88, (600, 2)) @ [1, 1j]
    before = ElementTree.fromstring(f'<path d="{d}"/>')
    clear = np.abs(outline_points(before)[:, None] - z).min(axis=0) > 1
    size = np.maximum(np.abs(z.real), np.abs(z.imag))
    outside, inside = z[clear & (size > 21)], z[size < 19]
    assert np.array_equal(winding(elements["a"], outside), winding(before, outside))
    assert not winding(elements["a"], inside).any()


def outline_points(path):
    return np.concatenate(
        [piece.at(np.linspace(0, 1, 300)) for run in path_data.runs(path.get("d")) for piece in run.pieces]
    )


def test_elements_that_stay_outside_are_removed(tmp_path):
    elements, notes = body(
        tmp_path, '<path id="a" d="M100 0H300V300Z"/><rect id="b" x="-5" width="10" height="10"/>'
    )
    assert "a" not in elements and "b" in elements
    assert notes == ("1 × shape outside the source, omitted",)


def test_a_line_ends_where_it_leaves_the_source_and_its_fill_does_not(tmp_path):
    drawing = '<rect id="a" x="-30" y="0" width="60" height="200" fill="red" stroke="blue" opacity=".5"/>'
    elements, _ = body(tmp_path, drawing)
    assert elements["a"].tag.endswith("}g") and style_of(elements["a"])["opacity"] == ".5"
    fill, line = elements["a"]
    assert style_of(fill)["stroke"] == "none" and style_of(line)["fill"] == "none"
    assert {style_of(part)["opacity"] for part in (fill, line)} == {"1"}
    (run,) = path_data.runs(line.get("d"))
    assert not run.closed
    ends = sorted([run.start, run.pieces[-1].last()], key=lambda z: z.real)
    assert np.abs(np.array(ends) - [-30 + 90j, 30 + 90j]).max() < 0.02
    assert path_data.runs(fill.get("d"))[0].closed


def test_a_line_around_the_source_does_not_follow_its_outline(tmp_path):
    elements, _ = body(tmp_path, '<rect id="a" x="-200" y="-200" width="400" height="400" stroke="red"/>')
    assert style_of(elements["a"])["stroke"] == "none"


@pytest.mark.parametrize("d", ["M-60 0L93 91", "M-60 -60C0 200 0 89 120 89", "M0 0Q80 80 100 85"])
def test_a_line_that_is_cut_off_keeps_its_direction(tmp_path, d):
    elements, _ = body(tmp_path, f'<path id="a" d="{d}" fill="none" stroke="red"/>')
    (before,), (after,) = path_data.runs(d), path_data.runs(elements["a"].get("d"))
    true = np.concatenate([piece.at(np.linspace(0, 1, 9000)) for piece in before.pieces])
    ends = after.pieces[-1].at(np.array([0.9, 1.0]))
    k = np.abs(true - ends[1]).argmin()
    assert abs(np.angle((ends[1] - ends[0]) / (true[k] - true[k - 9]))) < 0.1
    assert abs(max(abs(ends[1].real), abs(ends[1].imag)) - 90) < 0.05


def test_a_line_that_nearly_misses_the_source_is_removed_or_short(tmp_path):
    reach = 3e-4 * 180 * 2**0.5
    lines = [(90 + (reach - 10.0**-k) * 2**-0.5) * 2 for k in range(2, 15)]
    drawing = "".join(f'<path d="M{x - 80} 80L80 {x - 80}Z" stroke="red" fill="none"/>' for x in lines)
    _, notes = body(tmp_path, drawing)
    assert sum(int(note.split(" × shape")[0]) for note in notes) == len(lines)


@pytest.mark.parametrize("offset", [0, 1e7])
def test_drawings_far_from_the_origin_are_carried(tmp_path, offset):
    circle = f'<path id="shape" d="M{offset - 80} 0a80 80 0 1 0 160 0a80 80 0 1 0 -160 0"/>'
    (tmp_path / "a.svg").write_text(f'{HEAD}{circle}<circle id="a" cx="{offset}" r="95" stroke="red"/></svg>')
    source = shape.read(f"{tmp_path}/a.svg#shape")
    artwork.carry(source, curved(source, lambda z: z - offset), source, tmp_path / "b.svg", tolerance=0.01)
    elements = {e.get("id"): e for e in ElementTree.parse(tmp_path / "b.svg").getroot().iter()}
    for name in ("shape", "a"):
        z = outline_points(elements[name])
        assert np.isfinite(z).all() and np.abs(np.abs(z) - 80).max() < 0.05


def test_a_use_is_clipped_where_it_stands(tmp_path):
    drawing = """<clipPath id="c"><rect width="5" height="5"/></clipPath>
    <defs><rect id="r" width="9" height="9"/></defs>
    <use id="a" href="#r" x="20" y="30" clip-path="url(#c)"/>"""
    elements, _ = body(tmp_path, drawing)
    z = outline(referred(elements, elements["a"], "clip-path")[0])
    assert np.allclose([z.real.min(), z.imag.min()], [20, 30], atol=0.02)


def test_widths_and_dashes_follow_the_scale(tmp_path):
    drawing = """<g stroke="red" stroke-width="3" stroke-dasharray="4, 2" stroke-dashoffset="1">
    <path id="a" transform="scale(2)" d="M0 0H10"/><path id="b" pathLength="5" d="M0 0H20"/>
    <path id="c" vector-effect="non-scaling-stroke" d="M0 0H20"/></g>"""
    elements, notes = body(tmp_path, drawing, lambda z: 0.5 * z)
    a, b, c = (style_of(elements[name]) for name in "abc")
    assert (a["stroke-width"], a["stroke-dasharray"], a["stroke-dashoffset"]) == ("3", "4 2", "1")
    assert (b["stroke-width"], b["stroke-dasharray"]) == ("1.5", "8 4")
    assert "stroke-width" not in c and not notes


def test_a_line_of_varying_width_gets_a_note(tmp_path):
    drawing = '<path d="M-80 0H80" stroke="red"/><path d="M0 -5V5" stroke="red"/>'
    _, notes = body(tmp_path, drawing, lambda z: z + 0.003 * z**2)
    (note,) = notes
    assert note.startswith("1 × line") and "width" in note and "strokes to paths" in note


def test_markers_stay_at_the_vertices_of_the_shape(tmp_path):
    drawing = """<marker id="m" markerUnits="userSpaceOnUse" markerWidth="6" markerHeight="4"/>
    <path id="a" d="M-50 0C-50 40 0 40 0 0S50 -40 50 0" fill="none" stroke="red" marker="url(#m)"/>
    <path id="b" d="M0 10H200" fill="none" stroke="red" style="marker-start:url(#m);marker-end:url(#m)"/>
    <g style="marker-start:url(#m)"><rect id="c" width="9" height="9"/></g>"""
    elements, _ = body(tmp_path, drawing, lambda z: 0.5 * z + 0.0005 * z**2)
    line, dots = elements["a"]
    assert style_of(line)["marker-mid"] == "none" and style_of(dots)["marker-start"] == "none"
    (run,) = path_data.runs(dots.get("d"))
    vertices = np.array([run.start, *(piece.last() for piece in run.pieces)])
    z = np.array([-50, 0, 50])
    assert np.abs(vertices - (0.5 * z + 0.0005 * z**2)).max() < 0.02
    assert len(path_data.runs(line.get("d"))[0].pieces) > 2
    references = referred(elements, dots, "marker-mid")
    assert references.get("viewBox") == "0 0 6 4" and abs(float(references.get("markerWidth")) - 3) < 0.1
    assert (
        style_of(elements["b"])["marker-end"] == "none" and style_of(elements["b"])["marker-start"] != "none"
    )
    assert style_of(elements["c"])["marker-start"] == "none"


@pytest.mark.parametrize("order", ["normal", "stroke", "stroke fill markers"])
def test_a_line_that_is_cut_off_keeps_its_place_under_or_over_the_fill(tmp_path, order):
    drawing = f'<rect id="a" x="60" y="-20" width="80" height="40" stroke="red" paint-order="{order}"/>'
    elements, _ = body(tmp_path, drawing)
    unpainted = ["fill" if style_of(part).get("fill") == "none" else "stroke" for part in elements["a"]]
    assert unpainted == (["stroke", "fill"] if order == "normal" else ["fill", "stroke"])


def test_gradients_in_units_of_the_box_rotate_with_the_shape(tmp_path):
    drawing = """<linearGradient id="g"><stop stop-color="red"/></linearGradient>
    <rect id="a" x="10" y="20" width="40" height="30" fill="url(#g)"/>
    <path id="b" d="M0 0H20" stroke="url(#g)"/>"""
    elements, _ = body(tmp_path, drawing, lambda z: 1j * z)
    references = referred(elements, elements["a"], "fill")
    assert [references.get(name) for name in ("x1", "y1", "x2", "y2")] == ["0", "0", "1", "0"]
    place = affine.parse(references.get("gradientTransform"))
    corners = np.array([0, 1, 1j])
    assert np.abs(place(corners) - (-1j) * np.array([10 + 20j, 50 + 20j, 10 + 50j])).max() < 1e-5
    assert elements["b"].get("stroke") == "url(#g)"  # a box without area: SVG paints nothing


def test_percentages_of_a_gradient_refer_to_the_source(tmp_path):
    drawing = """<radialGradient id="g" gradientUnits="userSpaceOnUse" cx="75%" fx="10"/>
    <rect id="a" width="40" height="30" fill="url(#g)"/>"""
    elements, _ = body(tmp_path, drawing)
    references = referred(elements, elements["a"], "fill")
    assert [references.get(name) for name in ("cx", "cy", "r", "fx", "fy")] == [
        "150",
        "100",
        "100",
        "10",
        None,
    ]


def test_patterns_follow_the_shape(tmp_path):
    drawing = """<pattern id="p" width=".25" height=".5" patternContentUnits="objectBoundingBox"><g/></pattern>
    <pattern id="q" patternUnits="userSpaceOnUse" width="5" height="4" patternTransform="rotate(90)"><g/></pattern>
    <rect id="a" x="10" y="20" width="40" height="20" fill="url(#p)"/>
    <g transform="scale(2)"><rect id="b" width="9" height="9" fill="url(#q)"/></g>"""
    elements, notes = body(tmp_path, drawing, lambda z: 3 * z / 4 + 1)
    a, b = (referred(elements, elements[name], "fill") for name in "ab")
    assert [a.get(name) for name in ("x", "y", "width", "height")] == ["10", "20", "10", "10"]
    assert a.get("viewBox") == "0 0 0.25 0.5" and len(elements["p"]) == 1
    place = affine.parse(b.get("patternTransform"))
    assert np.abs(place(np.array([0, 1, 1j])) - np.array([1, 1 + 1.5j, -0.5])).max() < 1e-5
    assert not notes


def test_elements_that_cannot_be_bent_get_a_note(tmp_path):
    drawing = """<linearGradient id="g"/><rect x="-80" y="-80" width="160" height="160" fill="url(#g)"/>
    <rect width="3" height="3" fill="url(#g)"/>"""
    _, notes = body(tmp_path, drawing, lambda z: z + 0.003 * z**2)
    (note,) = notes
    assert note.startswith("1 × gradient") and "affine" in note


def test_a_filter_is_scaled_and_rotated_with_its_element(tmp_path):
    drawing = """<filter id="f" filterUnits="userSpaceOnUse" x="-10" y="-10" width="60" height="40">
    <feOffset dx="3" dy="1"/><feGaussianBlur stdDeviation="2 1"/><feTurbulence baseFrequency=".1"/>
    <fePointLight x="5" y="0" z="7"/><feDistantLight azimuth="30"/></filter>
    <g id="a" filter="url(#f)"><rect width="40" height="20"/></g>
    <g transform="scale(3)"><rect id="b" width="9" height="6" style="filter:url(#f)"/></g>"""
    elements, notes = body(tmp_path, drawing, lambda z: -1j * z / 2)  # y points down: 1j / 2 there
    references = referred(elements, elements["a"], "filter")
    offset, blur, noise, light, sun = references
    assert (offset.get("dx"), offset.get("dy"), blur.get("stdDeviation")) == ("-0.5", "1.5", "0.5 1")
    assert noise.get("baseFrequency") == "0.2" and sun.get("azimuth") == "120"
    assert np.allclose([float(light.get(k)) for k in "xyz"], [0, 2.5, 3.5], atol=1e-4)
    box = [float(references.get(name)) for name in ("x", "y", "width", "height")]
    assert np.allclose(box, [-15, -5, 20, 30], atol=0.05)  # a margin of 10 in each direction, halved
    assert referred(elements, elements["b"], "filter")[0].get("dy") == "4.5"
    assert not notes and "f" not in elements


def test_offsets_and_blurs_do_not_depend_on_where_a_filter_is_used(tmp_path):
    drawing = """<filter id="f"><feOffset dx="3" dy="1"/><feDropShadow dx="2" dy="-5" stdDeviation="2 1"/></filter>
    <rect id="a" x="10" y="-30" width="40" height="20" filter="url(#f)"/>"""
    elements, _ = body(tmp_path, drawing, lambda z: 2 * z + 30 - 10j)
    offset, shadow = referred(elements, elements["a"], "filter")
    assert (offset.get("dx"), offset.get("dy")) == ("6", "2")
    assert (shadow.get("dx"), shadow.get("dy"), shadow.get("stdDeviation")) == ("4", "-10", "4 2")


def test_masks_are_carried_where_they_are_used(tmp_path):
    drawing = """<mask id="m" style="mask-type:alpha" maskUnits="userSpaceOnUse" x="0" y="0" width="30" height="40">
    <circle cx="20" cy="20" r="20" fill="#fff"/></mask>
    <mask id="n" maskContentUnits="objectBoundingBox"><rect width="1" height=".5" fill="#fff"/></mask>
    <g id="a" mask="url(#m)"><rect width="40" height="40"/></g>
    <rect id="b" y="-40" width="40" height="40" mask="url(#n)"/>"""
    elements, notes = body(tmp_path, drawing, lambda z: z / 2 - 20)
    round_, half = (referred(elements, elements[name], "mask") for name in "ab")
    assert style_of(round_)["mask-type"] == "alpha" and round_.get("maskUnits") == "userSpaceOnUse"
    assert np.abs(np.abs(outline(round_[0][0]) - (-10 + 10j)) - 10).max() < 0.02
    (edge,) = referred(elements, round_[0], "clip-path")
    assert abs(outline(edge).real.max() + 5) < 0.02
    z = outline(half[0][0])
    assert np.allclose(
        [z.real.min(), z.real.max(), z.imag.min(), z.imag.max()], [-20, 0, -20, -10], atol=0.02
    )
    assert not notes and "m" not in elements


def embedded_png(pixels):
    return "data:image/png;base64," + base64.b64encode(image_files.as_png(Image(pixels))).decode()


def pixels_in(address):
    """The pixels of a picture embedded in a drawing."""
    return image_files.read_held(base64.b64decode(address.partition(",")[2]), "it").pixels


def bent(z):
    return z + 0.002 * z**2


def test_an_embedded_picture_is_resampled(tmp_path):
    """Its pixels are mapped, and bounded by one clip path: no seams, and no notches at its outline."""
    i, j = np.mgrid[:60, :120]
    ramp = np.stack([2 * j, 4 * i, 0 * i + 77], axis=2).astype(np.uint8)
    drawing = f"""<image id="a" x="10" y="20" width="60" height="30" transform="scale(.5)" opacity=".5"
    href="{embedded_png(ramp)}"/>"""
    elements, notes = body(tmp_path, drawing, bent)
    (part,) = elements["a"]
    (picture,) = part
    (corners,) = referred(elements, part, "clip-path")
    assert elements["a"].get("opacity") == ".5" and "transform" not in picture.attrib
    exact = bent(np.array([5 + 10j, 35 + 10j, 35 + 25j, 5 + 25j]))
    assert np.abs(outline(corners) - exact[:, None]).min(axis=1).max() < 0.02
    pixels = pixels_in(picture.get(LINK))
    height, width = pixels.shape[:2]
    assert any(f"{width} × {height}" in note for note in notes)
    x, y, across, down = (float(picture.get(name)) for name in ("x", "y", "width", "height"))
    rows, columns = np.mgrid[:height, :width]
    w = x + (columns + 0.5) * across / width + 1j * (y + (rows + 0.5) * down / height)
    z = (np.sqrt(1 + 0.008 * w) - 1) / 0.004
    texel = (z - (5 + 10j)) * 4  # four texels per unit of the root
    inside = (texel.real > 2) & (texel.real < 118) & (texel.imag > 2) & (texel.imag < 58)
    assert inside.sum() > 10_000
    expected = np.stack([2 * (texel.real - 0.5), 4 * (texel.imag - 0.5), 0 * texel.real + 77], axis=2)
    assert np.abs(pixels[..., :3] - expected)[inside].max() < 1.5


@pytest.mark.slow
@pytest.mark.skipif(not INKSCAPE, reason="NOT SHOWN BY INKSCAPE: install it")
def test_inkscape_shows_an_embedded_picture_without_seams(tmp_path, monkeypatch, iccm):
    """Bent onto a curved shape; the left of the picture is red, and the right blue."""
    monkeypatch.chdir(tmp_path)
    halves = np.full((20, 40, 3), (200, 30, 20), np.uint8)
    halves[:, 20:] = 20, 40, 200
    (tmp_path / "a.svg").write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 80 40">'
        f'<image width="80" height="40" href="{embedded_png(halves)}"/></svg>'
    )
    (tmp_path / "b.svg").write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 60">'
        '<path d="M5 10Q50 -10 95 10V50Q50 30 5 50Z"/></svg>'
    )
    assert iccm("map", "a.svg#canvas", "b.svg", "-o", "o.svg").code == 0
    command = [INKSCAPE, "o.svg", "--export-type=png", "--export-filename=o.png", "--export-width=500"]
    subprocess.run(command, check=True, timeout=100, capture_output=True)
    shown = image_files.read("o.png").pixels.astype(int)
    assert shown.shape[:2] == (300, 500) and not shown[290, 250, 3]
    for columns, colour in ((slice(40, 220), (200, 30, 20)), (slice(280, 460), (20, 40, 200))):
        inside = shown[60:190, columns]
        assert np.abs(inside - (*colour, 255)).max() <= 2


@pytest.mark.parametrize("size", [1, 40])
def test_an_embedded_picture_of_one_colour_stays_one(size, tmp_path):
    flat = np.full((size, 2 * size, 3), (180, 60, 20), np.uint8)
    elements, _ = body(
        tmp_path, f'<image id="a" x="-60" width="120" height="60" href="{embedded_png(flat)}"/>', bent
    )
    assert (pixels_in(elements["a"][0][0].get(LINK)) == (180, 60, 20)).all()


@pytest.mark.parametrize("aspect", ["none", "xMinYMax meet", "xMidYMid slice"])
def test_an_embedded_picture_under_a_similarity_is_unchanged(aspect, tmp_path):
    address = embedded_png(np.arange(8 * 16 * 3, dtype=np.uint8).reshape(8, 16, 3))
    drawing = f"""<image id="a" x="10" y="20" width="30" height="30" href="{address}"
    preserveAspectRatio="{aspect}" transform="rotate(20)"/>"""
    elements, notes = body(tmp_path, drawing, lambda z: (1.5 + 0.5j) * z + 7)
    (part,) = elements["a"]
    (picture,) = part
    assert picture.get(LINK) == address and not any("picture" in note for note in notes)
    placed = affine.parse(picture.get("transform"))
    box = [complex(x, y) for x in (0, float(picture.get("width"))) for y in (0, 1)]
    fit = affine.viewport((10, 20, 30, 30), (0, 0, 16, 8), aspect)
    turn = affine.rotation(20)
    expected = [
        np.conj((1.5 + 0.5j) * np.conj(turn(fit(complex(x, y)))) + 7) for x in (0, 16) for y in (0, 8)
    ]
    assert np.allclose([placed(z) for z in box], expected, atol=0.02)
    (corners,) = referred(elements, part, "clip-path")
    assert np.ptp(outline(corners).real) > 20


def test_external_and_unreadable_pictures_are_removed(tmp_path):
    flat = embedded_png(np.full((4, 4, 3), 90, np.uint8))
    cut = flat[:-40]
    drawing = f"""<image id="b" x="85" width="60" height="9" preserveAspectRatio="none" href="{flat}"/>
    <image id="c" x="300" width="9" height="9" href="{flat}"/>
    <image id="d" width="9" height="9" href="d.png"/><image id="e" width="9" height="9" href="data:image/png,"/>
    <image id="f" width="9" height="9" href="{cut}"/><image id="g" x="-50" y="-60" href="{flat}"/>"""
    elements, notes = body(tmp_path, drawing, bent)
    assert len(elements["b"]) == 1 and not {"d", "e"}.intersection(elements)
    assert not len(elements["c"]) and not len(elements["f"])
    (own_size,) = referred(elements, elements["g"][0], "clip-path")
    assert np.ptp(outline(own_size).real) == pytest.approx(4, rel=0.3)
    assert sum("not embedded" in note for note in notes) == 1
    assert sum("read" in note and "omitted" in note for note in notes) == 2
    assert "1 × shape outside the source, omitted" in notes


def test_a_symbol_is_drawn_where_it_is_used_and_clipped_to_its_view(tmp_path):
    drawing = """<symbol id="s" viewBox="0 0 10 10"><rect width="5" height="20"/></symbol>
    <g id="a"><use href="#s" x="10" y="20" width="30" height="30"/></g>
    <g id="b"><use href="#s" width="10" height="10" style="overflow:visible"/></g>"""
    elements, notes = body(tmp_path, drawing)
    bar = next(e for e in elements["a"].iter() if e.tag.endswith("}path"))
    z = outline(bar)
    assert np.allclose([z.real.min(), z.real.max(), z.imag.min(), z.imag.max()], [10, 25, 20, 80], atol=0.02)
    clipped = next(e for e in elements["a"].iter() if "clip-path" in style_of(e))
    (view,) = referred(elements, clipped, "clip-path")
    assert abs(outline(view).imag.max() - 50) < 0.02
    assert len([e for e in elements["a"].iter() if e.tag.endswith("}path")]) == 1
    assert not notes and "s" not in elements


def test_styles_selected_by_tag_or_id_survive_new_tags_and_ids(tmp_path):
    drawing = """<style>rect{fill:red}path{fill:blue}#r{stroke:lime}.t{transform:translate(9px,0)}</style>
    <defs><rect id="r" width="9" height="9"/></defs><g id="a"><use href="#r"/></g>
    <circle id="b" r="9" fill="gold"/><g id="c" class="t"><circle id="d" r="2"/></g>"""
    elements, _ = body(tmp_path, drawing)
    rect = style_of(next(e for e in elements["a"].iter() if e.tag.endswith("}path")))
    assert (rect["fill"], rect["stroke"], rect.get("id")) == ("red", "lime", None)
    assert style_of(elements["b"])["fill"] == "gold" and style_of(elements["d"])["fill"] == "inherit"
    assert (
        style_of(elements["c"])["transform"] == "none" and abs(outline(elements["d"]).real.mean() - 9) < 0.1
    )


def test_unsupported_style_rules_get_a_note(tmp_path):
    drawing = "<style>@font-face{font-family:x}.a:hover,g:has(.b){stroke-width:9}.c{fill:red}</style><circle r='9'/>"
    _, notes = body(tmp_path, drawing)
    assert len(notes) == 1 and notes[0].startswith("2 × style rule") and "kept" in notes[0]


def test_styles_selected_by_position_become_inline_styles(tmp_path):
    drawing = """<style>#a>rect,.t{fill:lime}linearGradient>stop{stop-color:red}path:not(.t){stroke:blue}
    g g path{opacity:.5}</style><linearGradient id="g"><stop id="stop"/></linearGradient>
    <g id="a"><rect id="b" width="9" height="9"/><rect id="c" width="9" height="9" fill="url(#g)"/></g>
    <g id="d"><g><circle id="e" class="t" r="9" fill="url(#g)"/></g></g>
    <rect id="f" width="5" height="5" fill="url(#g)"/>"""
    elements, notes = body(tmp_path, drawing)
    styles = {name: style_of(elements[name]) for name in ("b", "c", "e", "f", "stop")}
    assert styles["b"]["fill"] == styles["c"]["fill"] == "lime" and "stroke" not in styles["b"]
    assert styles["e"].get("fill") == "url(#g)" and "opacity" not in styles["e"]
    assert styles["f"]["fill"].startswith("url(#mapped-") and styles["stop"]["stop-color"] == "red"
    text = (tmp_path / "b.svg").read_text()
    assert ".t{fill:lime}" in text and "#a" not in text and ":not" not in text and not notes


def test_nothing_that_would_undo_the_map_or_run_is_kept(tmp_path):
    drawing = """<g xmlns:sodipodi="http://sodipodi.sourceforge.net/DTD/sodipodi-0.dtd"
    xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape" id="a" inkscape:label="Art" inkscape:groupmode="layer">
    <path id="b" sodipodi:type="star" inkscape:original-d="M0 0" d="M0 0H9V9" onclick="x()"/></g><script>x()</script>
    <switch><foreignObject requiredExtensions="x"/><g id="c"><rect width="5" height="5"/></g></switch>
    <g display="none"><rect id="d" width="9" height="9"/></g>
    <text writing-mode="sideways-lr">a</text><text writing-mode="sideways-lr">b</text><flowRoot/><animate/>"""
    elements, notes = body(tmp_path, drawing)
    assert set(elements["b"].attrib) == {"id", "d"}
    assert [k.partition("}")[2] for k in elements["a"].attrib] == ["", "label", "groupmode"]
    assert "c" in elements and "d" not in elements
    assert [note.partition(",")[0] for note in notes] == [
        "1 × <animate>",
        "1 × <flowRoot>",
        "1 × <script>",
        "2 × <text>",
        "1 × hidden element (display: none",
    ]


def test_mapped_artwork_can_be_mapped_again(tmp_path):
    drawing = """<linearGradient id="g"/><clipPath id="c"><rect width="50" height="50"/></clipPath>
    <rect id="a" width="40" height="30" fill="url(#g)" clip-path="url(#c)"/><circle id="b" r="9" fill="url(#g)"/>"""
    body(tmp_path, drawing, lambda z: 0.5 * z)
    once = (tmp_path / "b.svg").read_text()
    (tmp_path / "a.svg").write_text(once)
    source = shape.read(f"{tmp_path}/a.svg#shape")
    assert not artwork.carry(
        source, curved(source, lambda z: 2 * z), source, tmp_path / "b.svg", tolerance=0.01
    )
    elements = list(ElementTree.parse(tmp_path / "b.svg").getroot().iter())
    names = [e.get("id") for e in elements if e.get("id")]
    assert "mapped-1" in once and len(names) == len(set(names))
    by_id = {e.get("id"): e for e in elements}
    place = affine.parse(referred(by_id, by_id["b"], "fill").get("gradientTransform"))
    assert np.abs(place(np.array([0, 1, 1j])) - np.array([-9 - 9j, 9 - 9j, -9 + 9j])).max() < 1e-3
    assert abs(outline(referred(by_id, by_id["a"], "clip-path")[0]).real.max() - 50) < 0.05


def test_definitions_are_those_that_are_used(tmp_path):
    drawing = """<defs><linearGradient id="g" xlink:href="#h"/><linearGradient id="h"><stop/></linearGradient>
    <linearGradient id="no"/><pattern id="p" width="1" height="1"><use href="#dot"/></pattern>
    <circle id="dot" r="3"/><circle id="other" r="3"/></defs>
    <rect id="a" width="9" height="9" fill="url(#g)" stroke="url(#p)"/>"""
    elements, _ = body(tmp_path, drawing)
    assert {"g", "h", "p", "dot"} <= set(elements) and not {"no", "other"} & set(elements)


@pytest.mark.parametrize(
    ("drawing", "parts"),
    [
        ('<path id="a" d="M0 0H9" stroke="red" stroke-width="abc"/>', ["<path> 'a'", "stroke-width 'abc'"]),
        ('<linearGradient id="g" x1="z"/><rect width="9" height="9" fill="url(#g)"/>', ["<rect>", "x1 'z'"]),
        (
            '<filter id="f"><feOffset dx="z"/></filter><circle r="9" filter="url(#f)"/>',
            ["<feOffset> dx", "'z'"],
        ),
        (
            "".join(
                f'<mask id="m{k}"><rect width="9" height="9" mask="url(#m{k + 1})"/></mask>'
                for k in range(60)
            )
            + '<rect width="9" height="9" mask="url(#m0)"/>',
            ["more than 40 deep"],
        ),
    ],
)
def test_malformed_artwork_is_refused_in_one_line(tmp_path, drawing, parts):
    with pytest.raises(InputError) as caught:
        body(tmp_path, drawing)
    message = str(caught.value)
    assert (
        message.startswith(f"{tmp_path}/a.svg: ")
        and len(message) < 200 + len(str(tmp_path))
        and "\n" not in message
    )
    assert all(part in message for part in parts)


LINES = (
    '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 24 24" fill="none" stroke="black" stroke-width="2" '
    'stroke-linecap="round" stroke-linejoin="round">{}</svg>'
)
FACE = (
    '<path id="head" d="M4 7L7 4L10 6H15L19 3L20 8V16L16 21H8L4 16Z"/>'
    '<path id="left" d="M8 12v1"/><path id="right" d="M16 11v.5"/><path id="mouth" d="M9 17L12 18L16 17"/>'
)


def test_lines_of_an_icon_follow_the_map_of_the_area_they_enclose(tmp_path, iccm, monkeypatch):
    """Eyes and mouth lie inside the head's line, whose stroke would be a ring around a hole."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "face.svg").write_text(LINES.format(FACE))
    (tmp_path / "box.svg").write_text(LINES.format('<path d="M3 5H20V19L15 21H3Z"/>'))
    assert iccm("map", "face.svg", "box.svg", "--detail", "0", "-o", "o.svg").code == 0
    elements = {node.names[0]: node for node in drawn(tmp_path / "o.svg") if node.names}
    assert set(elements) == {"head", "left", "right", "mouth"}
    assert not any(node.filled for node in elements.values())
    middles = {name: complex(np.mean(reader.runs_of(node, 1e-3)[0].z)) for name, node in elements.items()}
    assert 4 < middles["left"].real < middles["mouth"].real < middles["right"].real < 19
    assert max(middles["left"].imag, middles["right"].imag) < middles["mouth"].imag - 3
    head = reader.runs_of(elements["head"], 1e-3)[0].z
    assert np.ptp(head.real) == pytest.approx(17, abs=0.6) and np.ptp(head.imag) == pytest.approx(16, abs=0.6)


def area_of(d):
    """The area that the fill of path data encloses."""
    (run,) = path_data.subpaths(d, affine.Affine(), 1e-6)
    z = run.z - run.z[0]
    return abs((z[:-1].conj() * z[1:]).imag.sum() / 2)


@pytest.mark.parametrize(
    "line",
    [
        '<line x1="-60" y1="20" x2="50" y2="30" stroke="red"/>',
        '<path d="M-60 40H50" stroke="red"/>',
        '<polyline points="-60,10 -20,10 50,10" stroke="red"/>',
        '<path d="M-60 -40H50Z" stroke="red"/>',
    ],
)
def test_straight_lines_paint_no_inside_where_they_are_bent(line, source, tmp_path):
    """SVG fills them by default, which is invisible while they are straight."""
    (tmp_path / "a.svg").write_text(HEAD + DRAWING.replace("</svg>", line + "</svg>"))
    source = shape.read(f"{tmp_path}/a.svg#shape")
    artwork.carry(source, curved(source), source, tmp_path / "b.svg")
    bent = [d for d in drawn(tmp_path / "b.svg") if d.properties.get("stroke") == "red"]
    assert bent and not any(d.filled for d in bent)
    assert area_of(bent[0].properties["d"]) > 20 or "Z" in line


@pytest.mark.parametrize("stroke", ["", ' stroke="red"'])
def test_the_closing_edge_of_an_open_fill_is_mapped_too(stroke, source, tmp_path):
    """The chord of the source, not of the target, bounds the fill; the line stays open."""
    open_path = f'<path d="M-60 20 L-5 60 L50 30" fill="gold"{stroke}/>'
    (tmp_path / "a.svg").write_text(HEAD + DRAWING.replace("</svg>", open_path + "</svg>"))
    source = shape.read(f"{tmp_path}/a.svg#shape")
    map = curved(source)
    artwork.carry(source, map, source, tmp_path / "b.svg", tolerance=0.01)
    gold = [d for d in drawn(tmp_path / "b.svg") if d.properties.get("fill") == "gold" and d.filled]
    (fill,) = [d for d in gold if not d.stroked]
    z = Curve(np.array([-60 - 20j, -5 - 60j, 50 - 30j])).resample(4000).z
    w = map(z)
    assert area_of(fill.properties["d"]) == pytest.approx(
        abs(np.imag(w.conj() @ np.roll(w, -1)) / 2), rel=2e-3
    )
    lines = [d for d in drawn(tmp_path / "b.svg") if d.properties.get("stroke") == "red"]
    assert [d.properties["d"].endswith("Z") for d in lines] == [False] * bool(stroke)
    assert not any(d.filled for d in lines)


def test_an_open_fill_is_cut_where_only_its_closing_edge_is_outside(source, tmp_path):
    """The chord of a crescent's horn leaves the shape, but the horn does not."""
    crescent = "M0 80 C-100 80 -100 -80 0 -80 C-60 -50 -60 50 0 80Z"
    arc = '<path d="M-12 70 C-80 60 -80 -60 -12 -70" fill="gold"/>'
    (tmp_path / "a.svg").write_text(f'{HEAD}<path id="shape" d="{crescent}" fill="tan"/>{arc}</svg>')
    source = shape.read(f"{tmp_path}/a.svg#shape")
    notes = artwork.carry(source, curved(source, lambda z: z), source, tmp_path / "b.svg", tolerance=0.05)
    (fill,) = [d for d in drawn(tmp_path / "b.svg") if d.properties.get("fill") == "gold"]
    (horn,) = [d for d in drawn(source.path) if d.properties.get("fill") == "gold"]
    assert any("partly outside" in note for note in notes)
    assert area_of(fill.properties["d"]) < 0.7 * area_of(horn.properties["d"])


@pytest.mark.parametrize(
    ("frames", "continuous"),
    [
        (["M0 0C1e-05 0 1 2 3 4Z", "M0 0C1 0 1 2 3 4Z"], True),
        (["M0 0C1 0 1 2 3 4Z", "M0 0C1 0 1 2 3 4"], False),
    ],
)
def test_paths_are_interpolated_command_by_command_for_any_form_of_numbers(frames, continuous):
    assert animation._continuous("d", frames) == continuous


def test_attributes_of_other_programs_stay_on_their_elements(tmp_path, monkeypatch, iccm):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.svg").write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" xmlns:s="http://inkstitch.org/namespace" viewBox="0 0 100 60" '
        'xmlns:ev="http://www.w3.org/2001/xml-events" xmlns:o="https://example.org/other">'
        '<path id="leaf" d="M10 10H90V50H10Z" s:angle="45" s:row_spacing_mm="0.25" o:depth="3" ev:event="click"/></svg>'
    )
    assert iccm("map", "a.svg", "a.svg", "-o", "o.svg").code == 0
    (leaf,) = (e for e in ElementTree.parse("o.svg").iter() if e.get("id") == "leaf")
    kept = {name: value for name, value in leaf.attrib.items() if name.startswith("{")}
    stitches = "{http://inkstitch.org/namespace}"
    assert kept == {
        f"{stitches}angle": "45",
        f"{stitches}row_spacing_mm": "0.25",
        "{https://example.org/other}depth": "3",
    }


@pytest.mark.keeps("inkstitch", "parameters of stitches", "commands, which move with the map and do not bend")
def test_commands_of_ink_stitch_stay_commands(tmp_path):
    """Ink/Stitch finds a command by the <symbol> of a <use> at one end of a line, and its object at the other end."""
    drawing = tmp_path / "a.svg"
    drawing.write_text(
        HEAD.replace("<svg ", '<svg xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape" ')
        + '<defs><symbol id="inkstitch_trim"><path d="M-4 -2h8v4h-8z"/></symbol></defs>'
        '<path id="leaf" d="M-60 -60h90v90z"/><g transform="translate(20 0)">'
        '<use id="cut" xlink:href="#inkstitch_trim" '
        'x="-70" y="10"/><use id="far" xlink:href="#inkstitch_trim" x="900"/></g><path id="line" d="M0 0L-50 10" '
        'fill="none" stroke="#000" inkscape:connection-start="#leaf" inkscape:connection-end="#cut"/></svg>'
    )
    source = shape.read(f"{drawing}#canvas")
    artwork.carry(source, curved(source), source, tmp_path / "b.svg")
    top = ElementTree.parse(tmp_path / "b.svg").getroot()
    by_id = {e.get("id"): e for e in top.iter() if e.get("id")}
    line, name = by_id["line"], "{http://www.inkscape.org/namespaces/inkscape}connection-"
    target, use = (by_id[line.get(name + end)[1:]] for end in ("start", "end"))
    symbol = by_id[use.get(LINK)[1:]]
    assert [e.tag.partition("}")[2] for e in (target, use, symbol)] == ["path", "use", "symbol"]
    assert symbol.get("id") == "inkstitch_trim" and sum(e.tag == use.tag for e in top.iter()) == 1
    z = -50 - 10j  # y up
    place = affine.parse(use.get("transform"))(complex(float(use.get("x", 0)), float(use.get("y", 0))))
    assert abs(place - (z + 0.003 * z**2).conjugate()) < 0.1


@pytest.mark.keeps("inkstitch", "rails and rungs of satin columns", "settings of the document")
def test_satin_columns_keep_their_rails_and_rungs(tmp_path):
    """Ink/Stitch tells them apart by the order, the directions and the ends of the lines in one path."""
    rails = [(-60, 20, 40, 15), (-60, 50, 40, 45)]
    rungs = [(-30, 8, -30, 60), (20, 5, 20, 58)]
    drawing = tmp_path / "a.svg"
    drawing.write_text(
        HEAD.replace("<svg ", '<svg xmlns:s="http://inkstitch.org/namespace" ')
        + "<metadata><s:collapse_len_mm>3</s:collapse_len_mm></metadata>"
        + '<path id="satin" fill="none" stroke="#a00" s:satin_column="True" d="'
        + "".join(f"M{x} {y}L{u} {v}" for x, y, u, v in rails + rungs)
        + '"/></svg>'
    )
    source = shape.read(f"{drawing}#canvas")
    artwork.carry(source, curved(source), source, tmp_path / "b.svg")
    top = ElementTree.parse(tmp_path / "b.svg").getroot()
    stitches = "{http://inkstitch.org/namespace}"
    assert top.findtext(f".//{stitches}collapse_len_mm") == "3"
    (satin,) = (e for e in top.iter() if e.get("id") == "satin")
    assert satin.get(f"{stitches}satin_column") == "True"
    lines = [run.z for run in path_data.subpaths(satin.get("d"), affine.Affine(), 1e-3)]
    ends = np.array([[line[0], line[-1]] for line in lines])
    z = np.array([[complex(x, -y), complex(u, -v)] for x, y, u, v in rails + rungs])
    assert ends.shape == z.shape and np.abs(ends - (z + 0.003 * z**2).conj()).max() < 0.1


def test_path_data_in_style_sheets_are_mapped(tmp_path, monkeypatch, iccm):
    monkeypatch.chdir(tmp_path)
    svg = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 60">{}</svg>'
    (tmp_path / "css.svg").write_text(
        svg.format(
            '<style>#p{d:path(\'M10 10H60V50H10z\');fill:#48c}#n{d:none}</style><path id="p"/><path id="n"/>'
        )
    )
    (tmp_path / "plain.svg").write_text(svg.format('<path id="p" d="M10 10H60V50H10z"/>'))
    as_outline = (
        "--detail",
        "0",
        "--background",
        "transparent",
    )  # else the drawing of two paths is composed on paper
    for name in ("css", "plain"):
        options = as_outline if name == "css" else ()  # without effect on a plain outline
        assert iccm("map", f"{name}.svg", "plain.svg", *options, "-o", f"o-{name}.svg").code == 0
    first, second = (
        [e.get("d") for e in ElementTree.parse(f"o-{name}.svg").iter() if e.get("d")]
        for name in ("css", "plain")
    )
    assert first == second and len(first) == 1
    assert "path(" not in (tmp_path / "o-css.svg").read_text()


def test_parts_of_outlines_are_evaluated_together(monkeypatch):
    round_outline = 2 + 1j + np.exp(2j * np.pi * np.arange(30) / 30)
    outlines = [Curve(np.array([0, 3, 3 + 2j, 2j])), Curve(round_outline)]
    curve = Bezier((0j, 1 + 2j, 3j, 4 + 1j))
    parts = [Span(outlines[k % 2], 0.07 * k, 5 - 0.11 * k) for k in range(90)]
    parts += [curve, Span(curve, 0.7, 0.2), Span(outlines[0], 14, -3)]
    t = np.array([0, 0.3, 1])
    expected = np.concatenate([part.at(t) for part in parts])
    calls, at = [], Curve.at
    monkeypatch.setattr(Curve, "at", lambda outline, s: calls.append(np.size(s)) or at(outline, s))
    numbers = np.random.default_rng(1).permutation(len(parts))
    points = SegmentMapper(parts)(np.repeat(numbers, t.size), np.tile(t, numbers.size))
    assert np.allclose(points.reshape(-1, t.size), expected.reshape(-1, t.size)[numbers], atol=1e-12)
    assert sorted(calls) == [45 * t.size, 46 * t.size]


PATTERNED = f"""{HEAD}<defs><pattern id="p" patternUnits="userSpaceOnUse" width="9" height="7"><circle r="2"/></pattern>
</defs><rect id="shape" x="-80" y="-60" width="160" height="120" fill="url(#p)"/></svg>"""


@pytest.mark.parametrize("target", ["blob.svg", "square.svg"])
@pytest.mark.parametrize("content", [f"{HEAD}{DRAWING}", PATTERNED], ids=["paths", "pattern"])
def test_a_drawing_prepared_before_the_map_is_known_is_written_as_otherwise(
    content, target, shapes, tmp_path, monkeypatch
):
    """Also if patterns are drawn as tiles, which only maps that bend them need."""
    (tmp_path / "s.svg").write_text(content)
    drawn, goal = shape.read(str(tmp_path / "s.svg#shape")), shape.read(str(shapes / target))
    bent = iccm.fit(drawn.curve, goal.curve, method="conformal", vertices=60).map
    built = []
    build = artwork.MappedDocument.of
    monkeypatch.setattr(
        artwork.MappedDocument, "of", lambda *given, **named: built.append(1) or build(*given, **named)
    )
    prepared = artwork.PreparedDrawing(drawn, goal)
    frame = artwork.ArtworkFrame([(drawn, bent)], goal, tmp_path / "prepared.svg")
    built.clear()
    notes = artwork.carry_frames([frame], prepared_drawing=prepared)
    assert not built
    again = artwork.carry_frames([frame._replace(path=tmp_path / "fresh.svg")], prepared_drawing=prepared)
    assert len(built) == 1  # it was used up
    assert notes == again
    assert (tmp_path / "prepared.svg").read_bytes() == (tmp_path / "fresh.svg").read_bytes()


def test_a_prepared_drawing_is_not_used_on_another_canvas(source, shapes, tmp_path):
    """Nor for another number of copies."""
    goal = shape.read(str(shapes / "blob.svg"))
    wide = replace(goal, box=(goal.box[0] - 7, goal.box[1] + 3j))
    prepared = artwork.PreparedDrawing(source, goal)
    assert prepared.take(source, wide, 1, bends=True, alone=True) is None
    assert prepared.take(source, goal, 2, bends=True, alone=True) is None
    assert prepared.take(source, goal, 1, bends=True, alone=False) is None
    assert prepared.take(source, goal, 1, bends=True, alone=True) is not None


def test_patterns_prepared_as_tiles_are_not_used_for_affine_maps(shapes, tmp_path):
    """An affine map keeps the pattern."""
    (tmp_path / "s.svg").write_text(PATTERNED)
    drawn, goal = shape.read(str(tmp_path / "s.svg#shape")), shape.read(str(shapes / "blob.svg"))
    prepared = artwork.PreparedDrawing(drawn, goal)
    assert prepared.take(drawn, goal, 1, bends=False, alone=True) is None
    assert prepared.take(drawn, goal, 1, bends=True, alone=True) is not None
