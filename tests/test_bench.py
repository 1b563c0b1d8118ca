"""The benches' own tools: a rival's map, a TopoJSON file, the orders' count, the gallery's small pictures."""

import importlib.util
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


RIVALS = {  # and how exactly each can be a similarity
    "polygon_harmonic": 1e-2,  # source and target are triangulated differently
    "rigid": 1e-6,  # an iteration
    "szego": 1e-9,
    "angles": 1e-9,
    "thin_plate": 1e-6,  # its system of equations is badly conditioned
}


@pytest.mark.parametrize("name", RIVALS)
def test_every_rival_reproduces_a_similarity(mesh, name):
    from tests.bench import rivals

    z = similarity(mesh.nodes)
    found = getattr(rivals, name)(mesh, z[mesh.rim])
    assert np.abs(found - z).max() < RIVALS[name]


def test_distortion_of_a_stretch_is_its_ratio(mesh):
    from tests.bench.rivals import distortion

    k, area = distortion(mesh, 3 * mesh.nodes.real + 1j * mesh.nodes.imag)
    assert np.allclose(k, 3) and np.allclose(area, 3)
    k, area = distortion(mesh, mesh.nodes.conj())
    assert np.allclose(area, -1)


def test_topojson_arcs_are_joined_and_turned():
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


def test_gallery_pictures_are_small_and_in_the_table():
    folder = ROOT / "docs" / "gallery"
    pictures = sorted(folder.glob("*.png"))
    text = (folder / "README.md").read_text(encoding="utf-8")
    assert all(path.stat().st_size <= 150_000 for path in pictures)
    assert sum(path.stat().st_size for path in pictures) < 1_500_000
    assert all(f"({path.name})" in text for path in pictures) and len(pictures) >= 7


def test_every_bench_of_the_list_is_a_module():
    from tests.bench.__main__ import ORDER

    missing = [name for name in ORDER if importlib.util.find_spec(f"tests.bench.{name}") is None]
    assert set(missing) <= {"meshes"}


@pytest.mark.slow
def test_a_bench_that_hangs_is_given_up_and_every_goal_is_listed(tmp_path, monkeypatch, capsys):
    from tests.bench import __main__ as bench
    from tests.bench.goals import GOALS

    here = tmp_path / "tests" / "bench"
    here.mkdir(parents=True)
    (here / "hangs.py").write_text(
        "import subprocess, sys\nprint('GOAL met     the first run, x: 1 of at most 8')\n"
        "subprocess.run([sys.executable, '-c', 'import time; time.sleep(600)'])"
    )
    (here / "ends.py").write_text("print('GOAL NOT MET imports beyond numpy and numba: 1 of at most 0.35')")
    monkeypatch.setattr(bench, "HERE", here)
    monkeypatch.setattr(bench, "ORDER", ("hangs", "ends"))
    monkeypatch.setattr(bench, "LONGEST", 5)
    assert bench.main([]) == 1
    said = capsys.readouterr().out
    assert "given up after 5 s" in said
    first, second, *others, count = said[said.rindex(" goals") :].splitlines()[1:]
    assert first.startswith("GOAL met     the first run, x") and second.startswith("GOAL NOT MET imports")
    assert len(others) == len(GOALS) - 2 and all("not measured in this run" in line for line in others)
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


def test_what_is_written_by_hand_above_a_gallery_picture_stays(capsys):
    from tests.bench import gallery

    before = "## Old heading\n\nGood: 1, 2.\nNot: 3.\n\n![sheet](sheet.png)\n\n| map | figures |"
    lines = gallery.table("sheet", [("a", "b")], before)
    assert lines.index("Good: 1, 2.\nNot: 3.") < lines.index("![sheet](sheet.png)")
    assert "by hand" in capsys.readouterr().err
    assert "\n".join(lines) == "\n".join(gallery.table("sheet", [("a", "b")], "\n".join(lines)))


@pytest.mark.slow
def test_figures_of_reports_are_those_of_the_files(tmp_path):
    """Of a bent sheet with a layout of its own, computed by code that shares nothing with iccm."""
    from tests.bench.figures import checked, differing

    x, y = (each.ravel() for each in np.meshgrid(np.linspace(0, 1, 9), np.linspace(0, 1, 9)))
    rows = [f"v {a} {b} {0.4 * np.sin(3 * a) * b}" for a, b in zip(x, y)]
    rows += [f"vt {0.1 + 0.8 * a} {0.1 + 0.6 * b + 0.2 * a * a}" for a, b in zip(x, y)]
    at = [9 * j + i + 1 for j in range(8) for i in range(8)]
    rows += ["f " + " ".join(f"{v}/{v}" for v in (k, k + 1, k + 10, k + 9)) for k in at]
    (tmp_path / "sheet.obj").write_text("\n".join(rows))
    found = list(checked(tmp_path / "sheet.obj", tmp_path))
    assert [mode for mode, *_ in found] == [
        "map (quads)",
        "flatten (quads)",
        "map",
        "flatten",
        "bake",
        "relayout",
    ]
    for mode, _, report, figures in found:
        assert figures and not differing(report, figures), mode
