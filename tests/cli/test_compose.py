"""`iccm compose`: saved maps one after the other, and their inverses."""

import json
from pathlib import Path

import numpy as np
import pytest
import shapely
from PIL import Image

import iccm as core

CIRCLE = np.exp(2j * np.pi * np.arange(48) / 48)
LEAF = CIRCLE * (2 + 0.4 * np.cos(2 * np.angle(CIRCLE)) + 0.2 * np.sin(np.angle(CIRCLE))) + 1
ELL = np.array([0, 6, 6 + 2j, 2.5 + 2j, 2.5 + 4j, 4j])
BOX = np.array([0, 5, 5 + 3j, 3j])


@pytest.fixture(scope="module")
def map_folder(tmp_path_factory):
    """A folder with maps from a leaf to an L, from the L to a box, and from a ring to another."""
    folder = tmp_path_factory.mktemp("maps")
    core.fit(LEAF, ELL, fit="whole").save(folder / "leaf-ell.npz")
    core.fit(ELL, BOX, fit="whole").save(folder / "ell-box.npz")
    core.deform(BOX, pins=[(1 + 1j, 1 + 1j), (4 + 2j, 4.3 + 2.2j)]).save(folder / "bent.npz")
    holes = {"source_holes": [0.4 * CIRCLE[::-1] + 1.3], "target_holes": [0.5 * CIRCLE[::-1] + 1.2 + 1.4j]}
    core.fit(LEAF, BOX, fit="whole", holes="keep", **holes).save(folder / "rings.npz")
    return folder


@pytest.fixture
def maps(map_folder, tmp_path, monkeypatch):
    """Those maps in the current folder."""
    for path in map_folder.iterdir():
        (tmp_path / path.name).write_bytes(path.read_bytes())
    monkeypatch.chdir(tmp_path)


def error(actual, expected, diagonal):
    """The distance of points that 99 % of them keep, relative to a diagonal; none may be missing."""
    away = np.abs(actual - expected) / diagonal
    assert np.isfinite(away).all()
    return np.quantile(away, 0.99)


@pytest.mark.slow
def test_maps_are_composed_and_certified_again(maps, iccm):
    result = iccm("compose", "leaf-ell.npz", "ell-box.npz", "-o", "leaf-box.npz")
    assert result.code == 0, result.err
    first, second, composed = (core.load(f"{name}.npz") for name in ("leaf-ell", "ell-box", "leaf-box"))
    assert composed.certificate.certified and composed.status.ok
    assert composed._boundary["hausdorff"] < 1e-3
    z = composed._interior
    assert error(composed.map(z), second.map(first.map(z)), composed._diagonal) < 2e-4
    w = composed.map(z)
    assert error(composed.inverse(w), first.inverse(second.inverse(w)), composed._diagonal) < 2e-4
    area = np.abs(composed.target.area)
    assert (
        area == pytest.approx(15)
        and composed.target.distances(composed.image).max() < 1e-3 * composed._diagonal
    )


@pytest.mark.slow
def test_a_tilde_inverts_a_map_in_any_place(maps, iccm):
    assert iccm("compose", "inverse:ell-box.npz", "~leaf-ell.npz", "-o", "box-leaf.npz").code == 0
    assert iccm("compose", "inverse:leaf-ell.npz", "-o", "ell-leaf.npz").code == 0
    assert iccm("compose", "leaf-ell.npz", "ell-leaf.npz", "-o", "same.npz").code == 0
    first, second = core.load("leaf-ell.npz"), core.load("ell-box.npz")
    back, inverse, identity = (core.load(f"{name}.npz") for name in ("box-leaf", "ell-leaf", "same"))
    assert back.certificate.certified and inverse.certificate.certified
    w = inverse._interior
    assert error(inverse.map(w), first.inverse(w), first._diagonal) < 2e-4
    z = identity._interior
    assert error(identity.map(z), z, identity._diagonal) < 4e-4  # two approximations
    u = back._interior
    assert error(back.map(u), first.inverse(second.inverse(u)), back._diagonal) < 4e-4


def test_holes_are_composed_too(maps, iccm):
    assert iccm("compose", "rings.npz", "~rings.npz", "-o", "same.npz").code == 0
    identity = core.load("same.npz")
    assert (
        identity.certificate.certified
        and len(identity.map.loops) == 2
        and list(identity.details.hole_partners) == [(0, 0)]
    )
    assert error(identity.map(identity._interior), identity._interior, identity._diagonal) < 4e-4
    assert not np.isfinite(identity.map(np.array([1.3 + 0j]))).any()  # in the hole


def test_a_composition_agrees_with_its_maps_one_after_the_other(maps, iccm):
    Path("p.csv").write_text("x,y\n1,0.5\n-0.2,0.1\n2.5,-0.7\n")
    for command in (
        ("compose", "leaf-ell.npz", "ell-box.npz", "-o", "leaf-box.npz"),
        ("apply", "leaf-ell.npz", "p.csv", "-o", "q.csv"),
        ("apply", "ell-box.npz", "q.csv", "-o", "r.csv"),
        ("apply", "leaf-box.npz", "p.csv", "-o", "s.csv"),
    ):
        assert iccm(*command).code == 0
    one_by_one, at_once = (np.loadtxt(name, delimiter=",", skiprows=1) for name in ("r.csv", "s.csv"))
    assert np.abs(one_by_one - at_once).max() < 1e-3 * abs(5 + 3j)
    assert np.ptp(at_once, axis=0).min() > 0.5


