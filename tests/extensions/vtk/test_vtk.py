"""VTK files that the package vtk writes and reads."""

import numpy as np
import pytest
from PIL import Image

from iccm.errors import InputError
from iccm.io import formats
from iccm.io.meshes import mesh_files
from tests.mesh_faces import check_71_faces_are_counted, check_written_faces_are_counted

pytest.importorskip("vtkmodules", reason="vtk is an extra")
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkPoints
from vtkmodules.vtkCommonDataModel import VTK_TETRA, vtkCellArray, vtkPolyData, vtkUnstructuredGrid
from vtkmodules.vtkIOLegacy import vtkPolyDataReader, vtkPolyDataWriter, vtkUnstructuredGridWriter
from vtkmodules.vtkIOXML import (
    vtkXMLPolyDataReader,
    vtkXMLPolyDataWriter,
    vtkXMLUnstructuredGridWriter,
)

pytestmark = pytest.mark.large
POINTS = np.array([(0, 0, 0), (4, 0, 1), (4, 3, 1), (0, 3, 0), (9, 0, 0), (9, 3, 0)], float)
COUNTS, CORNERS = [4, 3, 3], [0, 1, 2, 3, 1, 4, 5, 1, 5, 2]
UV = np.array([(0, 0), (0.4, 0), (0.4, 0.3), (0, 0.3), (0.9, 0), (0.9, 0.3)])
READERS = {".vtp": vtkXMLPolyDataReader, ".vtk": vtkPolyDataReader}


def points_of(positions):
    points = vtkPoints()
    points.SetData(numpy_to_vtk(positions, deep=True))
    return points


def sheet():
    """A quad and two triangles with coordinates at their points."""
    surface, cells = vtkPolyData(), vtkCellArray()
    surface.SetPoints(points_of(POINTS))
    for end, count in zip(np.cumsum(COUNTS), COUNTS):
        cells.InsertNextCell(count, CORNERS[end - count : end])
    surface.SetPolys(cells)
    surface.GetPointData().SetTCoords(numpy_to_vtk(UV, deep=True))
    return surface


def save(writer, content, name):
    writer.SetInputData(content)
    writer.SetFileName(name)
    assert writer.Write()


@pytest.fixture(params=["ascii.vtp", "binary.vtp", "appended.vtp", "ascii.vtk", "binary.vtk", "old.vtk"])
def file(request, tmp_path, monkeypatch):
    """The sheet in each form of file."""
    monkeypatch.chdir(tmp_path)
    form, _, suffix = request.param.partition(".")
    writer = vtkXMLPolyDataWriter() if suffix == "vtp" else vtkPolyDataWriter()
    if suffix == "vtp":
        writer.SetDataMode(["ascii", "binary", "appended"].index(form))
    else:
        writer.SetFileType(1 if form == "ascii" else 2)
        writer.SetFileVersion(42 if form == "old" else 51)
    save(writer, sheet(), request.param)
    return request.param


def test_a_surface_is_read_with_its_coordinates(file):
    mesh = mesh_files.read(file).mesh
    assert np.allclose(mesh.points, POINTS)
    assert mesh.sizes.tolist() == COUNTS and mesh.corners.tolist() == CORNERS
    assert np.allclose(mesh.uv[mesh.uv_corners], UV[CORNERS])
    mesh_files.check_size(mesh_files.Path(file), 3)
    with pytest.raises(InputError, match="3 faces"):
        mesh_files.check_size(mesh_files.Path(file), 2)


