"""The layout of a patch: plain least squares where that is one-to-one, else Newton from a layout without folds."""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from ..arrays import Complex, Index, at_vertices
from ..errors import InputError
from ..meshes.cut import extend_cut
from ..meshes.flatten import Flattening, lscm, overlap, upright
from ..meshes.patch import Patch
from . import seams, tutte
from .coarsening import by_coarser, coarser_layout, relaxed
from .free import LARGE_VERTEX_COUNT, Elastic, surface
from .opening import open_up
from .scaffold import relax_with_scaffold

METHODS = ("conformal", "lscm", "balanced")

# Chosen by hand, and nobody knows better, where a line does not say how a number was found.
SEAM_ROUNDS = 12  # of lengthening the seam of a surface that had to be cut
COARSE_SEAM_VERTICES = 10_000
"""Vertices from which a seam grows on a coarser triangulation, which has over a thousand then; with 800 of 50,000 seams
were up to a fifth longer."""
EVEN_AREA_SPREAD = 2.0  # spread of log10 area (p05 to p95) at which a seam is long enough for least squares
STRETCHED_P95 = 1.5
"""P95 of the stretch of an even layout from which the seam is too short: 1.6 left some less even."""
NEWTON_STEPS = 150  # of Newton's method; 7 to 69 were needed on 15 meshes
PLACING_STEPS = 30  # of them where only the place of the stretch is wanted
SCAFFOLD_STEPS = 300
"""With a scaffold, for one layout, and for all those of a seam that is lengthened for the sake of angles."""
KEPT_DILATATION_P95 = 1.3  # p95 of the dilatation at which angles count as kept
ANGLE_ROUNDS = 8  # rounds of lengthening a seam for it: most meshes that need some need 1 to 4
LEAST_DECREASE, LEAST_DECREASE_OF_SEAMS = 1e-5, 1e-4
"""Relative decrease that counts as none; while the seam grows."""
THETAS_TO_CONFORMAL = 0.1, 0.01
"""Θ on the way from even to conformal: Newton's method does not find the way from 0 alone."""


def flatten(
    patch: Patch,
    *,
    loop: int = 1,
    grow: bool = False,
    method: str = "conformal",
    chart: bool = False,
    joins: bool = False,
) -> Flattening:
    """Flatten a patch in the plane.

    Args:
        patch: one disk, with or without holes.
        loop: which boundary loop is the outline, 1 being the longest in space.
        grow: whether the seam of a patch that was cut may be lengthened.
        method: one of METHODS: "conformal", one-to-one: least squares (LSCM) where the patch is open and they are
            one-to-one, else the conformal limit of "balanced"; "lscm", least squares unchanged; "balanced", of least
            symmetric Dirichlet energy and one-to-one.
        chart: whether the layout is only to carry textures: then a seam that may be lengthened `joins` holes, and
            continues until angles are kept.
        joins: whether a seam that may be lengthened runs into holes where that helps, and makes them the outline's.

    Raises:
        InputError: there is no such loop, least squares have no solution, or nothing gave a flattening without
        overlap.
    """
    if not 1 <= loop <= len(patch.loops):
        raise InputError(
            f"{patch.mesh.name}: there is no boundary {loop}; choose 1 (the longest) to {len(patch.loops)}"
        )
    if method == "lscm":
        exact = _least_squares(patch, loop, grow and len(patch.seam) > 0)
        if not np.isfinite(exact.flat).all():
            name = patch.mesh.name
            raise InputError(
                f"{name}: LSCM has no solution, because some faces have no area; use another method"
            )
        return exact
    plain = _least_squares(patch, loop, False)
    fault = overlap(plain)
    # a cut leaves a choice of many layouts without distortion of angles: one is taken whose areas are even
    growing = grow and (len(patch.seam) > 0 or fault is not None or _spread(plain) > EVEN_AREA_SPREAD)
    joins = growing and (chart or joins)
    sound = plain if fault is None else None
    if method == "balanced":
        return _check(_even_with_seam(plain, growing, joins, sound)[0])
    if fault is None and not growing:
        return plain
    found = _conformal(*_even_with_seam(plain, growing, joins, sound))
    found = _check(_lengthen_seam(found) if growing and chart else found)
    return replace(found, notes=() if fault is None else (f"LSCM produced {fault}; another method was used",))


