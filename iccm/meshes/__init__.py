"""Triangle meshes: topology, patches, cuts, flattening, and baking of textures into UV layouts.

mesh                polygon meshes as arrays, their checks and triangles
topology            edges, components, orientation, fans, boundary loops
disk_patch          conversion of a mesh to one patch that can be flattened
patch               a patch: an oriented disk, with or without holes
geodesics           shortest paths on surfaces
cut                 cuts that open closed surfaces and handles, or relieve stretch
flatten             `Flattening`: a patch flattened; least squares conformal maps
packing             packing of charts into a region of the plane
stretch             singular values of a piecewise linear map, triangle by triangle
locate              the triangles of a flattened patch that contain given points
surface             positions of points of the plane in the mesh's own texture
surface_distortion  distortion between surfaces, from a map between their layouts
views               the sides from which two models are looked at together
charted             triangles with texture coordinates, and their tangents
layout              the texel grid of a mesh's charts
rasterise           triangles that cover texels
bake                resampling of a texture into a mesh's layout
relayout            transfer of textures from one layout to another
render              a picture of a textured surface
borders             edges at which a seam costs less, because the file has a border there, and lengths of edges for…
"""
