"""Shapes from files of every format, planar or flattened, and the constraints between them.

shape           `file#part` as a domain in the core plane
silhouette      pictures as outlines
smooth_outline  smooth curves fitted to pixel contours
own_picture     pictures as textures of the silhouettes that they show
scan            scans and photographs, cleaned for tracing
planar_obj      planar OBJ files as outlines
mesh_shape      a flattened mesh as a planar shape
mesh_parts      several parts of a mesh as one
mesh_reading    meshes read as shapes, one, or all charts or pieces
onto_outline    a mesh flattened onto a given outline
split_rims      meshes whose rims are split
projected       sheets on generated objects, and sheets marked on photographs
parts           pairs of corresponding shapes of two files
holes           pairs of corresponding holes, and the maps between them
constraints     pins and strokes, drawn or listed
regions         rigid regions: elements, masks, polygons
listing         constraints listed in a JSON file
landmarks/      landmarks of other programs, a module a format
packed_map      maps as short texts
starts          an earlier map to continue from
handles         a lattice of pins by which a map is edited
seam_order      the order of seams through pins
line_band       bands along lines: the target of `--along`, onto which a drawing is bent like text on a path
marked_seams    seams that a file marks: lines of an OBJ file along the edges of a mesh, or the borders of another…
"""
