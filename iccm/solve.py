"""The entry points `fit` and `deform`, which check the input and call one of the methods."""

from __future__ import annotations

import inspect
import warnings
from collections.abc import Callable, Mapping, Sequence, Sized
from dataclasses import dataclass, fields, replace
from difflib import get_close_matches
from functools import wraps
from typing import Any, TypeVar, Unpack

import numpy as np

from . import capabilities, deadline, fits
from .arrays import Complex
from .blas import on_one_thread
from .curve import Curve, inside_any, polygon_of
from .deadline import TimeUp
from .drawings.drawing import Drawing
from .errors import InputError
from .given import Outlines, drawing_of, flattening_of, outlines_of, pins_of, strokes_of
from .maps.triangulated.map import TriangulatedMap
from .meshes.flatten import Flattening
from .options import Options, OptionValues
from .pins import Pin, Softness, Stroke
from .problem import NEAR_SHARE, ON_OUTLINE_SHARE, Problem, as_domain, as_pins, as_strokes
from .progress import Progress, listening
from .result import Fit
from .signatures import plain_signature
from .status import Status

FORMER_NAMES = {"starts": "effort"}
"""Former names of options, with the present ones."""

Outline = Any
"""A shape in any form that `iccm.given` accepts: complex vertices, pairs, a polygon, a path, a `Curve`, a
flattening.
"""
Points = Any
"""Complex numbers, or pairs of real ones."""

__all__ = ["Fit", "Status", "deform", "fit"]


Solve = TypeVar("Solve", bound=Callable[..., Fit])


def _within_time(solve: Solve) -> Solve:
    """Decorate a solve so that it reports when the time limit (see `deadline`) ended its search."""

    @wraps(solve)
    def timed(*args: Any, **options: Any) -> Fit:
        limit = deadline.current()
        if limit is None:
            return solve(*args, **options)
        limit.cut = False
        try:
            result = solve(*args, **options)
        except InputError as error:
            if not limit.cut or isinstance(error, TimeUp):
                raise
            raise TimeUp(limit.message(deadline.searching(limit))) from error
        if not limit.cut:
            return result
        note = (
            f"The search stopped after {limit.seconds:g} s (--time-limit); the result is the best map so far."
        )
        ended = Status.LIMIT if result.ended.ok else result.ended
        return replace(result, ended=ended, notes=[*result.notes, note])

    return timed  # type: ignore[return-value]


