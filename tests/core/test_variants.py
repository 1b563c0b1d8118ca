"""Every variant of the core has the same results, to the last bit."""

import os
import subprocess
import sys

import pytest

from iccm.native.library import FOLDER, VARIANT, library

WORK = """
import hashlib
import numpy as np
from iccm.balanced.meshing.mesh import Sizes, triangulate
from iccm.maps import cauchy_green
rng = np.random.default_rng(1)
angle = 2 * np.pi * np.arange(70) / 70
polygon = (1 + 0.3 * np.cos(3 * angle + 1)) * np.exp(1j * angle) / 1.8
z, faces = triangulate(polygon, Sizes.even(0.001))
found = [z, faces, cauchy_green.coordinates(polygon, z), cauchy_green.jets(polygon, polygon[None] ** 2, z)]
print(hashlib.sha256(b"".join(each.tobytes() for each in found)).hexdigest())
"""


def digest(variant):
    done = subprocess.run(
        [sys.executable, "-c", WORK],
        env=os.environ | {VARIANT: variant}, capture_output=True, text=True, check=True,
    )  # fmt: skip
    return done.stdout.strip()


def test_variants_compute_the_same_bits():
    """Complex products among them, of which some compilers fuse parts where the processor can (core/compile.py)."""
    library()  # brings those of a checkout up to date
    level = library().iccm_runtime_x86_64_level()
    variants = [path.stem.removeprefix("core-") for path in FOLDER.glob("core-*.*")]
    if level < 3 or len(variants) < 2:
        pytest.skip("this processor can run one variant only")
    digests = {digest(variant) for variant in variants}
    assert len(digests) == 1 and "" not in digests
