"""Maps given by two triangulations with the same triangles, made smooth by quadratic patches.

map          `TriangulatedMap`: call, derivatives, inverse, boundary image
adjacency    edges of a triangulation, and the triangles beside them
patches      a quadratic patch for each triangle of the image: the inverse map
location     which patch, and where on it, a point belongs to
evaluation   values and derivatives of the patches
rim          points a little outside, moved onto the boundary and back
injectivity  one-to-one up to the boundary, by exact signs
simple       whether loops bound a region, by exact signs
"""
