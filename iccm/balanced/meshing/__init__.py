"""Meshes of a domain: Delaunay triangulations of good quality that keep boundary and inner edges.

delaunay   constrained Delaunay triangulation: ear clipping and edge flips
mesh       quality refinement to given sizes
transfer   interpolation of a map on another mesh
"""
