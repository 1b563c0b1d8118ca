"""Balanced maps are the same numbers on other processors."""

import os
import pkgutil
import subprocess
import sys
from importlib import import_module

import pytest

from iccm.jit import Kernel

SOLVE = """
import hashlib
import numpy as np
import iccm
t = 2 * np.pi * np.arange(200) / 200
flower = (2 + 0.9 * np.cos(5 * t + 0.3)) * np.exp(1j * t)  # a partial map: its bays are left open
print(hashlib.sha256(iccm.fit(iccm.Curve(flower), iccm.Curve([0, 3, 3 + 2j, 2j])).map.image.tobytes()).hexdigest())
"""


def test_no_kernel_may_put_sums_in_an_order_of_the_processor():
    names = [each.name for part in ("balanced", "linalg") for each in _modules(part)]
    kernels = [k for name in names for k in vars(import_module(name)).values() if isinstance(k, Kernel)]
    assert len(kernels) > 50
    assert not [k.py_func.__name__ for k in kernels if "fastmath" in k._options]


def _modules(part):
    package = import_module(f"iccm.{part}")
    return pkgutil.walk_packages(package.__path__, package.__name__ + ".")


@pytest.mark.slow
def test_a_processor_without_fused_products_makes_the_same_map(tmp_path):
    """Compiled for the first x86-64 processors; NumPy's and OpenBLAS' loops are those of old ones too."""
    old = {
        "NUMBA_CPU_NAME": "generic",
        "NUMBA_CACHE_DIR": str(tmp_path),
        "OPENBLAS_CORETYPE": "Prescott",
        "NPY_DISABLE_CPU_FEATURES": "AVX2 FMA3 AVX512F AVX512CD AVX512_SKX",
    }
    said = [
        subprocess.run(
            [sys.executable, "-W", "ignore", "-c", SOLVE],
            env=os.environ | extra, capture_output=True, text=True, check=True,
        ).stdout
        for extra in ({}, old)
    ]  # fmt: skip
    assert said[0] == said[1] != ""
