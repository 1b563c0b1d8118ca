"""`iccm field`: fields that SimpleITK, OpenCV and OpenImageIO read, and that `iccm apply` reads back."""

import gzip
import re
import zlib
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import iccm as core
from iccm.errors import InputError
from iccm.io import itk_files
from tests.cases import pixels

itk = pytest.importorskip("SimpleITK", reason="SimpleITK is an extra")
cv2 = pytest.importorskip("cv2")
pytestmark = pytest.mark.large

SVG = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {} {}"><path d="{}"/></svg>'
LEAF = "M10 60 C10 20 60 5 130 12 C150 45 120 85 60 88 C30 88 12 80 10 60 Z"
ELL = "M8 8 H60 V40 H100 V110 H8 Z"
SOURCE, TARGET = (160, 100), (108, 120)


@pytest.fixture(scope="module")
def field_folder(tmp_path_factory, iccm_once):
    """The files of a map from a leaf to an L, and a smooth picture of the leaf's canvas."""
    return iccm_once(tmp_path_factory.mktemp("field"))


@pytest.fixture(scope="module")
def iccm_once():
    """Make the files by the library, once."""

    def make(folder):
        (folder / "leaf.svg").write_text(SVG.format(*SOURCE, LEAF))
        (folder / "ell.svg").write_text(SVG.format(*TARGET, ELL))
        from iccm.io.run import Job, run

        job = {"source": str(folder / "leaf.svg"), "target": str(folder / "ell.svg"), "fit": "whole"}
        run(Job(**job, parts="largest", output=[str(folder / "map.npz")]))
        x, y = np.meshgrid(np.arange(SOURCE[0]), np.arange(SOURCE[1]))
        pixels = np.dstack([x * 1.5, y * 2.4, 127 + 100 * np.sin(x / 17 + y / 29)])
        Image.fromarray(pixels.astype(np.uint8)).save(folder / "leaf.png")
        return folder

    return make


@pytest.fixture
def field_files(field_folder, tmp_path, monkeypatch):
    """Those files in the current folder."""
    for path in field_folder.iterdir():
        (tmp_path / path.name).write_bytes(path.read_bytes())
    monkeypatch.chdir(tmp_path)


def ours(iccm, size=TARGET):
    """The picture that iccm makes with the map, with a linear filter, and the pixels that are well inside of it."""
    result = iccm(
        "apply",
        "map.npz",
        "leaf.png",
        "-o",
        "ours.png",
        "--size",
        f"{size[0]}x{size[1]}",
        "--filter",
        "linear",
        "--force",
    )
    assert result.code == 0, result.err
    picture = pixels("ours.png")
    full = (picture[..., 3] == 255).astype(np.uint8)
    return picture[..., :3], cv2.erode(full, np.ones((3, 3), np.uint8)) > 0


def close(picture, expected, inside):
    """Whether pictures agree inside, but for rounding and where a filter averages a squeezed picture."""
    away = np.abs(np.asarray(picture, float)[..., :3] - expected)[inside]
    assert inside.sum() > 3000 and expected[inside].std() > 30
    return np.quantile(away, 0.98) < 3 and away.mean() < 1


@pytest.mark.parametrize("suffix", [".nrrd", ".mha", ".nii", ".nii.gz"])
def test_simpleitk_resamples_to_the_same_picture(field_files, iccm, suffix):
    result = iccm("field", "map.npz", "-o", f"field{suffix}")
    assert result.code == 0, result.err
    field = itk.ReadImage(f"field{suffix}", itk.sitkVectorFloat64)
    field = field if field.GetDimension() == 2 else field[:, :, 0]
    assert field.GetSize() == TARGET and field.GetNumberOfComponentsPerPixel() == 2
    fixed = itk.Image(*TARGET, itk.sitkUInt8)
    moving = itk.ReadImage("leaf.png")
    resampled = itk.Resample(moving, fixed, itk.DisplacementFieldTransform(field), itk.sitkLinear)
    assert close(itk.GetArrayFromImage(resampled), *ours(iccm))


