"""Balanced maps with a surface in space as source, target or both.

method            solve: even layouts, a map between them, then Newton's method on the surfaces
partial           partial maps between the outlines of even layouts
problem           the checked problem, and the same in unit coordinates of even layouts
side              source or target: a planar domain, or a surface with its layouts
coincident        a start for surfaces in the same place: nearest points, cut along the same seam
icp_start         an initial map for layouts of almost the same shape
ground            a surface in space as the target of Newton's method
refined           a triangulation with added vertices: in faces, on the boundary, on chords
subdivided        triangles divided evenly, or rim edges split until chords follow an outline
inserted          vertices at given points, and edges along paths through them
target_mesh_map   the final map, on the surface's own triangles
coarse_start      a start for it on a large surface, from coarser triangulations
own_metric        the metric of such triangles
rigid             rigid regions: parts of the surface, each flattened separately
isomorphism       correspondence of two meshes with the same connectivity in any order
matching          registration of two meshes with the same triangles
as_written        distortion and accuracy of new texture coordinates
boundary_slivers  room for triangles that the outline leaves flat or flipped
packed            the map onto pieces that are packed inside a picture
seams             orders of landmarks that give the same seam on both surfaces
trilateration     transfer of a seam to another surface by geodesic distances
"""
