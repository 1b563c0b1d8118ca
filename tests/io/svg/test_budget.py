"""Small or legal drawings that need much work or memory: rejected immediately in one line, or simplified first."""

import gzip
from xml.etree.ElementTree import Element, SubElement, fromstring

import numpy as np
import pytest
import shapely

from iccm import InputError
from iccm.io import artwork, limits
from iccm.io.shapes import shape
from iccm.io.svg import crossings, fill, path_data, reader
from iccm.io.svg.affine import Affine
from iccm.io.svg.curves import Polyline, thinned
from iccm.io.svg.stylesheet import Stylesheet
from iccm.plane import diagonal
from tests.cases import slow

SVG = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 100">{}</svg>'


def points(z):
    return "L".join(f"{w.real:.6f} {w.imag:.6f}" for w in z)


def circle(count, radius=40):
    return 50 + 50j + radius * np.exp(2j * np.pi * np.arange(count) / count)


def star(count):
    """Every edge crosses nearly every other."""
    return 50 + 50j + 40 * np.exp(2j * np.pi * np.arange(count) * (count // 2) / count)


def refused(folder, body, match, part="", **options):
    path = folder / "bomb.svg"
    path.write_text(SVG.format(body))
    with pytest.raises(InputError, match=match) as caught:
        shape.read(f"{path}{part}", **options)
    text = str(caught.value)
    assert text.startswith(str(path)) and "\n" not in text and len(text) < 400 + len(str(path))


BOMBS = {
    "star": (f'<path d="M{points(star(20001))}Z"/>', "cross each other too often"),
    "star polygon": (f'<polygon points="{points(star(20001)).replace("L", " ")}"/>', "cross each other too often"),
    "stroked star": (f'<path fill="none" stroke="red" d="M{points(star(3001))}Z"/>', "cross each other too often"),
    "scribble": ('<path fill="none" stroke="red" stroke-width="20" d="M10 10' + "l30 .01l-30 .01" * 20_000 + '"/>', "close"),  # noqa: E501
    "grid": ('<path d="' + "".join(f"M{k / 10} 0h.01v100h-.01zM0 {k / 10}v.01h100v-.01z" for k in range(1000)) + '"/>', "cross"),  # noqa: E501
    "rectangles": ('<rect width="9" height="9"/>' * 100_001, "more than 100000 shapes"),
    "runs": ('<path d="' + "M1 1h1v1z" * 100_001 + '"/>', "more than 100000 subpaths"),
    "segments": ('<path d="M0 0' + "h1v1" * 600_000 + 'z"/>', "more than 1048576 lines and curves.*--max-segments"),
    "uses": ('<path id="p" d="M0 0' + "h1v1" * 5000 + 'z"/>' + '<use href="#p"/>' * 110, "more than 1048576 lines"),
    "nested": ('<path fill-rule="evenodd" d="' + "".join(f"M{k / 150} {k / 150}H{99 - k / 150}V{99 - k / 150}H{k / 150}Z" for k in range(5000)) + '"/>', "nested.*Break Apart"),  # noqa: E501
    "thin": ('<path d="M0 0H1V1000000H0z"/>', "1e.06 times as long as wide"),
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("name", BOMBS)
def test_excessive_drawings_are_refused_at_once(tmp_path, name):
    refused(tmp_path, *BOMBS[name])


def test_the_silhouette_of_too_many_overlaps_is_refused(tmp_path):
    rows = "".join(f'<rect x="0" y="{k / 5}" width="99" height=".1"/>' for k in range(300))
    (tmp_path / "a.svg").write_text(
        SVG.format(
            rows
            + rows.replace(' x="0" y=', ' y="0" x=').replace(
                'width="99" height=".1"', 'width=".1" height="99"'
            )
        )
    )
    with pytest.raises(InputError, match="cross each other too often"):
        shape.read(f"{tmp_path}/a.svg#silhouette")


def test_shapes_covered_by_the_silhouette_may_cross_any_number_of_times(tmp_path):
    star_and = f'<path stroke="#000" d="M{points(star(2001))}Z"/><path d="M{{0}} {{0}}H{{1}}V{{1}}H{{0}}Z"/>'
    (tmp_path / "a.svg").write_text(SVG.format(star_and.format(-10, 110)))
    assert shape.read(f"{tmp_path}/a.svg#silhouette").curve.area == 120**2
    refused(tmp_path, star_and.format(15, 110), "cross each other too often", part="#silhouette")


@pytest.mark.slow
def test_a_silhouette_that_is_refused_has_not_been_read_to_its_end(tmp_path, monkeypatch):
    rows = [f'<rect x="{k % 90}" y="{k // 90}" width="1.4" height="1.4"/>' for k in range(8100)]
    (tmp_path / "a.svg").write_text(SVG.format("".join(rows)))
    (tmp_path / "b.svg").write_text(SVG.format("".join(rows[:1000])))
    assert len(shape.read(f"{tmp_path}/b.svg#silhouette").curve.z) > 4
    seen, runs_of = [], reader.runs_of
    monkeypatch.setattr(reader, "runs_of", lambda *args: seen.append(1) or runs_of(*args))
    monkeypatch.setattr(limits, "CROSSINGS", 6000)  # of about 15,000
    with pytest.raises(InputError, match="cross each other too often"):
        shape.read(f"{tmp_path}/a.svg#silhouette")
    assert len(seen) <= 4000


def test_names_of_many_shapes_are_kept_in_order_and_once(tmp_path):
    rows = "".join(
        f'<g id="g"><rect id="r{k}" x="{k / 99}" y="0" width="9" height="9"/></g>' for k in range(2000)
    )
    (tmp_path / "a.svg").write_text(SVG.format(rows))
    names = list(reader.read(tmp_path / "a.svg").ids)
    assert names == ["g", *(f"r{k}" for k in range(2000))]


def test_the_limit_on_segments_can_be_set(tmp_path):
    refused(tmp_path, f'<path d="M{points(circle(2000))}Z"/>', "more than 1000 lines", max_segments=1000)


@pytest.mark.slow
def test_a_circle_of_a_million_segments_is_simplified_first(tmp_path):
    path = tmp_path / "circle.svg"
    path.write_text(SVG.format(f'<path d="M{points(circle(10**6))}Z"/>'))
    read = shape.read(str(path))
    assert read.curve.z.size < 2000 and abs(read.curve.area - np.pi * 1600) < 0.5
    assert any("simplified from 1000000" in note for note in read.notes)


@pytest.mark.slow
def test_many_rules_for_many_elements_are_looked_up_once(tmp_path):
    rules = "".join(f".a{{fill:#{k % 1000:03d}}}" for k in range(20_000))
    path = tmp_path / "rules.svg"
    path.write_text(SVG.format(f"<style>{rules}</style>" + '<path class="a" d="M1 1H9V9z"/>' * 2000))
    assert limits.RULES < 20_000 * 2000 and shape.read(str(path)).curve.area == 32


@pytest.fixture
def fewer_rules(monkeypatch):
    """A fifth of the limit, which takes a fifth of the time."""
    monkeypatch.setattr(limits, "RULES", limits.RULES // 5)


@pytest.mark.slow
@pytest.mark.usefixtures("fewer_rules")
def test_rules_that_cannot_be_looked_up_once_are_counted():
    sheet = Stylesheet("".join(f".a{{x:{k}}}.b{k}{{y:1}}" for k in range(2000)), Element("svg"))
    with pytest.raises(InputError, match="combinations of rules and elements"):
        for k in range(2000):
            sheet.style(Element("path", {"class": f"a b{k}"}))


def nested(depth):
    """An <svg> of nested groups, and the innermost one."""
    top = inner = Element("svg")
    for _ in range(depth):
        inner = SubElement(inner, "g")
    return top, inner


@pytest.mark.parametrize(
    "selector", ["a " + "g " * 12 + "g", "a" + "~g" * 9, "a" + " g~g" * 5, ":not(a g " + "g " * 9 + "g)"]
)
@pytest.mark.usefixtures("fewer_rules")
def test_steps_of_a_selector_are_counted(selector):
    top, _ = nested(150)
    for element in list(top.iter("g")):
        element[:] = [*element, *(Element("g") for _ in range(20))]
    sheet = Stylesheet(f"{selector}{{x:1}}", top)
    with pytest.raises(InputError, match="combinations of rules and elements"):
        for element in top.iter():
            sheet.style(element)


def test_siblings_are_looked_at_without_copies_of_their_lists():
    top = fromstring(f"<svg>{'<g/>' * 30_000}<a/></svg>")
    assert Stylesheet("a~g{x:1}g~a{y:2}", top).style(top[-1]) == {"y": "2"}


@pytest.mark.parametrize(
    "selector",
    [
        "g" + " g" * 600,
        "." * 5000,
        "g:not(" * 300 + "a" + ")" * 300,
        "[" * 2000,
        "g" + "[a]" * 400,
        "a|",
        "[|",
        "a::b",
        ')[a]@x("b',
    ],
)
def test_selectors_that_are_too_much_are_not_read(selector):
    top, inner = nested(3)
    sheet = Stylesheet(f"{selector}{{x:1}}g{{y:2}}", top)
    assert sheet.style(inner) in ({"y": "2"}, {}) and not sheet.contextual


@pytest.mark.parametrize(
    "condition",
    [
        "[d*='xy']",
        "[d~=x]",
        *(slow(condition) for condition in ("[d$=x i]", ":not([d^=x])", "[d*='xy'] > g")),
    ],
)
@pytest.mark.usefixtures("fewer_rules")
def test_comparing_long_attributes_is_counted(condition):
    top = fromstring(f'<svg d="{"x " * 500_000}"><g d="{"x " * 500_000}"/></svg>')
    with pytest.raises(InputError, match="combinations of rules and elements"):
        Stylesheet("".join(f"{condition}{{x:{k}}}" for k in range(9000)), top).style(top[0])


@pytest.mark.slow
def test_selectors_are_counted():
    with pytest.raises(InputError, match="more than 50000 selectors"):
        Stylesheet(",".join(f"a{k}" for k in range(60_000)) + "{x:1}", Element("svg"))


@pytest.mark.parametrize("closed", [True, False])
def test_a_thinned_line_stays_within_the_tolerance(closed):
    rng = np.random.default_rng(5)
    t = np.linspace(0, 2 * np.pi, 30_000, endpoint=not closed)
    z = (1 + 0.3 * np.cos(5 * t)) * np.exp(1j * t) + 1e-5 * rng.normal(size=t.size)
    z[1000] += 0.01
    fewer = thinned(z, 1e-3, closed=closed)
    assert fewer.size < 1000 and z[1000] in fewer
    ring = shapely.LinearRing if closed else shapely.LineString
    line = ring(np.column_stack([fewer.real, fewer.imag]))
    assert shapely.distance(line, shapely.points(z.real, z.imag)).max() <= 1e-3 + 1e-12


def test_crossings_are_counted_exactly():
    crossings.check([np.append(star(301), star(301)[:1])])
    with pytest.raises(crossings.TooMuch):
        crossings.check([np.append(star(401), star(401)[:1])])
    crossings.check([circle(100_000)])
    assert limits.CROSSINGS == 50_000


def test_a_run_of_lines_agrees_with_its_commands():
    d = (
        "M1 2L3 4L5,6 7-8L.5.5L1e1 2,3 4"
        + "L9 9 8 8" * 10
        + "l1 1l2 2 3 3" * 10
        + "C1 2 3 4 5 6" * 100
        + "A3 4 5 0 1 7 8" * 9
    )
    (separate,), (merged,) = path_data.runs(d), path_data.runs(d, joined=True)
    ends = [piece.last() for piece in separate.pieces]
    assert len(merged.pieces) < len(separate.pieces) and merged.pieces[-1].last() == ends[-1]
    straight = [piece for piece in separate.pieces if not piece.bend()]
    parts = [
        piece.z[1:] if isinstance(piece, Polyline) else [piece.last()]
        for piece in merged.pieces
        if isinstance(piece, Polyline) or not piece.bend()
    ]
    assert np.array_equal(np.concatenate(parts), [piece.last() for piece in straight])


def test_flattening_many_pieces_at_once_is_flattening_each():
    d = "M1 2" + "c0 5 3 9 8 9s9-4 9-9q3 4 5 6t7 8a3 4 20 0 1 7 8h3a0 0 0 0 0 3 3z" * 30
    affine = Affine.matrix(1, 0.2, -0.3, 2, 5, 6)
    many, runs = path_data.subpaths(d, affine, 1e-4), path_data.runs(d)
    assert len(many) == len(runs) == 30
    for flattened, run in zip(many, runs):
        pieces = [piece.under(affine) for piece in run.pieces]
        rough = [
            affine(run.start),
            *(z for p in pieces for z in (*p.at(np.array([0.25, 0.5, 0.75])), p.last())),
        ]
        tolerance = 1e-4 * diagonal(np.array(rough))
        counts = [max(1, int(np.ceil(np.sqrt(p.bend() / (8 * tolerance))))) for p in pieces]
        expected = np.concatenate([p.at(np.arange(1, n + 1) / n) for p, n in zip(pieces, counts)])
        assert flattened.z.size == 1 + expected.size and np.abs(flattened.z[1:] - expected).max() < 1e-9


@pytest.mark.parametrize(
    "wrong", ["M0 0L1 2 3", "M0 0L1 2L3 4 5L6 7", "M0 0l", "M0 0L1 1e99", "M0 0" + "L1 1" * 9 + "L1"]
)
def test_a_run_of_lines_with_a_mistake_is_refused(wrong):
    with pytest.raises(InputError, match=r"d: character \d+"):
        path_data.runs(wrong)


CLIPS = f'<clipPath id="c"><path d="M{points(circle(2000))}Z"/></clipPath><path id="o" d="M10 10H90V90H10Z"/>'
PIXEL = "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mP8z8BQDwAEhQGAhKmMIQAAAABJRU5ErkJggg=="
PICTURE = f'<image id="i" width="80" height="80" href="data:image/png;base64,{PIXEL}"/>'


@pytest.mark.slow
@pytest.mark.parametrize(
    "body",
    [
        CLIPS + '<path clip-path="url(#c)" d="M20 20h3v3h-3z"/>' * 300,
        f'<path id="o" d="M10 10H90V90H10Z"/><defs>{PICTURE}</defs>' + '<use href="#i"/>' * 500,
    ],
)
def test_artwork_that_multiplies_is_refused_before_the_solving(shapes, iccm, body):
    (shapes / "a.svg").write_text(SVG.format(body))
    result = iccm("map", "a.svg#o", "blob.svg", "-o", "out.svg", "-q")
    assert result.code == 2 and len(result.lines) == 1, result.err
    assert "a.svg" in result.err and "more than 100000 lines and curves" in result.err
    assert artwork.carry and not (shapes / "out.svg").exists()


SHOWN = '<path id="o" d="M10 10H90V90H10Z"/>'
FILTER = '<filter id="f"><feGaussianBlur stdDeviation="3"/></filter>'
LINKED = "".join(f'<linearGradient id="g{k}" href="#g{k + 1}"/>' for k in range(60))
AGAIN = {
    "styles": ('<path id="a" style="' + "font-family:'a b';" * 9000 + '" d="M2 2H9V9Z"/>' + '<use href="#a"/>' * 60, "copied attr"),  # noqa: E501
    "transforms": ('<path id="a" transform="' + "rotate(1)" * 9000 + '" d="M2 2H9V9Z"/>' + '<use href="#a"/>' * 200, "copied attr"),  # noqa: E501
    "texts": (f'<g id="a"><metadata>{"x" * 10**6}</metadata></g>' + '<use href="#a"/>' * 20, "copied attr"),
    "filters": (f'<filter id="f">{"<feOffset/>" * 600}</filter>' + '<path filter="url(#f)" d="M2 2H9V9Z"/>' * 100, "50000 elements"),  # noqa: E501
    "markers": (f'<marker id="m" markerUnits="userSpaceOnUse">{"<g/>" * 600}</marker>' + '<path marker-mid="url(#m)" d="M2 2H9V9Z"/>' * 100, "50000 elements"),  # noqa: E501
    "links": (LINKED + '<path fill="url(#g0)" d="M2 2H9V9Z"/>', "<linearGradient> 'g0' has a chain of more than 40 references"),  # noqa: E501
    "groups": (FILTER + '<g filter="url(#f)">' * 150 + '<path d="M2 2H9V9Z"/>' * 900 + "</g>" * 150, "under clip paths"),  # noqa: E501
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("name", AGAIN)
def test_repeated_uses_count_towards_the_budget(shapes, iccm, name):
    body, match = AGAIN[name]
    (shapes / "a.svg").write_text(SVG.format(SHOWN + body))
    result = iccm("map", "a.svg#o", "blob.svg", "-o", "out.svg", "-q")
    assert result.code == 2 and len(result.lines) == 1 and match in result.err
    assert not (shapes / "out.svg").exists()


def test_lists_of_classes_are_looked_up_once_and_counted(monkeypatch):
    monkeypatch.setattr(limits, "RULES", 20_000)
    sheet = Stylesheet("".join(f".b{k}{{y:{k}}}" for k in range(200)), Element("svg"))
    many = " ".join(f"b{k}" for k in range(20_000))
    for _ in range(100):
        assert sheet.style(Element("path", {"class": many}))["y"] == "199"
    with pytest.raises(InputError, match="combinations of rules and elements"):
        for k in range(100):
            sheet.style(Element("path", {"class": f"{many} c{k}"}))


@pytest.mark.slow
def test_a_picture_that_is_used_often_is_written_once(shapes, iccm):
    """If the map is a similarity, under which it is unchanged."""
    (shapes / "a.svg").write_text(SVG.format(f"<defs>{PICTURE}</defs>{SHOWN}" + '<use href="#i"/>' * 3))
    (shapes / "b.svg").write_text(SVG.format('<path d="M20 20H340V340H20Z"/>'))
    result = iccm("map", "a.svg#o", "b.svg", "-o", "out.svg", "-q")
    assert result.code == 0 and (shapes / "out.svg").read_text().count(PIXEL) == 1


def test_a_compressed_drawing_is_read_within_the_same_bounds(shapes, iccm):
    (shapes / "square.svgz").write_bytes(gzip.compress((shapes / "square.svg").read_bytes()))
    assert (
        iccm(
            "map", "square.svgz", "blob.svg", "--method", "paper", "--vertices", "40", "-o", "o.svg", "-q"
        ).code
        == 0
    )
    assert shape.read("square.svgz").curve.area == shape.read("square.svg").curve.area
    (shapes / "bomb.svgz").write_bytes(gzip.compress(bytes(limits.SVG_BYTES + 1)))
    assert "unpacks to more than" in iccm("info", "bomb.svgz").err
    whole = (shapes / "square.svgz").read_bytes()
    for damaged in (whole[:-9], whole[:10] + b"\xff" + whole[11:]):
        (shapes / "bad.svgz").write_bytes(damaged)
        result = iccm("info", "bad.svgz")
        assert result.code == 2 and "bad.svgz: damaged" in result.err and len(result.lines) == 1


@pytest.mark.parametrize("at_once", [64, fill.MOST_PAIRS])
def test_many_rings_wind_around_points_as_each_does(monkeypatch, at_once):
    """Overlapping triangles and quadrangles of either orientation, and a large ring around half of them."""
    monkeypatch.setattr(fill, "SEGMENTS_AT_ONCE", min(at_once, fill.SEGMENTS_AT_ONCE))
    monkeypatch.setattr(fill, "MOST_PAIRS", at_once)
    rng = np.random.default_rng(5)
    corners = rng.uniform(-1, 1, (40, 4)) + 1j * rng.uniform(-1, 1, (40, 4))
    rings = [z[: 3 + k % 2] + 5 * complex(*rng.uniform(-1, 1, 2)) for k, z in enumerate(corners)]
    rings.append(np.array([-9 - 9j, 9j, 9 + 9j, -8 + 9j]))
    faces, winding = fill._faces(rings, fill.FaceBudget())
    points = shapely.point_on_surface(faces)
    z = np.array([complex(p.x, p.y) for p in points])
    angles = [np.angle((np.roll(ring, -1) - z[:, None]) / (ring - z[:, None])).sum(axis=1) for ring in rings]
    assert np.array_equal(winding, np.rint(sum(angles) / (2 * np.pi))) and np.ptp(winding) > 2


@pytest.mark.slow
def test_crossings_of_all_shapes_are_limited_together(tmp_path, monkeypatch):
    """Each of many shapes crosses itself less often than one shape may; shapes that do not cross remain."""
    rng = np.random.default_rng(3)
    tangles = [rng.uniform(0, 100, 40) + 1j * rng.uniform(0, 100, 40) for _ in range(60)]
    path = tmp_path / "tangles.svg"
    path.write_text(
        SVG.format(
            "".join(f'<path d="M{points(z)}Z"/>' for z in tangles) + '<rect id="r" width="9" height="9"/>'
        )
    )
    monkeypatch.setattr(limits, "CUT_FACES", 2000)
    drawing = reader.read(path)
    assert "r" in [outline.names[0] for outline in drawing.outlines if outline.names]
    assert 30 < sum("in all" in str(error) for _, error in drawing.refused) < 60
    monkeypatch.setattr(limits, "CUT_FACES", 100_000)
    assert not reader.read(path).refused


def test_shapes_without_crossings_are_painted_without_cutting_the_plane(tmp_path, monkeypatch):
    monkeypatch.setattr(fill, "_faces", None)
    path = tmp_path / "many.svg"
    path.write_text(SVG.format("".join(f'<path d="M{3 * k} 0h2v{k + 1}z"/>' for k in range(30))))
    read = shape.read(str(path), whole=True)
    assert read.drawing.painted.area == pytest.approx(sum(range(1, 31)))
    monkeypatch.undo()
    path.write_text(SVG.format('<path d="M0 0H9V9L2 -3z"/><path d="M20 0h8v8h-8zm2 2v4h4v-4z"/>'))
    with_crossings = shape.read(str(path), whole=True)
    assert with_crossings.drawing.painted.area > 8 * 8 - 4 * 4
