"""Pins from two files of points, in the formats of the programs that place them."""

import io
import json
import sys
import zipfile

import numpy as np
import pytest
import roifile

import iccm as core
from iccm.errors import InputError
from iccm.io.geometry import document
from iccm.io.geometry import rois as regions
from iccm.io.run import point_files
from iccm.io.shapes import shape

SOURCE, TARGET = [(12.5, 30.0), (50.0, 60.25), (70.0, 21.0)], [(20.0, 40.5), (70.0, 65.0), (81.5, 33.0)]
HEIGHT = 100
NAMES = "eye", "nose", "ear"


def text_of(form, points):
    """The content of a file with some points, as a program writes it."""
    rows = list(zip(NAMES, points))
    if form == "table.csv":
        return "name,x,y\n" + "".join(f"{name},{x},{y}\n" for name, (x, y) in rows)
    if form == "results.csv":  # ImageJ, Analyze > Measure
        return " ,Area,X,Y\n" + "".join(f"{k},0,{x},{y}\n" for k, (_, (x, y)) in enumerate(rows, 1))
    if form == "napari.csv":
        return "index,axis-0,axis-1\n" + "".join(f"{k},{y},{x}\n" for k, (_, (x, y)) in enumerate(rows))
    if form == "stack.csv":
        return "index,axis-0,axis-1,axis-2\n" + "".join(
            f"{k},7,{y},{x}\n" for k, (_, (x, y)) in enumerate(rows)
        )
    if form == "one.tps":
        return f"LM={len(rows)}\n" + "".join(f"{x} {HEIGHT - y}\n" for _, (x, y) in rows) + "ID=0\n"
    if form == "labelme.json":
        shapes = [{"label": name, "shape_type": "point", "points": [[x, y]]} for name, (x, y) in rows]
        return json.dumps({"imageWidth": 90, "imageHeight": HEIGHT, "shapes": shapes})
    if form == "named.json":
        return json.dumps({name: {"x": x, "y": y} for name, (x, y) in rows})
    if form == "input.pts":
        return f"point\n{len(rows)}\n" + "".join(f"{x} {y}\n" for _, (x, y) in rows)
    assert form == "output.pts"  # of transformix
    return "".join(
        f"Point\t{k}\t; InputIndex = [ 1 2 ]\t; InputPoint = [ 1.0 2.0 ]\t; OutputIndexFixed = [ 3 4 ]\t"
        f"; OutputPoint = [ {x} {y} ]\t; Deformation = [ 0.5 0.5 ]\n"
        for k, (_, (x, y)) in enumerate(rows)
    )


TEXTS = (
    "table.csv", "results.csv", "napari.csv", "stack.csv", "one.tps", "labelme.json", "named.json", "input.pts",
    "output.pts",
)  # fmt: skip


def write(path, points):
    """Write points into a file by the name of its form."""
    if path.name == "multi.roi":
        roi = roifile.ImagejRoi.frompoints(np.array(points))
        roi.roitype = roifile.ROI_TYPE.POINT
        path.write_bytes(roi.tobytes())
    elif path.name == "manager.zip":
        written = []
        for name, point in zip(NAMES, points):
            written.append(roifile.ImagejRoi.frompoints(np.array([point]), name=name))
            written[-1].roitype = roifile.ROI_TYPE.POINT
        roifile.roiwrite(path, written)
    else:
        path.write_text(text_of(path.name, points))


@pytest.fixture
def pair(tmp_path):
    """Two drawings of the same height, with y down."""
    text = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 90 100"><path d="{}"/></svg>'
    for name, d in (("a", "M5 5H85V95H5Z"), ("b", "M2 8H88L80 90H10Z")):
        (tmp_path / f"{name}.svg").write_text(text.format(d))
    return shape.read(str(tmp_path / "a.svg")), shape.read(str(tmp_path / "b.svg"))


@pytest.mark.parametrize("form", [*TEXTS, "multi.roi", "manager.zip"])
def test_points_of_other_programs_are_pins_in_the_units_of_the_files(tmp_path, pair, form):
    for side, points in (("source", SOURCE), ("target", TARGET)):
        (tmp_path / side).mkdir()
        write(tmp_path / side / form, points)
    read = point_files.read_pairs(str(tmp_path / "source" / form), str(tmp_path / "target" / form))
    pairs = read.in_file_units(*pair)
    assert np.allclose([a for _, a, _ in pairs], SOURCE) and np.allclose([b for _, _, b in pairs], TARGET)
    named = form in ("table.csv", "labelme.json", "named.json", "manager.zip")
    assert [name for name, _, _ in pairs] == (
        list(NAMES) if named else ["1", "2", "3"] if "tps" in form else [""] * 3
    )


def test_names_pair_points_in_any_order_and_format(tmp_path, pair):
    write(tmp_path / "labelme.json", SOURCE)
    lines = text_of("table.csv", TARGET).splitlines()
    (tmp_path / "t.csv").write_text("\n".join([lines[0], *reversed(lines[1:])]) + "\n")
    pairs = point_files.read_pairs(str(tmp_path / "labelme.json"), str(tmp_path / "t.csv"))
    assert pairs.source == SOURCE and pairs.target == TARGET and pairs.names == list(NAMES)


