"""The entry points `fit` and `deform`, which check the input and call one of the methods."""

from __future__ import annotations

import inspect
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields, replace
from difflib import get_close_matches
from functools import wraps
from typing import TYPE_CHECKING, Any, TypeVar, Unpack

import numpy as np

from . import capabilities, deadline, fits
from .arrays import Complex
from .axes import Axes
from .blas import on_one_thread
from .curve import Curve
from .deadline import TimeUp
from .drawings.drawing import Drawing
from .errors import InputError
from .fit_data import with_details
from .given import Outlines, outline_of, outlines_of, pins_of, refuse_non_sequences, strokes_of
from .maps.triangulated.map import TriangulatedMap
from .meshes.flatten import Flattening
from .options import Options, OptionValues
from .pins import Pin, Softness, Stroke
from .plane import stretched
from .problem import NEAR_SHARE, ON_OUTLINE_SHARE, Problem
from .progress import Progress, listening
from .result import Fit
from .status import Status

if TYPE_CHECKING:
    from .balanced.coarse import CoarseMap
    from .drawings.detail import Detail

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
        ended = Status.LIMIT if result._ended.ok else result._ended
        return replace(result, _ended=ended, notes=[*result.notes, note])

    return timed  # type: ignore[return-value]


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
    choices: Sequence[Any] | None = None,
    detail: Detail | None = None,
    opaque: bool = True,
    free_gaps: bool = False,
    axes: Axes = "xy",
    progress: Callable[[Progress], object] | None = None,
    cancel: Callable[[], bool] | None = None,
    **options: Unpack[OptionValues],
) -> Fit:
    """Map the source onto the target: outline onto outline, or whole drawing onto whole drawing.

    Args:
        source: A shape. An outline: (n,) complex vertices x + iy with y up, in either orientation;
            pairs (n, 2); a shapely polygon with its holes (also an item of a GeoSeries, or a GeoJSON geometry); a
            path of trimesh or matplotlib; a contour of scikit-image or OpenCV (see `axes`); or a result of
            `iccm.read_shape` or `iccm.flatten`. A whole drawing: a MultiPolygon, a GeoSeries, or a list of rings
            (arrays) filled by the even-odd rule; a frame around all parts of one drawing is then mapped onto a frame
            around the other. With a flattened surface, the scale is uniform on the surface, and figures describe the
            surface.
        target: The other shape, in any of these forms.
        pins: Points of the source and their places in the target: (k, 2) complex or (k, 2, 2) pairs, or a list of
            `iccm.Pin`. Either both are inside, or both are on the outlines. The balanced method pulls a patch around
            each inner pin to its place, which may miss it a little; with `exact_pins` it meets all exactly.
        strokes: Pairs of open polylines: (p,) in the source, and (q,) in the target, onto which it is mapped. Its
            ends slide along the target, unless a pin fixes them or they are on the outlines. Strokes may divide the
            shapes or follow both outlines. Strokes and pins on the outlines are hard constraints of the balanced
            method; the other methods weight them.
        source_holes: Outlines of holes of a source that is given as an outline. The balanced method maps
            each onto a hole of the other shape. If one shape has more, the unmatched ones shrink to slits. Holes of
            polygons may be ignored where that costs less, see `holes`.
        target_holes: Those of the target.
        hole_partners: (i, j) for holes that must be mapped onto each other, counted from 0; the others are paired by
            position and size.
        rigid: Outlines of regions of the source that keep their shape: each connected region is mapped by a
            similarity, and is upright if the map is (balanced; see also `rigid_size`). For a surface they are
            polygons in its layout, whose triangles keep the shape of a separate flattening of the region.
        rigid_target: Regions of the target on which the picture is undistorted. Use either this or `rigid`.
        importance: (h, w) weights of distortion, row 0 on top, over the source's bounding box, or over a given box:
            (picture, (lower left, upper right)). Weights below a tenth of the largest are raised to it (balanced).
        size_map: (h, w) desired scale, as lengths relative to each other, over the same boxes as `importance`. A
            larger `balance` brings the scale closer to it (balanced).
        start: An earlier balanced map to start from; no other starting points are tried, so that the picture does not
            jump. Either a map of these domains whose constraints have moved (if inner pins have the same source
            points, the mesh is kept), or a map of the shapes in the previous frame, which is moved with their
            outlines (not for surfaces). Maps of flattened surfaces with holes are computed afresh.
        choices: For drawings: ways to map these drawings with these options, from `iccm.frames.choice.choose`, if
            they were compared before. The best that leads to a map without folds is refined.
        detail: For drawings: the edges of the picture that the source shows, a `Detail` of `iccm.drawings.detail`.
            Maps are then compared by what is seen of them, and the picture may be placed upright in the target, with
            paper around.
        opaque: For drawings: whether the texture also covers the gaps between the source's parts.
        free_gaps: For drawings: whether these gaps may be shown at no cost, as with a pattern that has no background.
        axes: Meaning of pairs and polygons: "xy", y up; "screen", x and y with y down (OpenCV, SVG); "image", rows
            and columns of pixels (NumPy, `skimage.measure.find_contours`). Polygons consist of x and y. Complex
            numbers are always x + iy with y up. `fit.map` and `fit.inverse` accept and return pairs in the same axes.
        progress: A function that is called with an `iccm.Progress` from time to time.
        cancel: A function that is called from time to time; when it returns true, `iccm.Cancelled` is raised.
        **options: See `iccm.options.Options`: `method`, `turn`, `fit`, `balance`, `effort`, `tolerance` and others.

    Returns:
        The map, the status of the solver, and figures about its quality. Failure to converge is a status, not an
        exception.

    Raises:
        InputError: A boundary that is not a simple polygon, a hole that is not inside or touches another, a
            constraint outside the source, an option out of range, holes for a method that does not support them; with
            the balanced method also constraints that no one-to-one map can meet.
        Cancelled: `cancel` returned true.

    Examples:
        >>> import numpy as np, iccm
        >>> square = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
        >>> found = iccm.fit(square, [3, 2] * square)
        >>> found.status.ok, complex(np.round(found.map(0.5 + 0.25j), 3))
        (True, (1.5+0.5j))
        >>> np.round(found.map(np.array([[0.5, 0.25]])), 3)
        array([[1.5, 0.5]])
        >>> np.round(found.transform.inverse([1.5, 0.5]), 3)
        array([0.5 , 0.25])
    """
    settings = _options(fit, options)
    refuse_non_sequences(
        strokes=() if strokes is None else strokes,
        source_holes=source_holes,
        target_holes=target_holes,
        hole_partners=hole_partners,
        rigid=rigid,
        rigid_target=rigid_target,
        terms=settings.terms,
    )
    points, softness = pins_of(pins, axes)
    lines, widths = strokes_of(strokes, axes)
    given = (
        outlines_of(source, "source", axes, source_holes),
        outlines_of(target, "target", axes, target_holes),
    )
    on_surface = any(side.layout is not None for side in given)
    if on_surface and settings.place != "fill":
        raise InputError(f"place: {settings.place} only works for planar drawings; leave it out for a mesh")
    if len(hole_partners) and not (given[0].holes and given[1].holes):
        raise InputError("hole_partners: at least one of the shapes has no holes; leave it out")
    with listening(progress, cancel):
        problem = Problem.of(
            given[0].outline,
            given[1].outline,
            points,
            lines,
            rigid=[_points(ring, f"rigid region {k + 1}", axes) for k, ring in enumerate(rigid)],
            rigid_target=[
                _points(ring, f"rigid region {k + 1}", axes) for k, ring in enumerate(rigid_target)
            ],
            importance=importance,
            size_map=size_map,
            softness=softness,
            stroke_widths=widths,
            partners=hole_partners,
        )
        is_drawn = settings.is_balanced or settings.place != "fill" or any(side.drawing for side in given)
        if is_drawn and not on_surface:
            result = _fit_drawings(
                problem, given, settings, start, choices, opaque=opaque, free_gaps=free_gaps, detail=detail
            )
        else:
            # other methods fill the holes of polygons
            holes = [side.holes if settings.is_balanced or side.holes_are_separate else () for side in given]
            result = _solve(problem.between(holes=(holes[0], holes[1])), settings, given, start)
    return _with_axes(result, axes, (source, target))