@plain_signature
@on_one_thread
@_within_time
def fit(
    source: Outline,
    target: Outline,
    *,
    pins: Points | Sequence[Pin | Points] | None = None,
    strokes: Sequence[tuple[Points, Points] | Stroke] | None = None,
    source_holes: Sequence[Outline] = (),
    target_holes: Sequence[Outline] = (),
    hole_partners: Sequence[tuple[int, int]] = (),
    rigid: Sequence[Outline] = (),
    rigid_target: Sequence[Outline] = (),
    importance: Any = None,
    size_map: Any = None,
    start: Fit | TriangulatedMap | None = None,
    opaque: bool = True,
    free_gaps: bool = False,
    axes: str = "xy",
    progress: Callable[[Progress], object] | None = None,
    cancel: Callable[[], bool] | None = None,
    **options: Unpack[OptionValues],
) -> Fit:
    """Map the source onto the target: outline onto outline, or whole drawing onto whole drawing.

    Parameters
    ----------
    source, target
        The two shapes. An outline: (n,) complex vertices x + iy with y up, in either orientation; pairs (n, 2); a
        shapely polygon with its holes (also an item of a GeoSeries, or a GeoJSON geometry); a trimesh path; a contour
        of scikit-image or OpenCV (see `axes`); or a result of `iccm.read_shape` or `iccm.flatten`. A whole drawing: a
        MultiPolygon, a GeoSeries, or a list of rings (arrays) filled by the even-odd rule; a frame around all parts of
        one drawing is then mapped onto a frame around the other. With a flattened surface, the scale is uniform on
        the surface, and figures describe the surface.
    pins
        Points of the source and their places in the target: (k, 2) complex or (k, 2, 2) pairs, or a list of `iccm.Pin`.
        Either both are inside, or both are on the outlines. The balanced method pulls a patch around each inner pin to
        its place, which may miss it a little; with `exact_pins` it meets all exactly.
    strokes
        Pairs of open polylines: (p,) in the source, and (q,) in the target, onto which it is mapped. Its ends slide
        along the target, unless a pin fixes them or they are on the outlines. Strokes may divide the shapes or follow
        both outlines. Strokes and pins on the outlines are hard constraints of the balanced method; the
        other methods weight them.
    source_holes, target_holes
        Outlines of holes, in addition to those of polygons. The balanced method maps each onto a hole of the other
        shape. If one shape has more, the unmatched ones shrink to slits.
    hole_partners
        (i, j) for holes that must be mapped onto each other, counted from 0; the others are paired by position and
        size.
    rigid
        Outlines of regions of the source that keep their shape: each connected region is mapped by a
            similarity, and is upright if the map is (balanced; see also `rigid_size`). For a surface they are
            polygons in its layout, whose triangles keep the shape of a separate flattening of the region.
    rigid_target
        Regions of the target on which the picture is undistorted. Use either this or `rigid`.
    importance
        (h, w) weights of distortion, row 0 on top, over the source's bounding box, or over a given box: (picture,
        (lower left, upper right)). Weights below a tenth of the largest are raised to it (balanced).
    size_map
        (h, w) desired scale, as lengths relative to each other, over the same boxes as `importance`. A larger `balance`
        brings the scale closer to it (balanced).
    start
        An earlier balanced map to start from; no other starting points are tried, so that the picture does not jump.
        Either a map of these domains whose constraints have moved (if inner pins have the same source points, the mesh
        is kept), or a map of the shapes in the previous frame, which is moved with their outlines (not for surfaces).
        Maps of flattened surfaces with holes are computed afresh.
    opaque
        For drawings: whether the texture also covers the gaps between the source's parts.
    free_gaps
        For drawings: whether these gaps may be shown at no cost, as with a pattern that has no background.
    axes
        Meaning of pairs and polygons: "xy", y up; "screen", x and y with y down (OpenCV, SVG); "image", rows and
        columns of pixels (NumPy, `skimage.measure.find_contours`). Polygons consist of x and y. Complex numbers are
        always x + iy with y up. `fit.map` and `fit.inverse` accept and return pairs in the same axes.
    progress
        A function that is called with an `iccm.Progress` from time to time.
    cancel
        A function that is called from time to time; when it returns true, `iccm.Cancelled` is raised.
    **options
        See `iccm.options.Options`: `method`, `turn`, `fit`, `balance`, `effort`, `tolerance` and others.

    Returns
    -------
    Fit
        The map, the status of the solver, and figures about its quality. Failure to converge is a status, not an
        exception.

    Raises
    ------
    InputError
        A boundary that is not a simple polygon, a hole that is not inside or touches another, a constraint outside the
        source, an option out of range, holes for a method that does not support them; with the balanced method also
        constraints that no one-to-one map can meet.
    Cancelled
        `cancel` returned true.

    Examples
    --------
    >>> import numpy as np
    >>> square = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    >>> found = fit(square, [3, 2] * square)
    >>> found.status.ok, complex(np.round(found.map(0.5 + 0.25j), 3))
    (True, (1.5+0.5j))
    >>> np.round(found.map(np.array([[0.5, 0.25]])), 3)
    array([[1.5, 0.5]])
    >>> np.round(found.inverted()([1.5, 0.5]), 3)
    array([0.5 , 0.25])
    """
    settings = _options(fit, options)
    points, softness = pins_of(pins, axes)
    lines, widths = strokes_of(strokes, axes)
    constraints = _Constraints(
        pins=points,
        softness=softness,
        strokes=lines,
        stroke_widths=widths,
        rigid=[_points(ring, f"rigid region {k + 1}", axes) for k, ring in enumerate(rigid)],
        rigid_target=[_points(ring, f"rigid region {k + 1}", axes) for k, ring in enumerate(rigid_target)],
        importance=importance,
        size_map=size_map,
        start=start,
    )
    sides = [
        _Side(
            shape,
            outlines_of(shape, name, axes) if drawing is None else None,
            drawing,
            [_points(hole, f"{name} hole {k + 1}", axes) for k, hole in enumerate(holes)],
            name,
        )
        for shape, name, holes in ((source, "source", source_holes), (target, "target", target_holes))
        for drawing in [drawing_of(shape, name, axes)]
    ]
    side_pair = sides[0], sides[1]
    with listening(progress, cancel):
        on_surface = any(side.is_surface for side in side_pair)
        if on_surface and settings.place != "fill":
            raise InputError(
                f"place: {settings.place} only works for planar drawings; leave it out for a mesh"
            )
        if (
            any(side.drawing is not None for side in side_pair) or settings.place != "fill"
        ) and not on_surface:
            return _fit_drawings(side_pair, constraints, settings, hole_partners, axes, opaque, free_gaps)
        return _fit_outlines(side_pair, constraints, settings, hole_partners, axes)


