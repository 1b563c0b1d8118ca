"""The passes over OBJ files, against the same in plain Python, on lines of every kind and on noise."""

import numpy as np
import pytest

from iccm.io.meshes import obj_scan
from tests.core.reference import obj as plain

WORDS = [
    *(
        b"v",
        b"vt",
        b"vn",
        b"f",
        b"o",
        b" ",
        b"\t",
        b"\n",
        b"\r",
        b"\\\n",
        b"\\\r\n",
        b"\\",
        b"/",
        b"#",
        b"\x0b",
    ),
    *(
        b"1",
        b"-2",
        b"0",
        b"1/2",
        b"3//1",
        b"1/",
        b"-1/-1/-1",
        b"1.5e3",
        b"-.5",
        b".",
        b"+7",
        b"1e-9",
        b"1e400",
    ),
    *(
        b"nan",
        b"123456789012345678",
        b"usemtl",
        b" f 1 2 3\n",
        b"v 1 2 3\n",
        b"v 1 2 3 \n",
        b"vt .5\n",
        b"\xc3",
    ),
]


def by_core(data):
    """Counts, errors, and all arrays."""
    raw = np.frombuffer(data, np.uint8)
    lines, corners = obj_scan.count(raw)
    result = obj_scan.scan(raw)
    arrays = [*vars(result.elements).values(), result.statement_at, *result.unconverted]
    return lines, corners, result.fault, result.fault_at, *([] if result.fault else arrays)


def by_reference(data):
    """The same in plain Python."""
    raw = np.frombuffer(data, np.uint8).astype(np.int64)
    lines, corners = plain.count(raw)
    v, vt, vn = (np.zeros((lines[kind], width)) for kind, width in ((1, 3), (2, 2), (3, 3)))
    sizes = len(vt), lines[4], lines[4] + 1, corners, corners, lines[5]
    vt_at, face_at, starts, corner_at, normals, statement_at = (np.zeros(k, np.int64) for k in sizes)
    slow = [np.zeros((values.size, 2), np.int64) for values in (v, vt, vn)]
    indices = np.zeros((corners, 2), np.int64), normals, np.zeros(corners, bool)
    arrays = [v, vt, vn, vt_at, face_at, starts, corner_at, *indices, statement_at]
    fault, place, *counts = plain.fill(raw, *arrays, *slow)
    left = [rows[:count] for rows, count in zip(slow, counts)]
    return lines, corners, fault, place, *([] if fault else [*arrays, *left])


def compared(data):
    compiled, expected = by_core(data), by_reference(data)
    assert len(compiled) == len(expected)
    for a, b in zip(compiled, expected):
        assert np.array_equal(a, b), data
    return compiled


def written(rng, count):
    """A file with lines of all kinds, with numbers that are exact and others, continued lines and comments."""
    v, vt = rng.standard_normal((count, 3)), rng.uniform(0, 1, (count, 2))
    lines = [f"v {x:.6f} {y:.9g} {z}{' .5 1e-3' * (i % 3)}" for i, (x, y, z) in enumerate(v.tolist())]
    lines += ["# a comment", "o part", "usemtl  red\\", "  and more", "mtllib a", "\tg b"]
    lines += [f"vt {x:.6f} {y:.17g}" for x, y in vt.tolist()] + ["vn 1 2.5 -1.23456789012345678", "vn 1"]
    for i, (a, b, c) in enumerate(rng.integers(1, count, (count, 3)).tolist()):
        lines.append(f"f {a}/{b}/{c} {b}//2 {c}" if i % 2 else f"f\t-{a}/-{b} -{b}/{c} {c} \\\r\n {a} # x")
    return "\n".join(lines).encode() + b"\r\n"


def test_a_file():
    data = written(np.random.default_rng(1), 40)
    result = compared(data)
    assert (
        result[0].tolist()[1:] == [40, 40, 2, 40, 4]
        and result[2] == 0
        and all(len(left) for left in result[-3:])
    )


@pytest.mark.parametrize("seed", range(4))
def test_noise(seed):
    rng = np.random.default_rng(seed)
    faults = set()
    for _ in range(300):
        data = b"".join(WORDS[k] for k in rng.integers(0, len(WORDS), rng.integers(1, 40)))
        faults.add(compared(data)[2])
    assert faults == {0, 1, 2, 3}


def test_texture_indices_are_replaced():
    rng = np.random.default_rng(2)
    data = written(rng, 40)
    corner_at = compared(data)[10][::3].copy()
    new_vt = 10 ** rng.integers(0, 9, corner_at.size) - rng.integers(0, 2, corner_at.size)
    raw, start = np.frombuffer(data, np.uint8), int(corner_at[0]) - 5
    results = []
    for passes, given in ((obj_scan, raw), (plain, raw.astype(np.int64))):
        out = np.zeros(len(data) + 20 * corner_at.size, np.uint8)
        size = passes.rewrite(given, start, len(data) - 3, corner_at, new_vt, out)
        results.append(out[:size].tobytes())
    assert results[0] == results[1] and f"/{new_vt[0] + 1}".encode() in results[0]
