"""Cortical surfaces and overlays, in files that nibabel writes or ships."""

import gzip
import struct
from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image

from iccm.errors import InputError
from iccm.io.isolated import process
from iccm.io.meshes import mesh_files, overlays
from tests.mesh_faces import check_71_faces_are_counted

nibabel = pytest.importorskip("nibabel", reason="nibabel is an extra")
gifti = pytest.importorskip("nibabel.gifti")
freesurfer = pytest.importorskip("nibabel.freesurfer")

SHIPPED = Path(gifti.__file__).parent / "tests/data"
ROWS, COLUMNS = 9, 14


def folded():
    """Points (n, 3) and triangles (m, 3) of a folded strip, longer than wide."""
    u, v = np.meshgrid(np.arange(COLUMNS) * 3.0, np.arange(ROWS) * 2.0)
    points = np.stack([u, v, 2 * np.sin(u / 5 + v / 9)], axis=-1).reshape(-1, 3)
    a = (np.arange(ROWS - 1)[:, None] * COLUMNS + np.arange(COLUMNS - 1)).ravel()
    b, c, d = a + 1, a + COLUMNS + 1, a + COLUMNS
    return points, np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])


def write_gifti(path, *arrays):
    """Write arrays, given as pairs of an intent and data, by nibabel."""
    kinds = {"f": "NIFTI_TYPE_FLOAT32", "i": "NIFTI_TYPE_INT32"}
    data_arrays = [
        gifti.GiftiDataArray(
            data.astype(f"{data.dtype.kind}4"), intent=intent, datatype=kinds[data.dtype.kind]
        )
        for intent, data in arrays
    ]
    gifti.GiftiImage(darrays=data_arrays).to_filename(path)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """The strip as a GIFTI file and as a surface of FreeSurfer, with the height as curvature."""
    monkeypatch.chdir(tmp_path)
    points, faces = folded()
    write_gifti("a.surf.gii", ("NIFTI_INTENT_POINTSET", points), ("NIFTI_INTENT_TRIANGLE", faces))
    write_gifti("a.surf.gii.gz", ("NIFTI_INTENT_POINTSET", points), ("NIFTI_INTENT_TRIANGLE", faces))
    freesurfer.write_geometry("lh.white", points, faces)
    freesurfer.write_morph_data("lh.curv", points[:, 0])
    return tmp_path


@pytest.mark.parametrize("name", ["a.surf.gii", "a.surf.gii.gz", "lh.white"])
def test_a_surface_is_read(name, folder):
    points, faces = folded()
    mesh = mesh_files.read(name).mesh
    assert np.allclose(mesh.points, points, atol=1e-5)
    assert np.array_equal(mesh.corners.reshape(-1, 3), faces)
    mesh_files.check_size(Path(name), len(faces))
    with pytest.raises(InputError, match=f"{len(faces)} faces"):
        mesh_files.check_size(Path(name), len(faces) - 1)


@pytest.mark.slow
def test_surfaces_that_nibabel_ships_are_read():
    for name, count in (("base64bin.gii", 10), ("ascii_flat_data.gii", 10)):
        expected = nibabel.load(SHIPPED / name)
        mesh = mesh_files.read(str(SHIPPED / name)).mesh
        assert (
            np.array_equal(mesh.points, expected.agg_data("pointset").astype(float))
            and mesh.sizes.size == count
        )
    with pytest.raises(InputError, match="another file"):
        mesh_files.read(str(SHIPPED / "external.gii")).mesh.points.sum()
    with pytest.raises(InputError, match="--overlay"):
        mesh_files.read(str(SHIPPED / "rh.shape.curv.gii"))


@pytest.mark.slow
def test_a_patch_has_the_triangles_of_its_surface(folder):
    points, faces = folded()
    in_patch = np.flatnonzero(points[:, 0] < 30)
    numbers = np.where(points[in_patch, 0] > 26, -1, 1) * (in_patch + 1)
    for name, places in (("lh.cut.patch.3d", 7 * points), ("lh.cut.patch.flat", points * [1, 1, 0])):
        rows = b"".join(struct.pack(">i3f", number, *places[k]) for number, k in zip(numbers, in_patch))
        Path(name).write_bytes(struct.pack(">ii", -1, in_patch.size) + rows)
        mesh = mesh_files.read(name).mesh
        assert np.array_equal(mesh.corners.reshape(-1, 3), faces[(points[faces, 0] < 30).all(axis=1)])
        shape = points if name.endswith("3d") else points * [1, 1, 0]
        assert np.allclose(mesh.points[in_patch], shape[in_patch], atol=1e-5)
    Path("rh.cut.patch.3d").write_bytes(Path("lh.cut.patch.3d").read_bytes())
    with pytest.raises(InputError, match=r"rh\.white"):
        mesh_files.read("rh.cut.patch.3d")