@dataclass(frozen=True)
class _Constraints:
    """The constraints of a map, as for `fit`, with points as complex numbers."""

    pins: Any
    softness: Softness | None
    strokes: Any
    stroke_widths: Sequence[float]
    rigid: Sequence[Any]
    rigid_target: Sequence[Any]
    importance: Any
    size_map: Any
    start: Fit | TriangulatedMap | None

    @property
    def points(self) -> Complex:
        """(k, 2) points and their images: the pins, and the ends of strokes.

        Raises:
            InputError: they are not pairs of points.
        """
        strokes = [as_strokes(k, pair) for k, pair in enumerate(self.strokes or [])]
        ends = [(a.z[k], b.z[k]) for a, b in strokes for k in (0, -1)]
        return np.concatenate([as_pins(self.pins), np.reshape(np.array(ends, complex), (-1, 2))])

    @property
    def refer_to_outlines(self) -> bool:
        """Whether there are constraints that are given for the outlines of the shapes: all but pins."""
        values = (self.strokes, self.rigid, self.rigid_target, self.importance, self.size_map)
        return any(
            value is not None and not (isinstance(value, Sized) and len(value) == 0) for value in values
        )


@dataclass(frozen=True)
class _Side:
    """The source or the target.

    Attributes:
        shape: as given.
        given_outlines: its outline and holes; None for drawings.
        drawing: the whole drawing that it is; None for outlines.
        given_holes: outlines of holes that were given separately.
        name: "source" or "target", for messages.
    """

    shape: Any
    given_outlines: Outlines | None
    drawing: Drawing | None
    given_holes: Sequence[Any]
    name: str

    @property
    def is_surface(self) -> bool:
        """Whether it is a surface flattened into the plane."""
        return flattening_of(self.shape) is not None

    @property
    def outlines(self) -> Outlines:
        """Its outline and those of its holes; for a drawing those of the tightest frame.

        Raises:
            InputError: holes were given for a shape that has its own.
        """
        outlines = self.given_outlines
        if outlines is None:
            assert self.drawing is not None
            holes = tuple(hole.z for hole in self.drawing.mappable_holes)
            outlines = Outlines(self.drawing.tightest.outline, holes)
        if self.given_holes and outlines.holes:
            raise InputError(f"{self.name}_holes: the shape already has holes; remove one of the two")
        return Outlines(outlines.outline, tuple(self.given_holes)) if self.given_holes else outlines

    def with_outline(self, outline: Curve, holes: Sequence[Curve]) -> _Side:
        """Return the side with an outline that replaces its drawing."""
        outlines = Outlines(outline, tuple(hole.z for hole in holes))
        return replace(self, given_outlines=outlines, drawing=None, given_holes=())


def _fit_drawings(
    sides: tuple[_Side, _Side],
    constraints: _Constraints,
    settings: Options,
    partners: Sequence[tuple[int, int]],
    axes: str,
    opaque: bool,
    free_gaps: bool,
) -> Fit:
    """Return the map between two drawings, one of which may have been given as an outline."""
    from .frames.placed import fit_placed
    from .frames.solve import fit_drawings

    def solve_outlines(
        source: Curve,
        target: Curve,
        source_holes: Sequence[Curve],
        target_holes: Sequence[Curve],
        options: Options,
        *,
        pinned: bool = True,
    ) -> Fit:
        used_sides = sides[0].with_outline(source, source_holes), sides[1].with_outline(target, target_holes)
        hole_partners = partners if source_holes or target_holes else ()
        used_constraints = constraints if pinned else replace(constraints, pins=None, softness=None)
        return _fit_outlines(used_sides, used_constraints, options, hole_partners, axes, advised=advised)

    advised = bool(
        {"whole", "keep"} & {settings.fit, settings.holes}
    )  # otherwise frames were compared, not requested
    source, target = (side.drawing or _drawing_of_outlines(side.outlines, side.name) for side in sides)
    if settings.place != "fill":
        result = fit_placed(source, target, settings, solve_outlines, pins=constraints.points, opaque=opaque)
        pins = as_pins(constraints.pins)
        return replace(result, opaque=opaque, pins=pins, softness=Softness.exact(len(pins)))
    searched = (
        not constraints.refer_to_outlines and not partners and settings.is_balanced and settings.balance <= 1
    )
    searched = searched and settings.max_dilatation is None and settings.max_stretch is None
    # pins in holes pair holes, which frames do not have
    pins = as_pins(constraints.pins)
    searched = searched and not _are_in_holes(pins, source, target)
    result = fit_drawings(
        source,
        target,
        settings,
        solve_outlines,
        free_gaps=free_gaps,
        searched=searched,
        pinned=len(pins) > 0,
        start=_map_of(constraints.start),
    )
    return replace(result, opaque=opaque)


