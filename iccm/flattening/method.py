"""Flatten a patch: plain least squares where that is one-to-one, else Newton's method from a layout without folds."""

from collections.abc import Iterable
from dataclasses import replace
from typing import Literal

import numpy as np

from ..arrays import Complex, Index, Real, at_vertices
from ..deadline import ends_search
from ..errors import InputError
from ..meshes.cut import extend_cut
from ..meshes.flatten import Flattening, lscm, overlap, upright
from ..meshes.mesh import with_unit_area
from ..meshes.patch import Patch, patch_of
from . import seams, tutte
from .coarsening import NONE, by_coarser, coarser_layout, much_coarser, reinsert_vertices, same_loop, smooth
from .free import LARGE_VERTEX_COUNT, Elastic, surface
from .multigrid import HUGE_VERTEX_COUNT, nearly_relaxed, relaxed, relaxed_from_coarsest
from .opening import open_up
from .scaffold import relax_with_scaffold

METHODS = ("conformal", "lscm", "balanced")

# These were chosen by hand, except where a line says how a number was found.
SEAM_ROUNDS = 12  # most times that the seam of a surface that had to be cut is lengthened
COARSE_SEAM_VERTICES = 10_000
"""Vertices from which the seam is grown on a coarser triangulation, which then has over a thousand. With 800 of 50,000
vertices, seams were up to a fifth longer."""
EVEN_AREA_SPREAD = 2.0  # spread of log10 area (p05 to p95) at which a seam is long enough for least squares
STRETCHED_P95 = 1.5
"""95th percentile of the stretch of an even layout from which the seam is too short; 1.6 left some uneven."""
NEWTON_STEPS = 150  # most Newton steps; 7 to 69 were needed on 15 meshes
PLACING_STEPS = 30  # the same where only the location of the stretch is wanted
SCAFFOLD_STEPS = 300
"""Most steps with a scaffold: for one layout, and in total for all layouts while a seam is lengthened for angles."""
KEPT_DILATATION_P95 = 1.3  # 95th percentile of the dilatation at which angles count as preserved
ANGLE_ROUNDS = 8  # most times that a seam is lengthened for angles; most meshes that need it need 1 to 4
LEAST_DECREASE, LEAST_DECREASE_OF_SEAMS, LEAST_DECREASE_OF_HIDDEN = 1e-5, 1e-4, 1e-3
"""Relative decrease that ends the iteration: finally, while the seam grows, and for a large layout that only serves as
a plane to work in. Without its last steps a tower with 31 holes was stretched 5 % more."""
SWEEPS = 6
"""Times that each vertex of a large patch is moved after its layout was found on a coarser triangulation; they take
about as long as two Newton steps, and save four."""
CONTINUATION_THETAS = 0.1, 0.01
"""θ on the way from even to conformal: Newton's method does not converge from an even layout at 0 directly."""


Purpose = Literal["domain", "texture", "solver"]
"""What the plane of a layout is for."""