@pytest.mark.parametrize("suffix", READERS)
def test_coordinates_are_written_so_that_vtk_reads_them(file, suffix, iccm):
    for name in (f"out{suffix}", "out.ply"):
        result = iccm("flatten", file, "--uv", name)
        assert result.code == 0, result.err
    reader = READERS[suffix]()
    reader.SetFileName(f"out{suffix}")
    reader.Update()
    surface = reader.GetOutput()
    corners = vtk_to_numpy(surface.GetPolys().GetConnectivityArray())
    assert np.diff(vtk_to_numpy(surface.GetPolys().GetOffsetsArray())).tolist() == COUNTS
    assert np.allclose(vtk_to_numpy(surface.GetPoints().GetData())[corners], POINTS[CORNERS])
    mesh = mesh_files.read("out.ply").mesh  # another format, by other code
    coordinates = vtk_to_numpy(surface.GetPointData().GetTCoords())[corners]
    assert np.allclose(coordinates, mesh.uv[mesh.uv_corners], atol=1e-6)
    assert np.ptp(coordinates, axis=0).min() > 0.1


def test_vertices_are_split_where_charts_end(file, iccm):
    done = iccm("flatten", "box.obj", "--uv", "box.vtp") if make_box() else None
    assert done is not None and done.code == 0, done.err
    reader = vtkXMLPolyDataReader()
    reader.SetFileName("box.vtp")
    reader.Update()
    assert reader.GetOutput().GetNumberOfPolys() == 6 and reader.GetOutput().GetNumberOfPoints() > 8
    again = iccm("flatten", "box.vtp", "--uv", "again.vtp")  # the seams are closed when it is read again
    assert again.code == 0, again.err


def make_box():
    """A closed box of six quads of three sizes."""
    corners = [f"v {x} {y} {z}\n" for z in (0, 4) for y in (0, 2) for x in (0, 3)]
    quads = "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n"
    with open("box.obj", "w") as file:
        return file.write("".join(corners) + quads)


