"""The entry points: `fit` and `deform`, the roof over the methods."""

import inspect
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields, replace
from difflib import get_close_matches
from typing import Any, Unpack

from numpy.typing import ArrayLike

from .arrays import Box
from .blas import on_one_thread
from .curve import Curve
from .errors import InputError
from .maps.triangulated.map import TriangulatedMap
from .meshes.flatten import Flattening
from .problem import NEAR, ON_OUTLINE, Options, OptionValues, Problem
from .result import Fit, Status

FORMER_NAMES = {"starts": "effort"}
"""Options by the names that they used to have."""

__all__ = ["Fit", "Status", "deform", "fit"]


@on_one_thread
def fit(
    source: ArrayLike | Curve | Flattening,
    target: ArrayLike | Curve | Flattening,
    *,
    pins: ArrayLike | None = None,
    strokes: Sequence[tuple[ArrayLike, ArrayLike]] | None = None,
    source_holes: Sequence[ArrayLike | Curve] = (),
    target_holes: Sequence[ArrayLike | Curve] = (),
    hole_partners: Sequence[tuple[int, int]] = (),
    rigid: Sequence[ArrayLike | Curve] = (),
    rigid_target: Sequence[ArrayLike | Curve] = (),
    importance: ArrayLike | tuple[ArrayLike, Box] | None = None,
    size_map: ArrayLike | tuple[ArrayLike, Box] | None = None,
    start: Fit | TriangulatedMap | None = None,
    **options: Unpack[OptionValues],
) -> Fit:
    """A map of the source domain onto the target domain: balanced, conformal, or as the paper has it.

    Args:
        source: (n,) complex vertices of the source's boundary, x + iy, y up, either way round, or (n, 2) real ones, as
            wherever points are taken; or a surface laid out in the plane: the balanced method is then even on the
            surface, and figures are the surface's.
        target: (m,) complex vertices of the target's boundary, or a surface.
        pins: (k, 2) complex or (k, 2, 2) real, a point inside the source and the point it should go to; on the outlines
            both must be.
        strokes: pairs of open polylines, (p,) inside the source and (q,) the one it should lie on. Its ends slide along
            that, unless a pin takes one to an end of it, or it is on the outlines. The balanced method meets pins and
            strokes, which may part the shapes or run along both outlines; the others weigh them.
        source_holes: outlines of the source's holes, (p,) complex, either way round; the balanced method takes each
            onto one of the target's. Where one shape has more, what is too much shrinks to a slit in the other.
        target_holes: those of the target's.
        hole_partners: (i, j) for holes that must go together, counted from 0; the others go by place and size.
        rigid: outlines of regions of the source that keep their form, (p,) complex: each connected one moves as a
            whole, by a similarity, upright if the map is. Of the balanced method; see also `rigid_size`. Of a surface
            they are polygons of its layout, whose triangles keep the form that they have laid flat by themselves.
        rigid_target: likewise regions of the target, on which nothing is to be bent; instead of `rigid`.
        importance: (h, w) how much distortion hurts, row 0 on top, over the source's bounding box, or with the box that
            it is over: (picture, (lower left, upper right)). A tenth of the largest is the least that counts. Of the
            balanced method, as is the next.
        size_map: (h, w) likewise how large things are to be, as lengths relative to each other. The larger `balance`
            is, the closer sizes are to that.
        start: an earlier balanced map to go on from: no other starts are looked at, so that the picture does not jump.
            Of these domains, where only the constraints have moved: with inner pins at the same points of the source
            the mesh stays. Or of the shapes as they were a frame before: it is carried along as their outlines move
            (not with surfaces). Maps of flattened surfaces with holes are solved for anew.
        **options: see `iccm.problem.Options`.

    Returns:
        The map, how the solver ended, and the figures that judge it. Failure to converge is a status, not an exception.

    >>> import numpy as np
    >>> square = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    >>> found = fit(square, [3, 2] * square)
    >>> found.status.ok, complex(np.round(found.map(0.5 + 0.25j), 3))
    (True, (1.5+0.5j))
    >>> np.round(found.inverted()([1.5, 0.5]), 3)
    array([0.5 , 0.25])

    Raises:
        InputError: a boundary that is no simple polygon, a hole that is not inside or touches another, a constraint
            outside the source, an option out of range, holes for a method that does not know of them;
            with the balanced method also constraints that no one-to-one map meets.
    """
    settings = _options(fit, options)
    holes = source_holes, target_holes
    layouts = _layout(source), _layout(target)
    problem = Problem.of(
        *(_outline(source), _outline(target), pins, strokes),
        first=settings.method == "paper",
        holes=holes,
        partners=hole_partners,
        rigid=rigid,
        rigid_target=rigid_target,
        importance=importance,
        size_map=size_map,
        reach=ON_OUTLINE if settings.is_balanced else NEAR,
        pins_inside=not settings.is_balanced,
    )
    if any(holes) and not settings.is_balanced:
        raise InputError("source_holes, target_holes: the balanced method alone knows of holes")
    if problem.rigid or problem.rigid_target:
        _check_rigid(problem, settings, layouts)
    for name in ("importance", "size_map"):
        if getattr(problem, name) and (not settings.is_balanced or any(layouts)):
            raise InputError(f"{name}: is for the balanced method, between outlines of the plane")
        if getattr(problem, name) and settings.fit in ("contain", "cover"):
            raise InputError(f"{name}: goes with fit whole, or auto, which is whole then")
    before = _map_of(start)
    if before is not None and not settings.is_balanced:
        raise InputError("start: an option of --method balanced")
    if settings.method == "paper":
        from .paper import algorithm1

        return _judged_by(settings, algorithm1.solve(problem, settings), layouts)
    if not settings.is_balanced:
        from .conformal import method as conformal

        return _judged_by(settings, conformal.solve(problem, settings), layouts)
    if any(layouts):
        from .surfaces import method as surfaces
        from .surfaces import partial

        if settings.fit in ("contain", "cover"):
            found = partial.solve(problem, settings, layouts)
            if found is not None:
                return found
            settings = replace(settings, fit="whole")
        return surfaces.solve(problem, settings, layouts, before)
    from .balanced import fit as balanced

    return balanced.solve(problem, settings, before)


