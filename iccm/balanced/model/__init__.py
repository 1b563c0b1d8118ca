"""A map in the making and what it is made of.

settings            what is asked of a map, and what a solve returns
frames              unit coordinates
outline             outlines simplified to a tolerance, with their corners
boundary_pairs      correspondences of outlines, and the pairs of arclengths at a mesh's boundary vertices
inner_constraints   pins and strokes as vertices of a mesh
metric              surfaces as planes with a metric
energy              what maps minimise and are compared by
boundary            what holds a mesh's boundary: outlines that it slides on, or pins alone
discrete_map        a mesh, its image, what holds its vertices, and its rest triangles
boundary_mesh       a mesh for a boundary and for what is inside
outline_split       a boundary split at the outlines' vertices that its mesh skips
retriangulation     edges flipped where that lowers the energy
measures            turn, stretch, dilatation and scale of a piecewise linear map
mesh_map            a map between two meshes: what all stages have in common
mesh_sizes          triangle sizes, smaller where a map magnifies
"""
