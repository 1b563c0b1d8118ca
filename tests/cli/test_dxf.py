"""DXF drawings through maps, read again by ezdxf and compared with the maps' own evaluation."""

from pathlib import Path

import numpy as np
import pytest
import shapely

import iccm as core
from tests.cases import slow

ezdxf = pytest.importorskip("ezdxf", reason="ezdxf is an extra")
paths = pytest.importorskip("ezdxf.path", reason="ezdxf is an extra")

pytestmark = pytest.mark.usefixtures("solve_once")

OUTLINE = [(0, 0, 0), (10, 0, 0), (10, 8, 0.4), (7, 14, 0), (3, 14, -0.3), (0, 9, 0)]
INCH = 25.4


def pattern(path, version="R2010", block="FRONT"):
    """Write a pattern piece in inches as a block, with a grain line, a notch, holes, text, a spline and a hatch."""
    document = ezdxf.new(version)
    document.units = 1
    for name, color in (("CUT", 1), ("NOTCH", 3), ("GRAIN", 5), ("HOLES", 2)):
        document.layers.add(name, color=color)
    piece = document.blocks.new(block)
    if version == "R12":
        piece.add_polyline2d(OUTLINE, format="xyb", close=True, dxfattribs={"layer": "CUT"})
    else:
        piece.add_lwpolyline(OUTLINE, format="xyb", close=True, dxfattribs={"layer": "CUT"})
        piece.add_ellipse((7, 5), (1.5, 0.3), 0.5, dxfattribs={"layer": "HOLES"})
        piece.add_spline([(3, 8), (5, 9), (6, 7), (8, 9)], dxfattribs={"layer": "GRAIN"})
        piece.add_hatch(color=4).paths.add_polyline_path([(2, 10, 1), (3, 10, 1)], is_closed=True)
    piece.add_line((5, 2), (5, 11), dxfattribs={"layer": "GRAIN", "color": 6})
    piece.add_point((0, 5), dxfattribs={"layer": "NOTCH"})
    piece.add_text("FRONT", height=0.5).set_placement((4, 4))
    piece.add_circle((2, 2), 0.5, dxfattribs={"layer": "HOLES"})
    piece.add_arc((4, 6), 0.7, 20, 250, dxfattribs={"layer": "HOLES"})
    document.modelspace().add_blockref(block, (20, 5), dxfattribs={"rotation": 20})
    document.saveas(path)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A pattern in inches, an ellipse in millimetres, and the pattern's outline twice as large and rotated."""
    monkeypatch.chdir(tmp_path)
    pattern("a.dxf")
    ellipse = ezdxf.new()
    ellipse.units = 4
    ellipse.modelspace().add_ellipse((300, 200), (150, 20), 0.8)
    ellipse.saveas("ellipse.dxf")
    twice = ezdxf.new()
    twice.units = 4
    line = twice.modelspace().add_lwpolyline(OUTLINE, format="xyb", close=True)
    line.transform(ezdxf.math.Matrix44.z_rotate(np.radians(20)))
    line.translate(20, 5, 0)
    turn = ezdxf.math.Matrix44.scale(2 * INCH) @ ezdxf.math.Matrix44.z_rotate(-0.4)
    line.transform(turn)
    twice.saveas("twice.dxf")
    return tmp_path


def entities(name):
    """The drawn entities of a drawing that ezdxf finds sound, without references."""
    document = ezdxf.readfile(name)
    audit = document.audit()
    assert not audit.errors and not audit.fixes
    assert document.units == (0 if document.dxfversion == "AC1009" else ezdxf.units.MM)  # R12 has no units
    parts = []
    for entity in document.modelspace():
        parts += entity.virtual_entities() if entity.dxftype() == "INSERT" else [entity]
    return document, parts