def test_the_places_and_axes_of_pictures_in_space_are_kept(field_files, iccm):
    moving = itk.ReadImage("leaf.png")
    moving.SetSpacing((0.25, 0.5))
    moving.SetOrigin((-7, 30))
    moving.SetDirection((0, 1, -1, 0))
    itk.WriteImage(moving, "leaf.mha")
    fixed = itk.Image(*(2 * side for side in TARGET), itk.sitkUInt8)
    fixed.SetSpacing((0.1, 0.3))
    fixed.SetOrigin((200, -40))
    fixed.SetDirection((-1, 0, 0, 1))
    itk.WriteImage(fixed, "ell.mha")
    result = iccm("field", "map.npz", "--fixed", "ell.mha", "--moving", "leaf.mha", "-o", "field.nrrd")
    assert result.code == 0, result.err
    field = itk.ReadImage("field.nrrd")
    assert field.GetSpacing() == pytest.approx((0.1, 0.3)) and field.GetOrigin() == (200, -40)
    resampled = itk.Resample(moving, fixed, itk.DisplacementFieldTransform(field), itk.sitkLinear)
    assert close(itk.GetArrayFromImage(resampled), *ours(iccm, tuple(2 * side for side in TARGET)))


def test_opencv_remaps_to_the_same_picture(field_files, iccm):
    assert iccm("field", "map.npz", "-o", "remap.npz").code == 0
    with np.load("remap.npz") as arrays:
        x, y, mask = arrays["map_x"], arrays["map_y"], arrays["mask"]
    remapped = cv2.remap(pixels("leaf.png")[..., :3].astype(np.float32), x, y, cv2.INTER_LINEAR)
    expected, inside = ours(iccm)
    assert close(remapped, expected, inside)
    assert (remapped[mask == 0] == 0).all() and mask[inside].min() == 1 and (mask == 0).any()


def test_pixel_vectors_lead_to_the_source(field_files, iccm):
    assert iccm("field", "map.npz", "--vectors", "pixels", "-o", "v.exr").code == 0
    assert iccm("field", "map.npz", "-o", "st.exr").code == 0
    import OpenImageIO

    away, st = (OpenImageIO.ImageBuf(name).get_pixels() for name in ("v.exr", "st.exr"))
    row, column = 30, 24
    x, y = column + away[row, column, 0], row - away[row, column, 1]
    back = core.load("map.npz").inverse(np.array([column + 0.5 - 1j * (row + 0.5)]))[0]
    assert (x + 0.5, y + 0.5) == pytest.approx((back.real, -back.imag), abs=0.02)
    assert st[row, column, 0] * SOURCE[0] == pytest.approx(back.real, abs=0.02)
    assert (1 - st[row, column, 1]) * SOURCE[1] == pytest.approx(-back.imag, abs=0.02)
    assert away[0, 0].tolist() == [0, 0, 0, 0]


@pytest.mark.parametrize(
    "options", [("field.nrrd",), ("remap.npz",), ("v.exr", "--vectors", "pixels"), ("st.tif",)]
)
def test_apply_reads_each_field_back(field_files, iccm, options):
    moving = () if options[0] == "st.tif" else ("--moving", "leaf.png")
    result = iccm("field", "map.npz", *options[1:], "-o", options[0], *moving)
    assert result.code == 0, result.err
    result = iccm("apply", options[0], "leaf.png", "-o", "back.png", "--filter", "linear")
    assert result.code == 0, result.err
    assert close(pixels("back.png"), *ours(iccm))


