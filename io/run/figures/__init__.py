"""Figures of a run: what `--plot` writes.

domains   grids, energy and distortion of a map
surfaces  a mesh's flattening, and its textured surface
"""
