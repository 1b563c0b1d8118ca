"""Maps given by two triangulations with the same triangles, made smooth by quadratic patches.

adjacency    edges of a triangulation, and which triangle lies on which side
patches      a quadratic patch for each triangle of the image: the inverse map
location     which patch, and where on it, a point belongs to
map          TriangulatedMap: call, derivatives, inverse, boundary image
injectivity  one-to-one up to the boundary, by exact signs (outlines)
preimages    the inverse on the pixels of a canvas
distortion   stretch, scale, dilatation and turn over the target's area, of any kind of map
"""