def points_of(entity, distance=1e-4):
    """Points (p,) densely on an entity."""
    if entity.dxftype() in ("POINT", "TEXT"):
        place = entity.dxf.location if entity.dxftype() == "POINT" else entity.dxf.insert
        return np.array([complex(place.x, place.y)])
    hatch = entity.dxftype() == "HATCH"
    path = next(iter(paths.from_hatch(entity))) if hatch else paths.make_path(entity)
    z = np.array([complex(v.x, v.y) for v in path.flattening(distance)])
    along = np.append(0, np.cumsum(np.abs(np.diff(z))))
    s = np.union1d(along, np.linspace(0, along[-1], 1500))
    return np.interp(s, along, z.real) + 1j * np.interp(s, along, z.imag)


def image_by(map, z):
    """The images of points by the map's own evaluation, for points on the outline those of points just inside."""
    w = map(z)
    lost = np.isnan(w)
    if lost.any():
        middle = np.array([complex(24, 14)])
        w[lost] = map(z[lost] + 1e-5 * (middle - z[lost]))
    return w


def distances(z, line):
    """Distances (p,) of points from a polyline, or from its only point."""
    xy = np.column_stack([line.real, line.imag])
    return shapely.distance(
        shapely.points(z.real, z.imag), shapely.LineString(xy) if len(xy) > 1 else shapely.Point(xy[0])
    )


@pytest.mark.parametrize("version", [slow("R2010"), "R12"])
def test_every_entity_is_mapped_and_keeps_its_layer_and_colour(version, folder, iccm):
    pattern("a.dxf", version)
    result = iccm(
        "map", "a.dxf#FRONT", "ellipse.dxf", "-o", "map.npz", "-o", "out.dxf", "--max-line-error", ".02"
    )
    assert result.code == 0, result.err
    assert "0.02 mm" in result.err
    map = core.load("map.npz").map
    before = ezdxf.readfile("a.dxf")
    given = list(before.modelspace()[0].virtual_entities())
    after, document = entities("out.dxf")
    (reference,) = after.modelspace()
    assert reference.dxf.name == "FRONT" and after.dxfversion == before.dxfversion
    assert [(e.dxf.layer, e.dxf.color) for e in document] == [(e.dxf.layer, e.dxf.color) for e in given]
    assert {layer.dxf.name: layer.color for layer in after.layers}["GRAIN"] == 5
    for old, new in zip(given, document):
        expected, images = image_by(map, points_of(old)), points_of(new)
        # the outline of the map's domain is flattened to 1e-4 of its size
        within = 0.02 + 0.05 * (old.dxf.layer == "CUT") + 1e-3
        assert distances(images, expected).max() < within, old.dxftype()
        assert distances(expected, images).max() < within, old.dxftype()
    text = next(e for e in document if e.dxftype() == "TEXT")
    assert text.dxf.text == "FRONT" and 5 < text.dxf.height < 20
    kinds = {e.dxftype() for e in document}
    assert ("SPLINE" in kinds) == (version != "R12")


@pytest.mark.slow
def test_arcs_stay_arcs_where_the_map_is_a_similarity(folder, iccm):
    conformal = ("--method", "conformal", "--parts", "largest")  # the balanced method prefers upright maps
    result = iccm("map", "a.dxf#FRONT", "twice.dxf", "-o", "map.npz", "-o", "out.dxf", *conformal)
    assert result.code == 0, result.err
    given = list(ezdxf.readfile("a.dxf").modelspace()[0].virtual_entities())
    _, document = entities("out.dxf")
    assert [e.dxftype() for e in document] == [e.dxftype() for e in given]
    by_kind = {e.dxftype(): e for e in document}
    assert by_kind["CIRCLE"].dxf.radius == pytest.approx(0.5 * 2 * INCH, rel=1e-4)
    assert by_kind["ARC"].dxf.radius == pytest.approx(0.7 * 2 * INCH, rel=1e-4)
    assert [b for _, _, b in by_kind["LWPOLYLINE"].get_points("xyb")] == pytest.approx(
        [b for *_, b in OUTLINE], abs=1e-3
    )
    turn = 2 * INCH * np.exp(-0.4j)
    for old, new in zip(given, document):
        # the target's outline is flattened, which moves the map by less than 1e-4 of its size
        assert distances(turn * points_of(old), points_of(new)).max() < 0.05


