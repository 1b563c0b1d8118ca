"""The benches' own tools: a peer's map, a TopoJSON file, the count of orders, the gallery's small pictures."""

import importlib.util
import os
import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="module", autouse=True)
def _importable():
    """Make `tests.bench` importable as `python -m tests.bench` does."""
    sys.path.insert(0, str(ROOT))
    yield
    sys.path.remove(str(ROOT))


@pytest.fixture(scope="module")
def mesh():
    from iccm import Curve
    from tests.bench.rivals import Mesh

    return Mesh.of(Curve(np.exp(2j * np.pi * np.arange(40) / 40) * (1 + 0.2j)), 80)


def similarity(z):
    return (0.5 + 1.2j) * z + 3 - 1j


RIVALS = {  # with the accuracy to which each can be a similarity
    "polygon_harmonic": 1e-2,  # source and target are triangulated differently
    "rigid": 1e-6,  # an iteration
    "szego": 1e-9,
    "angles": 1e-9,
    "thin_plate": 1e-6,  # its system of equations is ill-conditioned
}


@pytest.mark.parametrize("name", RIVALS)
def test_every_rival_reproduces_a_similarity(mesh, name):
    from tests.bench import rivals

    z = similarity(mesh.nodes)
    images = getattr(rivals, name)(mesh, z[mesh.rim])
    assert np.abs(images - z).max() < RIVALS[name]


def test_distortion_of_a_stretch_is_its_ratio(mesh):
    from tests.bench.rivals import distortion

    k, area = distortion(mesh, 3 * mesh.nodes.real + 1j * mesh.nodes.imag)
    assert np.allclose(k, 3) and np.allclose(area, 3)
    k, area = distortion(mesh, mesh.nodes.conj())
    assert np.allclose(area, -1)


def test_topojson_arcs_are_joined_and_reversed():
    from tests.bench.shapes import rings_of

    topology = {
        "transform": {"scale": [2, 3], "translate": [10, 20]},
        "arcs": [[[0, 0], [1, 0], [0, 1]], [[0, 0], [0, 1], [1, 0]]],
        "objects": {
            "countries": {
                "geometries": [
                    {"type": "Polygon", "arcs": [[0, -2]], "properties": {"name": "a"}},
                    {"type": "MultiPolygon", "arcs": [[[0, -2]]], "properties": {"name": "b"}},
                ]
            }
        },
    }
    (a, [ring]), (b, [again]) = rings_of(topology)
    assert (a, b) == ("a", "b")
    assert ring.tolist() == again.tolist() == [10 + 20j, 12 + 20j, 12 + 23j, 10 + 23j]


def test_needed_counts_iterations_to_the_last_energy():
    from tests.bench.orders import needed

    assert needed(np.array([4.0, 2.0, 1.0]), np.array([4.0, 1.0])) == 1
    assert needed(np.array([4.0, 2.0, 1.0]), np.array([4.0, 1.5])) is None


def test_a_pair_is_measured_by_both_methods(capsys):
    from tests.bench import shapes, solver

    source, target = (shapes.sample(f"ci/shapes/{name}.svg").curve for name in ("pebble", "drop"))
    rows = {method: [solver.measured(source, target, method=method)] for method in solver.METHODS}
    solver.summary(rows)
    assert rows["conformal"][0].gap <= min(1e-3, rows["paper"][0].gap)
    assert "certified injective" in capsys.readouterr().out


def test_gallery_pictures_are_small_and_shown():
    folder = ROOT / "docs" / "gallery"
    pictures = sorted(folder.glob("*.png"))
    pages = [ROOT / "README.md", *(ROOT / "docs").glob("*.md")]
    text = "".join(page.read_text(encoding="utf-8") for page in pages)
    assert all(path.stat().st_size <= 150_000 for path in pictures)
    assert sum(path.stat().st_size for path in pictures) < 1_500_000
    assert all(f"gallery/{path.name})" in text for path in pictures) and len(pictures) >= 7


