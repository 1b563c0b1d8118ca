"""Inputs of a job are read once."""

import subprocess
import sys

import pytest

from iccm.io.meshes import obj_format
from iccm.io.run.inputs import Inputs
from iccm.io.run.job import Job
from iccm.io.shapes import shape

COUNT = """
import json, sys
from collections import Counter
from iccm.io.run import Job, run
opened = Counter()
sys.addaudithook(lambda event, args: event == "open" and opened.update([str(args[0])]))
run(Job(source="square.svg", target="m.obj", method="paper", vertices=40, report="r.json", **json.loads(sys.argv[1])))
run(Job(source="o.obj", target="square.svg", method="paper", vertices=40, size=9, output="p.png"))
print(opened["m.obj"], opened["o.obj"])
"""
MESH = "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 .1\nv 0 1 0\n"
MESH += "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\n"


@pytest.mark.slow
@pytest.mark.parametrize(
    "more",
    [
        "{}",
        '{"plot": "p.pdf", "output": ["x.obj", "x.ply"]}',
        '{"bake": true, "size": 9, "output": ["x.png"]}',
    ],
)
def test_a_run_opens_its_mesh_once(shapes, more):
    """Whether it is a mesh, its size, its content, its references, its hash: all from one reading."""
    for name in ("m.obj", "o.obj"):
        (shapes / name).write_text(MESH)
    result = subprocess.run([sys.executable, "-c", COUNT, more], capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stderr
    assert result.stdout == "1 1\n"


def test_long_lines_and_blocks(shapes, monkeypatch):
    monkeypatch.setattr(obj_format, "BLOCK_BYTES", 7)
    monkeypatch.setattr(obj_format, "LONGEST_LINE", 20)
    text = "# " + "x" * 90 + " f 1\n" + MESH.replace("mtllib", "  mtllib") + "f 1 2 4"
    (shapes / "m.obj").write_text(text)
    (shapes / "m.mtl").write_text("")
    mesh = obj_format.ObjFormat(shapes / "m.obj")
    assert (mesh.count_faces(9), mesh.files_named()) == (3, [str(shapes / "m.mtl")])
    (shapes / "m.obj").write_text("")
    assert obj_format.ObjFormat(shapes / "m.obj").count_faces(9) == 0


def test_files_named_by_an_obj_are_inputs_with_the_hash_of_the_first_reading(shapes):
    (shapes / "m.obj").write_text(MESH)
    (shapes / "m.mtl").write_text("newmtl a\nmap_Kd -s 2 2 2 square.svg\n")
    inputs = Inputs(Job(source="m.obj", target="blob.svg"))
    assert inputs.is_mesh("m.obj#1") and not inputs.is_mesh("blob.svg")
    assert inputs.named == ("m.obj", "blob.svg", "m.mtl", "square.svg")
    before = inputs.sha256("m.obj")
    (shapes / "m.obj").write_text("")  # the first reading counts
    assert inputs.shape("m.obj").is_mesh and inputs.sha256("m.obj") == before


def test_a_drawing_is_read_once_for_each_side(shapes, monkeypatch):
    """Options that do not affect reading do not read it again; others do."""
    read = []
    monkeypatch.setattr(shape, "read_drawing", _counting(shape.read_drawing, read))
    inputs = Inputs(Job(source="blob.svg", target="blob.svg"))
    source, target = inputs.shape("blob.svg"), inputs.shape("blob.svg", target=True)
    assert source is not target  # else the job would be a deformation
    kept = inputs.of_job(inputs.job.model_copy(update={"holes": "keep"}))
    assert kept.shape("blob.svg") is source
    assert len(read) == 2
    single = inputs.of_job(inputs.job.model_copy(update={"parts": "largest"})).shape("blob.svg")
    assert single.drawing is None and source.drawing is not None


def _counting(function, calls):
    """Return a function that also adds to a list each time it is called."""

    def counted(*given, **named):
        calls.append(given)
        return function(*given, **named)

    return counted
