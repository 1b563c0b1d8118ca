"""Saved maps composed into one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

from ..arrays import Complex
from ..curve import Curve, hausdorff
from ..errors import InputError, naming
from ..fit_data import Details
from ..maps.approximation import triangulated
from ..maps.composition import Function, composed
from ..maps.triangulated.map import NEAR_SHARE, TriangulatedMap
from ..plane import diagonal
from ..result import Fit, result_of
from ..saved.map_file import SavedPlane
from ..saved.map_file import read as read_file
from ..status import Status
from . import files
from .spec import saved_map_of


@dataclass(frozen=True, eq=False)
class Step:
    """A saved map, or its inverse, as a part of a composition.

    Attributes:
        name: as typed.
        fit: the saved map.
        map: its mesh, from the source of this step to its target.
        forward: maps points of its source, NaN outside.
        backward: the inverse.
        planes: of this step's source and target.
        is_inverse: whether it is the inverse of the saved map.
    """

    name: str
    fit: Fit
    map: TriangulatedMap
    forward: Function
    backward: Function
    planes: tuple[SavedPlane, SavedPlane]
    is_inverse: bool

    @classmethod
    def read(cls, name: str) -> Step:
        """Read a step from a file, whose name may begin with `inverse:`.

        Raises:
            InputError: the file does not contain a valid map, or one that cannot be composed.
        """
        path, is_inverse = saved_map_of(name)
        stored = read_file(files.open_input(path))
        with naming(path):
            fit = result_of(stored)
        if fit.target is None or fit.details.filled is not None:
            kind = "the map of a deformation" if fit.target is None else "a map of parts of its shapes"
            raise InputError(f"{path}: {kind} cannot be composed; use maps of whole shapes (--fit whole)")
        map = triangulated(fit.map)
        if map.seen is not None:
            raise InputError(f"{path}: the map folds, so it cannot be composed")
        if is_inverse:
            back = replace(map.linear_inverse(), axes=fit.axes[::-1])
            return cls(name, fit, back, map.inverse, map, stored.planes[::-1], is_inverse)
        map = replace(map, axes=fit.axes)
        return cls(name, fit, map, map, map.inverse, stored.planes, is_inverse)

    @property
    def outlines(self) -> tuple[list[Curve], list[Curve]]:
        """The boundaries of its source and of its target as the mesh has them, the outer ones first."""
        return tuple([Curve(w[loop]) for loop in self.map.loops] for w in (self.map.source, self.map.image))  # type: ignore[return-value]

    @property
    def domains(self) -> tuple[tuple[Curve, Sequence[Curve]], tuple[Curve, Sequence[Curve]]]:
        """Outline and holes of its source and of its target, as they were given."""
        assert self.fit.target is not None
        sides = (self.fit.source, self.fit.source_holes), (self.fit.target, self.fit.target_holes)
        return sides[::-1] if self.is_inverse else sides


def compose(names: Sequence[str]) -> tuple[Fit, tuple[SavedPlane, SavedPlane]]:
    """Return the composition of saved maps, the first of which is applied first, and the planes it maps between.

    Args:
        names: Files of maps; `inverse:name` is the inverse of a map.

    Raises:
        InputError: A file does not contain a map that can be composed, or a map does not begin where the previous one
            ends.
    """
    steps = [Step.read(name) for name in names]
    for step, following in pairwise(steps):
        _check_joint(step, following)
    first, last = steps[0], steps[-1]

    def forward(points: Complex) -> Complex:
        for step in steps[1:]:
            points = step.forward(points)
        return points

    def backward(points: Complex) -> Complex:
        for step in steps[-2::-1]:
            points = step.backward(points)
        return points

    with naming(" ".join(names)):
        try:
            map, error = composed(first.map.image, first.map.faces, first.backward, forward)
        except InputError:  # the mesh of the last map may do where that of the first one does not
            map, error = composed(last.map.source, last.map.faces, backward, last.forward)
    map = replace(map, axes=(first.map.axes[0], last.map.axes[1]))
    (source, source_holes), (target, target_holes) = first.domains[0], last.domains[1]
    drawings = None
    if all(step.fit.details.drawings for step in steps):
        begin, end = first.fit.details.drawings or (), last.fit.details.drawings or ()
        drawings = begin[-1 if first.is_inverse else 0], end[0 if last.is_inverse else -1]
    fit = Fit(
        map,
        Status.REACHED,
        [],
        source,
        target,
        first.fit.pins[:0],
        [],
        [f"Composed of {', '.join(names)}, to within {error:.1e} of the diagonal."],
        source_holes=source_holes,
        target_holes=target_holes,
        axes=map.axes,
        details=Details(
            hole_partners=[
                (_nearest(map.source[loop], source_holes), _nearest(map.image[loop], target_holes))
                for loop in map.loops[1:]
            ],
            tolerance=max(step.fit.details.tolerance for step in steps),
            drawings=drawings,
        ),
    )
    if not fit.certificate.certified:
        fit = replace(fit, _ended=Status.FOLDED)
    elif fit._is_far_off:
        fit = replace(fit, _ended=Status.GAP)
    return fit, (first.planes[0], last.planes[1])


def _check_joint(first: Step, second: Step) -> None:
    """Check that a map begins on the shape on which the map before it ends.

    Raises:
        InputError: it does not; the message states how far the outlines are from each other.
    """
    ends, begins = first.outlines[1], second.outlines[0]
    if len(ends) != len(begins):
        raise InputError(
            f"{second.name}: its source has {len(begins) - 1} holes, but the target of {first.name} has "
            f"{len(ends) - 1}; compose maps that meet in the same shape"
        )
    if first.planes[1].down != second.planes[0].down:
        raise InputError(
            f"{second.name}: y points the other way than in the target of {first.name}; make both maps with the same "
            "file of the shape between them"
        )
    size = diagonal(ends[0].z)
    gap = max(min(hausdorff(end, begin) for begin in begins) for end in ends) / size
    if gap > NEAR_SHARE:
        raise InputError(
            f"{second.name}: its source is not the target of {first.name}: their outlines are up to {gap:.2%} "
            "of the diagonal apart. Maps of whole drawings go by way of frames, which may differ; --parts largest maps "
            "outlines"
        )


def _nearest(loop: Complex, holes: Sequence[Curve]) -> int:
    """Return the number of the hole that a loop of a mesh is the boundary of; -1 for none."""
    if not holes:
        return -1
    away = [hausdorff(Curve(loop), hole) / hole.diagonal for hole in holes]
    nearest = min(range(len(holes)), key=away.__getitem__)
    return nearest if away[nearest] <= 0.5 else -1
