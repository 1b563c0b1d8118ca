"""Outlines in files that are neither drawings nor meshes nor pictures.

polygons   GeoJSON, and annotations of pictures (labelme, COCO)
topology   TopoJSON as GeoJSON, and back
layers     GeoPackage, Shapefile, KML and FlatGeobuf
antimeridian  polygons across 180°
lettering  text set in a font file
dxf        closed lines of CAD drawings
"""
