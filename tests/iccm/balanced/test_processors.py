"""Balanced maps are identical on other processors."""

import os
import subprocess
import sys

import pytest

SOLVE = """
import hashlib
import numpy as np
import iccm
t = 2 * np.pi * np.arange(200) / 200
flower = (2 + 0.9 * np.cos(5 * t + 0.3)) * np.exp(1j * t)  # a partial map: its bays are left open
print(hashlib.sha256(iccm.fit(iccm.Curve(flower), iccm.Curve([0, 3, 3 + 2j, 2j])).map.image.tobytes()).hexdigest())
"""


@pytest.mark.slow
def test_a_processor_without_fused_products_makes_the_same_map(all_variants):
    """The core is the variant for the first x86-64 processors; NumPy's and OpenBLAS' loops are those for old ones,
    too.
    """
    old = {
        "ICCM_CORE": "x86-64",
        "OPENBLAS_CORETYPE": "Prescott",
        "NPY_DISABLE_CPU_FEATURES": "AVX2 FMA3 AVX512F AVX512CD AVX512_SKX",
    }
    outputs = [
        subprocess.run(
            [sys.executable, "-W", "ignore", "-c", SOLVE],
            env=os.environ | extra, capture_output=True, text=True, check=True,
        ).stdout
        for extra in ({}, old)
    ]  # fmt: skip
    assert outputs[0] == outputs[1] != ""
