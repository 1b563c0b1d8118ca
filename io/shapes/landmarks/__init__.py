"""Pairs of landmarks in files of other programs: read, and written as those programs read them. One class a format.

pairs           pairs of points with the conventions of their coordinates
landmarks_file  the interface of a format, and the formats by their suffixes
bigwarp         BigWarp
qgis            the Georeferencer of QGIS
tps_pairs       TPS files with two specimens
control_points  ground control points of GeoTIFFs
"""
