"""How Numba compiles kernels, and how long that takes."""
