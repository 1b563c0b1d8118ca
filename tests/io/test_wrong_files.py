"""Files and names that libraries refuse in their own words: one line and exit code 2, or a note."""

import struct
import zipfile
import zlib
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from iccm import InputError
from iccm.cli import COMMANDS
from iccm.io import options
from iccm.io.pictures import georeferenced, image_files
from tests.damaged_archives import DAMAGED_AT, check_damaged_archive

ARGUMENTS = {
    "apply": ["m.npz", "square.svg"],
    "batch": ["square.svg", "blob.svg"],
    "cartogram": ["a.geojson", "--by", "pop"],
    "check": [".", "."],
    "compose": ["m.npz"],
    "deform": ["square.svg"],
    "edit": ["square.svg", "blob.svg"],
    "field": ["m.npz"],
    "flatten": ["a.obj"],
    "info": ["square.svg"],
    "map": ["square.svg", "blob.svg"],
    "morph": ["square.svg", "blob.svg"],
    "plugins": ["install", "inkscape"],
    "relayout": ["a.obj", "a.obj"],
    "standardize": ["square.svg"],
}


def options_that_name_files():
    """Yield each command with each of its options whose values are files."""
    for command in COMMANDS:
        if command in ARGUMENTS:
            for name, (_, option) in options.of_command(command).items():
                if option.names_files:
                    yield command, f"--{name.replace('_', '-')}"


@pytest.mark.parametrize(("command", "option"), list(options_that_name_files()))
def test_an_empty_name_is_refused_whatever_option_it_is_given_to(shapes, iccm, command, option):
    before = sorted(Path().rglob("*"))
    typed = iccm(command, *ARGUMENTS[command], option, "")
    assert typed.code == 2 and len(typed.lines) <= 3 and "empty" in typed.err, typed.err
    assert sorted(Path().rglob("*")) == before


def regions(name):
    """An archive of a region of ImageJ."""
    roifile = pytest.importorskip("roifile")
    with zipfile.ZipFile(name, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("a.roi", roifile.ImagejRoi.frompoints([[1, 1], [9, 1], [9, 9]]).tobytes())


@pytest.mark.parametrize("where", DAMAGED_AT)
def test_damaged_archives_are_refused_in_one_line(shapes, iccm, where):
    regions("a.zip")
    check_damaged_archive(iccm, Path("a.zip"), where)


def test_points_in_an_unknown_format_are_refused(shapes, iccm):
    for name in ("a.points", "b.points"):
        Path(name).write_text("mapX,mapY,sourceX,sourceY\n1,2,3,4\n")
    landmarks = ("--source-landmarks", "a.points", "--target-landmarks", "b.points")
    typed = iccm("map", "square.svg", "blob.svg", *landmarks, "-o", "o.png")
    assert typed.code in (0, 1, 2) and "internal" not in typed.err
    Path("a.xyz").write_text("1 2 3")
    typed = iccm(
        "map", "square.svg", "blob.svg", "--source-landmarks", "a.xyz", "--target-landmarks", "a.xyz"
    )
    assert typed.code == 2 and len(typed.lines) == 1 and ".xyz" in typed.err


def test_an_error_of_a_decoder_that_is_not_text_is_reported(shapes, iccm):
    image_files.write("t.exr", image_files.Image(np.ones((8, 8, 4), np.float32)))
    content = Path("t.exr").read_bytes()
    Path("odd.exr").write_bytes(
        content.replace(b"dataWindow", b"data\xa0indow").replace(b"channels", b"chan\xffels")
    )
    for arguments in (
        ["apply", "odd.exr", "t.exr"],
        ["map", "square.svg", "blob.svg", "--texture", "odd.exr"],
    ):
        typed = iccm(*arguments, "-o", "o.png")
        assert typed.code == 2 and "odd.exr" in typed.err and len(typed.lines) == 1


@pytest.mark.large
@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("EPSG:3057", 3057),
        ("+proj=utm +zone=33 +datum=WGS84", 32633),
        ("EPSG:4326\n", 4326),
        ("EPSG:99999999", None),
        ("EPSG:Infinity", None),
        ("not a system", None),
        ("", None),
        ("http://127.0.0.1:9/a.wkt", None),
        ("/etc/hostname", None),
        ("+init=/etc/hostname:1", None),
        ("+proj=longlat +nadgrids=/etc/hostname", None),
        ("PROJCS[", None),
        ("\xff", None),
    ],
)
def test_a_projection_file_is_read_in_any_form_or_a_note_says_why_not(tmp_path, text, code):
    rasterio = pytest.importorskip("rasterio")
    Image.new("RGB", (6, 4)).save(tmp_path / "a.png")
    (tmp_path / "a.pgw").write_text("2\n0\n0\n-2\n100\n200\n")
    (tmp_path / "a.prj").write_bytes(text.encode("latin-1"))
    place, note = georeferenced.read(tmp_path / "a.png")
    assert place.transform == (2, 0, 99, 0, -2, 201)
    assert (place.crs == "") == (code is None) == bool(note)
    if code:
        assert rasterio.crs.CRS.from_string(place.crs).to_epsg() == code
    else:
        assert "a.prj" in note