def write_geometry(path):
    """Two points, of which one lies outside, a line, and a polygon, in the leaf."""
    ring = [[0.2, 0.1], [1.7, 0.3], [1.1, 1.2], [0.2, 0.1]]
    line = {"type": "LineString", "coordinates": [[0, -0.4], [2.5, 0.2]]}
    points = [{"type": "Point", "coordinates": place} for place in ([1, 0.5], [90, 1])]
    shapes = [*points, line, {"type": "Polygon", "coordinates": [ring]}]
    features = [{"type": "Feature", "properties": {}, "geometry": shape} for shape in shapes]
    Path(path).write_text(json.dumps({"type": "FeatureCollection", "features": features}))


def places(path):
    """The coordinates in a GeoJSON file, by type."""
    return {
        feature["geometry"]["type"]: np.array(feature["geometry"]["coordinates"], float)
        for feature in json.loads(Path(path).read_text())["features"]
    }


def test_a_chain_carries_geometry_exactly_and_back(maps, iccm):
    write_geometry("in.geojson")
    chain = ("leaf-ell.npz", "ell-box.npz")
    result = iccm("apply", *chain, "in.geojson", "-o", "box.geojson", "--report", "r.json")
    assert result.code == 0 and "1 points outside" in result.err
    first, second = (core.load(name) for name in chain)
    carried = places("box.geojson")
    assert carried["Point"] @ [1, 1j] == pytest.approx(second.map(first.map(np.array([1 + 0.5j])))[0])
    ends = second.map(first.map(np.array([-0.4j, 2.5 + 0.2j])))
    assert carried["LineString"][[0, -1]] @ [1, 1j] == pytest.approx(ends)
    assert len(carried["LineString"]) > 2  # it is bent
    assert json.loads(Path("r.json").read_text())["maps"] == list(chain)
    for back in (("inverse:ell-box.npz", "inverse:leaf-ell.npz"), (*chain, "--inverse")):
        names, options = [n for n in back if n != "--inverse"], [n for n in back if n == "--inverse"]
        result = iccm("apply", *names, "box.geojson", *options, "-o", "again.geojson", "--force")
        assert result.code == 0, result.err
        again = places("again.geojson")
        assert again["Point"] == pytest.approx([1, 0.5], abs=1e-6)
        assert again["LineString"][-1] == pytest.approx([2.5, 0.2], abs=1e-6)
        ring = shapely.Polygon(places("in.geojson")["Polygon"][0])
        assert shapely.Polygon(again["Polygon"][0]).symmetric_difference(ring).area < 2e-3 * ring.area


@pytest.mark.slow
def test_a_chain_carries_pictures_through_the_composition(maps, iccm):
    Image.fromarray((core.checkerboard(96)).astype(np.uint8)).save("t.png")
    assert iccm("compose", "leaf-ell.npz", "ell-box.npz", "-o", "leaf-box.npz").code == 0
    for names, out in ((("leaf-box.npz",), "one.png"), (("leaf-ell.npz", "ell-box.npz"), "chain.png")):
        result = iccm("apply", *names, "t.png", "-o", out, "--size", "64")
        assert result.code == 0, result.err
    composed, chain = (np.asarray(Image.open(name)) for name in ("one.png", "chain.png"))
    assert (composed == chain).all() and chain[..., :3].std() > 20


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("ell-box.npz", "leaf-ell.npz"), ("leaf-ell.npz", "ell-box.npz")),
        (("leaf-ell.npz", "none.npz"), ("none.npz",)),
        (("leaf-ell.npz", "st.exr"), ("st.exr", ".npz")),
        (("leaf-ell.npz", "~ell-box.npz", "--inverse"), ("inverse:",)),
    ],
)
def test_wrong_chains_are_refused_in_one_line(maps, iccm, arguments, words):
    write_geometry("in.geojson")
    options = [word for word in arguments if word.startswith("--")]
    result = iccm(
        "apply", *(w for w in arguments if w not in options), "in.geojson", *options, "-o", "o.geojson"
    )
    assert result.code == 2 and len(result.lines) == 1 and all(word in result.err for word in words)
    assert not Path("o.geojson").exists()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("ell-box.npz", "leaf-ell.npz", "-o", "no.npz"), ("leaf-ell.npz", "ell-box.npz", "outlines")),
        (("leaf-ell.npz", "~ell-box.npz", "-o", "no.npz"), ("~ell-box.npz", "outlines")),
        (("rings.npz", "~ell-box.npz", "-o", "no.npz"), ("~ell-box.npz", "holes")),
        (("bent.npz", "-o", "no.npz"), ("bent.npz", "deformation")),
        (("~none.npz", "-o", "no.npz"), ("none.npz", "no such file")),
        (("leaf-ell.npz", "-o", "no.png"), ("no.png", ".npz")),
        (("leaf-ell.npz", "-o", "leaf-ell.npz"), ("leaf-ell.npz",)),
        (("leaf-ell.npz", "-o", "ell-box.npz"), ("ell-box.npz", "exists")),
    ],
)
def test_wrong_compositions_are_refused_in_one_line(maps, iccm, arguments, words):
    before = {path.name: path.read_bytes() for path in Path().iterdir()}
    result = iccm("compose", *arguments)
    assert result.code == 2 and len(result.lines) == 1
    assert all(word in result.err for word in words)
    assert {path.name: path.read_bytes() for path in Path().iterdir()} == before