def test_the_inverse_and_a_chain_with_it(field_files, iccm):
    assert iccm("field", "~map.npz", "-o", "back.nrrd").code == 0
    assert iccm("field", "map.npz", "-o", "field.nrrd").code == 0
    forward, back = (
        itk.DisplacementFieldTransform(itk.ReadImage(name)) for name in ("field.nrrd", "back.nrrd")
    )
    assert itk.ReadImage("back.nrrd").GetSize() == SOURCE
    for place in ((30.0, 30.0), (24.0, 90.0), (80.0, 70.0)):
        assert back.TransformPoint(forward.TransformPoint(place)) == pytest.approx(place, abs=0.2)
    assert iccm("field", "map.npz", "~map.npz", "-o", "same.nrrd").code == 0
    away = itk.GetArrayFromImage(itk.ReadImage("same.nrrd"))
    assert away.shape == (SOURCE[1], SOURCE[0], 2) and np.abs(away).max() < 0.1


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("map.npz", "-o", "out.png"), "out.png"),
        (("map.npz", "-o", "f.nrrd", "--vectors", "pixels"), "--vectors"),
        (("map.npz", "-o", "f.nrrd", "--fixed", "leaf.png"), "leaf.png"),
        (("map.npz", "-o", "f.nrrd", "--fixed", "leaf.png", "--size", "30"), "--size"),
        (("map.npz", "-o", "f.nrrd", "--moving", "none.nrrd"), "none.nrrd"),
        (("map.npz", "-o", "f.nrrd", "--moving", "bad.nrrd"), "bad.nrrd"),
        (("leaf.png", "-o", "f.nrrd"), "leaf.png"),
        (("map.npz", "map.npz", "-o", "f.nrrd"), "map.npz"),
    ],
)
def test_wrong_fields_are_refused_in_one_line(field_files, iccm, arguments, message):
    Path("bad.nrrd").write_bytes(b"NRRD0004\nnonsense")
    refused = iccm("field", *arguments)
    assert refused.code == 2 and message in refused.err and len(refused.lines) == 1
    assert not Path("f.nrrd").exists() and not Path("out.png").exists()


def test_damaged_arrays_are_refused(field_files, iccm):
    np.savez("remap.npz", map_x=np.zeros((3, 4)), map_y=np.zeros((4, 3)))
    refused = iccm("apply", "remap.npz", "leaf.png", "-o", "out.png")
    assert refused.code == 2 and "map_x" in refused.err and len(refused.lines) == 1


META = """ObjectType = Image
NDims = 2
BinaryData = True
BinaryDataByteOrderMSB = False
DimSize = 6 4
ElementNumberOfChannels = 2
ElementType = MET_FLOAT
"""
NRRD = "NRRD0004\ntype: float\ndimension: 3\nsizes: 2 6 4\nkinds: vector domain domain\nendian: little\nencoding: raw\n"
VECTORS = np.arange(48, dtype="<f4").tobytes()
LOCAL = b"ElementDataFile = LOCAL\n"


def nifti(change=lambda data: None, keep=None):
    """The bytes of a small field in NIfTI, changed and cut."""
    itk.WriteImage(itk.GetImageFromArray(np.ones((4, 6, 2), np.float32), isVector=True), "small.nii")
    data = bytearray(Path("small.nii").read_bytes())
    change(data)
    return bytes(data[:keep])


def sized(*sides):
    """A change of a NIfTI header: the sides of the picture."""

    def change(data):
        data[40:56] = np.array([5, *sides, 1, 1, 2, 1, 1], "<i2").tobytes()

    return change


def detached(data):
    """A change of a NIfTI header: the data are in an .img file."""
    data[344:348] = b"ni1\0"