def test_blocks_that_are_not_bent_stay_the_same_and_others_are_copied(folder, iccm):
    document = ezdxf.readfile("a.dxf")
    drill = document.blocks.new("DRILL")
    drill.add_circle((0, 0), 1e-4)
    mark = document.blocks.new("MARK")
    mark.add_lwpolyline([(0, 0), (4, 0), (4, 1)])
    for insertion in ((21, 9), (24, 13)):
        document.modelspace().add_blockref("DRILL", insertion)
        document.modelspace().add_blockref("MARK", insertion).add_attrib("SIZE", "38", insertion)
    document.modelspace().add_blockref("MARK", (90, 90))
    document.saveas("a.dxf")
    result = iccm("map", "a.dxf#FRONT", "ellipse.dxf", "-o", "map.npz", "-o", "out.dxf")
    assert result.code == 0 and "outside" in result.err, result.err
    written, _ = entities("out.dxf")
    names = [entity.dxf.name for entity in written.modelspace()]
    assert names.count("DRILL") == 2 and len(set(names)) == 4 and "MARK" not in names
    map = core.load("map.npz").map
    inserted = {entity.dxf.name: entity for entity in written.modelspace()}
    marks = [entity for entity in written.modelspace() if entity.dxf.name.startswith("MARK")]
    for insertion, entity in zip((21 + 9j, 24 + 13j), marks):
        place = map(np.array([insertion]))[0]
        assert abs(complex(*entity.dxf.insert.vec2) - place) < 1e-9
        assert (
            entity.attribs[0].dxf.text == "38"
            and abs(complex(*entity.attribs[0].dxf.insert.vec2) - place) < 1e-9
        )
    assert inserted["FRONT"].dxf.layer == "0"


@pytest.mark.slow
def test_each_piece_follows_its_own_map(folder, iccm):
    old, new = ezdxf.new(), ezdxf.new()
    old.units = new.units = 4
    for document, size in ((old, 1), (new, 3)):
        for name, x in (("FRONT", 0), ("SLEEVE", 300)):
            piece = document.blocks.new(name)
            line = [(0, 0), (100 * size, 0), (120, 60 * size), (0, 50)]
            piece.add_lwpolyline(line, close=True, dxfattribs={"layer": "1"})
            if document is old:
                piece.add_line((10, 10), (80, 12), dxfattribs={"layer": "7"})
                piece.add_point((50, 0), dxfattribs={"layer": "4"})
            document.modelspace().add_blockref(name, (x * size, 0))
    old.saveas("old.dxf")
    new.saveas("new.dxf")
    result = iccm("map", "old.dxf#1", "new.dxf#1", "--parts", "all", "-o", "out.dxf")
    assert result.code == 0, result.err
    written, parts = entities("out.dxf")
    assert [entity.dxf.name for entity in written.modelspace()] == ["FRONT", "SLEEVE"]
    assert [e.dxf.layer for e in parts] == ["1", "7", "4"] * 2
    for outline, grain, notch in (parts[:3], parts[3:]):
        piece = shapely.Polygon(np.array(outline.get_points("xy")))
        assert piece.contains(
            shapely.LineString(np.column_stack([points_of(grain).real, points_of(grain).imag]))
        )
        point = points_of(notch)[0]
        assert shapely.distance(piece.exterior, shapely.Point(point.real, point.imag)) < 0.2


