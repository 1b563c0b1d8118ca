"""Rigid regions: parts of the source that a map moves as wholes.

given      regions as given, checked, and what is asked of them
room       where the target has room for a region
solve      the map without them made one that keeps them
"""
