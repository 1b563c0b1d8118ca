"""The core as a WebAssembly module: the functions that a solve and a warp call do the same in Node."""

import base64
import importlib.util
import json
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import iccm
from iccm.native import binding
from iccm.native.binding import ARGUMENT, CALLBACKS, STRUCT, Function, Record

ROOT = Path(__file__).parents[2]
CALLS = 3  # of each function that are compared
SOURCE = np.array([0, 2, 2.4 + 1j, 1.1 + 1.3j, 1.5j])
TARGET = np.exp(2j * np.pi * np.arange(24) / 24) * (1 + 0.2 * np.cos(np.arange(24) / 4))

pytestmark = [
    pytest.mark.slow,
    pytest.mark.timeout(900),  # compiles the module, and WebAssembly's C library at the first time
    pytest.mark.skipif(
        not shutil.which("node") or importlib.util.find_spec("ziglang") is None,
        reason="needs Node and ziglang",
    ),
]


def described(text, value, arrays):
    """An argument or a member for wasm.mjs; its arrays, and those of its members, are appended."""
    kind, pointer = (ARGUMENT.fullmatch(text)[part] for part in ("type", "pointer"))
    if isinstance(value, Record):
        members = STRUCT.fullmatch(value.declaration)["members"].rstrip("; ").split("; ")
        return {
            "kind": "record",
            "members": [described(part, given, arrays) for part, given in zip(members, value._values)],
        }
    if kind in CALLBACKS:
        assert value is None  # Python's functions are out of reach there
        return {"kind": "callback"}
    if pointer:
        arrays.append(value)
        return {"kind": "array", "bytes": base64.b64encode(value.tobytes()).decode()}
    number = str(value).replace("inf", "Infinity")  # as JavaScript reads it
    return {"kind": kind, "value": bool(value) if kind == "bool" else number}


@pytest.fixture
def recorded(monkeypatch):
    """Calls of the core by their functions: what wasm.mjs is given, what is returned, and arrays before and after."""
    monkeypatch.setenv("OMP_NUM_THREADS", "1")  # other threads write parts of the same arrays
    calls = {}
    entry = Function.__call__

    def call(self, *args):
        kept = calls.setdefault(self.name, [])
        if len(kept) >= CALLS:
            return entry(self, *args)
        arrays = []
        given = [described(text, value, arrays) for text, value in zip(self._arguments, args)]
        before = [array.copy() for array in arrays]
        result = entry(self, *args)
        request = {"name": self.name, "returns": self._returns, "args": given}
        kept.append((request, result, before, [array.copy() for array in arrays]))
        return result

    monkeypatch.setattr(binding.Function, "__call__", call)
    return calls


def difference(values, expected, before):
    """The largest difference of arrays relative to what has been written; infinite where other entries are finite."""
    if values.dtype.kind not in "fc":
        return 0.0 if np.array_equal(values, expected) else np.inf
    finite = np.isfinite(expected)
    if not np.array_equal(finite, np.isfinite(values)):
        return np.inf
    size = float(np.abs(expected[finite & (expected != before)]).max(initial=0.0))
    return float(np.abs(values[finite] - expected[finite]).max(initial=0.0)) / max(size, 1e-300)


def test_a_solve_and_a_warp_in_node(recorded, tmp_path):
    fit = iccm.fit(SOURCE, TARGET)
    picture = (np.arange(40 * 30 * 3).reshape(40, 30, 3) * 7 % 251).astype(np.uint8)
    assert iccm.transfer(picture, SOURCE, TARGET, start=fit, size=48).pixels.shape[2] == 4
    names = set(recorded)
    assert {"iccm_minimise_descend", "iccm_linalg_minimum_degree", "iccm_meshing_clip_ears"} <= names
    assert any(name.startswith("iccm_pixels") for name in names)
    module = [sys.executable, ROOT / "core" / "compile.py", "--target", "wasm32-wasi", tmp_path]
    subprocess.run(module, check=True, stdout=subprocess.DEVNULL)
    calls = [call for kept in recorded.values() for call in kept]
    done = subprocess.run(
        ["node", Path(__file__).with_name("wasm.mjs"), tmp_path / "core.wasm"],
        input=json.dumps([request for request, *_ in calls]),
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    for (request, result, before, after), answer in zip(calls, json.loads(done.stdout), strict=True):
        name = request["name"]
        assert float(answer["value"]) == pytest.approx(result, rel=1e-12, nan_ok=True), name
        for text, was, expected in zip(answer["arrays"], before, after, strict=True):
            values = np.frombuffer(base64.b64decode(text), expected.dtype).reshape(expected.shape)
            bound = 1e-6 if values.dtype in (np.float32, np.complex64) else 1e-12
            assert difference(values, expected, was) <= bound, name
