"""Pins from two files of points, one placed on the source and one on the target, as most programs save them."""

from __future__ import annotations

import cmath
from collections import Counter

from ...errors import InputError
from .. import limits
from ..geometry import document
from ..geometry.document import GeometryDocument
from ..shapes.landmarks.pairs import Axes, LandmarkPairs


def read_pairs(source: str, target: str) -> LandmarkPairs:
    """Return the landmarks that two files have in common, in the source's order.

    Points with equal names are a pair. If the files have no name in common, points are paired by their order.

    Args:
        source: a file of points on the source, in any format that `iccm apply` reads.
        target: a file of points on the target, possibly in another format.

    Raises:
        InputError: a file cannot be read or has no points, a name occurs in one file only, or points without names
            differ in number.
    """
    source_file, target_file = document.read(source), document.read(target)
    source_points, target_points = _named(source_file, source), _named(target_file, target)
    names = [name for name, _ in source_points]
    common = {name for name, _ in target_points} & {*names} - {""}
    if common:
        _check_names(source, names, [name for name, _ in target_points])
        _check_names(target, [name for name, _ in target_points], names)
        places = dict(target_points)
        pairs = [(name, z, places[name]) for name, z in source_points if name]
    elif len(source_points) == len(target_points):
        pairs = [("", z, w) for (_, z), (_, w) in zip(source_points, target_points)]
    else:
        raise InputError(
            f"{target}: has {len(target_points)} points, but {source} has {len(source_points)}; give both as many in "
            "the same order, or name them"
        )
    # formats that count landmarks keep the numbers of missing ones
    pairs = [(name, z, w) for name, z, w in pairs if not cmath.isnan(z) and not cmath.isnan(w)]
    if not pairs:
        raise InputError(f"{source}: no point has a position both in this file and in {target}")
    if len(pairs) > limits.PAGE_PINS:
        raise InputError(f"{source}: contains more than {limits.PAGE_PINS} points; leave some out")
    return LandmarkPairs(
        (_axes(source_file), _axes(target_file)),
        [name for name, _, _ in pairs],
        [(z.real, z.imag) for _, z, _ in pairs],
        [(w.real, w.imag) for _, _, w in pairs],
    )


def _named(file: GeometryDocument, name: str) -> list[tuple[str, complex]]:
    """Return the points of a file, each with its name or an empty string.

    Raises:
        InputError: there are none.
    """
    points = file.geometry.points.tolist()
    if not points:
        raise InputError(f"{name}: contains no points; lines and polygons cannot be pins")
    return list(zip(file.geometry.names or [""] * len(points), points))


def _check_names(file: str, names: list[str], other_names: list[str]) -> None:
    """Refuse names that are missing or repeated in a file.

    Raises:
        InputError: there are some.
    """
    if missing := sorted({*other_names} - {*names, ""}):
        raise InputError(f"{file}: has no point named {', '.join(missing[:12])}, which the other file has")
    if repeated := sorted(name for name, count in Counter(names).items() if name and count > 1):
        raise InputError(f"{file}: has more than one point named {', '.join(repeated[:12])}")


def _axes(file: GeometryDocument) -> Axes:
    return "lower-edge" if file.upward else "image"