def test_every_bench_of_the_list_is_a_module():
    from tests.bench.__main__ import ORDER

    missing = [name for name in ORDER if importlib.util.find_spec(f"tests.bench.{name}") is None]
    assert set(missing) <= {"meshes"}


@pytest.mark.slow
def test_a_bench_that_hangs_is_given_up_and_every_goal_is_listed(tmp_path, monkeypatch, capsys):
    from tests.bench import __main__ as bench
    from tests.bench.goals import GOALS

    folder = tmp_path / "tests" / "bench"
    folder.mkdir(parents=True)
    (folder / "hangs.py").write_text(
        "import subprocess, sys\nprint('GOAL met     the first run, x: 1 of at most 8')\n"
        "subprocess.run([sys.executable, '-c', 'import time; time.sleep(600)'])"
    )
    (folder / "ends.py").write_text("print('GOAL NOT MET imports beyond numpy: 1 of at most 0.35')")
    monkeypatch.setattr(bench, "HERE", folder)
    monkeypatch.setattr(bench, "ORDER", ("hangs", "ends"))
    monkeypatch.setattr(bench, "LONGEST", 5)
    assert bench.main([]) == 1
    output = capsys.readouterr().out
    assert "given up after 5 s" in output
    first, second, *unmeasured, count = output[output.rindex(" goals") :].splitlines()[1:]
    assert first.startswith("GOAL met     the first run, x") and second.startswith("GOAL NOT MET imports")
    assert len(unmeasured) == len(GOALS) - 2 and all(
        "not measured in this run" in line for line in unmeasured
    )
    assert count == f"1 of {len(GOALS)} met"


def test_the_bench_of_dragging_follows_pins_that_it_places(tmp_path):
    from iccm.io.edit.session import Session
    from iccm.io.run.job import make
    from tests.bench import live

    for name, path in (("a.svg", "M10 10H90V90H10Z"), ("b.svg", "M10 50L50 5L95 45L60 95Z")):
        (tmp_path / name).write_text(f'<svg xmlns="http://www.w3.org/2000/svg"><path d="{path}"/></svg>')
    session = Session(make({"source": str(tmp_path / "a.svg"), "target": str(tmp_path / "b.svg")}))
    session.solve(live.Scene())
    pins = live.spread(session, np.random.default_rng(1))
    assert np.shape(pins) == (live.PINS, 2, 2)
    seconds, missed = live.dragged(session, pins, 1, 6)
    assert seconds.shape == (6, 2) and missed == 0


def test_a_figure_of_the_gallery_replaces_its_rows_alone(tmp_path, monkeypatch):
    from tests.bench import gallery

    table = tmp_path / "figures.csv"
    table.write_text('figure,map,values\nrose,paper,"gap 1, K 2"\npins,nose,gap 3\n', encoding="utf-8")
    monkeypatch.setattr(gallery.pictures, "FOLDER", tmp_path)
    monkeypatch.setattr(gallery, "FIGURES", {"rose": None, "pins": lambda: [("eyes", "gap 4")]})
    assert gallery.main(["pins"]) == 0
    assert (
        table.read_text(encoding="utf-8") == 'figure,map,values\nrose,paper,"gap 1, K 2"\npins,eyes,gap 4\n'
    )
    assert gallery.main(["sheep"]) == 2


@pytest.mark.slow
def test_figures_of_reports_are_those_of_the_files(tmp_path):
    """For a bent sheet with a custom layout, computed by independent code."""
    from tests.bench.figures import checked, differing

    x, y = (axis.ravel() for axis in np.meshgrid(np.linspace(0, 1, 9), np.linspace(0, 1, 9)))
    rows = [f"v {a} {b} {0.4 * np.sin(3 * a) * b}" for a, b in zip(x, y)]
    rows += [f"vt {0.1 + 0.8 * a} {0.1 + 0.6 * b + 0.2 * a * a}" for a, b in zip(x, y)]
    corners = [9 * j + i + 1 for j in range(8) for i in range(8)]
    rows += ["f " + " ".join(f"{v}/{v}" for v in (k, k + 1, k + 10, k + 9)) for k in corners]
    (tmp_path / "sheet.obj").write_text("\n".join(rows))
    results = list(checked(tmp_path / "sheet.obj", tmp_path))
    assert [mode for mode, *_ in results] == [
        "map (quads)",
        "flatten (quads)",
        "map",
        "flatten",
        "bake",
        "relayout",
    ]
    for mode, _, report, figures in results:
        assert figures and not differing(report, figures), mode