def _judged_by(
    settings: Options, found: Fit, layouts: tuple[Flattening | None, Flattening | None] = (None, None)
) -> Fit:
    """The result of a method that weighs constraints, with the tolerance that judges it and a note on the method."""
    notes = [_switch_note(settings), *found.notes] if settings.switched_by else found.notes
    return replace(found, layouts=layouts, tolerance=settings.tolerance, notes=notes)


def _switch_note(settings: Options) -> str:
    name = settings.switched_by.replace("_", "-")
    return f"using --method conformal because of --{name}, which the default method does not have"


def _check_rigid(
    problem: Problem, settings: Options, layouts: tuple[Flattening | None, Flattening | None]
) -> None:
    """Raise an InputError for rigid regions that no method keeps."""
    name = "rigid" if problem.rigid else "rigid_target"
    if not settings.is_balanced:
        raise InputError(f"{name}: regions are kept by the balanced method")
    if problem.rigid and problem.rigid_target:
        raise InputError("rigid, rigid_target: regions of one side are kept; leave one of the two out")
    if all(layouts):
        raise InputError(f"{name}: regions are not kept between two surfaces; give pins")
    if layouts[1 if problem.rigid else 0]:
        other, side = ("rigid_target", "target") if problem.rigid else ("rigid", "source")
        raise InputError(
            f"{name}: the map follows the triangles of the surface; give {other}, regions of the {side}"
        )
    if any(layouts) and problem.strokes:
        raise InputError(f"{name}: goes without strokes on surfaces; give pins")
    if problem.rigid_target and (problem.importance or problem.size_map):
        raise InputError("rigid_target: goes without importance and size_map")
    if settings.fit in ("contain", "cover"):
        raise InputError(f"{name}: goes with fit whole, or auto, which is whole then")


def _options(function: Callable[..., Fit], options: OptionValues) -> Options:
    """The options that a function was called with; a misspelt name is told the nearest."""
    values: dict[str, Any] = {}
    for name, value in options.items():
        if name in FORMER_NAMES:
            new = FORMER_NAMES[name]
            warnings.warn(
                f"{name}: is called {new} now; the old name works until iccm 2", FutureWarning, stacklevel=4
            )
            values[new] = value
        else:
            values[name] = value
    refuse_unknown(function, values)
    return Options(**values)