def flatten(
    patch: Patch,
    *,
    loop: int = 1,
    grow: bool = False,
    method: str = "conformal",
    purpose: Purpose = "domain",
    joins: bool = False,
    stretch: float | None = None,
) -> Flattening:
    """Flatten a patch into the plane.

    Args:
        patch: a disk, with or without holes.
        loop: number of the boundary loop that becomes the outline, 1 being the longest in space.
        grow: whether the seam of a patch that was cut may be lengthened.
        method: one of METHODS. "conformal": one-to-one; least squares (LSCM) where the patch is open and that is
            one-to-one, else the conformal limit of "balanced". "lscm": plain least squares, which may fold.
            "balanced": the one-to-one layout of least symmetric Dirichlet energy.
        purpose: "domain" if shapes are mapped in the plane of the layout; "texture" if it only carries textures, so
            that a growing seam may join holes, and is lengthened until angles are preserved; "solver" if it is only a
            plane in which balanced maps are found. That of a large patch then stays nearly even where "conformal" would
            continue to a conformal one.
        joins: whether a growing seam may run into holes where that helps; these become part of the outline.
        stretch: 95th percentile of the stretch of an even layout from which a seam is lengthened, if it may grow, also
            into surfaces that are open; None for a default, with which open surfaces are cut only where their scale
            would vary by orders of magnitude.

    Raises:
        InputError: there is no such loop, the patch has no area, least squares have no solution, or no flattening
            without overlap was found.
    """
    if not 1 <= loop <= len(patch.loops):
        raise InputError(
            f"{patch.mesh.name}: there is no boundary {loop}; choose 1 (the longest) to {len(patch.loops)}"
        )
    if not patch.areas.any():
        raise InputError(f"{patch.mesh.name}: has no area")
    if method == "lscm":
        exact = _least_squares(patch, loop, grow and len(patch.seam) > 0)
        if not np.isfinite(exact.flat).all():
            name = patch.mesh.name
            raise InputError(
                f"{name}: LSCM has no solution, because some faces have no area; use another method"
            )
        return exact
    may_join = joins or purpose == "texture"
    if method == "balanced" and (layout := _even_from_coarsest(patch, loop, grow, may_join, stretch)):
        return layout
    outline, has_seam = patch.loops[loop - 1], grow and len(patch.seam) > 0
    if purpose == "solver" and has_seam and len(patch.points) >= LARGE_VERTEX_COUNT:
        # with a seam that is still too short, least squares are too far from even to start from them
        return _nearly_even(patch, outline, True, may_join, None)
    plain = _least_squares(patch, loop, False)
    fault = overlap(plain)
    # a cut surface has many layouts with little distortion of angles: choose one with even areas
    growing = has_seam or (grow and (stretch is not None or _needs_seam(plain, fault)))
    joins = growing and may_join
    sound = plain if fault is None else None
    most = STRETCHED_P95 if stretch is None else stretch
    if method == "balanced":
        return _check(_even_with_seam(patch, outline, growing, joins, sound, most)[0])
    if fault is None and not growing:
        return plain
    if purpose == "solver" and len(patch.points) >= LARGE_VERTEX_COUNT:
        layout = _nearly_even(patch, outline, growing, joins, sound)
    else:
        layout = _conformal(*_even_with_seam(patch, outline, growing, joins, sound, most))
        layout = _check(_lengthen_seam(layout) if growing and purpose == "texture" else layout)
    notes = (
        () if fault is None or purpose == "solver" else (f"LSCM produced {fault}; another method was used",)
    )
    return replace(layout, notes=notes)


def convex(layout: Flattening) -> Flattening:
    """Make polygons of a layout convex where moving a single vertex does; unchanged if it would overlap itself."""
    opened = replace(layout, flat=open_up(layout.flat, layout.patch, np.zeros(0, np.int64)))
    return layout if overlap(opened) else opened


def even_layout(layout: Flattening) -> Flattening:
    """Return the even layout of a patch: the one-to-one layout of least symmetric Dirichlet energy.

    It only serves as a plane to work in, so that of a large patch is not relaxed to convergence.

    Args:
        layout: a layout of the patch without folds or overlaps, from which to start.

    Raises:
        InputError: none without overlap was found.
    """
    if layout.method == "balanced":
        return layout
    if layout.even is not None and overlap(layout.even) is None:
        return layout.even
    points, faces = layout.patch.points, layout.patch.faces
    nearly = nearly_relaxed(points, faces, _unit(layout), 1.0, NEWTON_STEPS, LEAST_DECREASE)
    if nearly is not None and overlap(placed := _place(layout, nearly)) is None:
        return replace(placed, method="balanced")
    return replace(_check(_relax(layout, surface(points, faces), 1.0)), method="balanced")


def _least_squares(patch: Patch, loop: int, growing: bool) -> Flattening:
    """Return the LSCM layout; a growing seam is lengthened to the most shrunk vertex until areas are even enough."""
    for _ in range(SEAM_ROUNDS + 1):
        outline = patch.loops[loop - 1]
        result = Flattening(patch, upright(patch, lscm(patch, outline)), outline, "lscm")
        if not growing or _spread(result) <= EVEN_AREA_SPREAD:
            break
        patch, previous_patch, loop = extend_cut(patch, _most_shrunk(result)), patch, 1
        if patch is previous_patch:
            break
    return result


def _needs_seam(plain: Flattening, fault: str | None) -> bool:
    """Return whether the least squares layout of a patch without a seam is so uneven that one should be cut.

    Args:
        plain: the layout.
        fault: why it is not one-to-one; None if it is.
    """
    return fault is not None or _spread(plain) > EVEN_AREA_SPREAD


