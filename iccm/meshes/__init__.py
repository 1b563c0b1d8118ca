"""Triangle meshes: topology, patches, cuts, flattening, and textures baked into their layouts.

mesh                polygon meshes as arrays, their checks and triangles
topology            edges, components, orientation, fans, boundary loops
disk_patch          a mesh made into one patch that can be flattened
patch               such a patch: an oriented disk, with or without holes
geodesics           shortest ways on surfaces
cut                 closed surfaces and handles opened, areas relieved
flatten             `Flattening`: a patch flattened; least squares conformal maps
packing             charts packed into a region of the plane
stretch             singular values of a piecewise linear map, triangle by triangle
locate              triangles of a flattened patch that hold given points
surface             points of the plane in the mesh's own texture
surface_distortion  distortion of a map between layouts, on the surfaces
charted             triangles with texture coordinates, and their tangents
layout              the texel grid of a mesh's charts
rasterise           triangles that cover texels
bake                a texture resampled into a mesh's layout
relayout            textures of one layout carried to another
render              a picture of a textured surface
"""