def _are_in_holes(pins: Complex, source: Drawing, target: Drawing) -> bool:
    """Return whether an end of a pin (k, 2) is in a hole of its drawing that can be mapped."""
    sides = ((source, pins[:, 0]), (target, pins[:, 1]))
    return any(inside_any(drawing.mappable_holes, points).any() for drawing, points in sides)


def _drawing_of_outlines(outlines: Outlines, name: str) -> Drawing:
    """Return the drawing with one part that an outline with holes encloses."""
    outer = as_domain(outlines.outline, name)
    holes = [as_domain(hole, f"{name} hole {k + 1}").z for k, hole in enumerate(outlines.holes)]
    return Drawing(polygon_of(outer.z, *holes))


def _fit_outlines(
    sides: tuple[_Side, _Side],
    constraints: _Constraints,
    settings: Options,
    partners: Sequence[tuple[int, int]],
    axes: str,
    *,
    advised: bool = True,
) -> Fit:
    """Return the map between two outlines with their holes, or between surfaces."""
    settings = replace(settings, fit=fits.of_outlines(settings.fit))
    outlines = sides[0].outlines, sides[1].outlines
    holes: tuple[Sequence[Any], Sequence[Any]] = outlines[0].holes, outlines[1].holes
    if not settings.is_balanced and not any(side.given_holes for side in sides):
        holes = (), ()  # holes of polygons: other methods fill them
    problem = Problem.of(
        outlines[0].outline,
        outlines[1].outline,
        constraints.pins,
        constraints.strokes,
        holes=holes,
        partners=partners,
        rigid=constraints.rigid,
        rigid_target=constraints.rigid_target,
        importance=constraints.importance,
        size_map=constraints.size_map,
        softness=constraints.softness,
        stroke_widths=constraints.stroke_widths,
        reach=ON_OUTLINE_SHARE if settings.is_balanced else NEAR_SHARE,
        pins_inside=not settings.is_balanced,
    )
    layouts = flattening_of(sides[0].shape), flattening_of(sides[1].shape)
    result = _solve(problem, settings, layouts, constraints.start, advised=advised)
    return _with_axes(result, axes, (sides[0].shape, sides[1].shape))


def _solve(
    problem: Problem,
    settings: Options,
    layouts: tuple[Flattening | None, Flattening | None],
    start: Fit | TriangulatedMap | None,
    *,
    advised: bool,
) -> Fit:
    """Solve a problem by the requested method; see `balanced.fit.solve` for `advised`."""
    start_map = _map_of(start)
    if settings.keep_start and (start_map is None or any(layouts)):
        reason = (
            "does not work with surfaces; leave it out" if any(layouts) else "needs the map to keep, start"
        )
        raise InputError(f"keep_start: {reason}")
    capabilities.refuse(
        _constraint_names(problem, start_map), _method_of(settings), _kind_of(layouts), settings.fit
    )
    if settings.method == "paper":
        from .paper import algorithm1

        return _complete_result(settings, algorithm1.solve(problem, settings), layouts)
    if not settings.is_balanced:
        from .conformal import method as conformal

        return _complete_result(settings, conformal.solve(problem, settings), layouts)
    if any(layouts):
        from .surfaces import method as surfaces
        from .surfaces import partial

        if fits.leaves_out_parts(settings.fit):
            result = partial.solve(problem, settings, layouts)
            if result is not None:
                return result
            settings = replace(settings, fit="whole")
        return surfaces.solve(problem, settings, layouts, start_map)
    from .balanced import fit as balanced

    return balanced.solve(problem, settings, start_map, advised=advised)


