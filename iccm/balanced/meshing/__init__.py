"""Meshes of a domain: Delaunay triangles of good shape, boundary and inner edges kept.

delaunay   a constrained Delaunay triangulation under edit
mesh       quality refinement to given sizes
transfer   a map interpolated on another mesh
"""
