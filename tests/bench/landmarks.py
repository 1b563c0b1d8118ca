"""Meshes onto an outline, and onto remeshed copies of themselves by landmarks.

python -m tests.bench.landmarks [onto | copies] [NAME …]     both, of all meshes, by default

onto: stretch, dilatation and folds on the surface of meshes laid onto a heart, beside the map of the conformal
flattening's outline. copies: the distance on the surface between a point and where it goes, in diagonals, for a mesh
and a copy with half the triangles (libigl's qslim), by six landmarks that are far apart; closed ones are cut through
them.
"""

from __future__ import annotations

import argparse
import itertools
import sys
import time
from pathlib import Path

import igl
import numpy as np

import iccm
from iccm.curve import Curve
from iccm.errors import InputError
from iccm.flattening import flatten
from iccm.io.shapes import mesh_shape
from iccm.maps.distortion import inside_triangles as samples_of
from iccm.meshes.disk_patch import disk_patch
from iccm.meshes.flatten import Flattening
from iccm.meshes.locate import Locator
from iccm.meshes.mesh import Mesh, triangulated
from iccm.meshes.stretch import stretches
from iccm.meshes.surface_distortion import on_surfaces
from iccm.surfaces.rim_triangles import lifted

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
CANDIDATES = 18  # far apart, of which the first few that are inside are taken


def path_of(name: str) -> Path:
    """The file of a mesh, fetched if need be."""
    folder, file = MESHES[name]
    return (folder if isinstance(folder, Path) else fetched(folder)) / file


def far_apart(points: np.ndarray, count: int) -> list[int]:
    """Points each of which is the farthest from those before."""
    found = [int(np.argmax(np.linalg.norm(points - points.mean(axis=0), axis=1)))]
    while len(found) < count:
        away = np.linalg.norm(points[:, None] - points[found], axis=2).min(axis=1)
        found.append(int(np.argmax(away)))
    return found


def shortest_way(points: np.ndarray, faces: np.ndarray, stops: list[int]) -> list[int]:
    """The stops in the order of the shortest way on the surface through all."""
    none = np.zeros(0, np.int64)
    reach = [igl.exact_geodesic(points, faces, np.array([v]), none, np.array(stops), none) for v in stops]
    ways = itertools.permutations(range(len(stops)))
    best = min(ways, key=lambda way: sum(reach[a][b] for a, b in itertools.pairwise(way)))
    return [stops[k] for k in best]


def onto(names: list[str]) -> None:
    """Meshes onto a heart."""
    outline: Curve = icon("heart")
    for name in names:
        layout = mesh_shape.read(str(path_of(name)), cut=True).flattening
        for way, source in (("flattening's outline", layout.boundary), ("surface", layout)):
            start = time.process_time()
            fit = iccm.fit(source, outline)
            seconds = time.process_time() - start
            patch = layout.patch
            image = fit.fast(Curve(fit.map.polygon).pulled_in(layout.flat))
            image = lifted(image, patch.faces, layout.loop, outline.diagonal)
            folds = int((stretches(patch.points[patch.faces], image[patch.faces])[1] <= 0).sum())
            found = on_surfaces(samples_of(fit.map), (layout, None)).report()
            print(
                f"{name:8} {len(patch.faces):6} triangles  {way:21} stretch p50 {found['stretch']['p50']:.2f} "
                f"p95 {found['stretch']['p95']:.2f}  K95 {found['dilatation']['p95']:.2f}  "
                f"within 2x {found['scale']['within2']:.1%}  folds {folds}  {seconds:.1f} s"
            )


