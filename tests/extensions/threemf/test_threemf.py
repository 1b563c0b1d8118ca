"""3MF packages: objects at the places that the build gives them, and packages that are not read."""

import zipfile

import numpy as np
import pytest

from iccm.errors import InputError
from iccm.io.meshes import mesh_files
from tests.damaged_archives import DAMAGED_AT, check_damaged_archive
from tests.mesh_faces import check_71_faces_are_counted

pytest.importorskip("lxml", reason="lxml belongs to an extra")
pytest.importorskip("networkx", reason="networkx belongs to an extra")

CORE = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"
POINTS = np.array([(0, 0, 0), (7, 0, 1), (0, 4, 0), (7, 4, 2)], float)
FACES = [(0, 1, 2), (1, 3, 2)]
MESH = (
    "<mesh><vertices>"
    + "".join(f'<vertex x="{x}" y="{y}" z="{z}"/>' for x, y, z in POINTS)
    + "</vertices><triangles>"
    + "".join(f'<triangle v1="{a}" v2="{b}" v3="{c}"/>' for a, b, c in FACES)
    + "</triangles></mesh>"
)
# a quarter turn about the axis z, row by row, and a move
QUARTER = "0 1 0 -1 0 0 0 0 1 10 20 30"


def package(name, resources, build):
    """Write a package with one model."""
    model = (
        f'<?xml version="1.0" encoding="UTF-8"?><model unit="millimeter" xmlns="{CORE}">'
        f"<resources>{resources}</resources><build>{build}</build></model>"
    )
    with zipfile.ZipFile(name, "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr("3D/3dmodel.model", model)


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def test_objects_are_read_at_their_places():
    package(
        "two.3mf",
        f'<object id="1" name="flag">{MESH}</object>'
        '<object id="2"><components><component objectid="1" transform="2 0 0 0 2 0 0 0 2 0 0 0"/></components>'
        "</object>",
        f'<item objectid="1"/><item objectid="2" transform="{QUARTER}"/>',
    )
    opened = mesh_files.open_mesh(mesh_files.Path("two.3mf"))
    places = [opened.pick(name).mesh.points for name in opened.names]
    assert len(places) == 2 and np.allclose(places[0], POINTS)
    x, y, z = 2 * POINTS.T
    assert np.allclose(places[1], np.stack([10 - y, 20 + x, 30 + z], axis=1))


def test_triangles_are_counted_whatever_the_prefix_of_their_names():
    model = f'<c:model xmlns:c="{CORE}"><c:triangles><c:triangle v1="0"/><c:triangle\nv1="1"/></c:triangles></c:model>'
    with zipfile.ZipFile("a.3mf", "w") as file:
        file.writestr("3D/3dmodel.model", model)
    assert mesh_files.open_mesh(mesh_files.Path("a.3mf")).count_faces(9) == 2


def test_flattening_covers_all_objects(iccm):
    package(
        "two.3mf",
        f'<object id="1">{MESH}</object><object id="2">{MESH}</object>',
        f'<item objectid="1"/><item objectid="2" transform="{QUARTER}"/>',
    )
    result = iccm("flatten", "two.3mf", "--uv", "out.obj")
    assert result.code == 0, result.err
    assert mesh_files.read("out.obj").mesh.sizes.size == 4


def test_components_without_end_are_refused():
    item = '<item objectid="1"/>'
    package("self.3mf", '<object id="1"><components><component objectid="1"/></components></object>', item)
    doubling = "".join(
        f'<object id="{k}"><components>{f"<component objectid={chr(34)}{k + 1}{chr(34)}/>" * 2}</components></object>'
        for k in range(1, 40)
    )
    package("many.3mf", f'{doubling}<object id="40">{MESH}</object>', item)
    for name, reason in (("self.3mf", "contains itself"), ("many.3mf", "copies")):
        with pytest.raises(InputError, match=reason):
            mesh_files.read(name)


def test_triangles_count_as_often_as_they_are_placed():
    pair = '<components><component objectid="1"/><component objectid="1"/></components>'
    objects = f'<object id="1">{MESH}</object><object id="2">{pair}</object>'
    package("copies.3mf", objects, '<item objectid="1"/>' + 3 * '<item objectid="2"/>')
    placed = 2 + 3 * 2 * 2
    mesh_files.check_size(mesh_files.Path("copies.3mf"), placed)
    with pytest.raises(InputError, match=f"has {placed} faces, more than the limit of {placed - 1}"):
        mesh_files.check_size(mesh_files.Path("copies.3mf"), placed - 1)


def test_bad_packages_are_refused_in_one_line(iccm):
    package("none.3mf", f'<object id="1">{MESH}</object>', '<item objectid="9"/>')
    mesh_files.Path("junk.3mf").write_bytes(b"PK\3\4junk")
    with zipfile.ZipFile("other.3mf", "w") as file:
        file.writestr("word/document.xml", "<a/>")
    for name in ("none.3mf", "junk.3mf", "other.3mf"):
        result = iccm("flatten", name, "-o", "no.svg")
        assert result.code == 2 and name in result.err and len(result.err.splitlines()) == 1, result.err


def test_entities_are_not_expanded(tmp_path):
    secret = tmp_path / "secret.txt"
    secret.write_text("0")
    model = f'<!DOCTYPE m [<!ENTITY x SYSTEM "{secret.as_uri()}">]><model xmlns="{CORE}"><resources><object id="1">'
    model += MESH.replace('x="7"', 'x="7"').replace("<mesh>", "<mesh>&x;") + "</object></resources>"
    model += '<build><item objectid="1"/></build></model>'
    with zipfile.ZipFile("a.3mf", "w") as file:
        file.writestr("3D/3dmodel.model", model)
    try:
        mesh = mesh_files.read("a.3mf").mesh
    except InputError:
        return
    assert np.allclose(mesh.points, POINTS)


def test_faces_are_counted_without_reading_the_mesh(tmp_path):
    triangles = '<triangle v1="0" v2="1" v3="2"/>' * 71
    package("a.3mf", f'<object id="1"><mesh><triangles>{triangles}</triangles></mesh></object>', "")
    check_71_faces_are_counted(tmp_path / "a.3mf")


def test_the_unit_is_that_of_the_package():
    package("box.3mf", f'<object id="1">{MESH}</object>', '<item objectid="1"/>')
    assert mesh_files.open_mesh(mesh_files.Path("box.3mf")).millimetres() == 1.0


@pytest.mark.parametrize("option", ["-o", "--uv"])
def test_packages_are_not_written(iccm, option):
    package("box.3mf", f'<object id="1">{MESH}</object>', '<item objectid="1"/>')
    result = iccm("flatten", "box.3mf", option, "out.3mf")
    assert result.code == 2 and "does not write them" in result.lines[-1]


@pytest.mark.parametrize("where", DAMAGED_AT)
def test_damaged_packages_are_refused_in_one_line(shapes, iccm, where):
    package("a.3mf", f'<object id="1">{MESH}</object>', '<item objectid="1"/>')
    check_damaged_archive(iccm, shapes / "a.3mf", where)
