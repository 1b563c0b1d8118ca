"""Two meshes in the same place: matched by position, and `drifted` if the map still moves points far."""

import json
from types import SimpleNamespace

import numpy as np
import pytest
import trimesh

from iccm import fit
from iccm.io.run.by_position import pins_by_position
from iccm.io.shapes import mesh_reading
from iccm.status import Status


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
def test_meshes_in_the_same_place_are_matched_by_position(eggs, shapes, iccm):
    result = iccm("map", *eggs, "-o", "o.obj", "--report", "r.json")
    assert result.code == 0, result.err
    assert "pinned to the nearest points" in result.err and "--pin" in result.err
    data = json.loads((shapes / "r.json").read_text())
    assert data["status"] == "reached" and data["apart"]["p95"] < 0.03
    assert len(data["pins"]) >= 2


@pytest.mark.slow
def test_a_map_that_drifts_is_not_good_unless_its_landmarks_move(eggs):
    source, target = (mesh_reading.read(name, cut=True).domain for name in eggs)
    free = fit(source, target)
    assert free.report()["apart"]["p95"] > 0.05  # both are cut at different places
    assert free.status is Status.DRIFTED and not free.status.ok


@pytest.mark.parametrize(
    ("status", "has_drifted", "count"),
    [
        (Status.DRIFTED, True, 6),
        (Status.TWISTED, True, 6),
        (Status.TWISTED, False, 0),
        (Status.REACHED, False, 0),
    ],
)
def test_twisted_maps_between_meshes_in_the_same_place_are_matched_by_position_too(
    shapes, status, has_drifted, count
):
    for name, ball in (("a.obj", trimesh.creation.icosphere(2)), ("b.obj", trimesh.creation.uv_sphere())):
        bent(ball).export(name)
    pair = [mesh_reading.read(name, cut=True) for name in ("a.obj", "b.obj")]
    options = dict.fromkeys(("has_pins", "start", "rigid", "rigid_target", "several"))
    result = SimpleNamespace(status=status, _has_drifted=has_drifted)
    run = SimpleNamespace(
        job=SimpleNamespace(**options), fits=[result], fit=result, pairs=[pair], target=pair[1]
    )
    assert len(pins_by_position(run)) == count
