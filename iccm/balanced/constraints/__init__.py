"""Pins and strokes: checks, and their representation in a mesh.

soft               soft pins, with all radii and tolerances chosen
validate           pins and strokes as given, checked
boundary_strokes   strokes that touch the outlines
strokes            strokes as chains of mesh vertices
"""
