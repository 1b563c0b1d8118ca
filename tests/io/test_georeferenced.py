"""Pictures that lie on a map: GeoTIFF and world files, as rasterio (GDAL) reads them."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest
import shapely
from PIL import Image
from scipy import ndimage

import iccm as iccm_core
from iccm.io import limits
from iccm.io.pictures import georeferenced
from iccm.io.shapes import listing
from iccm.io.shapes.landmarks import landmarks_file
from iccm.saved.georeference import Georeference

rasterio = pytest.importorskip("rasterio", reason="rasterio is an extra")
pytestmark = pytest.mark.large

FILES = Path(__file__).parents[2] / "docs" / "files"
FIJI = Path(__file__).with_name("fiji.geojson")  # Natural Earth, 1:50m
LAMBERT = "EPSG:3057"
ELL = [
    [400000, 500000],
    [460000, 500000],
    [460000, 520000],
    [425000, 520000],
    [425000, 590000],
    [400000, 590000],
]


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A region in metres, an asymmetric picture, and the current folder around them."""
    crs = {"type": "name", "properties": {"name": "urn:ogc:def:crs:EPSG::3057"}}
    region = {"type": "Polygon", "coordinates": [[*ELL, ELL[0]]]}
    feature = {"type": "Feature", "properties": {"name": "ell"}, "geometry": region}
    content = {"type": "FeatureCollection", "crs": crs, "features": [feature]}
    (tmp_path / "ell.geojson").write_text(json.dumps(content))
    y, x = np.mgrid[:90, :60]
    Image.fromarray(np.dstack([x * 4, y * 2, 90 + 0 * x]).astype(np.uint8)).save(tmp_path / "chart.png")
    monkeypatch.chdir(tmp_path)


def place(file):
    with rasterio.open(file) as read:
        return read.transform, read.crs, read.width, read.height


def test_a_region_on_a_map_becomes_a_geotiff(folder, iccm):
    assert (
        iccm("map", "chart.png", "ell.geojson", "--fit", "whole", "--size", "120x180", "-o", "out.tif").code
        == 0
    )
    transform, crs, width, height = place("out.tif")
    assert crs == rasterio.crs.CRS.from_string(LAMBERT) and (width, height) == (120, 180)
    assert np.allclose(transform[:6], (500, 0, 400000, 0, -500, 590000))
    with rasterio.open("out.tif") as file:
        alpha = file.read(4)
        for x, y, inside in [
            (401000, 589000, 1),
            (459000, 501000, 1),
            (459000, 521500, 0),
            (426500, 589000, 0),
        ]:
            assert (alpha[file.index(x, y)] > 128) == inside


def marks(pixels, alpha):
    """The middles (x, y in pixels) of the red marks in a picture."""
    red, green, blue = pixels.astype(int)
    placed, count = ndimage.label((red - green > 90) & (red - blue > 90) & (alpha > 200))
    return np.array(ndimage.center_of_mass(placed > 0, placed, range(1, count + 1)))[:, ::-1] + 0.5


@pytest.mark.slow
def test_an_old_map_is_placed_by_its_pins(folder, iccm):
    """The marks of places on a drawn map of Iceland, as rasterio locates them, to a pixel."""
    for name in ("iceland.geojson", "old-iceland.png", "old-iceland.points"):
        Path(name).write_bytes((FILES / name).read_bytes())
    arguments = "--constraints", "old-iceland.points", "--size", "720", "-o", "out.tif", "-o", "map.npz"
    result = iccm("map", "old-iceland.png", "iceland.geojson", *arguments)
    assert result.code == 0, result.err
    drawn = np.moveaxis(np.asarray(Image.open("old-iceland.png").convert("RGB")), 2, 0)
    x, y = marks(drawn, np.full(drawn.shape[1:], 255)).T
    expected = iccm_core.load("map.npz").map(x - 1j * y)
    with rasterio.open("out.tif") as file:
        assert file.crs == rasterio.crs.CRS.from_string(LAMBERT)
        *colours, alpha = file.read()
        placed = np.array(
            [complex(*(file.transform @ tuple(mark))) for mark in marks(np.array(colours), alpha)]
        )
        assert len(placed) == len(expected) == 8
        assert np.abs(placed[:, None] - expected).min(axis=0).max() < file.res[0]
    rows = [line.split(",")[:2] for line in Path("old-iceland.points").read_text().splitlines()[2:]]
    true_places = np.array([complex(float(x), float(y)) for x, y in rows])
    assert np.abs(true_places[:, None] - placed).min(axis=1).max() < 10_000  # soft pins of a map of 500 km


