"""Pins and strokes that a map meets exactly.

given          as the user gave them, checked        inside         as vertices of a mesh
touching       strokes at the outlines
strokes        as chains of them                     ways, routes   how they go to their goals, straight or around
meeting        among the starts, from mesh to mesh   continuation   from an earlier map on
"""
