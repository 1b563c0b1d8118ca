"""Meshes of pairs of outlines: Delaunay triangles of good shape, sized by the map, and maps carried between them."""