def convex(layout: Flattening) -> Flattening:
    """Return the layout with polygons convex where moving a vertex makes them so; as it is where it would overlap
    itself.
    """
    opened = replace(layout, flat=open_up(layout.flat, layout.patch, np.zeros(0, np.int64)))
    return layout if overlap(opened) else opened


def even_layout(layout: Flattening) -> Flattening:
    """Return the layout of least symmetric Dirichlet energy, from one of the same patch without folds or overlaps.

    Raises:
        InputError: none without overlap was found.
    """
    if layout.method == "balanced":
        return layout
    if layout.even is not None and overlap(layout.even) is None:
        return layout.even
    sheet = surface(layout.patch.points, layout.patch.faces)
    return replace(_check(_relax(layout, sheet, 1.0)), method="balanced")


def _least_squares(patch: Patch, loop: int, growing: bool) -> Flattening:
    """LSCM, the seam lengthened to the most shrunk vertex until areas are even enough."""
    for _ in range(SEAM_ROUNDS + 1):
        outline = patch.loops[loop - 1]
        result = Flattening(patch, upright(patch, lscm(patch, outline)), outline, "lscm")
        if not growing or _spread(result) <= EVEN_AREA_SPREAD:
            break
        patch, before, loop = extend_cut(patch, _most_shrunk(result)), patch, 1
        if patch is before:
            break
    return result


def _even_with_seam(
    layout: Flattening, growing: bool, joins: bool, sound: Flattening | None
) -> tuple[Flattening, Elastic]:
    """Return the layout of least symmetric Dirichlet energy, its seam long enough, and the surface as it was found on.

    Args:
        layout: any, for its patch and outline.
        growing: whether the seam may be lengthened.
        joins: whether it may run into holes.
        sound: a layout of this patch without folds or overlaps, from which it is sought where that is near.
    """
    patch = layout.patch
    coarsely = len(patch.points) >= LARGE_VERTEX_COUNT and not growing  # where the way from afar is short
    near = sound is not None and (coarsely or sound.strained(95) < STRETCHED_P95)
    start = replace(sound, method="balanced") if sound and near else _start(patch, layout.loop)
    if not growing:
        sheet = surface(patch.points, patch.faces)
        return _relax(start, sheet, 1.0), sheet
    result, sheet, _ = _with_seam(start, joins)
    return _relax(result, sheet, 1.0), sheet


def _with_seam(start: Flattening, joins: bool) -> tuple[Flattening, Elastic, list[int]]:
    """Return a layout that is nearly even, its seam long enough, from one without folds; its surface, and the vertices
    to which the seam was extended, of large surfaces on a coarser triangulation first. Of the ways to these, such are
    left out as are not needed with those that came later.
    """
    small = coarser_layout(start, COARSE_SEAM_VERTICES)
    ends = [] if small is None else small[1][_with_seam(small[0], joins)[2]].tolist()
    result, sheet, _ = _roughly(_cut_to(start, ends, joins))
    while len(ends) < SEAM_ROUNDS and result.strained(95) >= STRETCHED_P95:
        tried = []
        for end in seams.ends(result, joins):
            further = result.cut_further(seams.lengthened(result, [end], joins))
            corner = np.argmax(result.patch.faces == end)
            tried.append((*_roughly(further), int(start.patch.faces.flat[corner])))
        if not tried:
            break
        result, sheet, _, end = min(tried, key=lambda found: found[2])
        ends.append(end)
    for end in ends[:-1] if small is None else []:
        left = [other for other in ends if other != end]
        other, its_sheet, _ = _roughly(_cut_to(start, left, joins))
        if other.strained(95) <= max(STRETCHED_P95, result.strained(95)):
            result, sheet, ends = other, its_sheet, left
    return result, sheet, ends


def _cut_to(start: Flattening, ends: list[int], joins: bool) -> Flattening:
    """Return a layout without folds, the seam extended to some vertices; as it is if there are none."""
    if not ends:
        return start
    patch = seams.lengthened(start, ends, joins)
    return _start(patch, patch.loop_of(start.patch, start.loop))