def _even_from_coarsest(
    patch: Patch, loop: int, grow: bool, joins: bool, stretch: float | None
) -> Flattening | None:
    """Return the even layout of a huge patch without factorising a matrix of all its vertices, where that succeeds.

    Returns None where that is not the case; arguments are as for `flatten`.
    """
    if len(patch.points) < HUGE_VERTEX_COUNT:
        return None
    outline = patch.loops[loop - 1]
    growing = grow and (len(patch.seam) > 0 or stretch is not None)
    if growing:
        lengthened = _lengthened_by_coarser(
            patch, outline, joins, STRETCHED_P95 if stretch is None else stretch
        )
        if lengthened is None:
            return None
        patch, outline = lengthened

    def start(vertices: Index, points: Real, faces: Index) -> Complex | None:
        coarse = patch_of(patch.mesh.name, points, faces)
        coarse_outline = same_loop(coarse, vertices, outline)
        if coarse_outline is None:
            return None
        plain = Flattening(coarse, upright(coarse, lscm(coarse, coarse_outline)), coarse_outline, "lscm")
        fault = overlap(plain)
        if grow and not growing and _needs_seam(plain, fault):
            return None
        return _unit(plain if fault is None else _start(coarse, coarse_outline))

    u = relaxed_from_coarsest(patch.points, patch.faces, start, 1.0, NEWTON_STEPS, LEAST_DECREASE)
    if u is None:
        return None
    layout = Flattening(patch, upright(patch, u), outline, "balanced")
    return layout if overlap(layout) is None else _apart_from_coarser(layout)


def _apart_from_coarser(layout: Flattening) -> Flattening | None:
    """Return a nearly even layout of a huge patch that does not overlap itself as `layout` does, or None.

    It is found with a scaffold on a coarser triangulation that has all of the boundary, so that the fine one does not
    overlap itself, either.
    """
    patch, rings = layout.patch, _rings(layout)
    small = much_coarser(patch.points, patch.faces, None, HUGE_VERTEX_COUNT, np.concatenate(rings))
    if small is None:
        return None
    vertices, faces, removed = small
    coarse = patch_of(patch.mesh.name, patch.points[vertices], faces)
    coarse_rings = [np.searchsorted(vertices, ring) for ring in rings]
    sheet, steps = surface(coarse.points, faces), range(SCAFFOLD_STEPS)
    start = _unit(_start(coarse, coarse_rings[0]))
    u = np.zeros(len(patch.points), complex)
    u[vertices] = relax_with_scaffold(sheet, start, coarse_rings, 1.0, steps, LEAST_DECREASE_OF_SEAMS)
    unit = with_unit_area(patch.points, patch.faces)
    if not reinsert_vertices(removed, unit, 1.0, u):
        return None
    rim = np.zeros(u.size, bool)
    rim[np.concatenate(rings)] = True
    smooth(patch.faces, unit, rim, SWEEPS, 1.0, u)
    apart = _place(layout, u)
    return apart if overlap(apart) is None else None


def _lengthened_by_coarser(
    patch: Patch, outline: Index, joins: bool, stretch: float
) -> tuple[Patch, Index] | None:
    """Return a huge patch with a seam that is long enough on a coarser triangulation, and its outline; None without it.

    Arguments are as for `_even_with_seam`.
    """
    small = much_coarser(patch.points, patch.faces, None, HUGE_VERTEX_COUNT, NONE)
    if small is None:
        return None
    vertices, faces, _ = small
    coarse = patch_of(patch.mesh.name, patch.points[vertices], faces)
    coarse_outline = same_loop(coarse, vertices, outline)
    if coarse_outline is None:
        return None
    ends = _with_seam(_start(coarse, coarse_outline), joins, stretch)[2]
    placeless = Flattening(patch, np.zeros(len(patch.points), complex), outline, "balanced")
    lengthened = seams.lengthened(placeless, vertices[ends].tolist(), joins)
    return lengthened, lengthened.loop_of(patch, outline)


