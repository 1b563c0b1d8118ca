"""The pair of shapes being edited: its inputs, the constraints that it begins with, and scenes in the core plane.

Without a target the shape is deformed: both sides are the same shape.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

from ...arrays import Complex
from ...curve import Curve
from ...errors import InputError
from ..run.constraints import check_inside
from ..run.inputs import Inputs
from ..run.job import Job
from ..run.phases import Phases
from ..run.resolve import suffix_for
from ..run.state import Run
from ..shapes import constraints, listing
from ..shapes.listing import ConstraintsFile, PinEntry, StrokeEntry
from ..shapes.mesh_shape import MeshShape
from ..shapes.shape import Shape
from .messages import Scene, scene_of
from .surface_view import SurfaceView

PLACE_DIGITS = 7
"""Significant digits of coordinates relative to the shape's size, the same on the page and in files."""


class PlacedConstraints(NamedTuple):
    """Pins and strokes in the core plane.

    Attributes:
        pins: (k, 2) points of the source and their images.
        strokes: pairs of curves.
        settings: of each pin, beside its places.
        stroke_widths: widths of the bands around strokes.
    """

    pins: Complex
    strokes: list[tuple[Curve, Curve]]
    settings: list[dict[str, float]]
    stroke_widths: list[float]


class Pair:
    """The shapes of a job, and what else the job reads.

    Attributes:
        job: the job, as the user gave it.
        source: the shape with the texture, without constraints drawn in its file.
        target: the other shape; the same one for deformations.
        deforming: whether there is no target.
        first: the constraints of the job, and those in its files.
        start: the map in the file of constraints, from which the first map continues; None if there is none.
        drawn: whether the files of the shapes contain constraints.
        suffix: of the picture or mesh that is written.
        run: the inputs of the job, to be solved.
    """

    def __init__(self, job: Job) -> None:
        """Read the inputs of a job.

        Raises:
            InputError: a file is invalid, or constraints do not lie in these shapes.
        """
        inputs = Inputs(job)
        source = inputs.shape(job.source)
        self.deforming = not job.target
        if self.deforming and source.is_mesh:
            raise InputError(f"{job.source}: a mesh can only be mapped, not deformed; name a TARGET")
        target = source if self.deforming else inputs.shape(job.target or "", target=True, source=source)
        self.job, self.suffix = job, suffix_for(job, inputs)
        self.drawn = bool(source.pins or source.strokes)
        listed = listing.read(job.constraints) if job.constraints else ConstraintsFile()
        self.first, self.start = _scene(job, source, target, listed), listed.start
        bare_source = replace(source, pins={}, strokes={})
        bare_target = bare_source if self.deforming else replace(target, pins={}, strokes={})
        self.run = Run.of_pairs(job, inputs, [(bare_source, bare_target)], lambda note: None, Phases())
        self.source, self.target = self.run.pairs[0]
        self.placed(self.first)

    @property
    def has_mesh(self) -> bool:
        """Whether a side is a mesh."""
        return self.source.is_mesh or self.target.is_mesh

    def placed(self, scene: Scene) -> PlacedConstraints:
        """Return the pins and strokes of a scene in the core plane.

        Raises:
            InputError: one of them is not inside its shape.
        """
        listed = ConstraintsFile(pins=scene.pins, strokes=scene.strokes)
        collected = constraints.collect(self.source, self.target, listed, exact=self.job.exact_pins)
        collected.check_weights()
        pins, strokes = collected.pins, collected.strokes
        sides = (self.source,) if self.deforming else (self.source, self.target)
        for side, shape in enumerate(sides):
            check_inside(shape, "pin", list(pins[:, side]))
            for number, stroke in enumerate(strokes):
                check_inside(shape, f"stroke {number + 1}: point", list(stroke[side].z))
        return PlacedConstraints(pins, strokes, collected.settings, collected.stroke_widths)

    def read_pins(self, name: str, text: str) -> list[dict[str, Any]]:
        """Return the pins in a file chosen in the browser, in the units of the shapes' files.

        Raises:
            InputError: the file is invalid, or one of the pins is outside its shape.
        """
        listed = listing.parse(name, text.encode())
        listed.check(self.source, self.target)
        pins = [
            _on_surface(pin, self.source, self.target) for pin in listed.pins_of(self.source, self.target)
        ]
        self.placed(scene_of(pins, [], []))
        return [pin.model_dump(mode="json") for pin in pins]


def _scene(job: Job, source: Shape, target: Shape, listed: ConstraintsFile) -> Scene:
    """Return all constraints of a job as a list: those drawn, those in its file, and those on the command line."""
    collected = constraints.collect(source, target)  # rejects names that occur in one file only
    listed.check(source, target)
    pins = [
        PinEntry(name=_bare(name), source=_place(source, a), target=_place(target, b), **settings)
        for name, (a, b), settings in zip(source.pins, collected.pins, collected.settings)
    ]
    strokes = [
        StrokeEntry(
            name=_bare(name),
            source=[_place(source, z) for z in a.z],
            target=[_place(target, z) for z in b.z],
        )
        for name, (a, b) in zip(source.strokes, collected.strokes)
    ]
    listed_pins = [*listed.pins_of(source, target), *listing.typed_pins(job.pin)]
    pins += [_on_surface(pin, source, target) for pin in listed_pins]
    strokes += [_on_surface(stroke, source, target) for stroke in listed.strokes]
    return scene_of(pins, strokes, listed.rigid, balance=job.balance, turn=job.turn or 0.0)


def _on_surface(entry: Any, source: Shape, target: Shape) -> Any:
    """Return a pin or stroke with its places in a mesh's plane replaced by points on the surface."""
    sides = (("source", source), ("target", target))
    surfaces = [(side, SurfaceView(shape)) for side, shape in sides if isinstance(shape, MeshShape)]
    places = {side: _points_on(surface, getattr(entry, side)) for side, surface in surfaces}
    return entry.model_copy(update=places)


def _points_on(surface: SurfaceView, place: Any) -> Any:
    """Return a place, or a list of places, with points (x, y) of the plane replaced by points on a surface."""
    if isinstance(place, list):
        return [_points_on(surface, point) for point in place]
    is_flat = isinstance(place, tuple) and len(place) == 2
    return tuple(surface.places(surface.shape.to_core([place]), PLACE_DIGITS)[0]) if is_flat else place


def _bare(name: str) -> str:
    """Return the name in an id of SVG such as pin-nose."""
    return name.partition("-")[2]


def _place(shape: Shape, z: complex) -> tuple[float, float]:
    x, y = shape.to_file(z).tolist()
    return x, y