@pytest.mark.slow
def test_a_picture_shows_the_overlay_at_its_flattened_place(folder, iccm):
    result = iccm(
        "flatten", "a.surf.gii", "--overlay", "lh.curv", "-o", "a.tif", "-o", "a.png", "-o", "flat.obj"
    )
    assert result.code == 0, result.err
    points, faces = folded()
    lines = [line.split() for line in Path("flat.obj").read_text().splitlines()]
    flat = np.array([words[1:3] for words in lines if words[0] == "v"], float)
    triangles = np.array([words[1:] for words in lines if words[0] == "f"], int) - 1
    picture = np.asarray(Image.open("a.tif"))
    assert max(picture.shape) == 1024
    low, high = flat.min(axis=0), flat.max(axis=0)
    pixel = max(high - low) * 1.02 / 1024
    middle = flat[triangles].mean(axis=1)
    column, row = (middle[:, 0] - (low + high)[0] / 2) / pixel, ((low + high)[1] / 2 - middle[:, 1]) / pixel
    positions = picture[(picture.shape[0] / 2 + row).astype(int), (picture.shape[1] / 2 + column).astype(int)]
    assert np.abs(positions - points[faces, 0].mean(axis=1)).max() < 0.2  # a pixel is 0.05 wide
    assert np.isnan(picture[0, 0])
    colours = np.asarray(Image.open("a.png"))
    assert colours.shape[2] == 4 and colours[0, 0, 3] == 0 and (colours[..., 3] == 255).mean() > 0.4


@pytest.mark.slow
def test_overlays_of_every_kind_have_the_same_values(folder):
    count = 20
    values = np.linspace(-3, 8, count).astype(np.float32)
    write_gifti("v.shape.gii", ("NIFTI_INTENT_SHAPE", values))
    np.savetxt("v.txt", values)
    nibabel.MGHImage(values.reshape(count, 1, 1), np.eye(4)).to_filename("v.mgz")
    freesurfer.write_morph_data("lh.thickness", values)
    for name in ("v.shape.gii", "v.txt", "v.mgz", "lh.thickness"):
        assert np.allclose(overlays.read(name, count).values, values, atol=1e-6), name
        with pytest.raises(InputError, match="vertices"):
            overlays.read(name, count + 1)
    curvature = overlays.read(SHIPPED / "rh.shape.curv.gii", 133764)
    assert np.array_equal(
        curvature.values, nibabel.load(SHIPPED / "rh.shape.curv.gii").darrays[0].data.ravel()
    )


@pytest.mark.slow
def test_labels_have_their_colours_and_no_others(folder, iccm):
    keys = (folded()[0][:, 1] > 7).astype(np.int32)
    table = np.array([[200, 10, 30, 0, 0], [20, 40, 220, 0, 1]])
    freesurfer.write_annot("lh.two.annot", keys, table, ["red", "blue"], fill_ctab=True)
    assert iccm("flatten", "lh.white", "--overlay", "lh.two.annot", "-o", "labels.png").code == 0
    pixels = np.asarray(Image.open("labels.png"))
    colours, counts = np.unique(pixels[pixels[..., 3] == 255][:, :3], axis=0, return_counts=True)
    assert {tuple(c) for c in colours[np.argsort(counts)[-2:]]} == {(200, 10, 30), (20, 40, 220)}
    assert np.sort(counts)[-2:].sum() > 0.98 * counts.sum()  # the others are mixed at edges