@pytest.mark.large
def test_a_coordinate_reference_system_of_a_stranger_is_not_looked_up(monkeypatch):
    """GDAL would connect to an address, and PROJ read a file, that a saved map gives as its coordinate system."""
    rasterio = pytest.importorskip("rasterio")
    grids = (
        'GEOGCS["a",DATUM["b",SPHEROID["c",6378137,298.25],EXTENSION["PROJ4_GRIDS","/x.gsb"]],PRIMEM["d",0],'
        'UNIT["degree",0.0174532925199433]]'
    )
    for text in (
        "http://127.0.0.1:9/x",
        "+init=/x:1",
        "+proj=longlat +nadgrids=/x",
        grids,
        "https://a.example/1=2",
    ):
        with pytest.raises(georeferenced.InputError):
            georeferenced.reference_system(rasterio, text)
    web_mercator = "+proj=merc +a=6378137 +b=6378137 +nadgrids=@null +wktext"
    assert georeferenced.reference_system(rasterio, web_mercator)


def test_options_that_name_files_are_recognised_by_their_placeholders():
    names = {option for _, option in options_that_name_files()}
    assert {
        "--texture",
        "--source-landmarks",
        "--rigid",
        "--output",
        "--report",
        "--overlay",
        "--root",
    } <= names


@pytest.mark.parametrize(
    "error", [AssertionError, IndexError, RecursionError, OverflowError, ZeroDivisionError]
)
def test_whatever_the_reader_of_dxf_raises_the_drawing_is_at_fault(tmp_path, monkeypatch, error):
    """A list of layouts that names one of them twice fails an assertion of ezdxf."""
    ezdxf = pytest.importorskip("ezdxf")
    from ezdxf import recover

    from iccm.io.outlines import dxf

    def fail(name):
        raise error

    ezdxf.new().saveas(tmp_path / "a.dxf")
    monkeypatch.setattr(recover, "readfile", fail)
    with pytest.raises(InputError, match=r"a\.dxf: cannot read this DXF drawing"):
        dxf.read(tmp_path / "a.dxf")


@pytest.mark.parametrize(
    "error", [struct.error, zlib.error, IndexError, KeyError, OverflowError, AssertionError]
)
def test_whatever_a_decoder_of_pictures_raises_the_picture_is_at_fault(tmp_path, monkeypatch, error):
    from PIL import Image

    from iccm.io.pictures import pillow

    def fail(*_, **__):
        raise error

    monkeypatch.setattr(Image, "open", fail)
    with pytest.raises(InputError, match=r"a\.png: cannot read this picture"), pillow.opened(b"", "a.png"):
        pass
