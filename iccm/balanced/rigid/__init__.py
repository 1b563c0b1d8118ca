"""Rigid regions: parts of the source that are mapped by similarities.

given      regions as given, checked, and their requested similarities
room       room for a region in the target
solve      the map with rigid regions, starting from the map without them
"""
