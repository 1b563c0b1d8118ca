"""Two meshes in the same place: cut along the same seam, and `drifted` if the map still moves points far."""

import json

import igl
import numpy as np
import pytest
import trimesh

from iccm import fit
from iccm.errors import InputError
from iccm.flattening import flatten
from iccm.io.shapes import mesh_reading
from iccm.meshes.disk_patch import open_piece, sound_piece
from iccm.meshes.locate import barycentric
from iccm.meshes.mesh import Mesh
from iccm.status import Status
from iccm.surfaces.coincident import map_by_nearest_points, twin_of


def bent(mesh):
    mesh.vertices *= (1, 1.6, 0.7)
    mesh.vertices[:, 0] += 0.2 * np.sin(3 * mesh.vertices[:, 1])
    return mesh


@pytest.fixture
def eggs(shapes, iccm):
    """Two closed meshes of one surface with different triangles; the first has texture coordinates."""
    bent(trimesh.creation.icosphere(2)).export("ball.obj")
    bent(trimesh.creation.uv_sphere(count=[16, 28])).export("globe.obj")
    assert iccm("flatten", "ball.obj", "--uv", "egg.obj").code == 0
    return "egg.obj", "globe.obj"


@pytest.mark.slow
def test_meshes_in_the_same_place_are_cut_along_the_same_seam(eggs, shapes, iccm):
    result = iccm("map", *eggs, "-o", "o.obj", "--report", "r.json")
    assert result.code == 0, result.err
    assert "same seam" in result.err and "--pin" in result.err
    data = json.loads((shapes / "r.json").read_text())
    assert data["status"] == "reached" and data["apart"]["p95"] < 0.03


def pear(halvings):
    """A closed, lopsided surface whose triangles were halved: coarse, or each divided into flat parts."""
    mesh = bent(trimesh.creation.icosphere(1))
    for _ in range(halvings):
        mesh = mesh.subdivide()
    return mesh


@pytest.mark.slow
@pytest.mark.parametrize("is_open", [False, True])
def test_a_model_and_its_subdivision_correspond_to_within_a_hundredth(shapes, iccm, is_open):
    coarse, fine = pear(0), pear(2)
    if is_open:
        coarse.update_faces(coarse.triangles_center[:, 1] < 0.9)
        fine = coarse.subdivide().subdivide()
    coarse.export("coarse.obj")
    fine.export("fine.obj")
    assert iccm("flatten", "coarse.obj", "--uv", "a.obj").code == 0
    result = iccm("map", "a.obj", "fine.obj", "-o", "o.obj", "--report", "r.json")
    assert result.code == 0, result.err
    # corresponding points are at the same place
    assert json.loads((shapes / "r.json").read_text())["apart"]["p95"] < 0.01


def test_a_twin_has_the_same_seam_on_its_own_edges():
    coarse, fine = (
        sound_piece(Mesh.triangles("egg", np.array(mesh.vertices), np.array(mesh.faces)))
        for mesh in (pear(0), pear(2))
    )
    source = flatten(open_piece(coarse, cut=True), grow=True)
    twin = twin_of(source.patch, fine)
    lengths = [
        np.linalg.norm(np.diff(patch.mesh.points[patch.seam], axis=1), axis=2).sum()
        for patch in (source.patch, twin.patch)
    ]
    assert lengths[0] == pytest.approx(lengths[1], rel=1e-9)
    target = flatten(twin.patch)
    start = map_by_nearest_points(source, target, twin.nodes)
    inside = np.setdiff1d(np.arange(target.flat.size), target.loop)
    layout, places = (
        np.column_stack([z.real, z.imag, 0 * z.real]) for z in (source.flat, start.source[inside])
    )
    _, face, foot = igl.point_mesh_squared_distance(places, layout, source.patch.faces)
    weights = barycentric(layout[source.patch.faces[face]], foot)
    back = np.einsum("pk,pkc->pc", weights, source.patch.points[source.patch.faces[face]])
    assert np.quantile(np.linalg.norm(back - target.patch.points[inside], axis=1), 0.9) < 1e-6


def test_a_closed_surface_has_no_twin_of_an_open_one():
    shell, open_shell = pear(1), pear(1)
    open_shell.update_faces(open_shell.triangles_center[:, 1] < 0.9)
    whole, disk = (
        sound_piece(Mesh.triangles("egg", np.array(mesh.vertices), np.array(mesh.faces)))
        for mesh in (shell, open_shell)
    )
    with pytest.raises(InputError):
        twin_of(disk, whole)


@pytest.mark.slow
def test_a_map_that_drifts_is_not_good_unless_its_landmarks_move(eggs):
    source, target = (
        mesh_reading.read(name, cutting=mesh_reading.Cutting(closed=True)).domain for name in eggs
    )
    free = fit(source, target)
    assert free.report()["apart"]["p95"] > 0.05  # both are cut at different places
    assert free.status is Status.DRIFTED and not free.status.ok