def _fit_drawings(
    problem: Problem,
    given: tuple[Outlines, Outlines],
    settings: Options,
    start: Fit | TriangulatedMap | None,
    choices: Sequence[Any] | None,
    *,
    opaque: bool,
    free_gaps: bool,
    detail: Detail | None,
) -> Fit:
    """Return the map between two drawings, of which outlines are those of one part."""
    from .frames.placed import fit_placed
    from .frames.solve import DrawingPair, fit_drawings

    def solve_outlines(
        source: Curve,
        target: Curve,
        source_holes: Sequence[Curve],
        target_holes: Sequence[Curve],
        options: Options,
        *,
        pinned: bool = True,
        coarse: CoarseMap | None = None,
        stretch: float = 1.0,
    ) -> Fit:
        framed = problem if pinned else problem.without_pins()
        framed = framed.between((source, target), (source_holes, target_holes))
        if stretch == 1:
            return _solve(framed, options, given, start, coarse)
        begun = _map_of(start)
        begun = None if begun is None else _with_width(begun, stretch)
        fit = _solve(framed.stretched(stretch), options, given, begun, coarse)
        assert isinstance(fit.map, TriangulatedMap)  # only the balanced method chooses a stretch
        pins = np.stack([stretched(fit.pins[:, 0], 1 / stretch), fit.pins[:, 1]], axis=1)
        return replace(fit, map=_with_width(fit.map, 1 / stretch), source=framed.source, pins=pins)

    source, target = given[0].as_drawing("source"), given[1].as_drawing("target")
    if settings.is_balanced and any(side.holes_are_separate for side in given):
        settings = replace(settings, holes="keep")  # they were given to be mapped
    pair = DrawingPair(source, target, settings, solve_outlines, free_gaps=free_gaps, opaque=opaque)
    if settings.place != "fill":
        result = replace(fit_placed(pair, pins=problem.ends, detail=detail), pins=problem.pins)
        return with_details(result, softness=Softness.exact(len(problem.pins)))
    searched = settings.is_balanced and settings.balance <= 1 and not settings.has_bounds
    searched = searched and not problem.refers_to_outlines
    # pins in holes pair holes, which frames do not have
    searched = searched and not _are_in_holes(problem.pins, source, target)
    return fit_drawings(
        pair, searched=searched, pins=problem.pins, start=_map_of(start), choices=choices, detail=detail
    )