@pytest.mark.slow
def test_a_closed_surface_is_cut_open(tmp_path, monkeypatch, iccm):
    monkeypatch.chdir(tmp_path)
    ball = trimesh.creation.icosphere(subdivisions=3)  # as many vertices as nibabel's functional data have
    write_gifti(
        "ball.gii",
        ("NIFTI_INTENT_POINTSET", ball.vertices * [1, 2, 3]),
        ("NIFTI_INTENT_TRIANGLE", ball.faces),
    )
    result = iccm("flatten", "ball.gii", "--overlay", str(SHIPPED / "task.func.gii"), "-o", "ball.png")
    assert result.code == 0 and "cut open" in result.err, result.err


@pytest.mark.slow
def test_other_files_than_surfaces_and_overlays_are_refused(folder, iccm):
    Path("rh.broken").write_bytes(b"\xff\xff\xfecreated\n\n" + struct.pack(">ii", 5, 1 << 30))
    Path("junk.gii").write_text("<GIFTI>")
    Path("lh.bad").write_bytes(b"\xff\xff\xff\0\0")
    for arguments in (
        ("rh.broken", "-o", "no.svg"),
        ("junk.gii", "-o", "no.svg"),
        ("lh.white", "--overlay", "lh.bad", "-o", "no.png"),
        ("lh.white", "--overlay", "missing.gii", "-o", "no.png"),
        ("lh.white", "-o", "no.png"),
        ("lh.white", "--overlay", "lh.curv", "-o", "no.svg"),
        ("lh.white", "--overlay", "lh.curv", "-o", "no.png", "--colormap", "nonsense"),
    ):
        result = iccm("flatten", *arguments)
        assert result.code == 2 and result.err and "Traceback" not in result.err, (arguments, result.err)
    assert not list(folder.glob("no.*"))


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("lh.big", b"\xff\xff\xff" + struct.pack(">iii", 1 << 30, 1, 1) + bytes(40)),
        ("lh.old", b"\x0f\x00\x00\x00\x00\x01" + bytes(40)),
        ("lh.big.annot", struct.pack(">i", 1 << 30) + bytes(40)),
        ("lh.none.annot", struct.pack(">i", -5) + bytes(40)),
        ("lh.big.mgh", struct.pack(">6i", 1, 1 << 14, 1 << 14, 1 << 14, 1, 3) + bytes(300)),
        ("lh.big.mgz", gzip.compress(struct.pack(">6i", 1, 1 << 14, 1 << 14, 1 << 14, 1, 3) + bytes(300))),
        ("lh.short.mgh", b"\0\0"),
    ],
    ids=["big", "old", "annot", "none", "mgh", "mgz", "short"],
)
def test_headers_are_checked_before_values_are_read(tmp_path, monkeypatch, name, content):
    """A header of a few bytes can promise gigabytes, for which readers allocate memory."""
    path = tmp_path / name
    path.write_bytes(content)
    monkeypatch.setattr(process, "read", None)
    with pytest.raises(InputError, match=r"promises more|no values|too short"):
        overlays.read(path, 1 << 30)


def test_volumes_of_one_hemisphere_are_overlays(tmp_path):
    """As FreeSurfer names them, like its surfaces: lh.thickness.mgh."""
    import nibabel

    path = tmp_path / "lh.thickness.mgh"
    nibabel.save(nibabel.MGHImage(np.arange(5, dtype=np.float32).reshape(5, 1, 1), np.eye(4)), path)
    assert np.array_equal(overlays.read(path, 5).values, np.arange(5))


FACES = {
    "a.gii": b'<GIFTI><DataArray Dim0="3" Intent="NIFTI_INTENT_POINTSET"/>'
    b'<DataArray Intent="NIFTI_INTENT_TRIANGLE" Dim0="71" Dim1="3">',
    "a.gii.gz": gzip.compress(b'<DataArray Dim0="71" Intent="NIFTI_INTENT_TRIANGLE">'),
    "lh.white": b"\xff\xff\xfecreated by somebody\n\n" + struct.pack(">ii", 3, 71) + bytes(12 * 74),
}


@pytest.mark.parametrize("name", FACES)
def test_faces_are_counted_without_reading_the_mesh(tmp_path, name):
    (tmp_path / name).write_bytes(FACES[name])
    check_71_faces_are_counted(tmp_path / name)


def test_arrays_have_no_names(folder):
    write_gifti("v.shape.gii", ("NIFTI_INTENT_SHAPE", np.arange(5.0)))
    for name in ("v.shape.gii#height", "lh.curv#height"):
        with pytest.raises(InputError, match="have no names"):
            overlays.read(name, 5)