def _roughly(start: Flattening) -> tuple[Flattening, Elastic, float]:
    """Return a layout that is nearly even, from one without folds; its surface, and its energy."""
    points = start.patch.points
    sheet = surface(points, start.patch.faces)
    flat = relaxed(sheet, points, _unit(start), 1, PLACING_STEPS, LEAST_DECREASE_OF_SEAMS)
    return _place(start, flat), sheet, sheet.energy(flat, 1)


def _conformal(even: Flattening, sheet: Elastic, steps: Iterable[int] = range(SCAFFOLD_STEPS)) -> Flattening:
    """From an even layout to a conformal one."""
    found = even
    for theta in THETAS_TO_CONFORMAL:
        found = _relax(found, sheet, theta, steps)
    return replace(found, method="conformal", even=even)


def _lengthen_seam(found: Flattening) -> Flattening:
    """Return the conformal layout that keeps angles best as the seam continues, at most until it does, or has taken
    long.
    """
    best, fewest, steps = found, _angle_loss(found), iter(range(SCAFFOLD_STEPS))
    for _ in range(ANGLE_ROUNDS):
        if fewest <= KEPT_DILATATION_P95 or next(steps, None) is None:
            break
        patch = seams.sharper(found)
        if patch is found.patch:
            break
        start, sheet = (found.even or found).cut_further(patch), surface(patch.points, patch.faces)
        found = _conformal(_relax(start, sheet, 1.0, steps), sheet, steps)
        best, fewest = min((best, fewest), (found, _angle_loss(found)), key=lambda pair: pair[1])
    return best


def _angle_loss(result: Flattening) -> float:
    """Return how little a layout keeps angles: p95 of its dilatation, infinite where it overlaps itself."""
    return np.inf if overlap(result) else result.dilated(95)


def _relax(
    start: Flattening, sheet: Elastic, theta: float, steps: Iterable[int] = range(SCAFFOLD_STEPS)
) -> Flattening:
    """Return a layout without folds relaxed to the end; where it overlaps itself then, from one that does not, with a
    scaffold.
    """
    points = start.patch.points
    result = _place(start, relaxed(sheet, points, _unit(start), theta, NEWTON_STEPS, LEAST_DECREASE))
    if overlap(result) is None:
        return result
    if overlap(start) is not None:
        start = _start(start.patch, start.loop)
    u = _unit(start)
    loops = [start.loop, *(loop for loop in start.patch.loops if not np.array_equal(loop, start.loop))]

    def apart(own: Elastic, kept: Index) -> Complex:
        rings = [np.searchsorted(kept, loop) for loop in loops]
        return relax_with_scaffold(own, u[kept], rings, theta, steps, LEAST_DECREASE)

    # with the whole boundary kept, what does not overlap itself on the coarser triangulation does not anywhere
    u = by_coarser(sheet, points, u, theta, apart, np.concatenate(loops))
    return _place(start, relax_with_scaffold(sheet, u, loops, theta, steps, LEAST_DECREASE))


def _start(patch: Patch, outline: Index) -> Flattening:
    """Return a layout without folds, as far from even as it may be."""
    try:
        return Flattening(patch, upright(patch, tutte.convex(patch, outline)), outline, "balanced")
    except RuntimeError:  # scipy's word for a singular matrix
        raise InputError(
            f"{patch.mesh.name}: found no flattening without folds; cut the patch into smaller parts"
        ) from None


def _place(result: Flattening, flat: Complex) -> Flattening:
    return replace(result, flat=upright(result.patch, flat))


def _unit(result: Flattening) -> Complex:
    """Positions at an area of one."""
    return result.flat / np.sqrt(result.patch.areas.sum())


def _check(result: Flattening) -> Flattening:
    fault = overlap(result)
    if fault is None:
        return result
    raise InputError(
        f"{result.patch.mesh.name}: every flattening overlaps itself ({fault}); cut the patch into smaller parts"
    )


def _spread(result: Flattening) -> float:
    low, _, high = result.report()["log10_area"].values()
    return high - low


def _most_shrunk(result: Flattening) -> int:
    """Return the inner vertex around which the plane shows the surface smallest."""
    mean = at_vertices(
        np.log(np.maximum(np.abs(result.stretch[0]), 1e-300)), result.patch.faces, len(result.flat)
    )
    mean[np.concatenate(result.patch.loops)] = np.inf
    return int(np.argmin(mean))