@pytest.mark.slow
def test_back_and_forth_and_from_inches_to_the_units_of_a_drawing(folder, iccm):
    Path("sheet.svg").write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" width="20cm" height="10cm" viewBox="0 0 400 200">'
        '<path d="M20 30 L250 60 L370 170 L40 150 Z"/></svg>'
    )
    assert iccm("map", "a.dxf#FRONT", "sheet.svg", "-o", "map.npz").code == 0
    assert iccm("apply", "map.npz", "a.dxf", "-o", "on.dxf", "--max-line-error", ".005").code == 0
    _, document = entities("on.dxf")
    notch = next(e for e in document if e.dxftype() == "POINT").dxf.location
    point = next(
        e for e in ezdxf.readfile("a.dxf").modelspace()[0].virtual_entities() if e.dxftype() == "POINT"
    )
    place = image_by(core.load("map.npz").map, points_of(point))[0]
    # half a millimetre a unit, y from the lower edge of the sheet
    assert abs(complex(notch.x, notch.y) - 0.5 * (place + 200j)) < 1e-3
    result = iccm("apply", "map.npz", "on.dxf", "--inverse", "-o", "back.dxf", "--max-line-error", ".005")
    assert result.code == 0, result.err
    _, back = entities("back.dxf")
    given = list(ezdxf.readfile("a.dxf").modelspace()[0].virtual_entities())
    for old, new in zip(given, back):
        assert distances(points_of(new), INCH * points_of(old)).max() < 0.1


def test_mirrored_entities_and_entities_that_leave_the_piece(folder, iccm):
    document = ezdxf.readfile("a.dxf")
    space = document.modelspace()
    space.add_arc((-24, 14), 1, 0, 90, dxfattribs={"extrusion": (0, 0, -1), "layer": "MIRROR"})
    mirrored = {"extrusion": (0, 0, -1), "layer": "MIRROR"}
    space.add_lwpolyline([(-22, 12, 1), (-23, 12, 0)], format="xyb", dxfattribs=mirrored)
    space.add_line((0, 12), (60, 14), dxfattribs={"layer": "LONG"})
    document.saveas("a.dxf")
    result = iccm(
        "map", "a.dxf#FRONT", "ellipse.dxf", "-o", "map.npz", "-o", "out.dxf", "--max-line-error", ".02"
    )
    assert result.code == 0 and "partly outside" in result.err
    map = core.load("map.npz").map
    _, entities_out = entities("out.dxf")
    for layer in ("MIRROR", "LONG"):
        old = [e for e in ezdxf.readfile("a.dxf").modelspace() if e.dxf.layer == layer]
        new = [e for e in entities_out if e.dxf.layer == layer]
        assert len(old) == len(new)
        for before, after in zip(old, new):
            expected = map(points_of(before))
            expected = expected[~np.isnan(expected)]
            assert distances(expected, points_of(after)).max() < 0.05


def test_requests_that_dxf_cannot_hold_are_refused(folder, iccm):
    Path("heart.svg").write_text('<svg xmlns="http://www.w3.org/2000/svg"><path d="M0 0H90V50H0Z"/></svg>')
    for arguments in (
        ("map", "cow.png", "ellipse.dxf", "-o", "no.dxf"),
        ("map", "cow.png", "heart.svg", "-o", "no.svg"),
        ("map", "a.dxf#nothing", "heart.svg", "-o", "no.dxf"),
        ("map", "a.dxf", "ellipse.dxf", "-o", "no.png", "--max-line-error", ".1"),
    ):
        result = iccm(*arguments)
        assert result.code == 2 and "Traceback" not in result.err, arguments
    assert not list(folder.glob("no.*"))


def test_blocks_that_contain_themselves_or_too_much_are_refused(folder, iccm):
    document = ezdxf.new()
    previous = document.blocks.new("B0")
    previous.add_circle((0, 0), 1)
    for level in range(1, 8):
        block = document.blocks.new(f"B{level}")
        for k in range(10):
            block.add_blockref(previous.name, (k, level))
        previous = block
    document.modelspace().add_blockref(previous.name, (0, 0))
    document.saveas("bomb.dxf")
    result = iccm("map", "bomb.dxf", "ellipse.dxf", "-o", "no.dxf")
    assert result.code == 2 and "entities" in result.err
