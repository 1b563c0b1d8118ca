"""Meshes mapped onto an outline, and onto remeshed copies of themselves by landmarks.

python -m tests.bench.landmarks [onto | copies] [NAME …]     both, of all meshes, by default

onto: stretch, dilatation and folds on the surface of meshes mapped onto a heart, compared with the map of the conformal
flattening's outline. copies: the distance in space between a vertex and its preimage, relative to the diagonal, for a
mesh and a copy with half the triangles (libigl's qslim), with six landmarks that are far apart: vertices of the mesh
and points of the copy. Closed meshes are cut through them.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import time
from pathlib import Path

import igl
import numpy as np

import iccm
from iccm.curve import Curve
from iccm.errors import InputError
from iccm.io.run.inputs import Inputs
from iccm.io.run.job import Job
from iccm.io.shapes import constraints, mesh_reading
from iccm.maps.distortion import inside_triangles as samples_of
from iccm.meshes.disk_patch import sound_piece
from iccm.meshes.flatten import Flattening
from iccm.meshes.locate import Locator
from iccm.meshes.mesh import triangulate
from iccm.meshes.stretch import stretches
from iccm.meshes.surface_distortion import on_surfaces
from iccm.surfaces.boundary_slivers import lift

from .flattening import fetched
from .shapes import icon

SAMPLES = Path(__file__).parents[2] / "samples"
MESHES = {
    "face": (SAMPLES / "face-pins", "face.obj"),
    "lego": ("potpourri3d", "lego.ply"),
    "spot": ("potpourri3d", "spot.ply"),
    "bone": ("pymeshlab", "bone.ply"),
    "fox": ("potpourri3d", "fox.ply"),
    "cow": ("pymeshlab", "cow.obj"),
    "bunny": ("pymeshlab", "bunny10k_textured.obj"),
}
LANDMARKS = 6


def path_of(name: str) -> Path:
    """Return the file of a mesh, fetched if necessary."""
    folder, file = MESHES[name]
    return (folder if isinstance(folder, Path) else fetched(folder)) / file


def far_apart(points: np.ndarray, count: int) -> list[int]:
    """Return points by farthest point sampling."""
    vertices = [int(np.argmax(np.linalg.norm(points - points.mean(axis=0), axis=1)))]
    while len(vertices) < count:
        away = np.linalg.norm(points[:, None] - points[vertices], axis=2).min(axis=1)
        vertices.append(int(np.argmax(away)))
    return vertices


def onto(names: list[str]) -> None:
    """Map meshes onto a heart."""
    outline: Curve = icon("heart")
    for name in names:
        layout = mesh_reading.read(str(path_of(name)), cutting=mesh_reading.Cutting(closed=True)).flattening
        for label, source in (("flattening's outline", layout.boundary), ("surface", layout)):
            start = time.process_time()
            fit = iccm.fit(source, outline)
            seconds = time.process_time() - start
            patch = layout.patch
            image = fit.map(Curve(fit.map.polygon).pulled_in(layout.flat))
            image = lift(image, patch.faces, layout.loop, outline.diagonal)
            folds = int((stretches(patch.points[patch.faces], image[patch.faces])[1] <= 0).sum())
            figures = on_surfaces(samples_of(fit.map), (layout, None)).report()
            print(
                f"{name:8} {len(patch.faces):6} triangles  {label:21} stretch p50 {figures['stretch']['p50']:.2f} "
                f"p95 {figures['stretch']['p95']:.2f}  K95 {figures['dilatation']['p95']:.2f}  "
                f"within 2x {figures['scale']['within2']:.1%}  folds {folds}  {seconds:.1f} s"
            )


def copies(names: list[str]) -> None:
    """Map meshes onto copies with half the triangles, as `iccm map copy.obj mesh.obj --cut --constraints
    marks.json`.
    """
    for name in names:
        with tempfile.TemporaryDirectory() as folder:
            job, count = _written(name, Path(folder))
            start = time.process_time()
            inputs = Inputs(job)
            source, target = inputs.shape(job.source), inputs.shape(str(job.target), target=True)
            pins = constraints.collect(source, target, inputs.listed).pins
            read = time.process_time() - start
            try:
                fit = iccm.fit(source.domain, target.domain, pins=pins)
            except InputError as error:
                print(f"{name:8} {error}")
                continue
        seconds = time.process_time() - start
        away = distances(fit, *fit.details.layouts)
        print(
            f"{name:8} {count[0]:6} -> {count[1]:6} triangles  {len(pins)} pins  "
            f"median {np.median(away):.2%}  p95 {np.quantile(away, 0.95):.2%}  worst {away.max():.2%} of the diagonal  "
            f"{fit.status.name}  {seconds:.1f} s, {read:.1f} for seams and layouts",
            flush=True,
        )


def _written(name: str, folder: Path) -> tuple[Job, tuple[int, int]]:
    """Write a mesh and its copy with their landmarks; return the job, and the numbers of triangles of both."""
    whole = mesh_reading.mesh_files.read(str(path_of(name))).mesh
    faces = whole.corners[triangulate(whole)].astype(np.int64)
    patch = sound_piece(whole)
    inner = np.setdiff1d(
        patch.vertex, patch.vertex[np.concatenate([*patch.loops, np.zeros(0, np.int64)]).astype(int)]
    )
    marks = {f"m{k}": v for k, v in enumerate(inner[far_apart(whole.points[inner], LANDMARKS)].tolist())}
    points, other_faces = _halved(whole.points, faces)
    _write(folder / "copy.obj", points, other_faces)
    _write(folder / "mesh.obj", whole.points, faces)
    source_places = {mark: whole.points[v].tolist() for mark, v in marks.items()}
    target_places = {mark: f"v{v + 1}" for mark, v in marks.items()}
    (folder / "marks.json").write_text(
        json.dumps({"landmarks": {"source": source_places, "target": target_places}})
    )
    source, target, listed = (str(folder / file_name) for file_name in ("copy.obj", "mesh.obj", "marks.json"))
    return Job(source=source, target=target, constraints=listed, cut=True), (len(other_faces), len(faces))


def _write(path: Path, points: np.ndarray, faces: np.ndarray) -> None:
    lines = ["v {!r} {!r} {!r}".format(*map(float, point)) for point in points]
    path.write_text("\n".join([*lines, *("f {} {} {}".format(*face) for face in (faces + 1).tolist())]))


def _halved(points: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    arrays = [
        result for result in igl.qslim(points, faces, len(faces) // 2) if isinstance(result, np.ndarray)
    ]
    return arrays[0], arrays[1]


def distances(fit: iccm.Fit, source: Flattening, target: Flattening) -> np.ndarray:
    """Return the distances of the target's vertices from their preimages, relative to the diagonal."""
    z = fit.inverse(target.flat)
    face, weights = Locator(source)(np.where(np.isfinite(z), z, 0), 1)
    carried = np.einsum("pk,pkc->pc", weights, source.patch.points[source.patch.faces[face]])
    carried[~np.isfinite(z)] = np.inf
    size = np.linalg.norm(np.ptp(target.patch.points, axis=0))
    return np.linalg.norm(carried - target.patch.points, axis=1) / size


if __name__ == "__main__":
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("what", nargs="*", help=f"onto, copies, or of {', '.join(MESHES)}")
    requested = parser.parse_args().what
    chosen = [name for name in requested if name in MESHES] or list(MESHES)
    for name, work in (("onto", onto), ("copies", copies)):
        if name in requested or not {"onto", "copies"} & set(requested):
            work(chosen)
    sys.exit(0)