def _with_width(map: TriangulatedMap, ratio: float) -> TriangulatedMap:
    """Return a map of the plane whose width is stretched by a ratio relative to its height, areas kept."""
    return replace(map, source=stretched(map.source, ratio), bulge=stretched(map.bulges, ratio))


def _are_in_holes(pins: Complex, source: Drawing, target: Drawing) -> bool:
    """Return whether an end of a pin (k, 2) is in a hole of its drawing that can be mapped, or on its outline."""
    sides = ((source, pins[:, 0]), (target, pins[:, 1]))
    return any(
        (hole.contains(points) | (hole.distances(points) <= ON_OUTLINE_SHARE * hole.diagonal)).any()
        for drawing, points in sides
        for hole in drawing.mappable_holes
    )


def _solve(
    problem: Problem,
    settings: Options,
    given: tuple[Outlines, Outlines],
    start: Fit | TriangulatedMap | None,
    coarse: CoarseMap | None = None,
) -> Fit:
    """Solve for the map of two outlines, or of surfaces, by the requested method; see `balanced.fit.solve`."""
    layouts, start_map = (given[0].layout, given[1].layout), _map_of(start)
    reach = ON_OUTLINE_SHARE if settings.is_balanced else NEAR_SHARE
    problem.refuse_outside(reach, pins_inside=not settings.is_balanced)
    if settings.keep_start and (start_map is None or any(layouts)):
        reason = (
            "does not work with surfaces; leave it out" if any(layouts) else "needs the map to keep, start"
        )
        raise InputError(f"keep_start: {reason}")
    fit = fits.of_outlines(settings.fit)
    capabilities.refuse(_constraint_names(problem, start_map), _method_of(settings), _kind_of(layouts), fit)
    settings = replace(settings, fit=fit)
    if settings.method == "paper":
        from . import paper

        return _complete_result(settings, paper.solve(problem, settings), layouts)
    if not settings.is_balanced:
        from . import conformal

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

    return balanced.solve(problem, settings, start_map, coarse=coarse)


