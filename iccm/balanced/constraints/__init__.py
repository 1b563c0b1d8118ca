"""Pins and strokes that a map meets exactly.

validate           pins and strokes as given, checked
boundary_strokes   strokes that touch the outlines
strokes            strokes as chains of mesh vertices
"""
