"""Pictures of numbers: rasters of maps, labels, and channels of microscopes, compared with rasterio and tifffile."""

import json
import warnings

import numpy as np
import pytest
import tifffile

rasterio = pytest.importorskip("rasterio", reason="rasterio is an extra")
pytestmark = pytest.mark.large

SQUARE = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {0} {1}"><path d="{2}"/></svg>'
WIDTH, HEIGHT = 60, 40
KEEP = "M6 4H54V36H6Z"  # of the canvas, inside of which the identity shows everything


@pytest.fixture
def folder(tmp_path, monkeypatch, iccm):
    """A map from the canvas onto itself, in m.npz, and into a part of it by half, in half.npz."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.svg").write_text(SQUARE.format(WIDTH, HEIGHT, f"M0 0H{WIDTH}V{HEIGHT}H0Z"))
    (tmp_path / "b.svg").write_text(SQUARE.format(WIDTH, HEIGHT, "M10 10H40V30H10Z"))
    (tmp_path / "drop.svg").write_text(
        SQUARE.format(WIDTH, HEIGHT, "M5 20C5 5 30 0 55 8S50 38 30 36S5 32 5 20Z")
    )
    for name, target in (("m", "a"), ("half", "b"), ("drop", "drop")):
        assert iccm("map", "a.svg", f"{target}.svg", "-o", f"{name}.npz").code == 0
    return tmp_path


def raster(name, bands, nodata=None, names=(), place=True, **more):
    """Write a GeoTIFF by rasterio."""
    more |= (
        {"transform": rasterio.Affine(10, 0, 500000, 0, -10, 5400000), "crs": "EPSG:32633"} if place else {}
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        with rasterio.open(
            *(name, "w"), driver="GTiff", width=WIDTH, height=HEIGHT, count=len(bands), dtype=bands.dtype,
            nodata=nodata, **more,
        ) as file:  # fmt: skip
            file.write(bands)
            for number, text in enumerate(names, start=1):
                file.set_band_description(number, text)


def opened(name):
    """Numbers and what rasterio says about a file."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        with rasterio.open(name) as file:
            return file.read(), file.profile, file.descriptions


def slope(dtype, count=1):
    """Numbers that rise to the right and downwards, other ones in each band."""
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    return np.stack([(300 + 40 * k + x + 2 * y).astype(dtype) for k in range(count)])


KINDS = [
    ("uint8", 1, 255),
    ("uint16", 1, 0),
    ("int16", 1, -32768),
    ("int16", 1, None),
    ("int32", 1, -2147483648),
    ("uint32", 2, 7),
    ("float32", 1, -9999),
    ("float32", 1, np.nan),
    ("float32", 4, -3.4028234663852886e38),
    ("float64", 1, 1e20),
    ("uint16", 3, 65535),
    ("int8", 1, -128),
]


@pytest.mark.parametrize(("dtype", "count", "nodata"), KINDS)
@pytest.mark.keeps("gdal", "type of numbers", "number of bands", "no-data value")
def test_numbers_without_data_are_not_mixed_and_the_tags_are_kept(folder, iccm, dtype, count, nodata):
    numbers = slope("float64", count)
    if np.dtype(dtype).itemsize == 1:
        numbers = (numbers - 300) // 3
    numbers = numbers.astype(dtype)
    hole = np.zeros((HEIGHT, WIDTH), bool)
    if nodata is not None:
        hole[12:20, 20:33] = True
        numbers[:, hole] = nodata
    raster("r.tif", numbers, nodata, [f"band {k}" for k in range(count)])
    assert iccm("apply", "m.npz", "r.tif", "-o", "o.tif", "--size", f"{WIDTH}x{HEIGHT}").code == 0
    result, profile, names = opened("o.tif")
    assert profile["dtype"] == dtype and profile["count"] == count
    assert names == tuple(f"band {k}" for k in range(count))
    assert profile["nodata"] == (None if nodata is None else pytest.approx(nodata, nan_ok=True))
    np.testing.assert_allclose(result[:, hole], numbers[:, hole])
    np.testing.assert_allclose(result[:, ~hole], numbers[:, ~hole], rtol=1e-6)
    assert iccm("apply", "drop.npz", "r.tif", "-o", "d.tif", "--size", "150").code == 0
    bent, profile, _ = opened("d.tif")
    missing = 0 if nodata is None else np.array(nodata).astype(dtype)
    data = bent[:, ~(np.isnan(bent[0]) if nodata is not None and np.isnan(nodata) else bent[0] == missing)]
    assert 0.3 < data[0].size / bent[0].size < 0.7
    valid = numbers[:, ~hole].astype(float)
    for band, original in zip(data.astype(float), valid):
        assert original.min() - 2 <= band.min() and band.max() <= original.max() + 2