def test_world_and_projection_files_give_the_same_place(folder, iccm):
    outputs = "-o", "out.tif", "-o", "out.png", "-o", "out.pgw", "-o", "out.prj"
    assert iccm("map", "chart.png", "ell.geojson", "--fit", "whole", "--size", "120", *outputs).code == 0
    of_tiff, of_world = place("out.tif")[0], place("out.png")[0]
    assert np.allclose(of_tiff[:6], of_world[:6])
    assert rasterio.crs.CRS.from_wkt(Path("out.prj").read_text()).to_epsg() == 3057
    # and they are read back, as those of the target
    assert iccm("map", "chart.png", "out.png#canvas", "--size", "60", "-o", "again.tif").code == 0
    again, crs, *_ = place("again.tif")
    assert np.allclose(again @ (40, 60), of_tiff @ (80, 120)) and crs.to_epsg() == 3057


def test_a_rotated_geotiff_stays_rotated(folder, iccm):
    affine = rasterio.Affine(30, 9, 400000, 12, -40, 700000)
    pixels = np.full((3, 50, 80), 90, np.uint8)
    how = {"driver": "GTiff", "width": 80, "height": 50, "count": 3, "dtype": "uint8"}
    with rasterio.open("turned.tif", "w", crs=LAMBERT, transform=affine, **how) as file:
        file.write(pixels)
    assert iccm("map", "chart.png", "turned.tif#canvas", "--size", "160", "-o", "out.tif").code == 0
    placed, crs, width, height = place("out.tif")
    assert (width, height) == (160, 100) and crs.to_epsg() == 3057
    for x, y in [(0, 0), (80, 0), (13, 50)]:
        assert np.allclose(placed @ (2 * x, 2 * y), affine @ (x, y))


def test_saved_maps_keep_both_places(folder, iccm):
    affine = rasterio.Affine(2, 0, 1000, 0, -2, 5000)
    how = {"driver": "GTiff", "width": 60, "height": 90, "count": 3, "dtype": "uint8"}
    with rasterio.open("scan.tif", "w", crs="EPSG:32627", transform=affine, **how) as file:
        file.write(np.moveaxis(np.asarray(Image.open("chart.png")), 2, 0))
    assert iccm("map", "scan.tif#canvas", "ell.geojson", "--fit", "whole", "-o", "map.npz").code == 0
    assert iccm("apply", "map.npz", "chart.png", "--size", "120", "-o", "there.tif").code == 0
    transform, crs, *_ = place("there.tif")
    assert np.allclose(transform @ (80, 120), (460000, 500000)) and crs.to_epsg() == 3057
    assert iccm("apply", "map.npz", "there.tif", "--inverse", "--size", "120", "-o", "back.tif").code == 0
    back, crs, *_ = place("back.tif")
    assert np.allclose(back[:6], (1.5, 0, 1000, 0, -1.5, 5000)) and crs.to_epsg() == 32627


@pytest.mark.slow
def test_ground_control_points_of_a_geotiff_are_pins(folder, iccm):
    points = [(15, 20, 405000, 510000), (48, 75, 450000, 508000), (12, 70, 412000, 580000)]
    control = [rasterio.control.GroundControlPoint(row=y, col=x, x=u, y=v) for x, y, u, v in points]
    how = {"driver": "GTiff", "width": 60, "height": 90, "count": 3, "dtype": "uint8"}
    for name, crs in (("scan.tif", LAMBERT), ("other.tif", "EPSG:32627")):
        with rasterio.open(name, "w", gcps=control, crs=crs, **how) as file:
            file.write(np.moveaxis(np.asarray(Image.open("chart.png")), 2, 0))
    arguments = "--constraints", "scan.tif", "--fit", "whole", "-o", "map.npz"
    assert iccm("map", "scan.tif#canvas", "ell.geojson", *arguments).code == 0
    pins = iccm_core.load("map.npz").pins
    assert [(z.real, -z.imag, w.real, w.imag) for z, w in pins] == points
    wrong = iccm("map", "scan.tif#canvas", "ell.geojson", "--constraints", "other.tif", "-o", "no.npz")
    assert wrong.code == 2 and "EPSG:32627" in wrong.err and LAMBERT in wrong.err
    none = iccm("map", "chart.png", "ell.geojson", "--constraints", "chart.tif", "-o", "no.npz")
    assert none.code == 2


