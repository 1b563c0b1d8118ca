"""The discrete map that a solve works on, and its parts.

solution            the solution of a solve, and the log that it keeps
unit_coordinates    unit coordinates
outline             outlines simplified to a tolerance, with their corners
boundary_pairs      correspondences of outlines, and the pairs of arclengths at a mesh's boundary vertices
inner_constraints   pins and strokes as vertices of a mesh
metric              surfaces as planes with a metric
energy              the objective that maps minimise, and by which they are compared
boundary            how a mesh's boundary is constrained: it slides on outlines, or only pins are held
discrete_map        a mesh, its image, the constraints on its vertices, and its rest triangles
boundary_mesh       a mesh for a boundary and everything inside it
outline_split       a boundary split at the outlines' vertices that its mesh skips
retriangulation     edges flipped where that lowers the energy
measures            rotation, stretch, dilatation and scale of a piecewise linear map
mesh_map            a map between two meshes, the form that all stages share
mesh_sizes          triangle sizes, smaller where a map magnifies
"""
