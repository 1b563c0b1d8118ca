"""Bugs in the compiled core, each of which takes some compiling: `--core` runs them."""

from .mutant import Mutant

CORE: list[Mutant] = [
    Mutant(
        "core/pixels/coverage.cpp",
        "max(ceil(x - 0.5), 0.0)",
        "max(ceil(x), 0.0)",
        "tests/core/test_pixels.py tests/iccm/pixels/test_warp.py",
        "which pixels count as inside is off by half a pixel",
    ),
    Mutant(
        "core/pixels/coverage.cpp",
        "density * (right - left) * (double(j + 1) - 0.5 * (left + right))",
        "density * (right - left) * (double(j + 1) - left)",
        "tests/core/test_pixels.py tests/iccm/pixels/test_warp.py",
        "slanting edges cover too much of their pixels",
    ),
    Mutant(
        "core/pixels/footprint.h",
        "f(xx * yx + xy * yy)",
        "f(xx * xy + yx * yy)",
        "tests/core/test_pixels.py tests/iccm/pixels/test_filters.py",
        "textures are filtered with a transposed Jacobian",
    ),
    Mutant(
        "core/pixels/texture.h",
        "-right.im * corner.down,              -down.im * corner.down",
        "-down.im * corner.down,              -right.im * corner.down",
        "tests/core/test_pixels.py tests/iccm/pixels/test_texture.py",
        "derivatives down a texture are exchanged",
    ),
    Mutant(
        "core/pixels/pyramid.h",
        "return min(i, 2 * n - 1 - i);",
        "return min(i, 2 * n - i);",
        "tests/core/test_pixels.py tests/iccm/pixels/test_edges.py",
        "mirrored textures have a seam of one texel",
    ),
    Mutant(
        "core/meshes/rasterise.cpp",
        "const double u = double(x) + 0.5, v = double(y) + 0.5;",
        "const double u = double(x), v = double(y);",
        "tests/core/test_meshes.py tests/iccm/meshes/test_bake.py",
        "baked charts are shifted by half a texel",
    ),
    Mutant(
        "core/include/iccm/density.h",
        "double core = p / d * power(0.5 * (d + 1 / d), theta);",
        "double core = p / d * power(0.5 * (1 + 1 / d), theta);",
        "tests/core/test_minimise.py tests/iccm/balanced/test_energy.py",
        "the energy does not grow where areas do",
    ),
    Mutant(
        "core/include/iccm/density.h",
        "return core * power(core, q - 1) * (1 - share + share * d);",
        "return core * power(core, q - 1);",
        "tests/core/test_minimise.py tests/iccm/balanced/test_energy.py",
        "the energy counts the source's area alone",
    ),
]