def _even_with_seam(
    patch: Patch, outline: Index, growing: bool, joins: bool, sound: Flattening | None, stretch: float
) -> tuple[Flattening, Elastic]:
    """Return the even layout with a long enough seam, and the surface on which it was found.

    Args:
        patch: the patch.
        outline: its boundary loop that becomes the outline.
        growing: whether the seam may be lengthened.
        joins: whether it may run into holes.
        sound: a layout of this patch without folds or overlaps, used as the start if it is close enough.
        stretch: 95th percentile of the stretch from which the seam is too short.
    """
    start = _first_layout(patch, outline, growing, sound)
    if not growing:
        sheet = surface(patch.points, patch.faces)
        return _relax(start, sheet, 1.0), sheet
    result, sheet, _ = _with_seam(start, joins, stretch)
    return _relax(result, sheet, 1.0), sheet


def _nearly_even(
    patch: Patch, outline: Index, growing: bool, joins: bool, sound: Flattening | None
) -> Flattening:
    """Return a nearly even layout of a large patch with a long enough seam; arguments as for `_even_with_seam`.

    Raises:
        InputError: none without overlap was found.
    """
    start = _first_layout(patch, outline, growing, sound)
    result, sheet, _ = _with_seam(start, joins, STRETCHED_P95) if growing else _roughly(start)
    if overlap(result) is None:
        return result
    u = _apart(result, sheet, 1.0, range(SCAFFOLD_STEPS))
    rim = np.zeros(u.size, bool)
    rim[np.concatenate(_rings(result))] = True
    unit = result.patch.points / np.sqrt(result.patch.areas.sum())
    smooth(sheet.faces, unit, rim, SWEEPS, 1.0, u)
    rings, steps = _rings(result), range(SCAFFOLD_STEPS)
    relaxed_u = relax_with_scaffold(sheet, u, rings, 1.0, steps, LEAST_DECREASE_OF_HIDDEN, settled=1)
    return _check(_place(result, relaxed_u))


def _first_layout(patch: Patch, outline: Index, growing: bool, sound: Flattening | None) -> Flattening:
    """Return a layout without folds from which to relax; arguments as for `_even_with_seam`."""
    coarsely = (
        len(patch.points) >= LARGE_VERTEX_COUNT and not growing
    )  # coarsening makes up for a distant start
    is_near = sound is not None and (coarsely or sound.strained(95) < STRETCHED_P95)
    return replace(sound, method="balanced") if sound and is_near else _start(patch, outline)


def _with_seam(start: Flattening, joins: bool, stretch: float) -> tuple[Flattening, Elastic, list[int]]:
    """Return a nearly even layout with a long enough seam, its surface, and the vertices that the seam was extended to.

    Seams of large surfaces are found on a coarser triangulation first. On others, extensions are dropped again that are
    not needed with those that came later. `start` is a layout without folds; there are at most SEAM_ROUNDS extensions.
    """
    small = coarser_layout(start, COARSE_SEAM_VERTICES)
    ends = [] if small is None else small[1][_with_seam(small[0], joins, stretch)[2]].tolist()
    result, sheet, _ = _roughly(_cut_to(start, ends, joins))
    while len(ends) < SEAM_ROUNDS and result.strained(95) >= stretch and not ends_search():
        trials = []
        for end in seams.ends(result, joins):
            further = result.cut_further(seams.lengthened(result, [end], joins))
            corner = np.argmax(result.patch.faces == end)
            trials.append((*_roughly(further), int(start.patch.faces.flat[corner])))
        if not trials:
            break
        result, sheet, _, end = min(trials, key=lambda trial: trial[2])
        ends.append(end)
    for end in ends[:-1] if small is None and not ends_search() else []:
        remaining_ends = [shorter for shorter in ends if shorter != end]
        shorter, its_sheet, _ = _roughly(_cut_to(start, remaining_ends, joins))
        if shorter.strained(95) <= max(stretch, result.strained(95)):
            result, sheet, ends = shorter, its_sheet, remaining_ends
    return result, sheet, ends


def _cut_to(start: Flattening, ends: list[int], joins: bool) -> Flattening:
    """Return a layout without folds whose seam is extended to the given vertices; unchanged if there are none."""
    if not ends:
        return start
    patch = seams.lengthened(start, ends, joins)
    return _start(patch, patch.loop_of(start.patch, start.loop))


def _roughly(start: Flattening) -> tuple[Flattening, Elastic, float]:
    """Relax a layout without folds until it is nearly even; return it, its surface and its energy."""
    points = start.patch.points
    sheet = surface(points, start.patch.faces)
    flat = relaxed(sheet, points, _unit(start), 1, PLACING_STEPS, LEAST_DECREASE_OF_SEAMS)
    return _place(start, flat), sheet, sheet.energy(flat, 1)


