"""USD files that usd-core writes and reads."""

import numpy as np
import pytest

from iccm.errors import InputError
from iccm.io.meshes import mesh_files
from tests.mesh_faces import check_71_faces_are_counted, check_written_faces_are_counted

Usd = pytest.importorskip("pxr.Usd", reason="usd-core is an extra")
Sdf, UsdGeom = pytest.importorskip("pxr.Sdf"), pytest.importorskip("pxr.UsdGeom")
pytestmark = pytest.mark.large

POINTS = [(0, 0, 0), (4, 0, 1), (4, 3, 1), (0, 3, 0), (9, 0, 0), (9, 3, 0)]
COUNTS, CORNERS = [4, 3, 3], [0, 1, 2, 3, 1, 4, 5, 1, 5, 2]
UV = [(0, 0), (0.4, 0), (0.4, 0.3), (0, 0.3), (0.9, 0), (0.9, 0.3)]


@pytest.fixture(params=[".usda", ".usdc", ".usd"])
def scene(request, tmp_path, monkeypatch):
    """A sheet of a quad and two triangles, moved and with coordinates at its vertices."""
    monkeypatch.chdir(tmp_path)
    name = f"sheet{request.param}"
    stage = Usd.Stage.CreateNew(name)
    group = UsdGeom.Xform.Define(stage, "/world")
    group.AddTranslateOp().Set((10, 20, 30))
    mesh = UsdGeom.Mesh.Define(stage, "/world/sheet")
    mesh.CreatePointsAttr(POINTS)
    mesh.CreateFaceVertexCountsAttr(COUNTS)
    mesh.CreateFaceVertexIndicesAttr(CORNERS)
    kinds = Sdf.ValueTypeNames.TexCoord2fArray
    UsdGeom.PrimvarsAPI(mesh).CreatePrimvar("st", kinds, UsdGeom.Tokens.vertex).Set(UV)
    stage.GetRootLayer().Save()
    return name


def test_a_mesh_is_read_with_its_place_and_its_coordinates(scene):
    mesh = mesh_files.read(scene).mesh
    assert np.allclose(mesh.points, np.add(POINTS, (10, 20, 30)))
    assert mesh.sizes.tolist() == COUNTS and mesh.corners.tolist() == CORNERS
    assert np.allclose(mesh.uv[mesh.uv_corners], np.array(UV)[CORNERS], atol=1e-6)
    mesh_files.check_size(mesh_files.Path(scene), 3)
    with pytest.raises(InputError, match="3 faces"):
        mesh_files.check_size(mesh_files.Path(scene), 2)


def flattened(layer):
    """What a layer says about a mesh, without its texture coordinates."""
    return {
        str(spec.path): (spec.typeName, {key: str(spec.GetInfo(key)) for key in spec.ListInfoKeys()})
        for path in paths_of(layer)
        if "primvars:st" not in str(path)
        and (spec := layer.GetObjectAtPath(path))
        and hasattr(spec, "typeName")
    }


def paths_of(layer):
    paths = []
    layer.Traverse("/", paths.append)
    return paths


def test_coordinates_are_written_and_the_stage_is_kept(scene, iccm):
    """Prims, transforms, normals, materials, the up axis and the unit stay; only the coordinates change."""
    stage = Usd.Stage.Open(scene)
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
    UsdGeom.SetStageMetersPerUnit(stage, 0.01)
    mesh = UsdGeom.Mesh.Get(stage, "/world/sheet")
    mesh.CreateNormalsAttr([(0, 0, 1)] * len(POINTS))
    stage.DefinePrim("/world/paint", "Material")
    stage.GetRootLayer().Save()
    before = flattened(stage.GetRootLayer())
    suffix = scene[scene.index(".") :]
    result = iccm("flatten", scene, "-o", "flat.obj", "--uv", f"out{suffix}")
    assert result.code == 0, result.err
    after = Usd.Stage.Open(f"out{suffix}")
    assert flattened(after.GetRootLayer()) == before and len(before) > 6
    st = np.array(
        UsdGeom.PrimvarsAPI(after.GetPrimAtPath("/world/sheet")).GetPrimvar("st").ComputeFlattened()
    )
    assert len(st) == len(CORNERS)
    with open("flat.obj") as file:
        lines = [line.split() for line in file]
    flat = np.array([words[1:3] for words in lines if words[0] == "v"], float)
    vertices = np.concatenate(
        [np.array([w.partition("/")[0] for w in words[1:]], int) - 1 for words in lines if words[0] == "f"]
    )
    # the OBJ lists triangles first, the USD polygons in their order: compare the extents and all points as sets
    scale = np.ptp(st, axis=0).max() / np.ptp(flat, axis=0).max()
    ours = np.unique(np.round((flat[vertices] - flat.min(axis=0)) * scale, 4), axis=0)
    theirs = np.unique(np.round(st - st.min(axis=0), 4), axis=0)
    assert ours.shape == theirs.shape and np.abs(ours - theirs).max() < 2e-4


