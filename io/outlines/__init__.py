"""Outlines in files that are neither drawings nor meshes nor pictures.

polygons   GeoJSON, and annotations of pictures (labelme, COCO)
lettering  words set in a font file
dxf        closed lines of CAD drawings
"""