@pytest.mark.parametrize(("dtype", "count", "nodata"), KINDS)
def test_pixels_are_those_of_gdalwarp(folder, iccm, dtype, count, nodata):
    """Where the map is the identity, at another resolution: rasterio's `reproject` is the code of gdalwarp."""
    from rasterio.warp import Resampling, reproject

    rng = np.random.default_rng(5)
    numbers = rng.integers(20, 90, (count, HEIGHT, WIDTH)).astype(dtype)
    hole = np.zeros((HEIGHT, WIDTH), bool)
    if nodata is not None:
        hole[12:20, 20:33] = True
        numbers[:, hole] = nodata
    raster("r.tif", numbers, nodata)
    wide, high = 3 * WIDTH, 3 * HEIGHT
    size = "--size", f"{wide}x{high}", "--filter", "nearest"
    assert iccm("apply", "m.npz", "r.tif", "-o", "o.tif", *size).code == 0
    result, profile, _ = opened("o.tif")
    warped = np.empty((count, high, wide), "float64")
    coarse, fine = rasterio.Affine.scale(1.0), rasterio.Affine.scale(1 / 3)
    place = {"src_transform": coarse, "dst_transform": fine, "src_crs": "EPSG:32633", "dst_crs": "EPSG:32633"}
    reproject(numbers.astype("float64"), warped, resampling=Resampling.nearest, **place)
    assert result.shape == warped.shape and profile["dtype"] == dtype
    np.testing.assert_array_equal(result, warped.astype(dtype))


@pytest.mark.parametrize(
    ("dtype", "count"), [("uint8", 1), ("uint8", 3), ("uint16", 3), ("int16", 2), ("float32", 5)]
)
@pytest.mark.keeps("gdal", "the target's coordinate reference system")
def test_results_lie_where_their_target_does(folder, iccm, dtype, count):
    numbers = slope("float64", count).astype("float32") / 5
    raster("place.tif", numbers.astype(dtype))
    for arguments in (("map", "place.tif#canvas", "place.tif#canvas", "-o", "o.tif"),):
        assert iccm(*arguments, "--size", f"{2 * WIDTH}x{2 * HEIGHT}").code == 0
        _, profile, _ = opened("o.tif")
        assert profile["crs"].to_epsg() == 32633
        assert tuple(profile["transform"])[:6] == pytest.approx((5, 0, 500000, 0, -5, 5400000))
    assert iccm("map", "a.svg", "place.tif#canvas", "-o", "g.npz").code == 0
    raster("flat.tif", numbers.astype(dtype), place=False)
    assert iccm("apply", "g.npz", "flat.tif", "-o", "p.tif", "--size", f"{WIDTH}").code == 0
    assert opened("p.tif")[1]["crs"].to_epsg() == 32633
    assert iccm("apply", "g.npz", "place.tif", "--inverse", "-o", "q.tif", "--size", f"{WIDTH}").code == 0
    assert opened("q.tif")[1]["crs"] is None


