"""3MF, the format of 3D printing: read by trimesh and lxml. Its colours and textures are ignored."""

from __future__ import annotations

import re
import zipfile
from collections import Counter
from functools import cached_property
from io import BytesIO
from typing import Any

from ...errors import InputError
from ...io import files, limits
from ...io.meshes.mesh_format import MeshContent, MeshFile, MeshFormat
from ...meshes.mesh import Mesh
from ...saved import archive
from . import EXTRA

TRIANGLE = re.compile(rb"<(?:[\w.-]+:)?triangle[\s/>]")
MODEL = re.compile(rb"<(?:[\w.-]+:)?model\b[^>]*>")
UNIT = re.compile(rb"\bunit\s*=\s*[\"']([a-z]+)[\"']")
UNITS = {"micron": 1e-3, "millimeter": 1.0, "centimeter": 10.0, "inch": 25.4, "foot": 304.8, "meter": 1000.0}
"""Millimetres in the units of 3MF."""


class ThreeMfFormat(MeshFormat):
    """3MF packages (.3mf)."""

    def count_faces(self, most: int) -> int:
        """Return the number of triangles, those of an object as often as the build places it."""
        files.open_input(self.path, max_bytes=limits.MESH_BYTES)
        if not zipfile.is_zipfile(self.path):
            return 0
        return max(sum(map(_count_triangles, self._models)), self._placed)

    def read(self) -> dict[str, MeshFile]:
        """Read each object of the build at its place, in the order of the build."""
        purpose = f"{self.path}: reading 3MF"
        EXTRA.load(purpose, "lxml", "etree")
        EXTRA.load(purpose, "networkx")  # trimesh needs both
        import trimesh

        if self._placed > self._keep >= 0:
            raise InputError(
                f"{self.path}: has {self._placed} faces, more than the limit of {self._keep}; raise --max-faces"
            )
        declares_triangles = any(map(_count_triangles, self._models))
        del self._models  # trimesh unpacks the file itself
        scene = trimesh.load_scene(self.path, file_type="3mf", process=False)
        meshes = dict[str, MeshFile]()
        for node in scene.graph.nodes_geometry:
            matrix, geometry = scene.graph[node]
            solid = scene.geometry[geometry]
            points = solid.vertices @ matrix[:3, :3].T + matrix[:3, 3]
            if len(solid.faces):
                mesh = Mesh.triangles(str(self.path), points, solid.faces, up_axis=2)
                meshes[str(node)] = MeshFile.whole(self.path, MeshContent(mesh))
        if not meshes and declares_triangles:
            raise InputError(
                f"{self.path}: none of the objects that its build places were found; save it without the production "
                "extension"
            )
        return meshes

    @cached_property
    def _models(self) -> list[bytes]:
        """The models of the package, unpacked once, to be counted and checked.

        Raises:
            InputError: the package is damaged, or unpacks to too many bytes.
        """
        with archive.opened(
            self.path,
            otherwise="is not a 3MF package, or is damaged",
            damaged="is damaged",
            most_bytes=limits.MESH_BYTES,
        ) as package:
            return [package.read(name) for name in package.namelist() if name.lower().endswith(".model")]

    def millimetres(self) -> float:
        """Return the length of the unit of the first model, by default a millimetre."""
        start = MODEL.search(self._models[0]) if zipfile.is_zipfile(self.path) and self._models else None
        stated = UNIT.search(start[0]) if start else None
        return UNITS.get(stated[1].decode(), 1.0) if stated else 1.0

    @cached_property
    def _placed(self) -> int:
        """The number of triangles that the build places.

        Raises:
            InputError: an object contains itself, or there are too many copies of objects.
        """
        etree = EXTRA.load(f"{self.path}: reading 3MF", "lxml", "etree").etree
        triangles, components, build = _structure(etree, self._models)
        drawn = dict[str, tuple[int, int]]()

        def count(name: str, containing: tuple[str, ...]) -> tuple[int, int]:
            """Return how many copies of objects an object draws, itself included, and how many triangles."""
            if name in containing:
                raise InputError(f"{self.path}: object {name} contains itself")
            if name not in drawn:
                inner = components.get(name, Counter())
                parts = [(times, *count(part, (*containing, name))) for part, times in inner.items()]
                drawn[name] = (
                    1 + sum(times * copies for times, copies, _ in parts),
                    triangles[name] + sum(times * faces for times, _, faces in parts),
                )
            return drawn[name]

        items = [(times, *count(name, ())) for name, times in build.items()]
        total = sum(times * copies for times, copies, _ in items)
        if total > limits.COPIES_3MF:
            raise InputError(f"{self.path}: has {total} copies of objects, more than {limits.COPIES_3MF}")
        return sum(times * faces for times, _, faces in items)


def _count_triangles(model: bytes) -> int:
    """Count the triangles of a model, whatever prefix the file has for their namespace."""
    return sum(1 for _ in TRIANGLE.finditer(model))


def _structure(etree: Any, models: list[bytes]) -> tuple[Counter[str], dict[str, Counter[str]], Counter[str]]:
    """Return the triangles of each object of the models, how often it contains which others, and how often the build
    contains each.
    """
    triangles, components, build = Counter[str](), dict[str, Counter[str]](), Counter[str]()
    tags = "{*}object", "{*}build"
    for model in models:
        for _, element in etree.iterparse(BytesIO(model), tag=tags, resolve_entities=False, no_network=True):
            if element.tag.endswith("}build"):
                build.update(item.get("objectid", "") for item in element.iter("{*}item"))
            else:
                name = element.get("id", "")
                triangles[name] = sum(1 for _ in element.iter("{*}triangle"))
                components[name] = Counter(part.get("objectid", "") for part in element.iter("{*}component"))
            element.clear()  # its vertices and triangles
    return triangles, components, build