def refuse_unknown(
    function: Callable[..., Any], options: Mapping[str, object], passed_to: Callable[..., Any] | None = None
) -> None:
    """Raise a TypeError that names the nearest if a name is neither an option nor of the function passed to."""
    names = [each.name for each in fields(Options)]
    names += inspect.signature(passed_to).parameters if passed_to else []
    unknown = next((name for name in options if name not in names), None)
    if unknown is not None:
        known = [*inspect.signature(function).parameters, *names]
        near = "".join(f"; did you mean {name!r}?" for name in get_close_matches(unknown, known, 1))
        raise TypeError(f"{function.__name__}() got an unexpected keyword argument {unknown!r}{near}")


def _layout(shape: ArrayLike | Curve | Flattening) -> Flattening | None:
    return shape if isinstance(shape, Flattening) else None


def _outline(shape: ArrayLike | Curve | Flattening) -> ArrayLike | Curve:
    return shape.boundary if isinstance(shape, Flattening) else shape


@on_one_thread
def deform(
    source: ArrayLike | Curve,
    *,
    pins: ArrayLike | None = None,
    strokes: Sequence[tuple[ArrayLike, ArrayLike]] | None = None,
    source_holes: Sequence[ArrayLike | Curve] = (),
    rigid: Sequence[ArrayLike | Curve] = (),
    start: Fit | TriangulatedMap | None = None,
    **options: Unpack[OptionValues],
) -> Fit:
    """Move a shape by pins and strokes alone, without a target boundary.

    By the balanced method they are met, nothing folds, and every part stays as rigid as that allows; its outline may
    come to overlap itself, which the status tells. The other methods weigh them (paper §3.3), and need the smoothness
    energy to be well posed.

    Args:
        source: as for `fit`.
        pins: (k, 2) complex, a point inside the source, or on its outline, and the point it should go to, anywhere.
        strokes: as for `fit`; they may go anywhere.
        source_holes: outlines of holes, (p,) complex; they move freely with the shape. One that holds a pin or a stroke
            is moved as if it were filled. Of the balanced method.
        rigid: bones: outlines of regions that keep their form and size, and turn with what is around them; two pins in
            one say how, and its size. What is not in one is soft. Of the balanced method.
        start: an earlier deformation of the same shape, to go on from: motions larger than half a turn come out right
            in steps. With pins at the same points of the source it keeps its mesh, and takes hundredths of a second.
            Of the balanced method.
        **options: see `iccm.problem.Options`.

    Raises:
        InputError: as `fit`; no pins and no strokes.

    >>> import numpy as np
    >>> bar = np.array([0, 4, 4 + 1j, 1j])
    >>> bent = deform(bar, pins=[(0.5 + 0.5j, 0.5 + 0.5j), (3.5 + 0.5j, 3 + 2j)])
    >>> bent.status.ok, complex(np.round(bent.map(3.5 + 0.5j), 6))
    (True, (3+2j))
    """
    settings = _options(deform, options)
    reach = ON_OUTLINE if settings.is_balanced else NEAR
    problem = Problem.of(source, None, pins, strokes, holes=(source_holes, ()), reach=reach, rigid=rigid)
    if not problem.pins.size and not problem.strokes:
        raise InputError("deform: no pins and no strokes; give at least one")
    if settings.is_balanced:
        from .balanced import fit as balanced

        if settings.rigid_size is not None:
            raise InputError("rigid_size: bones of a shape that is deformed keep their size")
        if settings.turn is not None:
            raise InputError("turn: a shape that is deformed turns as its pins and strokes do")
        return balanced.deform(problem, settings, _map_of(start))
    if start is not None:
        raise InputError("start: an option of --method balanced")
    if rigid:
        raise InputError("rigid: regions are kept by the balanced method")
    if source_holes:
        raise InputError("source_holes: the balanced method alone knows of holes")
    from .paper import algorithm1

    weighed = Options(**OptionValues(smoothness=1e-4, order=0, max_iterations=100) | options)
    return _judged_by(settings, algorithm1.deform(problem, weighed))


def _map_of(start: Fit | TriangulatedMap | None) -> TriangulatedMap | None:
    if isinstance(start, Fit) and start.filled is not None:
        raise InputError(
            "start: is a partial map, which is not gone on from; solve that one with fit='whole'"
        )
    found = start.map if isinstance(start, Fit) else start
    if found is not None and not isinstance(found, TriangulatedMap):
        raise InputError("start: is no balanced map, nor the result that holds one")
    return found
