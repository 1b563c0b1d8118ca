"""Saved maps: their files, their inverses, and mapping of geometry.

archive   archives of arrays that are not trusted
georeference  where the coordinates of a file lie on a map of the earth
map_file  reading, writing and validation of map files
inverted  the inverse of a map, used as a map
geometry  points, lines and polygons mapped by a map
"""
