"""Maps of whole drawings by way of frames.

choice  the pair of frames, or the fit of outlines, whose map costs the least
solve   the map of two drawings
placed  the map of a drawing that keeps its proportions, inside another or over it
"""
