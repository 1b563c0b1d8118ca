"""Shapes from files of every format, planar or flattened, and the constraints between them.

shape           `file#part` as a domain in the core plane
silhouette      pictures as outlines
smooth_outline  smooth curves through contours of pixels
own_picture     pictures as textures of the silhouettes that they show
scan            scans and photographs, cleaned to be traced
planar_obj      planar OBJ files as outlines
mesh_shape      a mesh as a planar shape, flattened
mesh_parts      several parts of a mesh as one
mesh_reading    meshes read as such, one, or all charts or pieces
onto_outline    a mesh flattened onto a given outline
split_rims      meshes whose rims are split
parts           which shapes of two files go together
holes           which holes go together, and the maps between them
constraints     pins and strokes, drawn or listed
regions         rigid regions: elements, masks, polygons
listing         those listed in a JSON file
landmarks       those listed by other programs
starts          an earlier map to continue from
seam_order      the order of seams through pins
"""
