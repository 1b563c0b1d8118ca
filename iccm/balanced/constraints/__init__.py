"""Pins and strokes.

soft               soft pins, with radii and tolerances chosen
validate           pins and strokes as given, checked
boundary_strokes   strokes that touch the outlines
strokes            strokes as chains of mesh vertices
"""
