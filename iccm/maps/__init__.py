"""What a map between planar domains is: harmonic maps, their evaluation, inverse, boundary image and injectivity."""
