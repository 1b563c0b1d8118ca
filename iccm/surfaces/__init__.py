"""Balanced maps of surfaces.

method            the method: layouts, a planar map, Newton on the surfaces
partial           partial maps, by the outlines of even layouts
problem           what is solved, checked, and in unit coordinates
side              a domain of the plane, or a surface in an even layout
icp_start         a start for layouts of almost the same shape
ground            a surface in space as what a map goes onto
refined           more vertices: in faces, on the boundary, in chords
subdivided        rims split until chords follow an outline
inserted          given points and strokes as vertices and edges
target_mesh_map   the last map, on the target's own triangles
rigid             rigid regions: the surface's own triangles, flattened on their own
isomorphism       two meshes of the same connectivity, in any order
matching          two meshes with the same triangles brought together
as_written        figures of new texture coordinates
boundary_slivers  triangles at the boundary without room
packed            the map onto pieces that are packed inside a picture
seams             the order of two seams through the same landmarks
trilateration     one surface's seam on the other, by geodesic distances
"""