def _complete_result(
    settings: Options, result: Fit, layouts: tuple[Flattening | None, Flattening | None] = (None, None)
) -> Fit:
    """Complete the result of a method that weights constraints.

    It gets the layouts, the method's tolerance, and a note if constraints determined the choice of the method.
    """
    notes = [_switch_note(settings), *result.notes] if settings.switched_by else result.notes
    return with_details(replace(result, notes=notes), layouts=layouts, tolerance=settings.tolerance)


def _switch_note(settings: Options) -> str:
    name = settings.switched_by.replace("_", "-")
    return f"using --method conformal because of --{name}, which the default method does not support"


def _constraint_names(problem: Problem, start: TriangulatedMap | None) -> set[str]:
    """Return the names of the constraints of a problem, as in `capabilities`."""
    names = ("strokes", "rigid", "rigid_target", "importance", "size_map")
    constraint_names = {name for name in names if getattr(problem, name)}
    constraint_names |= {f"{side}_holes" for side in ("source", "target") if getattr(problem.holes, side)}
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
    return outline_of(shape, name, axes).outline


def _with_axes(result: Fit, axes: str, shapes: tuple[Outline, ...]) -> Fit:
    """Return the result with the axes of both sides."""
    sides = [_side(axes, shape) for shape in shapes]
    axis_pair = (sides[0], sides[-1])
    map = result.map if axis_pair == result.map.axes else replace(result.map, axes=axis_pair)
    return replace(result, map=map, axes=axis_pair)


def _side(axes: str, shape: Outline) -> str:
    """Return the axes of a shape: for shapes that are read from files or flattened, pairs are x and y, y up."""
    return axes if not isinstance(shape, Curve | Flattening) and not hasattr(shape, "curve") else "xy"


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
    axes: Axes = "xy",
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
        >>> import numpy as np, iccm
        >>> bar = np.array([0, 4, 4 + 1j, 1j])
        >>> bent = iccm.deform(bar, pins=[(0.5 + 0.5j, 0.5 + 0.5j), (3.5 + 0.5j, 3 + 2j)])
        >>> bent.status.ok, complex(np.round(bent.map(3.5 + 0.5j), 1))
        (True, (3+2j))
    """
    settings = _options(deform, options)
    refuse_non_sequences(strokes=() if strokes is None else strokes, source_holes=source_holes, rigid=rigid)
    reach = ON_OUTLINE_SHARE if settings.is_balanced else NEAR_SHARE
    outlines = outline_of(source, "source", axes)
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
        rigid=[_points(ring, f"rigid region {k + 1}", axes) for k, ring in enumerate(rigid)],
    )
    problem.refuse_outside(reach)
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
    from . import paper

    weighed = Options(**OptionValues(smoothness=1e-4, order=0, max_iterations=100) | options)
    return _complete_result(settings, paper.deform(problem, weighed))


def _map_of(start: Fit | TriangulatedMap | None) -> TriangulatedMap | None:
    if isinstance(start, Fit) and start.details.filled is not None:
        raise InputError("start: cannot continue from a partial map; compute it with fit='whole'")
    map = start.map if isinstance(start, Fit) else start
    if map is not None and not isinstance(map, TriangulatedMap):
        raise InputError("start: not a balanced map, nor a result that contains one")
    return map