@pytest.mark.slow
def test_heights_in_a_region_of_a_map(folder, iccm):
    """A raster of heights with a hole, cut to a region in its coordinate reference system."""
    heights = slope("float32")
    heights[:, 12:20, 20:33] = -9999
    raster("dem.tif", heights, -9999)
    corners = [[500050, 5399650], [500500, 5399680], [500570, 5399960], [500080, 5399930], [500050, 5399650]]
    crs = {"type": "name", "properties": {"name": "urn:ogc:def:crs:EPSG::32633"}}
    (folder / "zone.geojson").write_text(
        json.dumps({"type": "Polygon", "coordinates": [corners], "crs": crs})
    )
    assert iccm("map", "dem.tif#canvas", "zone.geojson", "-o", "z.tif", "--size", "90").code == 0
    with rasterio.open("z.tif") as file:
        cut = file.read(1, masked=True)
        assert file.nodata == -9999 and file.crs.to_epsg() == 32633 and file.dtypes[0] == "float32"
        west, south, east, north = file.bounds
    assert west < 500100 < 500500 < east and south < 5399700 < 5399900 < north
    assert cut.min() >= 300 and cut.max() <= heights.max() and not cut.mask.all()
    middle = cut[cut.shape[0] // 3 : 2 * cut.shape[0] // 3, cut.shape[1] // 4 : 3 * cut.shape[1] // 4]
    assert 0.02 < middle.mask.mean() < 0.7  # the hole


@pytest.mark.slow
@pytest.mark.parametrize("dtype", ["uint8", "uint16"])
def test_pictures_lie_where_the_raster_does_that_they_are_mapped_onto(folder, iccm, dtype):
    from PIL import Image

    ramp = np.stack([np.tile(np.arange(WIDTH) * 4, (HEIGHT, 1))] * 3, axis=2).astype("uint8")
    ramp[:5, :9] = 200, 10, 20
    Image.fromarray(ramp).save("smooth.png")
    raster("q.tif", slope(dtype, 3), photometric="RGB")
    size = "--size", f"{WIDTH}x{HEIGHT}"
    assert iccm("map", "smooth.png#canvas", "q.tif#canvas", "-o", "o.tif", *size).code == 0
    numbers, profile, _ = opened("o.tif")
    assert profile["crs"].to_epsg() == 32633
    assert tuple(profile["transform"])[:6] == pytest.approx((10, 0, 500000, 0, -10, 5400000))
    np.testing.assert_array_equal(np.moveaxis(numbers[:3], 0, 2), ramp)


def cells(dtype, step=1):
    """Discs with numbers on a background of 0."""
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    labels = np.zeros((HEIGHT, WIDTH), dtype)
    for k, (cx, cy) in enumerate((cx, cy) for cx in range(8, WIDTH, 12) for cy in range(7, HEIGHT, 11)):
        labels[np.hypot(x - cx, y - cy) < 5] = 1 + step * ((7 * k) % 20)
    return labels


@pytest.mark.parametrize(
    ("dtype", "step"),
    [("uint8", 1), ("uint16", 13), ("uint32", 3), ("int32", 100_000_001), ("uint32", 90_000_001)],
)
@pytest.mark.keeps("labels", "every number, up to 32 bits")
def test_labels_stay_labels(folder, iccm, dtype, step):
    labels = cells(dtype, step)
    tifffile.imwrite("l.tif", labels)
    result = iccm("apply", "drop.npz", "l.tif", "-o", "o.tif", "--size", "240")
    assert result.code == 0 and "labels" in result.err
    bent = tifffile.imread("o.tif")
    assert bent.dtype == dtype and bent.shape == (160, 240)
    assert {*np.unique(bent)} == {*np.unique(labels)}
    assert iccm("apply", "m.npz", "l.tif", "-o", "s.tif", "--size", f"{WIDTH}x{HEIGHT}").code == 0
    assert np.array_equal(tifffile.imread("s.tif"), labels)
    if step < 10 and np.dtype(dtype).itemsize == 1:
        from PIL import Image

        Image.fromarray(labels).save("l.png")
        assert iccm("apply", "drop.npz", "l.png", "-o", "o.png", "--size", "240").code == 0
        assert {*np.unique(np.asarray(Image.open("o.png"))[..., 0])} == {*np.unique(labels)}
    mixed = iccm("apply", "drop.npz", "l.tif", "-o", "f.tif", "--size", "240", "--filter", "linear")
    assert mixed.code == 0 and "labels" not in mixed.err


@pytest.mark.keeps("gdal", "palette of classes")
def test_palettes_of_classes_are_kept(folder, iccm):
    classes = cells("uint8") % 7
    palette = {k: (30 * k, 255 - 30 * k, 90, 255) for k in range(7)}
    raster("c.tif", classes[None], nodata=255)
    with rasterio.open("c.tif", "r+") as file:
        file.write_colormap(1, palette)
    assert iccm("apply", "drop.npz", "c.tif", "-o", "o.tif", "--size", "240").code == 0
    bent, profile, _ = opened("o.tif")
    assert {*np.unique(bent)} == {*np.unique(classes), 255} and profile["nodata"] == 255
    with rasterio.open("o.tif") as file:
        kept = file.colormap(1)
    assert all(kept[k] == palette[k] for k in palette)


@pytest.mark.parametrize("dtype", ["uint8", "uint16"])
def test_photographs_and_heights_are_not_labels(dtype):
    from iccm.io.pictures.rasters import is_label

    y, x = np.mgrid[:80, :90]
    smooth = 120 + 60 * np.sin(x / 17) * np.cos(y / 23)
    disc = 255 * np.clip(31 - np.hypot(x - 40, y - 40), 0, 1)
    noise = np.random.default_rng(3).integers(0, 255, (80, 90))
    for picture in (smooth, disc, noise, smooth // 8 * 8 + noise % 3):
        assert not is_label(picture.astype(dtype), of_file=True)


@pytest.mark.parametrize("dtype, count, nodata", [*KINDS, ("uint16", 6, 0), ("float32", 2, None)])
def test_rasters_show_themselves_where_they_have_data(tmp_path, monkeypatch, dtype, count, nodata):
    """However few of the numbers of their type they use, and also where NaN is not stated to mean no data."""
    from iccm.io.shapes import shape as shapes

    monkeypatch.chdir(tmp_path)
    bands, hole = slope(dtype, count), (slice(None), slice(5, 15), slice(20, 40))
    if nodata is not None or dtype == "float32":
        bands[hole] = np.nan if nodata is None else nodata
    raster("a.tif", bands, nodata)
    shape = shapes.read("a.tif#canvas")
    assert shape.coloured and shape.pictures
    if count == 2 or nodata == 0:
        assert len(shapes.read("a.tif").holes) == 1  # where it has no data


def test_a_compression_that_cannot_be_read_has_a_remedy(tmp_path, monkeypatch):
    from iccm.errors import InputError
    from iccm.io.pictures import image_files

    monkeypatch.chdir(tmp_path)
    raster("a.tif", slope("int16"), compress="LERC")
    with pytest.raises(InputError, match="its compression LERC is not supported; use gdal_translate"):
        image_files.read("a.tif")


def stack(count):
    """Channels with other patterns."""
    return np.stack([(slope("float64")[0] * (k + 1) + 900 * k).astype("uint16") for k in range(count)])


@pytest.mark.keeps(
    "imagej",
    "all channels, slices and frames",
    "mode",
    "names, ranges and lookup tables of channels",
    "calibration if the canvas stays the same",
)
@pytest.mark.loses("imagej", "calibration otherwise", "overlays and regions")
def test_all_channels_of_imagej_are_mapped(folder, iccm):
    channels = stack(4)
    names = ["DAPI", "CD3", "CD8", "PanCK"]
    tables = [np.outer(colour, np.arange(256)).astype("uint8") for colour in np.eye(3)[[2, 1, 0, 1]]]
    shown = {"Labels": names, "Ranges": (0.0, 9e3) * 4, "LUTs": tables, "Overlays": [b"Iout" + bytes(60)]}
    about = {"axes": "CYX", "unit": "um", "mode": "composite", **shown}
    tifffile.imwrite("ij.tif", channels, imagej=True, metadata=about, resolution=(4, 5))
    assert iccm("apply", "m.npz", "ij.tif", "-o", "o.tif", "--size", f"{WIDTH}x{HEIGHT}").code == 0
    with tifffile.TiffFile("o.tif") as file:
        assert file.is_imagej and file.imagej_metadata["channels"] == 4 and file.series[0].axes == "CYX"
        assert file.imagej_metadata["unit"] == "um"
        assert [file.pages[0].tags[f"{axis}Resolution"].value for axis in "XY"] == [(4, 1), (5, 1)]
        np.testing.assert_array_equal(file.asarray(), channels)
    assert iccm("apply", "half.npz", "ij.tif", "-o", "h.tif", "--size", "90").code == 0
    with tifffile.TiffFile("h.tif") as file:
        assert file.asarray().shape == (4, 60, 90) and "unit" not in file.imagej_metadata
        assert file.imagej_metadata["Labels"] == names and file.imagej_metadata["Ranges"] == (0.0, 9e3) * 4
        np.testing.assert_array_equal(file.imagej_metadata["LUTs"], tables)
        assert "Overlays" not in file.imagej_metadata and file.pages[0].tags["XResolution"].value == (1, 1)


@pytest.mark.keeps("ome", "all planes", "names of channels")
@pytest.mark.loses("ome", "physical size of pixels, unless the canvas stays the same")
def test_all_channels_of_ome_are_mapped(folder, iccm):
    channels = stack(3)
    names = {
        "axes": "CYX",
        "PhysicalSizeX": 0.25,
        "PhysicalSizeY": 0.25,
        "Channel": {"Name": ["DAPI", "GFP", "RFP"]},
    }
    tifffile.imwrite("c.ome.tif", channels, ome=True, photometric="minisblack", metadata=names)
    assert iccm("apply", "half.npz", "c.ome.tif", "-o", "o.ome.tif", "--size", "90").code == 0
    with tifffile.TiffFile("o.ome.tif") as file:
        assert file.is_ome and file.series[0].shape == (3, 60, 90) and file.series[0].axes == "CYX"
        assert "DAPI" in file.ome_metadata and "PhysicalSizeX" not in file.ome_metadata


def test_numbers_that_a_format_cannot_hold_are_refused(folder, iccm):
    tifffile.imwrite("l.tif", cells("int32", 100_000_001))
    tifffile.imwrite("h.tif", slope("int16")[0])
    for name in ("l.tif", "h.tif"):
        result = iccm("apply", "m.npz", name, "-o", "o.png")
        assert result.code == 2 and len(result.err.splitlines()) <= 2
        assert not (folder / "o.png").exists()


@pytest.mark.parametrize("form", ["epsg", "proj", "wkt", "esri", "bom"])
def test_prj_files_of_any_form_are_read(folder, iccm, form):
    from PIL import Image

    crs = rasterio.CRS.from_epsg(32633)
    texts = {
        "epsg": "EPSG:32633\n",
        "proj": "+proj=utm +zone=33 +datum=WGS84 +units=m +no_defs",
        "wkt": crs.to_wkt(),
        "esri": crs.to_wkt(version="WKT1_ESRI"),
        "bom": "\ufeff" + crs.to_wkt(),
    }
    Image.fromarray(slope("uint8")[0]).save("s.png")
    (folder / "s.pgw").write_text("10\n0\n0\n-10\n500005\n5399995\n")
    (folder / "s.prj").write_text(texts[form], encoding="utf-8")
    assert iccm("map", "a.svg", "s.png#canvas", "-o", "o.tif", "--size", "60").code == 0
    assert opened("o.tif")[1]["crs"].to_epsg() == 32633


@pytest.mark.parametrize(("name", "becomes"), [("o.png", "transparent"), ("o.jpg", "white")])
def test_a_format_that_does_not_mark_pixels_without_data_is_noted(folder, iccm, name, becomes):
    numbers = slope("uint8", 1)
    numbers[:, 12:20, 20:33] = 7
    raster("r.tif", numbers, 7)
    noted = iccm("apply", "m.npz", "r.tif", "-o", name)
    assert (
        noted.code == 0 and "without data" in noted.err and becomes in noted.err and "number 7" in noted.err
    )
    raster("all.tif", numbers, None)
    assert "without data" not in iccm("apply", "m.npz", "all.tif", "-o", name, "--force").err


@pytest.mark.keeps("gdal", "names of bands", "scale, offset and unit of numbers")
@pytest.mark.loses("gdal", "statistics, overviews, other metadata")
def test_what_gdal_states_about_bands_is_kept_unless_it_is_no_longer_true(folder, iccm):
    raster("r.tif", slope("int16", 2))
    with rasterio.open("r.tif", "r+") as file:
        file.scales, file.offsets, file.units = (0.01, 0.1), (-5.0, 0.0), ("m", "K")
        file.set_band_description(2, "warm")
        file.update_tags(1, STATISTICS_MAXIMUM="7")
        file.update_tags(note="by hand")
        file.build_overviews([2])
    assert iccm("apply", "half.npz", "r.tif", "-o", "o.tif", "--size", "90").code == 0
    with rasterio.open("o.tif") as file:
        assert (file.scales, file.offsets, file.units) == ((0.01, 0.1), (-5.0, 0.0), ("m", "K"))
        assert file.descriptions == (None, "warm")
        assert not file.tags(1) and "note" not in file.tags() and not file.overviews(1)


@pytest.mark.keeps("gdal", "masks as an alpha channel or a no-data value")
@pytest.mark.parametrize(("dtype", "count"), [("uint8", 3), ("uint16", 1), ("float32", 1), ("int16", 1)])
def test_masks_of_gdal_hide_what_they_hide(folder, iccm, dtype, count):
    numbers = slope("float64", count)
    numbers = (numbers / numbers.max() * 100 + 50).astype(dtype)
    hole = np.zeros((HEIGHT, WIDTH), bool)
    hole[12:20, 20:33] = True
    numbers[:, hole] = 1  # what lies below the mask must not show
    with rasterio.Env(GDAL_TIFF_INTERNAL_MASK=True):
        raster("r.tif", numbers)
        with rasterio.open("r.tif", "r+") as file:
            file.write_mask(~hole)
    result = iccm("apply", "m.npz", "r.tif", "-o", "o.tif", "--size", f"{WIDTH}x{HEIGHT}")
    assert result.code == 0 and "several pictures" not in result.err
    with rasterio.open("o.tif") as file:
        assert ((file.dataset_mask() > 0) == ~hole).mean() > 0.999
        np.testing.assert_array_equal(file.read(1)[~hole], numbers[0][~hole])
    assert iccm("apply", "m.npz", "r.tif", "-o", "small.tif", "--size", f"{WIDTH // 2}").code == 0
    with rasterio.open("small.tif") as file:
        shown = file.read(1)[file.dataset_mask() > 0]
    assert shown.min() > 45


def test_labels_of_64_bits_become_labels_of_32(folder, iccm):
    """skimage.measure.label returns them."""
    labels = cells("int64", 1000)
    tifffile.imwrite("l.tif", labels)
    assert iccm("apply", "m.npz", "l.tif", "-o", "o.tif", "--size", f"{WIDTH}x{HEIGHT}").code == 0
    written = tifffile.imread("o.tif")
    assert written.dtype == np.int32
    np.testing.assert_array_equal(written, labels)
    tifffile.imwrite("huge.tif", labels * 2**40)
    tifffile.imwrite("complex.tif", slope("float32")[0].astype("complex64"))
    for name in ("huge.tif", "complex.tif"):
        result = iccm("apply", "m.npz", name, "-o", "x.tif")
        assert result.code == 2 and len(result.lines) == 1 and "gdal_translate" in result.err


def test_a_single_channel_of_imagej_and_ome_is_as_they_read_it(folder, iccm):
    counts = (slope("float64")[0] / 9).astype("uint16")
    table = np.stack([np.arange(256), np.zeros(256), np.zeros(256)]).astype("uint8")
    about = {"unit": "um", "LUTs": [table]}
    tifffile.imwrite("ij.tif", counts, imagej=True, resolution=(4, 4), metadata=about)
    tifffile.imwrite("a.ome.tif", counts, ome=True, metadata={"axes": "YX"})
    for name in ("ij.tif", "a.ome.tif"):
        result = iccm("apply", "m.npz", name, "-o", f"o-{name}", "--size", f"{WIDTH}x{HEIGHT}")
        assert result.code == 0 and "single colour" not in result.err
        with tifffile.TiffFile(f"o-{name}") as file:
            assert file.series[0].axes == "YX" and file.is_imagej == (name == "ij.tif")
            assert "LUTs" in file.imagej_metadata if file.is_imagej else file.is_ome
            np.testing.assert_array_equal(file.asarray(), counts)


def test_descriptions_of_ome_may_have_any_letters(folder, iccm):
    about = (
        '<?xml version="1.0" encoding="UTF-8"?><OME xmlns="http://www.openmicroscopy.org/Schemas/OME/2016-06">'
        '<Image ID="Image:0" Name="Zelle"><Pixels ID="Pixels:0" DimensionOrder="XYCZT" Type="uint16" SizeX="90" '
        'SizeY="60" SizeC="1" SizeZ="1" SizeT="1" PhysicalSizeX="0.5" PhysicalSizeXUnit="µm"><Channel ID="Channel:0:0" '
        'Name="Phäno"/><TiffData IFD="0"/></Pixels></Image></OME>'
    )
    counts = np.arange(5400, dtype=np.uint16).reshape(60, 90)
    tifffile.imwrite("u.ome.tif", counts, description=about.encode(), metadata=None)
    assert iccm("apply", "m.npz", "u.ome.tif", "-o", "o.ome.tif").code == 0
    with tifffile.TiffFile("o.ome.tif") as file:
        assert file.is_ome and "Phäno" in file.pages.first.description