def _conformal(even: Flattening, sheet: Elastic, steps: Iterable[int] = range(SCAFFOLD_STEPS)) -> Flattening:
    """Continue from an even layout to a conformal one."""
    layout = even
    for theta in CONTINUATION_THETAS:
        layout = _relax(layout, sheet, theta, steps)
    return replace(layout, method="conformal", even=even)


def _lengthen_seam(layout: Flattening) -> Flattening:
    """Lengthen the seam of a conformal layout until angles are preserved, or the step limits are reached.

    Returns the layout that preserves angles best.
    """
    best, fewest, steps = layout, _angle_loss(layout), iter(range(SCAFFOLD_STEPS))
    for _ in range(ANGLE_ROUNDS):
        if fewest <= KEPT_DILATATION_P95 or next(steps, None) is None:
            break
        patch = seams.sharper(layout)
        if patch is layout.patch:
            break
        start, sheet = (layout.even or layout).cut_further(patch), surface(patch.points, patch.faces)
        layout = _conformal(_relax(start, sheet, 1.0, steps), sheet, steps)
        best, fewest = min((best, fewest), (layout, _angle_loss(layout)), key=lambda pair: pair[1])
    return best


def _angle_loss(result: Flattening) -> float:
    """Return the 95th percentile of a layout's dilatation; infinite where it overlaps itself."""
    return np.inf if overlap(result) else result.dilated(95)


def _relax(
    start: Flattening, sheet: Elastic, theta: float, steps: Iterable[int] = range(SCAFFOLD_STEPS)
) -> Flattening:
    """Relax a layout without folds to convergence.

    If the result overlaps itself, start again from a layout that does not, with a scaffold.
    """
    points = start.patch.points
    result = _place(start, relaxed(sheet, points, _unit(start), theta, NEWTON_STEPS, LEAST_DECREASE))
    if overlap(result) is None:
        return result
    u = _apart(start, sheet, theta, steps)
    return _place(start, relax_with_scaffold(sheet, u, _rings(start), theta, steps, LEAST_DECREASE))


def _apart(start: Flattening, sheet: Elastic, theta: float, steps: Iterable[int]) -> Complex:
    """Return (n,) positions without folds or overlaps: those of `start`, or others where that overlaps itself.

    Those of a large patch are relaxed on a coarser triangulation that has all of its boundary.
    """
    if overlap(start) is not None:
        start = _start(start.patch, start.loop)
    u, loops = _unit(start), _rings(start)

    def apart(coarse: Elastic, vertices: Index) -> Complex:
        rings = [np.searchsorted(vertices, loop) for loop in loops]
        return relax_with_scaffold(coarse, u[vertices], rings, theta, steps, LEAST_DECREASE)

    # with the whole boundary kept, a layout without overlap on the coarser triangulation has none on the fine one
    return by_coarser(sheet, start.patch.points, u, theta, apart, np.concatenate(loops))


def _rings(layout: Flattening) -> list[Index]:
    """Return the boundary loops of a layout, its outline first."""
    other_loops = [loop for loop in layout.patch.loops if not np.array_equal(loop, layout.loop)]
    return [layout.loop, *other_loops]


def _start(patch: Patch, outline: Index) -> Flattening:
    """Return a layout without folds, which may be far from even."""
    try:
        return Flattening(patch, upright(patch, tutte.convex(patch, outline)), outline, "balanced")
    except RuntimeError:  # raised by scipy for a singular matrix
        raise InputError(
            f"{patch.mesh.name}: found no flattening without folds; cut the patch into smaller parts"
        ) from None


def _place(result: Flattening, flat: Complex) -> Flattening:
    return replace(result, flat=upright(result.patch, flat))


def _unit(result: Flattening) -> Complex:
    """Return the positions scaled to a surface area of one."""
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
    """Return the inner vertex around which the layout is smallest relative to the surface."""
    mean = at_vertices(
        np.log(np.maximum(np.abs(result.stretch[0]), 1e-300)), result.patch.faces, len(result.flat)
    )
    mean[np.concatenate(result.patch.loops)] = np.inf
    return int(np.argmin(mean))
