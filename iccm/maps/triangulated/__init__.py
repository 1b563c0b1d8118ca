"""Maps given by two triangulations with the same triangles, smoothed by quadratic patches.

map          `TriangulatedMap`: call, derivatives, inverse, boundary image
adjacency    edges of a triangulation, and the triangles at them
patches      a quadratic patch for each triangle of the image: the inverse map
location     the patch that contains a point, and the point's position on it
evaluation   values and derivatives of the patches
rim          nearest points on the boundary, for points slightly outside
injectivity  certificate that a map is one-to-one, by exact signs
simple       whether loops bound a region, by exact signs
"""