def copies(names: list[str]) -> None:
    """Meshes onto copies with half the triangles."""
    for name in names:
        whole = mesh_shape.mesh_files.read(str(path_of(name))).mesh
        points, faces = whole.points, whole.corners[triangulated(whole)].astype(np.int64)
        other, other_faces = _halved(points, faces)
        meshes = Mesh.triangles("copy", other, other_faces), Mesh.triangles(name, points, faces)
        try:
            here, there, pins = _laid_out(*meshes)
        except InputError as error:
            print(f"{name:8} {error}")
            continue
        start = time.process_time()
        fit = iccm.fit(here, there, pins=pins)
        seconds = time.process_time() - start
        away = distances(fit, here, there)
        print(
            f"{name:8} {len(other_faces):6} -> {len(faces):6} triangles  {len(pins)} pins  "
            f"median {np.median(away):.2%}  p95 {np.quantile(away, 0.95):.2%}  worst {away.max():.2%} of the diagonal  "
            f"{fit.status.name}  {seconds:.1f} s"
        )


def _halved(points: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    found = [each for each in igl.qslim(points, faces, len(faces) // 2) if isinstance(each, np.ndarray)]
    return found[0], found[1]


def _laid_out(copy: Mesh, mesh: Mesh) -> tuple[Flattening, Flattening, np.ndarray]:
    """Both laid out, cut through the landmarks if closed, and the pins."""
    faces = mesh.corners.reshape(-1, 3)
    used = np.unique(faces)
    try:
        there = flatten(disk_patch(mesh))
    except InputError:
        stops = used[far_apart(mesh.points[used], LANDMARKS)].tolist()
        through = mesh.points[shortest_way(mesh.points, faces, stops)]
        here, there = (
            flatten(disk_patch(each, cut=True, through=through), grow=False) for each in (copy, mesh)
        )
        return here, there, _both(here, there, through)
    inner = np.setdiff1d(np.arange(len(there.flat)), np.concatenate(there.patch.loops))
    landmarks = inner[far_apart(there.patch.points[inner], CANDIDATES)][:LANDMARKS]
    here = flatten(disk_patch(copy))
    return here, there, np.column_stack([_on(here, there.patch.points[landmarks]), there.flat[landmarks]])


def _both(here: Flattening, there: Flattening, through: np.ndarray) -> np.ndarray:
    """The landmarks on the seam, on both of its sides, as pins of the outlines."""
    sides = []
    for layout in (here, there):
        outline = layout.patch.points[layout.loop]
        first = int(np.argmin(((outline - through[0]) ** 2).sum(axis=1)))
        around = np.roll(layout.loop, -first)
        nearest = [int(np.argmin(((layout.patch.points - p) ** 2).sum(axis=1))) for p in through]
        chosen = np.isin(layout.patch.vertex[around], layout.patch.vertex[nearest])
        sides.append(layout.flat[around[chosen]])
    return np.column_stack(sides)


def _on(layout: Flattening, points: np.ndarray) -> np.ndarray:
    """Where the layout has the nearest points of its surface to points in space."""
    _, face, foot = igl.point_mesh_squared_distance(points, layout.patch.points, layout.patch.faces)
    corners = layout.patch.points[layout.patch.faces[face]]
    weights = [
        np.linalg.lstsq(np.vstack([c.T, np.ones(3)]), np.append(p, 1), rcond=None)[0]
        for c, p in zip(corners, foot)
    ]
    return np.einsum("pk,pk->p", np.array(weights), layout.flat[layout.patch.faces[face]])


def distances(fit, here: Flattening, there: Flattening) -> np.ndarray:
    """Of the target's vertices from where they come from, in diagonals."""
    z = fit.inverse(there.flat)
    face, weights = Locator(here)(np.where(np.isfinite(z), z, 0), 1)
    found = np.einsum("pk,pkc->pc", weights, here.patch.points[here.patch.faces[face]])
    found[~np.isfinite(z)] = np.inf
    size = np.linalg.norm(np.ptp(there.patch.points, axis=0))
    return np.linalg.norm(found - there.patch.points, axis=1) / size


if __name__ == "__main__":
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("what", nargs="*", help=f"onto, copies, or of {', '.join(MESHES)}")
    asked = parser.parse_args().what
    chosen = [name for name in asked if name in MESHES] or list(MESHES)
    for name, work in (("onto", onto), ("copies", copies)):
        if name in asked or not {"onto", "copies"} & set(asked):
            work(chosen)
    sys.exit(0)