SIDE = 512  # pixels: cracks are measured at this size


def bar_and_disc():
    """A bar beside a disc: two parts, not symmetric."""
    y, x = np.mgrid[:SIDE, :SIDE]
    bar = (x >= 40) & (x < 200) & (y >= 100) & (y < 420)
    return bar, (x - 370) ** 2 + (y - 180) ** 2 < 100**2


@pytest.mark.parametrize(("width", "is_crack"), [(1, True), (4, True), (6, True), (8, False), (20, False)])
def test_a_slit_is_a_crack_up_to_twice_the_radius(width, is_crack):
    from tests.bench import coverage

    bar, _ = bar_and_disc()
    result = bar.copy()
    result[120:400, 90 : 90 + width] = False
    area = 280 * width / bar.sum()
    shares = coverage.seen(bar, result)
    assert shares.covered == pytest.approx(1 - area)
    # for a wider hole, the closing rounds the corners, each by less than a pixel's width times its radius
    assert shares.cracks == pytest.approx(area if is_crack else 0, abs=4 * 9 / bar.sum())


def test_gaps_of_the_target_are_not_cracks():
    from tests.bench import coverage

    bar, disc = bar_and_disc()
    bar[:, 90:94] = False
    assert coverage.seen(bar | disc, bar | disc).cracks == 0
    assert coverage.seen(bar, bar | disc).spilled == pytest.approx(disc.sum() / (bar | disc).sum())


def test_coverage_counts_parts_that_show_nothing_on_the_canvas_and_beyond_it():
    from tests.bench import coverage

    bar, disc = bar_and_disc()
    assert coverage.parts(bar | disc) == 2
    assert coverage.seen(bar | disc, disc).covered == pytest.approx(disc.sum() / (disc.sum() + 160 * 320))
    assert coverage.seen(bar, bar, outside=160 * 320).covered == pytest.approx(0.5)


def test_a_line_drawing_may_be_covered_as_drawn_or_filled():
    from tests.bench import coverage

    y, x = np.mgrid[:SIDE, :SIDE]
    inside = ((x - 250) / 1.3) ** 2 + (y - 230) ** 2 < 150**2
    line = inside & (((x - 250) / 1.3) ** 2 + (y - 230) ** 2 > 146**2)
    left_half = inside & (x < 250)
    assert coverage.seen(line, line).reading == "drawn" and coverage.seen(line, line).covered == 1
    assert coverage.seen(line, inside).reading == "filled" and coverage.seen(line, inside).covered == 1
    half = coverage.seen(line, left_half)
    assert half.reading == "filled" and half.covered == pytest.approx(left_half.sum() / inside.sum())
    bar, _ = bar_and_disc()
    bar[200:210, 90:99] = False  # a filled drawing with a hole has no other reading
    assert list(coverage.readings(bar)) == ["drawn"]


def test_holes_of_the_result_are_counted_where_the_target_has_none():
    from tests.bench import coverage

    bar, _ = bar_and_disc()
    target = bar.copy()
    target[150:180, 60:100] = False  # a counter
    result = target.copy()
    result[300:330, 120:140] = False
    assert coverage.seen(target, result).extra_holes == 1
    assert coverage.seen(target, target).extra_holes == 0


