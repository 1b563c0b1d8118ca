"""Checks that faces of mesh files are counted before they are read, for formats of iccm and of extensions."""

import numpy as np
import pytest

from iccm.errors import InputError
from iccm.io.meshes import mesh_files
from iccm.io.meshes.mesh_format import NewCoordinates, ShownPictures


def check_71_faces_are_counted(path):
    """Check the limit for a file with 71 faces, which need not be complete."""
    assert mesh_files.open_mesh(path).count_faces(71) == 71
    mesh_files.check_size(path, 71)
    with pytest.raises(InputError, match="71 faces, more than the limit of 70; raise --max-faces"):
        mesh_files.check_size(path, 70)


def check_written_faces_are_counted(path):
    """Write a strip of 71 triangles, check the limit, and read it."""
    count = 71
    uv = np.array([[k / 100, k % 2 / 3] for k in range(count + 2)])
    faces = np.array([[k, k + 1, k + 2] if k % 2 else [k + 1, k, k + 2] for k in range(count)])
    lines = [f"v {9 * u} {2 * v} {u * u}" for u, v in uv] + ["f {} {} {}".format(*face) for face in faces + 1]
    (path.parent / "plain.obj").write_text("\n".join(lines))
    new = NewCoordinates(uv, faces.ravel(), np.arange(3 * count).reshape(count, 3))
    file = mesh_files.read(str(path.parent / "plain.obj"))
    mesh_files.write(file, new, ShownPictures(), path, path, force=True)
    assert mesh_files.open_mesh(path).count_faces(count) == count
    with pytest.raises(InputError, match="71 faces, more than the limit of 70; raise --max-faces"):
        mesh_files.check_size(path, count - 1)
    mesh = mesh_files.read(str(path)).mesh
    assert np.allclose(mesh.uv[mesh.uv_corners], uv[faces.ravel()], atol=1e-6)
    assert np.allclose(mesh.points[mesh.corners], file.mesh.points[faces.ravel()], atol=1e-6)
