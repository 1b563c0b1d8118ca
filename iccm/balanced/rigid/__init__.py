"""Rigid regions: parts of the source that a map moves as wholes.

given      regions as given, checked, and what is asked of them
solve      the map without them made one that keeps them
"""
