"""Every variant of the core has the same results, to the last bit."""

import os
import subprocess
import sys

import pytest

from iccm.native.library import VARIANT

MESHES = """
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
PIXELS = """
import hashlib
import numpy as np
from iccm.pixels import filters, pyramid
from iccm.pixels.canvas import Band, Diagnostics

rng = np.random.default_rng(10)
digest = hashlib.sha256()
for channels in (1, 2, 3, 4, 6):
    tex = pyramid.pyramid(rng.random((70, 47, channels), dtype=np.float32), pyramid.MIRROR)
    xy = rng.uniform(-20, 80, (500, 2))
    turn = rng.normal(size=(500, 4)) * np.exp(rng.uniform(-3, 4, (500, 1)))
    for kind in (filters.LINEAR, filters.CUBIC, filters.LANCZOS):
        for clamped in (False, True):
            digest.update(filters.read(tex, xy, turn, kind, clamped).tobytes())
    z, right, down = rng.normal(size=(3, 20, 30)) + 1j * rng.normal(size=(3, 20, 30))
    slopes = [part.astype(np.complex64) for part in (right, down)]
    band = Band(0, rng.random(z.shape, dtype=np.float32), z, *slopes, Diagnostics())
    out = np.zeros((20, 30, channels + 1), np.uint8)
    filters.paint(tex, band, (0, 30), (-1.0, 1.0, 23.0, 30.0), filters.CUBIC, True, channels, out)
    digest.update(out.tobytes())
print(digest.hexdigest())
"""


def digest(work, variant):
    result = subprocess.run(
        [sys.executable, "-c", work],
        env=os.environ | {VARIANT: variant}, capture_output=True, text=True, check=True,
    )  # fmt: skip
    return result.stdout.strip()


@pytest.mark.slow
@pytest.mark.parametrize("work", [MESHES, PIXELS], ids=["meshes", "pixels"])
def test_variants_compute_the_same_bits(work, all_variants):
    """Complex products among them, of which some compilers fuse parts where the processor can (core/compile.py)."""
    digests = {digest(work, variant) for variant in all_variants}
    assert len(all_variants) > 1 and len(digests) == 1 and "" not in digests
