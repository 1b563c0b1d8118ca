"""Maps that are kept: their files, their inverses, and what goes through them besides pictures.

map_file  a file of a map: written, read, checked
inverted  the inverse of a map in the place of a map
geometry  points, lines and polygons carried through a map
"""