def _complete_result(
    settings: Options, result: Fit, layouts: tuple[Flattening | None, Flattening | None] = (None, None)
) -> Fit:
    """Complete the result of a method that weights constraints.

    It gets the layouts, the method's tolerance, and a note if constraints determined the choice of the method.
    """
    notes = [_switch_note(settings), *result.notes] if settings.switched_by else result.notes
    return replace(result, layouts=layouts, tolerance=settings.tolerance, notes=notes)


def _switch_note(settings: Options) -> str:
    name = settings.switched_by.replace("_", "-")
    return f"using --method conformal because of --{name}, which the default method does not support"


def _constraint_names(problem: Problem, start: TriangulatedMap | None) -> set[str]:
    """Return the names of the constraints of a problem, as in `capabilities`."""
    names = ("strokes", "source_holes", "target_holes", "rigid", "rigid_target", "importance", "size_map")
    constraint_names = {name for name in names if getattr(problem, name)}
    if any(problem.stroke_widths):
        constraint_names.add(capabilities.STROKE_WIDTHS)
    # Not for exact pins, which fix the ends of strokes with every method.
    if problem.softness.is_given.any():
        constraint_names.add(capabilities.PATCHES)
    if problem.softness.has_derivative.any():
        constraint_names.add(capabilities.PATCH_DERIVATIVES)
    return constraint_names if start is None else constraint_names | {"start"}


def _method_of(settings: Options) -> str:
    """Return the name of the method that solves."""
    if settings.is_balanced:
        return "balanced"
    return "paper" if settings.method == "paper" else "conformal"


def _kind_of(layouts: tuple[Flattening | None, Flattening | None]) -> capabilities.Kind:
    """Return the kind of the problem: which of the two shapes are surfaces."""
    if all(layouts):
        return "between surfaces"
    if layouts[0]:
        return "from surface"
    return "onto surface" if layouts[1] else "plane"


def _options(function: Callable[..., Fit], options: OptionValues) -> Options:
    """Return the options with which a function was called; for a misspelt name, the nearest one is suggested."""
    values: dict[str, Any] = {}
    for name, value in options.items():
        if name in FORMER_NAMES:
            new = FORMER_NAMES[name]
            warnings.warn(
                f"{name}: is now {new}; the old name works until iccm 2", FutureWarning, stacklevel=4
            )
            values[new] = value
        else:
            values[name] = value
    refuse_unknown(function, values)
    return Options(**values)


def refuse_unknown(
    function: Callable[..., Any], options: Mapping[str, object], passed_to: Callable[..., Any] | None = None
) -> None:
    """Raise a TypeError, which suggests the nearest name, if an option is unknown.

    Args:
        function: the function that was called.
        options: its keyword arguments.
        passed_to: another function whose arguments are allowed too.
    """
    names = [field.name for field in fields(Options)]
    names += inspect.signature(passed_to).parameters if passed_to else []
    unknown = next((name for name in options if name not in names), None)
    if unknown is not None:
        allowed = [*inspect.signature(function).parameters, *names]
        suggestion = "".join(f"; did you mean {name!r}?" for name in get_close_matches(unknown, allowed, 1))
        raise TypeError(f"{function.__name__}() got an unexpected keyword argument {unknown!r}{suggestion}")


def _points(shape: Outline, name: str, axes: str) -> Any:
    """Return the outline of a hole or of a region."""
    return outlines_of(shape, name, axes).outline


def _with_axes(result: Fit, axes: str, shapes: tuple[Outline, ...]) -> Fit:
    """Return the result with the axes of both sides."""
    sides = [_side(axes, shape) for shape in shapes]
    axis_pair = (sides[0], sides[-1])
    map = result.map if axis_pair == result.map.axes else replace(result.map, axes=axis_pair)
    return replace(result, map=map, axes=axis_pair)


def _side(axes: str, shape: Outline) -> str:
    """Return the axes of a shape: for shapes that are read from files or flattened, pairs are x and y, y up."""
    return axes if not isinstance(shape, Curve | Flattening) and not hasattr(shape, "curve") else "xy"