def test_strips_become_triangles(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    surface, strips = vtkPolyData(), vtkCellArray()
    surface.SetPoints(points_of(POINTS))
    strips.InsertNextCell(6, [3, 0, 2, 1, 5, 4])
    surface.SetStrips(strips)
    save(vtkXMLPolyDataWriter(), surface, "strip.vtp")
    mesh = mesh_files.read("strip.vtp").mesh
    assert mesh.sizes.tolist() == [3] * 4
    normals = np.cross(*np.diff(mesh.points[mesh.corners.reshape(-1, 3)], axis=1).swapaxes(0, 1))
    assert (normals[:, 2] > 0).all()  # all on the same side


@pytest.mark.parametrize("suffix", [".vtu", ".vtk"])
def test_the_surface_of_a_volume_is_read(tmp_path, monkeypatch, suffix):
    monkeypatch.chdir(tmp_path)
    grid = vtkUnstructuredGrid()
    grid.SetPoints(points_of(np.array([(0, 0, 0), (3, 0, 0), (0, 2, 0), (0, 0, 5), (4, 4, 4)], float)))
    for cell in ([0, 1, 2, 3], [1, 2, 3, 4]):
        grid.InsertNextCell(VTK_TETRA, 4, cell)
    save(
        vtkXMLUnstructuredGridWriter() if suffix == ".vtu" else vtkUnstructuredGridWriter(),
        grid,
        f"a{suffix}",
    )
    surface = mesh_files.read(f"a{suffix}")
    assert surface.mesh.sizes.tolist() == [3] * 6 and "surface" in surface.notes[0]


def test_bad_files_are_refused_in_one_line(tmp_path, monkeypatch, iccm):
    monkeypatch.chdir(tmp_path)
    save(vtkXMLPolyDataWriter(), sheet(), "whole.vtp")
    whole = mesh_files.Path("whole.vtp").read_bytes()
    contents = {
        "empty.vtp": b"",
        "cut.vtp": whole[: len(whole) // 2],
        "junk.vtk": b"# vtk DataFile Version 4.2\njunk\nASCII\nDATASET NOTHING\n",
        "many.vtp": whole.replace(b'NumberOfPoints="6"', b'NumberOfPoints="600000000000"'),
    }
    for name, content in contents.items():
        mesh_files.Path(name).write_bytes(content)
        result = iccm("flatten", name, "-o", "no.svg")
        assert result.code == 2 and name in result.err and len(result.err.splitlines()) == 1
    assert not mesh_files.Path("no.svg").exists()


def test_numbers_at_points_are_shown_in_the_flattening(tmp_path, monkeypatch, iccm):
    monkeypatch.chdir(tmp_path)
    surface = sheet()
    for name, values in (("height", POINTS[:, 2]), ("place", 2 * POINTS[:, 0] - 3)):
        array = numpy_to_vtk(values, deep=True)
        array.SetName(name)
        surface.GetPointData().AddArray(array)
    save(vtkXMLPolyDataWriter(), surface, "part.vtp")
    result = iccm("flatten", "part.vtp", "--overlay", "part.vtp#place", "-o", "place.tif")
    assert result.code == 0, result.err
    pixels = np.asarray(Image.open("place.tif"))
    low, high = np.nanmin(pixels), np.nanmax(pixels)
    assert -3 <= low < -2.5 and 14.5 < high <= 15
    unnamed = iccm("flatten", "part.vtp", "--overlay", "part.vtp", "-o", "no.tif")
    assert unnamed.code == 2 and "#height" in unnamed.err and "#place" in unnamed.err
    missing = iccm("flatten", "part.vtp", "--overlay", "part.vtp#heat", "-o", "no.tif")
    assert missing.code == 2 and "heat" in missing.err
    surface.GetPointData().SetActiveScalars("height")
    save(vtkXMLPolyDataWriter(), surface, "active.vtp")
    result = iccm("flatten", "part.vtp", "--overlay", "active.vtp", "-o", "height.tif")
    assert result.code == 0 and np.nanmax(np.asarray(Image.open("height.tif"))) <= 1


@pytest.mark.parametrize(
    ("name", "text"),
    [
        (
            "wide.vtp",
            '<VTKFile type="PolyData"><PolyData><Piece NumberOfPoints="5" NumberOfPolys="1"><Points>'
            '<DataArray type="Float32" NumberOfComponents="4294967295" format="binary">AAAA</DataArray>'
            "</Points></Piece></PolyData></VTKFile>",
        ),
        (
            "wide.vtk",
            "# vtk DataFile Version 3.0\nx\nASCII\nDATASET POLYDATA\nPOINTS 1 float\n0 0 0\nPOINT_DATA 1\n"
            "FIELD f 1\na 1000000 1000000 double\n1\n",
        ),
    ],
)
def test_sizes_of_arrays_are_checked_before_vtk_reads_them(tmp_path, monkeypatch, name, text):
    from iccm.io.isolated import process

    (tmp_path / name).write_text(text)
    monkeypatch.setattr(process, "read", None)
    with pytest.raises(InputError, match="promises more numbers"):
        mesh_files.open_mesh(tmp_path / name).count_faces(-1)


@pytest.mark.parametrize("suffix", [".vtk", ".vtp"])
def test_faces_of_written_files_are_counted(tmp_path, suffix):
    check_written_faces_are_counted(tmp_path / f"strip{suffix}")


FACES = {
    "a.vtk": b"# vtk DataFile Version 5.1\na\nASCII\nDATASET POLYDATA\nPOINTS 3 float\nPOLYGONS 72 213\n",
    "a.vtp": b'<VTKFile type="PolyData"><PolyData><Piece NumberOfPoints="3" NumberOfPolys="70" NumberOfStrips="1">',
    "a.vtu": b'<VTKFile type="UnstructuredGrid"><UnstructuredGrid><Piece NumberOfPoints="3" NumberOfCells="71">',
}


@pytest.mark.parametrize("name", FACES)
def test_faces_are_counted_without_reading_the_mesh(tmp_path, name):
    (tmp_path / name).write_bytes(FACES[name])
    check_71_faces_are_counted(tmp_path / name)


@pytest.mark.parametrize("name", ["lh.white.vtk", "LH.PIAL.VTK"])
def test_a_surface_of_a_brain_may_be_a_vtk_file(name):
    assert formats.suffix_of(name) == ".vtk" and formats.of(name).uv
