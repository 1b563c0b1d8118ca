"""Points, lines and polygons in files: read, carried through a map, and written as they were read.

document   what a file holds, and the reader that its suffix names
table      CSV and TSV
geojson    GeoJSON, and lists of landmarks in JSON
tps        landmark files of morphometrics
polylines  OBJ lines and points
"""