def test_ground_control_points_of_a_large_scan_are_read(folder):
    points = [(150, 20, 405000, 510000), (48, 75, 450000, 508000)]
    control = [rasterio.control.GroundControlPoint(row=y, col=x, x=u, y=v) for x, y, u, v in points]
    how = {"driver": "GTiff", "width": 5000, "height": 4000, "count": 1, "dtype": "uint8"}
    with rasterio.open("large.tif", "w", gcps=control, crs=LAMBERT, **how) as file:
        file.write(np.zeros((1, 4000, 5000), np.uint8))
    assert Path("large.tif").stat().st_size > limits.CONSTRAINTS_BYTES
    listing.read("large.tif")
    pairs = landmarks_file.file_of("large.tif").read()
    assert [(*a, *b) for a, b in zip(pairs.source, pairs.target)] == points


def test_islands_across_the_antimeridian_lie_together(folder, iccm):
    Path("fiji.geojson").write_bytes(FIJI.read_bytes())
    arguments = "--parts", "largest", "--target-box", "bbox", "--size", "200"
    assert (
        iccm("map", "chart.png", "fiji.geojson#4", "--fit", "whole", *arguments, "-o", "taveuni.tif").code
        == 0
    )
    with rasterio.open("taveuni.tif") as file:
        assert file.crs.to_epsg() == 4326
        west, south, east, north = file.bounds
        assert (west, east) == pytest.approx((179.896, 180.176), abs=0.005)
        assert (south, north) == pytest.approx((-17, -16.688), abs=0.005)
        feature = json.loads(FIJI.read_text())["features"][0]
        rings = [parts[0] for parts in feature["geometry"]["coordinates"]]
        # west of the line, and east of it, where its longitude in the file is negative
        for x, y in [(179.95, -16.9), (180.09, -16.8)]:
            assert any(
                shapely.Polygon(ring).contains(shapely.Point((x + 180) % 360 - 180, y)) for ring in rings
            )
            assert file.read(4)[file.index(x, y)] > 128


def test_without_rasterio_a_picture_is_written_with_a_note(folder, iccm, monkeypatch):
    monkeypatch.setitem(sys.modules, "rasterio", None)
    result = iccm(
        "map", "chart.png", "ell.geojson", "--fit", "whole", "--size", "60", "-o", "out.tif", "-o", "out.tfw"
    )
    assert result.code == 0 and "iccm[gis]" in result.err
    assert [float(line) for line in Path("out.tfw").read_text().split()] == [
        1500,
        0,
        0,
        -1500,
        400750,
        589250,
    ]


def test_a_drawing_has_no_world_file(folder, iccm):
    Path("heart.svg").write_bytes((FILES / "heart.svg").read_bytes())
    result = iccm("map", "chart.png", "heart.svg", "-o", "out.png", "-o", "out.pgw")
    assert result.code == 2 and "out.pgw" in result.err and not Path("out.png").exists()


@pytest.mark.parametrize("content", ["1\n2\n3", "a b c d e f", "0 0 0 0 5 5", "nan 0 0 -1 0 0"])
def test_a_world_file_that_is_not_one_is_ignored_with_a_note(folder, content):
    Path("chart.pgw").write_text(content)
    placed, note = georeferenced.read(Path("chart.png"))
    assert placed is None and "chart.pgw" in note


def test_a_place_on_the_map_and_back():
    turned = Georeference((30.0, 9.0, 400000.0, 12.0, -40.0, 700000.0), LAMBERT)
    assert turned.from_map(*turned.to_map(13.0, 50.0)) == pytest.approx((13, 50))
    assert Georeference.of_json(turned.as_json()) == turned