def test_the_visible_share_of_a_source_is_measured_through_the_map():
    from tests.bench import coverage

    y, x = np.mgrid[:80, :100]
    source = (x < 50) & (y >= 20)  # the left half, except for its upper quarter
    down, right = np.mgrid[:300, :200]
    # the picture shows the right 80 % of the canvas, upside down and sheared, in its columns 20 to 180
    across = 0.2 + 0.8 * (right + 0.5 - 20) / 160
    up = (down + 0.5) / 300
    places = np.stack([across + 0.05 * (up - 0.5), up], -1)
    visible = (right >= 20) & (right < 180)
    assert coverage.shown_share(places, visible, source) == pytest.approx(0.3 / 0.5, abs=0.02)
    assert coverage.shown_share(places, np.zeros_like(visible), source) == 0


@pytest.mark.skipif(os.name != "posix", reason="the bench limits its commands in ways that only POSIX has")
def test_a_picture_is_found_on_the_canvas_or_on_a_part(tmp_path):
    pytest.importorskip("pyvips")
    from PIL import Image

    from tests.bench import drawings
    from tests.bench.drawing_sets import Drawing

    svg = (
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="10 20 200 100"><rect x="20" y="30" width="60" height="80"/>'
        '<rect x="150" y="60" width="20" height="10" fill="none" stroke="#123" stroke-width="10"/></svg>'
    )
    target = Drawing("target.svg", svg, (10, 20, 200, 100), "game")
    result = drawings.painted_area(target, target.canvas, (512, 256))
    box, placed = drawings.shown_box(target, result)
    assert placed and box == target.canvas
    rows = [drawings.Row(0, 1.0, True)] * 2
    picture = tmp_path / "result.png"
    for number, pixels in enumerate((result, np.ones((341, 512), bool))):  # all of it; only the frame's box
        alpha = np.where(pixels, 255, 0).astype(np.uint8)
        Image.fromarray(np.dstack([alpha] * 4)).save(picture)
        rows[number] = drawings.with_picture(rows[number], picture, target)
    frame = 30 * 20  # the whole box is painted, but the target leaves the frame's inside empty
    assert rows[0].covered == 1 and rows[0].cracks == 0
    assert rows[1].covered == pytest.approx(frame / (frame + 60 * 80), abs=0.02)


def turned_around_two_pins(z, turns):
    """Return the points turned about .1 + .2i: fully within .5 of it, and less and less up to a distance of .9."""
    middle = 0.1 + 0.2j
    share = np.clip((0.9 - np.abs(z - middle)) / 0.4, 0, 1)
    return middle + (z - middle) * np.exp(2j * np.pi * turns * share)


def test_maps_are_wound_if_pins_went_around_each_other():
    from tests.bench.isotopy import wound

    pins = np.array([-0.2 + 0.1j, 0.4 + 0.3j, -0.5 - 1.3j, 1.2 - 0.4j])  # the first two are turned
    arcs = [pins[0] + (pin - pins[0]) * np.linspace(0, 1, 1000) for pin in pins[1:]]
    bent = [arc + 0.1j * np.sin(np.pi * np.linspace(0, 1, arc.size)) for arc in arcs]
    assert not wound(arcs, bent, pins)
    turned = [turned_around_two_pins(arc, 1) for arc in arcs]
    back = [turned_around_two_pins(arc, -1) for arc in turned]
    assert np.abs(turned[0][-1] - pins[1]) < 1e-12
    assert wound(arcs, turned, pins) and not wound(arcs, back, pins)


def test_words_count_the_sides_on_which_a_path_passes():
    from tests.bench.isotopy import word

    punctures = np.array([0.3 + 0.1j, 2.0 - 0.4j])
    circle = np.exp(2j * np.pi * np.arange(17) / 17)
    assert word(0.3 + circle, punctures) == [-1]
    assert word((0.3 + circle)[::-1], punctures) == [1]
    assert word(np.concatenate([0.3 + circle, (0.3 + circle)[::-1]]), punctures) == []
    assert word(1.1 + 2 * circle, punctures) in ([-1, -2], [-2, -1])
    assert word(5 + circle, punctures) == []
