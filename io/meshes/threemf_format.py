"""3MF, the format of 3D printing: read by trimesh and lxml. Its colours and textures are ignored."""

from __future__ import annotations

import re
import zipfile
from collections import Counter
from functools import cached_property
from io import BytesIO
from typing import Any

from ...errors import InputError
from ...meshes.mesh import Mesh
from ...saved import archive
from .. import extras, files, limits
from .mesh_format import MeshContent, MeshFile, MeshFormat

TRIANGLE = re.compile(rb"<(?:[\w.-]+:)?triangle[\s/>]")
MODEL = re.compile(rb"<(?:[\w.-]+:)?model\b[^>]*>")
UNIT = re.compile(rb"\bunit\s*=\s*[\"']([a-z]+)[\"']")
UNITS = {"micron": 1e-3, "millimeter": 1.0, "centimeter": 10.0, "inch": 25.4, "foot": 304.8, "meter": 1000.0}
"""Millimetres in the units of 3MF."""
MOST_COPIES = 10_000
"""Objects of a file's build, counting each copy of a component: a millisecond each."""


class ThreeMfFormat(MeshFormat):
    """3MF packages (.3mf)."""

    def count_faces(self, most: int) -> int:
        """Return the number of triangles of all models, each counted once."""
        files.open_input(self.path, max_bytes=limits.MESH_BYTES)
        if not zipfile.is_zipfile(self.path):
            return 0
        return sum(map(_count_triangles, self._models))

    def read(self) -> dict[str, MeshFile]:
        """Read each object of the build at its place, in the order of the build."""
        purpose = f"{self.path}: reading 3MF"
        etree = extras.load(purpose, "lxml", "etree").etree
        extras.load(purpose, "networkx")  # trimesh needs both
        import trimesh

        self._check_copies(*_structure(etree, self._models))
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

    def _check_copies(self, components: dict[str, Counter[str]], build: Counter[str]) -> None:
        """Refuse objects that contain themselves, and too many copies of objects.

        Args:
            components: how often each object contains which others.
            build: how often the build contains each object.

        Raises:
            InputError: an object contains itself, or there are too many copies.
        """
        copies = dict[str, int]()

        def copies_of(name: str, containing: tuple[str, ...]) -> int:
            if name in containing:
                raise InputError(f"{self.path}: object {name} contains itself")
            if name not in copies:
                inner = components.get(name, Counter())
                chain = (*containing, name)
                copies[name] = 1 + sum(times * copies_of(part, chain) for part, times in inner.items())
            return copies[name]

        total = sum(times * copies_of(name, ()) for name, times in build.items())
        if total > MOST_COPIES:
            raise InputError(f"{self.path}: has {total} copies of objects, more than {MOST_COPIES}")


def _count_triangles(model: bytes) -> int:
    """Count the triangles of a model, whatever prefix the file has for their namespace."""
    return sum(1 for _ in TRIANGLE.finditer(model))


def _structure(etree: Any, models: list[bytes]) -> tuple[dict[str, Counter[str]], Counter[str]]:
    """Return how often each object of the models contains which others, and how often the build contains each."""
    components, build = dict[str, Counter[str]](), Counter[str]()
    tags = "{*}object", "{*}build"
    for model in models:
        for _, element in etree.iterparse(BytesIO(model), tag=tags, resolve_entities=False, no_network=True):
            if element.tag.endswith("}build"):
                build.update(item.get("objectid", "") for item in element.iter("{*}item"))
            else:
                parts = Counter(part.get("objectid", "") for part in element.iter("{*}component"))
                components[element.get("id", "")] = parts
            element.clear()  # its vertices and triangles
    return components, build