def test_missing_landmarks_are_omitted(tmp_path):
    (tmp_path / "a.tps").write_text("LM=3\n1 2\nNA NA\n5 6\n")
    (tmp_path / "b.tps").write_text("LM=3\n1 9\n3 4\n8 6\n")
    pairs = point_files.read_pairs(str(tmp_path / "a.tps"), str(tmp_path / "b.tps"))
    assert pairs.source == [(1, 2), (5, 6)] and pairs.target == [(1, 9), (8, 6)]


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("name,x,y\neye,1,2\nnose,3,4\n", ["t.csv", "ear"]),
        ("name,x,y\neye,1,2\nnose,3,4\near,5,6\ntail,7,8\n", ["table.csv", "tail"]),
        ("x,y\n1,2\n3,4\n", ["t.csv", "2 points", "3"]),
    ],
)
def test_points_without_a_partner_are_refused(tmp_path, content, words):
    write(tmp_path / "table.csv", SOURCE)
    (tmp_path / "t.csv").write_text(content)
    with pytest.raises(InputError) as error:
        point_files.read_pairs(str(tmp_path / "table.csv"), str(tmp_path / "t.csv"))
    assert all(word in str(error.value) for word in words)


@pytest.mark.parametrize(
    ("name", "data"),
    [
        ("a.pts", b"point\n3\n1 2\n3 4\n"),
        ("a.pts", b"point\n1\n1 2 3\n"),
        ("a.pts", b"1 2\n3 4\n"),
        ("a.pts", b"point\n1\n1 nan\n"),
        ("a.pts", b"point\n" + b"9" * 5000 + b"\n1 2\n"),
        ("a.tps", b"LM=" + b"9" * 5000 + b"\n1 2\n"),
        ("a.roi", b"Iout" + bytes(20)),
        ("a.roi", b"Iout" + bytes([255]) * 100),
        ("a.zip", b"PK\x03\x04" + bytes(40)),
        ("a.zip", b""),
        ("a.json", b'{"shapes": [{"shape_type": "point", "points": [["x", 1]]}]}'),
    ],
)
def test_damaged_files_are_refused(tmp_path, name, data):
    (tmp_path / name).write_bytes(data)
    with pytest.raises(InputError) as error:
        point_files.read_pairs(str(tmp_path / name), str(tmp_path / name))
    assert name in str(error.value)


@pytest.mark.slow
def test_many_names_are_compared_in_little_time(tmp_path):
    rows = "".join(f"p{number},{number % 97},{number % 31}\n" for number in range(100_000))
    for name in ("a.csv", "b.csv"):
        (tmp_path / name).write_text("name,x,y\n" + rows)
    with pytest.raises(InputError, match=r"more than \d+ points"):
        point_files.read_pairs(str(tmp_path / "a.csv"), str(tmp_path / "b.csv"))


def archive(**rois):
    """The bytes of an archive of regions."""
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as archive_file:
        for name, roi in rois.items():
            archive_file.writestr(f"{name}.roi", roi.tobytes())
    return file.getvalue()


def test_regions_are_not_written_outside_of_their_archive(tmp_path):
    names = {"a": "../../evil", "b": "C:\\evil", "c": "x" * 70_000}
    rois = {key: roifile.ImagejRoi.frompoints(np.array(SOURCE), name=name) for key, name in names.items()}
    (tmp_path / "a.zip").write_bytes(archive(**rois))
    read = document.read(str(tmp_path / "a.zip"))
    geometry = read.geometry
    images = document.Images(
        geometry.points, [[line] for line in geometry.lines], [[z] for z in geometry.polygons]
    )
    with zipfile.ZipFile(io.BytesIO(read.encode(images))) as archive_file:
        assert len(archive_file.namelist()) == 3
        for name in archive_file.namelist():
            assert not set("/\\:") & set(name) and len(name) < 255


def test_regions_without_positions_of_their_own_are_refused_or_written(tmp_path):
    """A region with counters but none of its points, which roifile cannot name."""
    roi = roifile.ImagejRoi.frompoints(np.array(SOURCE))
    roi.name, roi.counter_positions = "", np.empty(0, int)
    read = regions.Rois([(roi, "polygon", 1)], True, document.Geometry(polygons=[[np.array([1, 5, 5j])]]))
    with pytest.raises(InputError):
        read.encode(document.Images(np.empty(0), [], [[[np.array([1, 5, 5j])]]]))


def test_the_extra_is_named_where_it_is_missing(tmp_path, monkeypatch):
    write(tmp_path / "multi.roi", SOURCE)
    monkeypatch.setitem(sys.modules, "roifile", None)
    with pytest.raises(InputError) as error:
        point_files.read_pairs(str(tmp_path / "multi.roi"), str(tmp_path / "multi.roi"))
    assert "iccm[imagej]" in str(error.value)


def test_the_command_pins_landmarks(tmp_path, pair, iccm, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write(tmp_path / "multi.roi", SOURCE)
    write(tmp_path / "table.csv", TARGET)
    arguments = "a.svg", "b.svg", "--exact-pins", "--source-landmarks", "multi.roi"
    result = iccm("map", *arguments, "--target-landmarks", "table.csv", "-o", "map.npz")
    assert result.code == 0, result.err
    images = core.load("map.npz").map(np.array(SOURCE) @ [1, -1j])  # y up, where the files have it down
    assert np.abs(images - np.array(TARGET) @ [1, -1j]).max() < 1e-6
    result = iccm("map", *arguments, "-o", "other.npz")
    assert result.code == 2 and "--target-landmarks" in result.err