def test_only_the_mesh_that_is_named_gets_new_coordinates(scene, iccm):
    stage = Usd.Stage.Open(scene)
    other = UsdGeom.Mesh.Define(stage, "/other")
    other.CreatePointsAttr(POINTS[:4])
    other.CreateFaceVertexCountsAttr(COUNTS[:1])
    other.CreateFaceVertexIndicesAttr(CORNERS[:4])
    stage.GetRootLayer().Save()
    assert iccm("flatten", f"{scene}#other", "--uv", f"out-{scene}").code == 0
    after = Usd.Stage.Open(f"out-{scene}")
    kept = UsdGeom.PrimvarsAPI(after.GetPrimAtPath("/world/sheet")).GetPrimvar("st")
    assert np.allclose(kept.Get(), UV, atol=1e-6) and kept.GetInterpolation() == "vertex"
    assert len(UsdGeom.PrimvarsAPI(after.GetPrimAtPath("/other")).GetPrimvar("st").ComputeFlattened()) == 4


def test_references_to_other_files_are_refused(scene, iccm):
    stage = Usd.Stage.CreateNew("outer.usda")
    stage.DefinePrim("/a").GetReferences().AddReference(f"./{scene}", "/world")
    stage.GetRootLayer().Save()
    result = iccm("flatten", "outer.usda", "-o", "no.svg")
    assert result.code == 2 and "other USD files" in result.err


@pytest.mark.parametrize("place", [16, "section", "items"])
def test_sections_of_binary_files_are_checked_before_usd_reads_them(
    scene, iccm, tmp_path, monkeypatch, place
):
    """The places of the table of sections, of a section, and the number of items in one."""
    import struct

    from iccm.io.isolated import process

    whole = tmp_path / "whole.usdc"
    stage = Usd.Stage.CreateNew(str(whole))
    mesh = UsdGeom.Mesh.Define(stage, "/sheet")
    mesh.CreatePointsAttr(POINTS)
    mesh.CreateFaceVertexCountsAttr(COUNTS)
    mesh.CreateFaceVertexIndicesAttr(CORNERS)
    stage.GetRootLayer().Save()
    assert mesh_files.open_mesh(whole).count_faces(-1) == len(COUNTS)
    data = bytearray(whole.read_bytes())
    table = struct.unpack_from("<q", data, 16)[0]
    assert data[table + 8 : table + 14] == b"TOKENS"
    places = {"section": table + 32, "items": struct.unpack_from("<q", data, table + 24)[0]}
    struct.pack_into("<q", data, places.get(place, place), 1 << 60)
    bad = tmp_path / "bad.usdc"
    bad.write_bytes(data)
    monkeypatch.setattr(process, "read", None)
    with pytest.raises(InputError, match="promises more"):
        mesh_files.open_mesh(bad).count_faces(-1)


@pytest.mark.parametrize("metres", [None, 0.01, 0.0254])
def test_the_unit_is_that_of_the_stage(tmp_path, metres):
    stage = Usd.Stage.CreateNew(str(tmp_path / "unit.usda"))
    if metres:
        UsdGeom.SetStageMetersPerUnit(stage, metres)
    stage.Save()
    expected = metres and pytest.approx(1000 * metres)
    assert mesh_files.open_mesh(tmp_path / "unit.usda").millimetres() == expected


@pytest.mark.parametrize("suffix", [".usd", ".usda", ".usdc"])
def test_faces_of_written_files_are_counted(tmp_path, suffix):
    check_written_faces_are_counted(tmp_path / f"strip{suffix}")


@pytest.mark.parametrize("suffix", [".usd", ".usda"])
def test_faces_are_counted_without_reading_the_mesh(tmp_path, suffix):
    counts = b"3, " * 70 + b"3"
    path = tmp_path / f"a{suffix}"
    path.write_bytes(b'#usda 1.0\ndef Mesh "m"\n{\nint[] faceVertexCounts = [' + counts + b"]\n}\n")
    check_71_faces_are_counted(path)