@plain_signature
@on_one_thread
@_within_time
def deform(
    source: Outline,
    *,
    pins: Points | Sequence[Pin | Points] | None = None,
    strokes: Sequence[tuple[Points, Points] | Stroke] | None = None,
    source_holes: Sequence[Outline] = (),
    rigid: Sequence[Outline] = (),
    start: Fit | TriangulatedMap | None = None,
    axes: str = "xy",
    progress: Callable[[Progress], object] | None = None,
    cancel: Callable[[], bool] | None = None,
    **options: Unpack[OptionValues],
) -> Fit:
    """Deform a shape by pins and strokes, without a target.

    With the balanced method, pins draw the patches around them to their places (exactly with `exact_pins`),
    strokes are met, the map does not fold, and every part stays as rigid as they permit. The outline may
    overlap itself, which the status reports. The other methods weight pins and strokes (paper §3.3), and need
    the smoothness energy to be well posed.

    Args:
        source: as for `fit`.
        pins: (k, 2) complex, a point inside the source or on its outline, and its image, which may be anywhere.
        strokes: as for `fit`; their images may be anywhere.
        source_holes: outlines of holes, (p,) complex; they move freely with the shape. A hole that contains a pin or a
            stroke moves as if it were filled (balanced).
        rigid: outlines of regions ("bones") that keep their shape and size, and rotate with their surroundings.
            Two pins in a region determine its rotation and size. The rest of the shape is soft (balanced).
        start: an earlier deformation of the same shape to start from. Use it for rotations by more than half a
            revolution, in steps. With pins at the same source points the mesh is kept, which takes hundredths of a
            second (balanced).
        axes, progress, cancel: as for `fit`.
        **options: see `iccm.options.Options`.

    Raises:
        InputError: as for `fit`, or there are neither pins nor strokes.

    Examples:
        >>> import numpy as np
        >>> bar = np.array([0, 4, 4 + 1j, 1j])
        >>> bent = deform(bar, pins=[(0.5 + 0.5j, 0.5 + 0.5j), (3.5 + 0.5j, 3 + 2j)])
        >>> bent.status.ok, complex(np.round(bent.map(3.5 + 0.5j), 1))
        (True, (3+2j))
    """
    settings = _options(deform, options)
    reach = ON_OUTLINE_SHARE if settings.is_balanced else NEAR_SHARE
    outlines = outlines_of(source, "source", axes)
    points, softness = pins_of(pins, axes)
    lines, widths = strokes_of(strokes, axes)
    holes = [_points(hole, f"source hole {k + 1}", axes) for k, hole in enumerate(source_holes)]
    problem = Problem.of(
        outlines.outline,
        None,
        points,
        lines,
        softness=softness,
        stroke_widths=widths,
        holes=(holes or (outlines.holes if settings.is_balanced else ()), ()),
        reach=reach,
        rigid=[_points(ring, f"rigid region {k + 1}", axes) for k, ring in enumerate(rigid)],
    )
    if not problem.pins.size and not problem.strokes:
        raise InputError("deform: no pins or strokes are given; add at least one")
    with listening(progress, cancel):
        result = _deform(problem, settings, start, options)
    return _with_axes(result, axes, (source,))


def _deform(
    problem: Problem, settings: Options, start: Fit | TriangulatedMap | None, options: OptionValues
) -> Fit:
    """Return the deformation of a problem by the requested method."""
    if settings.is_balanced:
        from .balanced import fit as balanced

        if settings.rigid_size is not None:
            raise InputError("rigid_size: does not apply to deform, where rigid regions keep their size")
        if settings.turn is not None:
            raise InputError("turn: does not apply to deform, where pins and strokes determine the rotation")
        if settings.keep_start:
            raise InputError("keep_start: does not apply to deform; leave it out")
        return balanced.deform(problem, settings, _map_of(start))
    capabilities.refuse(
        _constraint_names(problem, _map_of(start)), _method_of(settings), "plane", settings.fit
    )
    from .paper import algorithm1

    weighed = Options(**OptionValues(smoothness=1e-4, order=0, max_iterations=100) | options)
    return _complete_result(settings, algorithm1.deform(problem, weighed))


def _map_of(start: Fit | TriangulatedMap | None) -> TriangulatedMap | None:
    if isinstance(start, Fit) and start.filled is not None:
        raise InputError("start: cannot continue from a partial map; compute it with fit='whole'")
    map = start.map if isinstance(start, Fit) else start
    if map is not None and not isinstance(map, TriangulatedMap):
        raise InputError("start: not a balanced map, nor a result that contains one")
    return map
