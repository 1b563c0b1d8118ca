"""Path data compared with another reader, for paths that both can read."""

import re

import numpy as np
import svgelements
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from iccm.io.svg import path_data
from iccm.io.svg.affine import Affine
from iccm.io.svg.budget import Budget
from iccm.io.svg.curves import Arc

number = st.integers(-99, 99).map(lambda k: k / 4)
radius = st.integers(1, 99).map(lambda k: k / 4)
flag = st.sampled_from([0, 1])
ARGUMENTS = {
    **{kind: [number] * count for kind, count in zip("LHVCSQT", (2, 1, 1, 6, 4, 4, 2))},
    "A": [radius, radius, st.integers(-400, 400), flag, flag, number, number],
}


def command(kind):
    groups = st.lists(st.tuples(*ARGUMENTS[kind]), min_size=1, max_size=3)
    letter = st.sampled_from([kind, kind.lower()])
    return st.tuples(letter, groups).map(lambda c: c[0] + " ".join(f"{x:g}" for g in c[1] for x in g))


commands = st.sampled_from(list(ARGUMENTS)).flatmap(command)
move = st.tuples(st.sampled_from("Mm"), number, number).map(lambda m: f"{m[0]}{m[1]:g},{m[2]:g}")
run = st.tuples(move, st.lists(commands, min_size=1, max_size=5), st.sampled_from(["", "Z", "z", "Zl1 2"]))
path = st.lists(run.map(lambda r: r[0] + "".join(r[1]) + r[2]), min_size=1, max_size=3).map(" ".join)


@settings(max_examples=60, deadline=None)
@given(path)
def test_every_piece_is_where_another_reader_has_it(d):
    # SVG mirrors a control point only after the same kind of curve; the other reader after any
    assume(not re.search(r"[CcSs][^A-Za-z]*[Tt]|[QqTt][^A-Za-z]*[Ss]", d))
    drawn = (svgelements.Line, svgelements.QuadraticBezier, svgelements.CubicBezier, svgelements.Arc)
    expected = [segment for segment in svgelements.Path(d) if isinstance(segment, drawn)]
    pieces = [piece for run in path_data.runs(d) for piece in run.pieces]
    assert len(pieces) == len(expected)
    t = np.array([0.0, 0.3, 0.5, 0.8, 1.0])
    for piece, segment in zip(pieces, expected):
        assert abs(piece.last() - complex(segment.end)) < 1e-9
        if segment.start == segment.end:  # a degenerate arc: nothing is drawn
            continue
        points = np.array([segment.point(x).x + 1j * segment.point(x).y for x in t])
        # the other reader's arcs are accurate to about the square root of rounding if the radii are slightly too small
        assert np.abs(piece.at(t) - points).max() < (1e-4 if isinstance(piece, Arc) else 1e-9)


def test_arcs_end_exactly_where_they_should():
    (run,) = path_data.runs("M10 20 A 30 5 17 1 0 11 21.5 1 1 0 0 1 40 40")
    for piece, start in zip(run.pieces, (10 + 20j, 11 + 21.5j)):
        ends = piece.at(np.array([0.0, 1.0]))
        assert abs(ends - [start, piece.last()]).max() < 1e-13


@settings(max_examples=60, deadline=None)
@given(path)
def test_runs_are_flattened_together_as_each_alone(d):
    pens = [*path_data.runs(d, joined=True), *path_data.runs("M7 7Zm1 2", joined=True)]
    affine = Affine.matrix(2, 0.5, -0.25, 1, 30, -4)
    together = path_data.flatten(pens, affine, 1e-3, Budget())
    for run, pen in zip(together, pens, strict=True):
        (alone,) = path_data.flatten([pen], affine, 1e-3, Budget())
        assert run.closed == alone.closed
        assert np.array_equal(run.z, alone.z)
        assert run.z[0] == affine(pen.start)
