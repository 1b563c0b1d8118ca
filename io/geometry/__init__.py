"""Points, lines and polygons in files: read, mapped, and written back in the same format.

document   content of a file, and its reader by suffix
table      CSV and TSV
columns    their columns of x and y
geojson    GeoJSON, and lists of landmarks in JSON
layers     GeoPackage, Shapefile, KML and FlatGeobuf
tps        landmark files of morphometrics
elastix    point sets of elastix and transformix
rois       regions of interest of ImageJ
polylines  OBJ lines and points
"""