HOSTILE_FIELDS = {
    "data in another file": ("f.mha", lambda: META.encode() + b"ElementDataFile = ../secret.raw\n"),
    "with a colon": ("f.mha", lambda: META.encode() + b"ElementDataFile: ../secret.raw\n"),
    "after one that is a comment": (
        "f.mha", lambda: META.encode() + b"Comment = ElementDataFile = LOCAL\nElementDataFile = ../secret.raw\n",
    ),
    "in a list of files": ("f.mha", lambda: META.encode() + b"ElementDataFile = LIST\n../secret.raw\n"),
    "after a carriage return": (
        "f.mha", lambda: META.encode() + b"Comment = a\rElementDataFile = ../secret.raw\n" + LOCAL + VECTORS,
    ),
    "of NRRD": ("f.nrrd", lambda: NRRD.encode() + b"data file: ../secret.raw\n\n"),
    "of NRRD in one word": ("f.nrrd", lambda: NRRD.encode() + b"DataFile: ../secret.raw\n\n"),
    "of NIfTI": ("f.nii", lambda: nifti(detached)),
    "too short": ("f.mha", lambda: META.encode() + LOCAL + VECTORS[:-1]),
    "compressed and damaged": ("f.mha", lambda: META.encode() + b"CompressedData = True\n" + LOCAL + b"x"),
    "compressed and too short": (
        "f.mha", lambda: META.encode() + b"CompressedData = True\n" + LOCAL + zlib.compress(VECTORS[:-1]),
    ),
    "compressed to a size beyond the file": (
        "f.mha",
        lambda: META.encode() + b"CompressedData = True\nCompressedDataSize = 99999999999\n" + LOCAL
        + zlib.compress(VECTORS),
    ),
    "NRRD too short": ("f.nrrd", lambda: NRRD.encode() + b"\n" + VECTORS[:-1]),
    "NIfTI too short": ("f.nii", lambda: nifti(keep=-1)),
    "NIfTI, compressed, too short": ("f.nii.gz", lambda: gzip.compress(nifti(keep=-1))),
    "NIfTI, compressed and cut": ("f.nii.gz", lambda: gzip.compress(nifti())[:-12]),
    "huge": ("f.mha", lambda: META.replace("6 4", "60000 60000").encode() + LOCAL + VECTORS),
    "huge NIfTI": ("f.nii", lambda: nifti(sized(30000, 30000))),
    "large NIfTI": ("f.nii", lambda: nifti(sized(3000, 3000))),
    "many components": (
        "f.mha", lambda: META.replace("Channels = 2", "Channels = 500000000").encode() + LOCAL + VECTORS,
    ),
    "no spacing": ("f.mha", lambda: META.encode() + b"ElementSpacing = 0 1\n" + LOCAL + VECTORS),
    "no direction": ("f.mha", lambda: META.encode() + b"TransformMatrix = 0 0 0 0\n" + LOCAL + VECTORS),
    "no place": ("f.mha", lambda: META.encode() + b"Offset = 1e200 0\n" + LOCAL + VECTORS),
    "a page of the web": ("f.nii", lambda: b"<html></html>"),
    "a PNG": ("f.nrrd", lambda: b"\x89PNG\r\n\x1a\n" + bytes(30)),
}  # fmt: skip


@pytest.mark.parametrize("name", HOSTILE_FIELDS)
def test_hostile_itk_fields_are_refused_in_one_line(tmp_path, monkeypatch, capfd, name):
    (tmp_path / "secret.raw").write_bytes(VECTORS)
    (tmp_path / "in").mkdir()
    monkeypatch.chdir(tmp_path / "in")
    file, content = HOSTILE_FIELDS[name]
    Path(file).write_bytes(content())
    capfd.readouterr()
    with pytest.raises(InputError, match=re.escape(file)) as refused:
        itk_files.read(file)
    assert "\n" not in str(refused.value) and capfd.readouterr().err == ""


def test_a_field_with_data_in_another_file_is_refused_by_commands(field_files, iccm):
    file, content = HOSTILE_FIELDS["data in another file"]
    Path(file).write_bytes(content())
    for arguments in (
        ("apply", file, "leaf.png", "-o", "out.png"),
        ("field", "map.npz", "--moving", file, "-o", "out.npz"),
    ):
        refused = iccm(*arguments)
        assert refused.code == 2 and file in refused.err and len(refused.lines) == 1
        assert not list(Path().glob("out.*"))


@pytest.mark.parametrize("suffix", [".nrrd", ".mha", ".nii", ".nii.gz"])
@pytest.mark.parametrize("compressed", [False, True])
def test_fields_written_by_simpleitk_are_read(tmp_path, suffix, compressed):
    away = np.random.default_rng(3).normal(size=(4, 6, 2)).astype(np.float32)
    image = itk.GetImageFromArray(away, isVector=True)
    image.SetMetaData("0008|0005", "ISO_IR 100")
    path = tmp_path / f"f{suffix}"
    itk.WriteImage(image, str(path), compressed)
    assert np.array_equal(itk_files.read(str(path)).pixels, away)
